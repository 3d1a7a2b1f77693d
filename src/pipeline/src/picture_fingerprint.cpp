// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "picture_fingerprint.h"

#include <algorithm>
#include <cstring>

namespace planar_mapping::detail {
namespace {

/// FNV-1a over words of eight bytes.
class Fingerprint {
 public:
  void add(const void* bytes, std::size_t size) {
    const auto* data = static_cast<const unsigned char*>(bytes);
    for (std::size_t i = 0; i < size; i += sizeof(std::uint64_t)) {
      std::uint64_t word = 0;
      std::memcpy(&word, data + i, std::min(sizeof(word), size - i));
      value_ = (value_ ^ word) * 0x100000001b3u;
      value_ ^= value_ >> 32u;  // words differ in high bits, too, which a product only carries up
    }
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

}  // namespace

std::uint64_t pictureFingerprint(const Frame& frame) {
  if (frame.images.left.empty()) return 0;
  Fingerprint fingerprint;
  for (const io::Image* image : {&frame.images.left, &frame.images.right}) {
    fingerprint.add(image->pixels.data(), image->pixels.size());
  }
  // Enough of the depths to see their noise.
  constexpr std::size_t kStep = 16;
  for (std::size_t i = 0; i < frame.cloud->size(); i += kStep) {
    fingerprint.add((*frame.cloud)[i].data, 3 * sizeof(float));
  }
  return fingerprint.value();
}

}  // namespace planar_mapping::detail
