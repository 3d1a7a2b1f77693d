// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

#include "evaluation/simulation/scene.h"

namespace planar_mapping::evaluation {

/// Puts solids into a scene. Places of furniture are given in a frame of their own (x to the
/// right, y to the back, z up) that stands somewhere on the ground, turned by a yaw.
struct SceneBuilder {
  SceneParams params;
  Scene scene;
  Pose place = Pose::Identity();  ///< of what is added next

  /// Adds what follows relative to a frame at (x, y, z), turned by \p yaw_deg.
  void moveTo(double x, double y, double z = 0.0, double yaw_deg = 0.0);
  /// A box by its lowest corner and its full lengths.
  void box(const std::string& name, const Vector3& low, const Vector3& size,
           const Material& material);
  /// A box by its centre, full lengths and rotation.
  void turnedBox(const std::string& name, const Vector3& center, const Vector3& size,
                 const Eigen::AngleAxisd& rotation, const Material& material);
  /// An upright cylinder standing at \p foot.
  void cylinder(const std::string& name, const Vector3& foot, double diameter, double height,
                const Material& material);
  void sphere(const std::string& name, const Vector3& center, double diameter,
              const Material& material);
  /// A wall along local x from 0 to \p length with an opening: full height left and right of it,
  /// a lintel above and a sill below.
  void wallWithOpening(const std::string& name, double length, double height, double thickness,
                       double opening_begin, double opening_end, double opening_low,
                       double opening_high, const Material& material);
  /// Camera at a world position, looking along \p yaw_deg (0 = +x) and \p pitch_deg (up > 0).
  void lookFrom(const Vector3& position, double yaw_deg, double pitch_deg);
  /// Lays the path the parameters ask for along a line that goes from s = 0 to s = 1 and is about
  /// \p length metres long. \p look calls lookFrom() for a place on it; the turn is added to its
  /// yaw: 180 degrees on the way back.
  void followLine(double length, const std::function<void(double s, double turn_deg)>& look);
  /// As followLine(), along a line that ends where it began: its way back is a second round.
  void followRound(double length, const std::function<void(double s)>& look);
  /// The last added \p count objects are there from frame \p first to frame \p last only.
  void onlyIn(std::size_t count, int first, int last);
  /// A person of 1.7 m who stands at x, y of the world and leaves before frame \p leaves, but not
  /// before the second; nobody unless the parameters ask for what moves.
  void person(double x, double y, int leaves);
  /// The first frame for which \p passed holds; \p fraction of the frames if there is none.
  int frameWhen(const std::function<bool(const Vector3& camera)>& passed, double fraction) const;
};

using BuildScene = void(SceneBuilder& builder);
BuildScene buildRoom, buildCorridor, buildOutdoor, buildRooms, buildWhite, buildBuilding;

}  // namespace planar_mapping::evaluation
