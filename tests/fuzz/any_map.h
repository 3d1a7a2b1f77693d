// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <zstd.h>

#include <cmath>

#include "fuzz.h"
#include "planar_mapping/base/types.h"

namespace planar_mapping::fuzz {

/// The identity, or turned anyhow and up to \p most decades of metres away.
inline Pose anyPose(Input& input, double most = 6.0) {
  Pose pose = Pose::Identity();
  if (input.flag()) return pose;
  const double reach = std::pow(10.0, input.between(-1.0, most));
  for (int k = 0; k < 3; ++k) pose.translation()[k] = input.between(-reach, reach);
  const Vector3 axis(input.between(-1, 1), input.between(-1, 1), input.between(-1, 1));
  if (axis.norm() > 0.1) {
    pose.linear() = Eigen::AngleAxisd(input.between(-3, 3), axis.normalized()).toRotationMatrix();
  }
  return pose;
}

}  // namespace planar_mapping::fuzz

// In place of the library's, at its quickest level: compressing maps well took half of the time,
// and is not what is tried here.
extern "C" std::size_t ZSTD_compress(void* to, std::size_t capacity, const void* from,
                                     std::size_t size, int /*level*/) {
  static ZSTD_CCtx* const context = ZSTD_createCCtx();
  return ZSTD_compressCCtx(context, to, capacity, from, size, 1);
}
