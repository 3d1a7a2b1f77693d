// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "evaluation/simulation/ray_caster.h"

namespace planar_mapping::evaluation {

constexpr double kNearestDepth = 0.05;  ///< metres; nothing is seen closer to the camera

/// Rows of an image that one thread works on at a time.
constexpr int kBandRows = 16;

/// Pixels [begin, end) of an image.
struct PixelWindow {
  int column_begin, column_end, row_begin, row_end;
};

/// An object as one camera sees it. Rays are given in the camera's frame with z = 1, so that the
/// parameter of a point of the ray is its depth.
struct ObjectView {
  const SceneObject* object = nullptr;
  const Scene* scene = nullptr;  ///< it belongs to
  int frame = 0;
  int index = 0;
  Matrix3 R_object_camera = Matrix3::Identity();
  Vector3 origin = Vector3::Zero();  ///< the camera, object frame
  Vector3 half = Vector3::Zero();    ///< of the size
  Vector3 light = Vector3::Zero();   ///< towards it, object frame
  PixelWindow window{0, 0, 0, 0};    ///< where it can appear
  float nearest = 0.0f;              ///< depth of which no point of it is in front

  /// Where a ray of the camera meets it; not closer than kNearestDepth.
  bool hit(const Vector3& ray, double& depth, int& face) const;
};

/// Objects that are there and can appear in the image, the nearest first.
std::vector<ObjectView> viewsOf(const Scene& scene, const PinholeCamera& camera,
                                const Pose& T_world_camera, int frame);

/// \throws InputError for an object that is not finite or of negative size
void requireSound(const SceneObject& object);

/// The view of each object by its index; null where it cannot appear.
std::vector<const ObjectView*> byIndex(const std::vector<ObjectView>& views, const Scene& scene);

}  // namespace planar_mapping::evaluation
