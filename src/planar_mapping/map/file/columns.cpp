// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/file/columns.h"

#include "planar_mapping/base/error.h"

namespace planar_mapping::detail {

const std::uint8_t* Columns::take(std::size_t bytes) {
  if (bytes > left()) fail("ends too early");
  at_ += bytes;
  return data_ + at_ - bytes;
}

void Columns::labels(std::vector<std::uint8_t>& labels, std::size_t count) {
  const std::size_t bytes = count / 4 + (count % 4 != 0 ? 1 : 0);
  if (!is_reading_) {
    const std::size_t start = written_.size();
    written_.resize(start + bytes);
    for (std::size_t i = 0; i < count; ++i) {
      std::uint8_t& byte = written_[start + i / 4];
      byte = static_cast<std::uint8_t>(byte | labels[i] << (2 * (i % 4)));
    }
    return;
  }
  const std::uint8_t* packed = take(bytes);
  labels.resize(count);
  for (std::size_t i = 0; i < count; ++i) labels[i] = packed[i / 4] >> (2 * (i % 4)) & 3u;
}

void Columns::text(std::string& text) {
  if (is_reading_) {
    const std::size_t size = left();
    text.assign(reinterpret_cast<const char*>(take(size)), size);
  } else {
    written_.insert(written_.end(), text.begin(), text.end());
  }
}

void Columns::end() const {
  if (left() != 0) fail("has bytes left over");
}

void Columns::fail(const std::string& problem) const {
  throw Error("the section " + section_ + " of the map " + problem);
}

}  // namespace planar_mapping::detail
