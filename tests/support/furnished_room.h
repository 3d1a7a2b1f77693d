// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/plane.h"

namespace planar_mapping::test {

/// A depth frame and the face each pixel shows.
struct RoomFrame {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<float> xyz;     ///< camera frame, NaN where nothing was measured
  std::vector<int> labels;    ///< index into planes, -1 = curved or flying
  std::vector<Plane> planes;  ///< of all faces, seen or not
};

/// The frame of a structured-light camera (640 x 480, x right, y down, z forward) in a room of
/// 5 x 4 x 2.7 m with a table, a box on it, a cabinet, a chest, a ball and a column: 12 or 13 faces
/// of at least 1,000 pixels. Disparities have smooth noise and steps of 1/8 pixel, depths steps of
/// a millimetre; 1 % of the pixels are missing and those at depth edges fly or are missing.
inline RoomFrame furnishedRoom(std::uint64_t seed) {
  constexpr int kWidth = 640;
  constexpr int kHeight = 480;
  constexpr double kFocal = 525.0;
  constexpr double kBaseline = 0.075;
  constexpr double kDisparityNoise = 0.05;
  constexpr int kSteps = 8;  // of a pixel of disparity
  struct Box {
    Vector3 low, high;
    bool from_inside;
  };
  const std::array<Box, 5> boxes = {{{{0.0, 0.0, 0.0}, {5.0, 4.0, 2.7}, true},
                                     {{2.2, 1.2, 0.70}, {3.5, 2.1, 0.76}, false},
                                     {{2.6, 1.4, 0.76}, {2.95, 1.75, 1.06}, false},
                                     {{3.9, 3.4, 0.0}, {4.7, 4.0, 1.7}, false},
                                     {{4.2, 0.3, 0.0}, {4.8, 1.0, 0.5}, false}}};
  const Vector3 ball(1.9, 2.7, 0.35);
  constexpr double kBallRadius = 0.35;
  const Vector3 column(3.4, 3.0, 0.0);
  constexpr double kColumnRadius = 0.18;

  Random random(seed, 91);
  const double eye_x = random.uniform(0.5, 0.7);
  const double eye_y = random.uniform(0.5, 0.7);
  const Vector3 eye(eye_x, eye_y, 1.5);
  const Vector3 forward = (Vector3(3.6, 2.5, 0.75) - eye).normalized();
  const Vector3 right = forward.cross(Vector3::UnitZ()).normalized();
  const Vector3 down = forward.cross(right);

  const auto index = [](int row, int column_of) {
    return static_cast<std::size_t>(row) * kWidth + static_cast<std::size_t>(column_of);
  };
  std::vector<double> white(static_cast<std::size_t>(kWidth) * kHeight);
  for (double& value : white) value = random.normal();
  // Mean of 5 x 5 pixels with the variance of one.
  const auto smooth = [&](int row, int column_of) {
    double sum = 0.0;
    int number = 0;
    for (int r = std::max(0, row - 2); r <= std::min(kHeight - 1, row + 2); ++r) {
      for (int c = std::max(0, column_of - 2); c <= std::min(kWidth - 1, column_of + 2); ++c) {
        sum += white[index(r, c)];
        ++number;
      }
    }
    return sum / std::sqrt(static_cast<double>(number));
  };

  RoomFrame frame;
  frame.width = kWidth;
  frame.height = kHeight;
  frame.xyz.assign(3 * white.size(), std::numeric_limits<float>::quiet_NaN());
  frame.labels.assign(white.size(), -1);
  for (const Box& box : boxes) {
    for (int side = 0; side < 6; ++side) {
      const int axis = side / 2;
      const Vector3 normal(right[axis], down[axis], forward[axis]);
      const double at = side % 2 == 0 ? box.low[axis] : box.high[axis];
      frame.planes.push_back({normal, eye[axis] - at});
    }
  }
  const auto rayOf = [&](int row, int column_of) {
    return Vector3((column_of - 0.5 * (kWidth - 1)) / kFocal, (row - 0.5 * (kHeight - 1)) / kFocal,
                   1.0);
  };
  const auto set = [&](int row, int column_of, double depth) {
    const Vector3 p = rayOf(row, column_of) * depth;
    float* to = &frame.xyz[3 * index(row, column_of)];
    for (int axis = 0; axis < 3; ++axis) to[axis] = static_cast<float>(p[axis]);
  };

  for (int row = 0; row < kHeight; ++row) {
    for (int col = 0; col < kWidth; ++col) {
      const Vector3 ray = rayOf(row, col);
      const Vector3 d = right * ray.x() + down * ray.y() + forward;
      double depth = std::numeric_limits<double>::max();
      int face = -1;
      const auto see = [&](double at, int seen) {
        if (!(at > 0.1) || at >= depth) return;
        depth = at;
        face = seen;
      };
      for (std::size_t b = 0; b < boxes.size(); ++b) {
        double enter = -std::numeric_limits<double>::max();
        double leave = std::numeric_limits<double>::max();
        int first = -1;
        int last = -1;
        for (int axis = 0; axis < 3; ++axis) {
          const double low = (boxes[b].low[axis] - eye[axis]) / d[axis];
          const double high = (boxes[b].high[axis] - eye[axis]) / d[axis];
          if (std::min(low, high) > enter) {
            enter = std::min(low, high);
            first = 2 * axis + (low < high ? 0 : 1);
          }
          if (std::max(low, high) < leave) {
            leave = std::max(low, high);
            last = 2 * axis + (low < high ? 1 : 0);
          }
        }
        if (enter > leave) continue;
        const bool inside = boxes[b].from_inside;
        see(inside ? leave : enter, 6 * static_cast<int>(b) + (inside ? last : first));
      }
      const auto seeRound = [&](const Vector3& from, const Vector3& along, double radius) {
        const double a = along.squaredNorm();
        const double half = along.dot(from);
        const double root = half * half - a * (from.squaredNorm() - radius * radius);
        if (root > 0.0) see((-half - std::sqrt(root)) / a, -1);
      };
      seeRound(eye - ball, d, kBallRadius);
      const Vector3 flat(1.0, 1.0, 0.0);
      seeRound((eye - column).cwiseProduct(flat), d.cwiseProduct(flat), kColumnRadius);

      const double disparity =
          std::round((kBaseline * kFocal / depth + kDisparityNoise * smooth(row, col)) * kSteps) /
          kSteps;
      const double missing = random.uniform();
      if (missing < 0.01 || !(disparity > 0.0)) continue;
      set(row, col, std::round(kBaseline * kFocal / disparity * 1000.0) / 1000.0);
      frame.labels[index(row, col)] = face;
    }
  }
  const std::vector<float> before = frame.xyz;
  const auto depthAt = [&](int row, int col) { return before[3 * index(row, col) + 2]; };
  for (int row = 1; row + 1 < kHeight; ++row) {
    for (int col = 1; col + 1 < kWidth; ++col) {
      const double depth = depthAt(row, col);
      if (!std::isfinite(depth)) continue;
      for (const double beside : {depthAt(row, col - 1), depthAt(row, col + 1),
                                  depthAt(row - 1, col), depthAt(row + 1, col)}) {
        if (!std::isfinite(beside) || std::fabs(beside - depth) < 0.1 + 0.03 * depth) continue;
        const bool flies = random.uniform() >= 0.5;
        const double fraction = random.uniform();
        set(row, col,
            flies ? depth + fraction * (beside - depth) : std::numeric_limits<double>::quiet_NaN());
        frame.labels[index(row, col)] = -1;
        break;
      }
    }
  }
  return frame;
}

}  // namespace planar_mapping::test
