// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "evaluation/simulation/scene.h"
#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/camera.h"

namespace planar_mapping::evaluation {

/// What a perfect camera sees, row major. Pixels that hit nothing have depth 0 and object -1.
struct Rendering {
  PinholeCamera camera;
  std::vector<float> depth;           ///< z in the camera frame, metres
  std::vector<std::int32_t> object;   ///< index into Scene::objects
  std::vector<std::uint8_t> face;     ///< of that object
  std::vector<float> incidence;       ///< cosine between ray and surface normal, in [0, 1]
  std::vector<float> texture;         ///< stereo matching succeeds where this is high, in [0, 1]
  std::vector<std::uint32_t> colors;  ///< shaded, 0xRRGGBB; of the sky where nothing is hit

  std::size_t size() const { return depth.size(); }
};

struct PLANAR_MAPPING_EXPORT RenderParams {
  int frame = 0;                ///< objects that are not there in it are left out
  double plain_fraction = 0.0;  ///< of all surface, in patches of 0.7 m: no texture, in [0, 1]
  bool colors = true;           ///< false: Rendering::colors stays empty, which is faster
  int threads = 1;              ///< 0 = all cores; changes nothing but the time

  /// \throws ParameterError
  void validate() const;
};

/// Casts the ray of every pixel centre at every object it may meet; exact up to rounding.
/// \throws ParameterError for a camera without size or focal length, and bad \p params; InputError
///         for poses or sizes that are not finite, or negative sizes
PLANAR_MAPPING_EXPORT Rendering render(const Scene& scene, const PinholeCamera& camera,
                                       const Pose& T_world_camera,
                                       const RenderParams& params = RenderParams());

/// Where a ray first meets the object: the parameter t of origin + t direction, t > 0, and the
/// face; false if it does not, or starts inside. Both vectors in the world frame.
PLANAR_MAPPING_EXPORT bool intersect(const SceneObject& object, const Vector3& origin,
                                     const Vector3& direction, double& t, int& face);

}  // namespace planar_mapping::evaluation
