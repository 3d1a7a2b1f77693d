// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

#include "planar_mapping/core/base/types.h"

// Numbers of binary formats, all of which are little endian, as are the processors we know.
namespace planar_mapping::io {

template <typename Number>
void appendBytes(std::string& out, Number value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

inline void appendFloats(std::string& out, const Vector3& v) {
  for (int i = 0; i < 3; ++i) appendBytes(out, static_cast<float>(v[i]));
}

}  // namespace planar_mapping::io
