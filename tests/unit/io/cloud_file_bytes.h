// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <lzf.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace planar_mapping::io {

// Cloud files as bytes, made by hand so that readers are not tested against our own writer.

template <typename T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

inline std::string header(const std::string& fields, const std::string& sizes,
                          const std::string& types, const std::string& counts, int width,
                          int height, const std::string& data) {
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS " + fields + "\nSIZE " +
         sizes + "\nTYPE " + types + "\nCOUNT " + counts + "\nWIDTH " + std::to_string(width) +
         "\nHEIGHT " + std::to_string(height) + "\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " +
         std::to_string(width * height) + "\nDATA " + data + "\n";
}

inline std::string xyzHeader(int width, int height, const std::string& data) {
  return header("x y z", "4 4 4", "F F F", "1 1 1", width, height, data);
}

inline std::string compressed(const std::string& head, const std::string& plain) {
  std::vector<char> packed(plain.size() + plain.size() / 8 + 64);
  const unsigned size = lzf_compress(plain.data(), static_cast<unsigned>(plain.size()),
                                     packed.data(), static_cast<unsigned>(packed.size()));
  if (size == 0) throw std::runtime_error("cannot be compressed");
  std::string bytes = head;
  append(bytes, static_cast<std::uint32_t>(size));
  append(bytes, static_cast<std::uint32_t>(plain.size()));
  return bytes.append(packed.data(), size);
}

inline std::string compressedCloud(int points) {
  std::string plain;
  for (int field = 0; field < 3; ++field)
    for (int i = 0; i < points; ++i) append(plain, static_cast<float>(10 * field + i / 8));
  for (int i = 0; i < points; ++i) append(plain, 0x00FF8000u);
  return compressed(
      header("x y z rgb", "4 4 4 4", "F F F U", "1 1 1 1", points, 1, "binary_compressed"), plain);
}

inline std::string plyHeader(const std::string& format, const std::string& properties,
                             const std::string& before = "", const std::string& after = "") {
  return "ply\nformat " + format + " 1.0\ncomment made by hand\nobj_info nothing\n" + before +
         "element vertex 2\n" + properties + after + "end_header\n";
}

}  // namespace planar_mapping::io
