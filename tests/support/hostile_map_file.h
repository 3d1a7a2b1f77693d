// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <zstd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::test {

using Bytes = std::vector<std::uint8_t>;

inline PlanarMap load(const Bytes& bytes) {
  return PlanarMap::deserialize(bytes.data(), bytes.size());
}

/// CRC-32 of IEEE 802.3, bit by bit.
inline std::uint32_t crc(const std::uint8_t* data, std::size_t size) {
  std::uint32_t c = 0xffffffffu;
  for (std::size_t i = 0; i < size; ++i) {
    c ^= data[i];
    for (int bit = 0; bit < 8; ++bit) c = (c >> 1) ^ ((c & 1u) != 0 ? 0xedb88320u : 0u);
  }
  return ~c;
}

constexpr std::size_t kHeader = 20;  ///< magic, version, flags, size, CRC-32
constexpr std::size_t kFreeSections = 1u << 20;

inline void putNumber(Bytes& bytes, std::size_t at, std::uint64_t value, std::size_t size) {
  for (std::size_t b = 0; b < size; ++b)
    bytes[at + b] = static_cast<std::uint8_t>(value >> (8 * b));
}
inline std::uint64_t numberAt(const Bytes& bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t b = 0; b < size; ++b) value |= std::uint64_t{bytes[at + b]} << (8 * b);
  return value;
}

/// Gives a file its checksum again.
inline void fixChecksum(Bytes& file) {
  Bytes checked(file.begin(), file.begin() + 16);
  checked.insert(checked.end(), file.begin() + kHeader, file.end());
  putNumber(file, 16, crc(checked.data(), checked.size()), 4);
}

/// The sections of a file, unpacked.
inline Bytes sectionsOf(const Bytes& file) {
  Bytes sections(numberAt(file, 8, 8));
  const std::size_t size =
      ZSTD_decompress(sections.data(), sections.size(), &file[kHeader], file.size() - kHeader);
  EXPECT_EQ(size, sections.size());
  return sections;
}

/// The file of sections, with a right checksum.
inline Bytes fileOf(const Bytes& sections, bool is_finished) {
  Bytes file(kHeader + ZSTD_compressBound(sections.size()));
  file.resize(kHeader + ZSTD_compress(&file[kHeader], file.size() - kHeader, sections.data(),
                                      sections.size(), 1));
  const std::uint8_t start[8] = {'P', 'M', 'A', 'P', 5, is_finished, 0, 0};
  std::copy(std::begin(start), std::end(start), file.begin());
  putNumber(file, 8, sections.size(), 8);
  fixChecksum(file);
  return file;
}

/// Where the content of a section starts.
inline std::size_t sectionAt(const Bytes& sections, const std::string& name) {
  for (std::size_t at = 0; at < sections.size();) {
    const std::size_t size = numberAt(sections, at + 8, 8);
    if (std::string(reinterpret_cast<const char*>(&sections[at])).substr(0, 8) == name) {
      return at + 16;
    }
    at += 16 + size;
  }
  ADD_FAILURE() << "no section " << name;
  return 0;
}

/// Loads or throws Error: nothing else, and with bounded memory.
inline bool loadsOrFailsCleanly(const Bytes& file) {
  try {
    const PlanarMap map = load(file);
    EXPECT_LT(map.memoryBytes(), 16 * (kFreeSections + 256 * file.size()));
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// A file that loads must not when it is cut anywhere, or goes on after its end.
inline void expectRejectedAtEveryOtherLength(const Bytes& whole) {
  EXPECT_TRUE(loadsOrFailsCleanly(whole));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(loadsOrFailsCleanly(cut)) << size;
  }
  Bytes longer = whole;
  longer.push_back(0);
  EXPECT_FALSE(loadsOrFailsCleanly(longer));
  EXPECT_THROW(PlanarMap::deserialize(nullptr, 0), Error);
}

inline void expectRejectedWhenABitFlips(const Bytes& whole) {
  Random random(5);
  for (int i = 0; i < 4000; ++i) {
    Bytes spoilt = whole;
    spoilt[random.below(static_cast<std::uint32_t>(whole.size()))] ^=
        static_cast<std::uint8_t>(1u << random.below(8));
    EXPECT_FALSE(loadsOrFailsCleanly(spoilt));
  }
}

/// Spoils some bytes from \p first on.
inline Bytes spoilt(Bytes bytes, std::size_t first, Random& random) {
  const std::uint32_t flips = 1 + random.below(4);
  for (std::uint32_t k = 0; k < flips; ++k) {
    const auto span = static_cast<std::uint32_t>(bytes.size() - first);
    bytes[first + random.below(span)] =
        random.below(2) != 0 ? static_cast<std::uint8_t>(random.below(256)) : 0xff;
  }
  return bytes;
}

/// What load() says of a file, nothing if it loads.
inline std::string problemOf(const Bytes& file) {
  try {
    load(file);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace planar_mapping::test
