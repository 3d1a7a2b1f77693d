// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "file/bit_coder.h"

namespace planar_mapping::detail {

/// What stands around the coded bits of a map: four bytes by which it is known, a version, the
/// CRC-32 of what follows.
struct FileFrame {
  std::uint8_t magic[4];
  std::uint8_t version;
  const char* readable;  ///< versions that can be read, for messages

  std::vector<std::uint8_t> around(const std::vector<std::uint8_t>& payload) const;
  bool starts(const std::uint8_t* data, std::size_t size) const;
  /// Is this the version of a file that starts so?
  bool isOfThisVersion(const std::uint8_t* data, std::size_t size) const;
  /// The coded bits of a file that starts so. \throws Error naming what is wrong
  BitCoder open(const std::uint8_t* data, std::size_t size) const;
  [[noreturn]] void failForVersion(std::uint32_t found) const;
};

}  // namespace planar_mapping::detail
