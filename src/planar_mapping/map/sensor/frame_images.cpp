// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/sensor/depth_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace planar_mapping::detail {
namespace {

/// Pinhole model that explains an organized cloud to a fraction of a pixel, if there is one.
std::optional<PinholeCamera> estimateCamera(const PointsView& points) {
  if (!points.isOrganized() || points.width < 2) return std::nullopt;
  constexpr std::size_t kSamples = 4096;
  constexpr std::size_t kMinSamples = 32;
  constexpr double kMaxError = 0.5;  // pixels, root mean square
  // column = fx (x / z) + cx and row = fy (y / z) + cy: two straight lines.
  struct Line {
    double n = 0, a = 0, b = 0, aa = 0, ab = 0, bb = 0;
    void add(double from, double to) {
      n += 1.0;
      a += from;
      b += to;
      aa += from * from;
      ab += from * to;
      bb += to * to;
    }
    /// slope, intercept, root mean square residual; slope 0 if there is none
    std::array<double, 3> fit() const {
      const double spread = aa - a * a / n;
      if (!(spread > 1e-9 * n)) return {0.0, 0.0, 0.0};
      const double slope = (ab - a * b / n) / spread;
      const double residual = (bb - b * b / n) - slope * (ab - a * b / n);
      return {slope, (b - slope * a) / n, std::sqrt(std::max(0.0, residual) / n)};
    }
  };
  Line columns, rows;
  // A step that shares no factor with common widths, so that all columns are sampled.
  const std::size_t step = std::max<std::size_t>(1, points.size / kSamples) | 1u;
  for (std::size_t i = 0; i < points.size; i += step) {
    if (!points.isMeasured(i)) continue;
    const float* p = points[i];
    if (!(p[2] > kNearPlane)) continue;
    columns.add(static_cast<double>(p[0]) / p[2], static_cast<double>(i % points.width));
    rows.add(static_cast<double>(p[1]) / p[2], static_cast<double>(i / points.width));
  }
  if (columns.n < kMinSamples) return std::nullopt;
  const std::array<double, 3> c = columns.fit();
  const std::array<double, 3> r = rows.fit();
  if (!(c[0] > 1.0 && r[0] > 1.0 && c[2] < kMaxError && r[2] < kMaxError)) {
    return std::nullopt;
  }
  return PinholeCamera{
      c[0], r[0], c[1], r[1], static_cast<int>(points.width), static_cast<int>(points.height)};
}

}  // namespace

std::vector<DepthImage> makeDepthImages(const FrameObservation& observation,
                                        const Matrix3& rotation, const Vector3& position,
                                        const std::vector<std::uint8_t>& use, double step,
                                        const Clearing& clearing, bool counted) {
  const PointsView& points = observation.points;
  std::vector<DepthImage> images;
  if (points.size == 0) return images;
  std::optional<PinholeCamera> camera = observation.camera;
  if (!camera) camera = estimateCamera(points);
  if (camera) {
    const bool organized = points.isOrganized();
    camera->width = organized ? static_cast<int>(points.width) : camera->width;
    camera->height = organized ? static_cast<int>(points.height) : camera->height;
    images.emplace_back(*camera, rotation, position, false, clearing);
    if (organized) {
      images.back().fill(points, use);
    } else {
      for (std::size_t i = 0; i < points.size; ++i) {
        if (points.isMeasured(i)) images.back().add(points.point(i));
      }
    }
    images.back().finish(counted);
    return images;
  }

  // Six cameras of a little more than a right angle each, so that a cell at an edge of the cube is
  // seen whole by one of them.
  constexpr double kReach = 1.1;
  PinholeCamera face;
  face.fx = face.fy = 1.0 / step;
  face.width = face.height = 2 * static_cast<int>(std::ceil(kReach / step)) + 1;
  face.cx = face.cy = 0.5 * (face.width - 1);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      Matrix3 axes;
      axes.col(2) = sign * Vector3::Unit(axis);
      axes.col(0) = Vector3::Unit((axis + 1) % 3);
      axes.col(1) = axes.col(2).cross(axes.col(0));
      DepthImage image(face, axes, position, true, clearing);
      bool any = false;
      for (std::size_t i = 0; i < points.size; ++i) {
        if (!points.isMeasured(i)) continue;
        const Vector3 p = axes.transpose() * (rotation * points.point(i));
        if (!(p.z() > 0.0 && std::abs(p.x()) <= kReach * p.z() &&
              std::abs(p.y()) <= kReach * p.z())) {
          continue;
        }
        image.add(p);
        any = true;
      }
      if (!any) continue;
      image.finish(counted);
      images.push_back(std::move(image));
    }
  }
  return images;
}

}  // namespace planar_mapping::detail
