// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/scene/ground.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>

#include "planar_mapping/viewer/scene/camera.h"

namespace planar_mapping::visualization {

double roundStep(double length, int parts) {
  const double raw = std::max(length, 1e-9) / std::max(parts, 1);
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

std::vector<double> multiples(double low, double high, double step) {
  std::vector<double> values;
  const double first = std::ceil(low / step - 1e-6);
  // Counted, not summed: far from zero a step may be below the precision of the sum.
  for (int i = 0; i < 1000; ++i) {
    const double value = (first + i) * step;
    if (!(value <= high + 1e-6 * step)) break;
    values.push_back(value);
  }
  return values;
}

std::string shortNumber(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", std::abs(value) < 1e-9 ? 0.0 : value);
  return text;
}

GroundFrame groundFrame(const SceneContent& content) {
  GroundFrame frame;
  frame.up = content.up.normalized();
  horizontalAxes(content.up, frame.right, frame.forward);
  frame.height = groundHeight(content);
  Eigen::AlignedBox2d box;
  const auto add = [&](const Vector3& p) {
    box.extend(Vector2(p.dot(frame.right), p.dot(frame.forward)));
  };
  for (const Cuboid* cuboid : content.framed()) {
    for (const Vector3& corner : corners(*cuboid)) add(corner);
  }
  if (content.sensors_known) {
    for (const Pose& pose : content.trajectory) add(pose.translation());
  }
  if (content.cuboids.empty()) {
    Vector3 low, high;
    if (content.bounds(low, high)) {
      for (int corner = 0; corner < 8; ++corner)
        add(Eigen::AlignedBox3d(low, high).corner(Eigen::AlignedBox3d::CornerType(corner)));
    }
  }
  if (box.isEmpty()) box = Eigen::AlignedBox2d(Vector2(-1.0, -1.0), Vector2(1.0, 1.0));
  const double longest = box.sizes().maxCoeff();
  frame.step = longest < 2.5 ? 0.1 : std::max(1.0, roundStep(longest, 100));
  frame.low_right = std::floor(box.min().x() / frame.step - 0.2) * frame.step;
  frame.high_right = std::ceil(box.max().x() / frame.step + 0.2) * frame.step;
  frame.low_forward = std::floor(box.min().y() / frame.step - 0.2) * frame.step;
  frame.high_forward = std::ceil(box.max().y() / frame.step + 0.2) * frame.step;
  return frame;
}

}  // namespace planar_mapping::visualization
