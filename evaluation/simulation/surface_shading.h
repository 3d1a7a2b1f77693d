// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "evaluation/simulation/object_view.h"

namespace planar_mapping::evaluation {

constexpr std::uint32_t kSkyColor = 0xBFD2E6;

/// A pixel's image on a surface.
struct SurfacePatch {
  double incidence = 0.0;               ///< cosine between ray and normal, in [0, 1]
  double texture = 0.0;                 ///< how much there is to match, in [0, 1]
  double light = 0.0;                   ///< that falls on it: factor of the material's colour
  double u = 0.0, v = 0.0;              ///< its middle, surface coordinates, metres
  double along_u = 0.0, along_v = 0.0;  ///< its longer side, metres
  double width = 0.0;                   ///< across that, metres
  int samples = 0;                      ///< squares of that width it is covered by
};

/// One face as one camera sees it.
class SurfaceShader {
 public:
  /// \param colors  false: patches have incidence and texture only
  SurfaceShader(const ObjectView& view, int face, const PinholeCamera& camera,
                double plain_fraction, bool colors);

  /// \param ray  through the pixel, camera frame, z = 1
  SurfacePatch patchAt(double depth, const Vector3& ray) const;
  /// Colour 0xRRGGBB of a patch: material, light and pattern, averaged over the patch.
  std::uint32_t colorOf(const SurfacePatch& patch) const;

 private:
  /// Light of the scene's lamp at a point of the surface (object frame) that is seen along \p
  /// direction.
  double lampLight(const Vector3& local, const Vector3& normal, const Vector3& direction) const;

  const ObjectView& view_;
  int face_;
  Vector3 pixel_right_;  ///< step of the ray from pixel to pixel, object frame
  Vector3 pixel_down_;
  double plain_fraction_;
  bool colors_;
  std::uint32_t seed_;
};

}  // namespace planar_mapping::evaluation
