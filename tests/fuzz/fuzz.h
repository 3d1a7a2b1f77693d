// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "planar_mapping/base/error.h"

// Each target defines this. What it throws, and every other end but a return, is a finding.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace planar_mapping::fuzz {

/// Ends the program if a property does not hold.
inline void require(bool holds, const char* property) {
  if (holds) return;
  std::fprintf(stderr, "property broken: %s\n", property);
  std::abort();
}

/// False if the call throws an error of ours; others are findings.
template <typename Call>
bool succeeds(const Call& call) {
  try {
    call();
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// The bytes of an input as numbers and texts; zeros follow its end.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), end_(data + size) {}

  template <typename Number>
  Number number() {
    Number value{};
    const std::size_t size = std::min(sizeof value, left());
    std::memcpy(&value, data_, size);
    data_ += size;
    return value;
  }
  unsigned below(unsigned count) { return number<std::uint8_t>() % count; }
  bool flag() { return below(2) != 0; }
  /// In [low, high], in steps of 1/65535 of that.
  double between(double low, double high) {
    return low + (high - low) * number<std::uint16_t>() / 65535.0;
  }
  std::string text(std::size_t size) {
    size = std::min(size, left());
    const auto* first = reinterpret_cast<const char*>(data_);
    data_ += size;
    return {first, size};
  }
  std::string rest() { return text(left()); }
  std::size_t left() const { return static_cast<std::size_t>(end_ - data_); }

 private:
  const std::uint8_t* data_;
  const std::uint8_t* end_;
};

/// A folder of this process in memory, where there is such a file system.
inline const std::string& folder() {
  struct Folder {
    std::string path = std::filesystem::exists("/dev/shm") ? "/dev/shm/fuzz_XXXXXX" : "fuzz_XXXXXX";
    Folder() { require(::mkdtemp(path.data()) != nullptr, "a folder for inputs"); }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
  };
  static const Folder folder;
  return folder.path;
}

inline std::string write(const std::string& name, const std::string& content) {
  const std::string path = folder() + "/" + name;
  std::ofstream(path, std::ios::binary) << content;
  return path;
}

}  // namespace planar_mapping::fuzz
