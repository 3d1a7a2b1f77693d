// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/base/types.h"

#include <string>

#include "planar_mapping/base/error.h"

namespace planar_mapping {

void requireRigid(const char* what, const Pose& pose) {
  constexpr double kTolerance = 1e-3;
  const Matrix3 r = pose.linear();
  if (!r.allFinite() || !pose.translation().allFinite())
    throw InputError(std::string(what) + " is not finite");
  if (!(r.transpose() * r).isIdentity(kTolerance) || !(r.determinant() > 0.0))
    throw InputError(std::string(what) + " is no rigid motion: its rotation is not orthonormal");
}

}  // namespace planar_mapping
