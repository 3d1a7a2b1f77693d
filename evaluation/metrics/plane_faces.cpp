// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "evaluation/metrics/plane_quality.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping::evaluation {
namespace {

constexpr std::uint32_t kBlockSide = 4;  ///< pixels

void requireImage(const PointsView& points, int min_points) {
  if (!points.isOrganized()) throw InputError("faces are connected in an image only");
  requireInRange("min_points", min_points, 3, 2147483647, "points");
}

/// The connected parts of some points of an image, ascending by their first point; those with
/// fewer than \p min_points are left out.
std::vector<Indices> connectedParts(const PointsView& points, const Indices& list, int min_points) {
  // Blocks by row and column, each with its points.
  std::map<std::pair<std::uint32_t, std::uint32_t>, Indices> blocks;
  for (const int i : list) {
    const auto index = static_cast<std::uint32_t>(i);
    blocks[{index / points.width / kBlockSide, index % points.width / kBlockSide}].push_back(i);
  }
  std::vector<Indices> parts;
  while (!blocks.empty()) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> open = {blocks.begin()->first};
    Indices part = std::move(blocks.begin()->second);
    blocks.erase(blocks.begin());
    while (!open.empty()) {
      const auto [row, column] = open.back();
      open.pop_back();
      // Unsigned: one before the first row or column is a block that is not there.
      for (std::uint32_t r = row - 1; r != row + 2; ++r) {
        for (std::uint32_t c = column - 1; c != column + 2; ++c) {
          const auto next = blocks.find({r, c});
          if (next == blocks.end()) continue;
          open.push_back(next->first);
          part.insert(part.end(), next->second.begin(), next->second.end());
          blocks.erase(next);
        }
      }
    }
    if (part.size() < static_cast<std::size_t>(min_points)) continue;
    std::sort(part.begin(), part.end());
    parts.push_back(std::move(part));
  }
  std::sort(parts.begin(), parts.end());
  return parts;
}

}  // namespace

PlaneTruth splitFaces(const PointsView& points, const PlaneTruth& truth, int min_points) {
  requireImage(points, min_points);
  if (truth.labels.size() != points.size) {
    throw InputError(std::to_string(truth.labels.size()) + " labels for " +
                     std::to_string(points.size) + " points");
  }
  std::vector<Indices> lists(truth.planes.size());
  PlaneTruth faces;
  faces.labels = truth.labels;
  for (std::size_t i = 0; i < truth.labels.size(); ++i) {
    const int label = truth.labels[i];
    if (label < 0) continue;
    if (static_cast<std::size_t>(label) >= lists.size()) {
      throw InputError("label " + std::to_string(label) + " of " +
                       std::to_string(truth.planes.size()) + " planes");
    }
    faces.labels[i] = kNotJudged;
    lists[static_cast<std::size_t>(label)].push_back(static_cast<int>(i));
  }
  for (std::size_t plane = 0; plane < lists.size(); ++plane) {
    for (const Indices& part : connectedParts(points, lists[plane], min_points)) {
      for (const int i : part)
        faces.labels[static_cast<std::size_t>(i)] = static_cast<int>(faces.planes.size());
      faces.planes.push_back(truth.planes[plane]);
    }
  }
  return faces;
}

std::vector<PlaneSegment> splitFaces(const PointsView& points,
                                     const std::vector<PlaneSegment>& segments, int min_points) {
  requireImage(points, min_points);
  std::vector<PlaneSegment> faces;
  for (const PlaneSegment& segment : segments) {
    for (const int i : segment.inliers) {
      if (i < 0 || static_cast<std::size_t>(i) >= points.size) {
        throw InputError("inlier " + std::to_string(i) + " is outside the cloud of " +
                         std::to_string(points.size) + " points");
      }
    }
    for (Indices& part : connectedParts(points, segment.inliers, min_points)) {
      PlaneSegment face;
      face.plane = segment.plane;
      face.inliers = std::move(part);
      faces.push_back(std::move(face));
    }
  }
  return faces;
}

}  // namespace planar_mapping::evaluation
