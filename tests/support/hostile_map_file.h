// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/base/detail/random.h"
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

/// Loads or throws Error: nothing else, and with bounded memory.
inline bool loadsOrFailsCleanly(const Bytes& file) {
  try {
    const PlanarMap map = load(file);
    EXPECT_LT(map.memoryBytes(), 4096 + 2048 * file.size());
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

/// Spoils bytes behind the header of a file and gives it its checksums again, 4000 times: it loads
/// or fails cleanly. \return how often it loads
template <typename FixChecksum>
std::size_t loadedWhenSpoilt(const Bytes& whole, std::size_t header, FixChecksum&& fixChecksum) {
  Random random(6);
  std::size_t loaded = 0;
  for (int i = 0; i < 4000; ++i) {
    Bytes spoilt = whole;
    const std::uint32_t flips = 1 + random.below(4);
    for (std::uint32_t k = 0; k < flips; ++k) {
      const std::size_t at =
          header + random.below(static_cast<std::uint32_t>(whole.size() - header));
      spoilt[at] = random.below(2) != 0 ? static_cast<std::uint8_t>(random.below(256))
                                        : static_cast<std::uint8_t>(0xff);
    }
    fixChecksum(spoilt);
    loaded += loadsOrFailsCleanly(spoilt);
  }
  return loaded;
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

/// Files that are no map, of a later version, damaged or cut are told apart by a sentence.
/// \param version_at place of the byte that says the version
inline void expectSaysWhatIsWrong(const Bytes& whole, std::size_t version_at,
                                  std::uint8_t later_version) {
  EXPECT_NE(problemOf({'P', 'C', 'D'}).find("no planar map"), std::string::npos);
  Bytes later = whole;
  later[version_at] = later_version;
  EXPECT_NE(problemOf(later).find("version " + std::to_string(later_version)), std::string::npos);
  Bytes damaged = whole;
  damaged[40] ^= 1u;
  EXPECT_NE(problemOf(damaged).find("checksum"), std::string::npos);
  const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(whole.size() / 2));
  EXPECT_NE(problemOf(cut).find("cut short"), std::string::npos);
}

}  // namespace planar_mapping::test
