// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/plane.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping::evaluation {

/// Labels of points that are on no plane of PlaneTruth::planes.
constexpr int kOnNoPlane = -1;  ///< known to be on none: a segment there is wrong
constexpr int kNotJudged = -2;  ///< unknown: as if the point were not there

/// The planes of a cloud as they are known.
struct PlaneTruth {
  std::vector<int> labels;    ///< of each point: index into planes, kOnNoPlane or kNotJudged
  std::vector<Plane> planes;  ///< unit normals; their sign does not matter

  /// Points of each plane.
  std::vector<std::size_t> sizes() const;
};

/// Truth of a cloud whose points carry the numbers of planes, which are fitted to them along the
/// rays of a sensor at the origin (least squares of the inverse range), so that noise along oblique
/// rays does not turn them. Planes are numbered by rising label; non-finite points are not judged.
/// \param labels     of each point: any number >= 0, kOnNoPlane or kNotJudged
/// \param min_points labels with fewer points are not judged, >= 3
/// \throws InputError if sizes disagree or a label is below kNotJudged; ParameterError
PlaneTruth truthOfLabels(const PointsView& points, const std::vector<int>& labels,
                         int min_points = 3);
/// The same with planes that are known: labels are indices into \p planes.
/// \throws InputError also for a label that is no such index
PlaneTruth truthOf(const PointsView& points, const std::vector<int>& labels,
                   const std::vector<Plane>& planes, int min_points = 3);

/// When two planes count as one and the same.
struct CoplanarParams {
  /// Metres, > 0: how much farther than from their own plane (root of the difference of the mean
  /// squares) the points of the plane with fewer points may be from the other.
  double max_distance = 0.02;
  double max_angle = 0.05;  ///< between the normals, radians, in (0, pi/2]

  /// \throws ParameterError
  void validate() const;
};

/// The unit "one plane of space": joins planes that are coplanar, connected or not. The largest
/// plane takes all that are coplanar with it, then the largest of the rest, and so on. Labels of
/// planes and segments of a search are joined by one rule, so that neither labels that split a
/// plane nor a search that does is judged for it.
/// \throws InputError if sizes disagree; ParameterError
PlaneTruth joinCoplanar(const PointsView& points, const PlaneTruth& truth,
                        const CoplanarParams& params);
/// The same of segments; only `plane` and `inliers` of the result are filled.
/// \throws InputError if an inlier is outside the cloud; ParameterError
std::vector<PlaneSegment> joinCoplanar(const PointsView& points,
                                       const std::vector<PlaneSegment>& segments,
                                       const CoplanarParams& params);

/// The unit "one connected face": splits planes and segments into their connected parts in the
/// image, by one rule for both, and drops parts of few points; points of planes that are dropped
/// are not judged. Connected are points in the same or in touching blocks of 4 x 4 pixels, so that
/// pin-holes do not cut a face.
/// \param min_points least points of a face, >= 3
/// \throws InputError if the cloud is not organized or sizes disagree; ParameterError
PlaneTruth splitFaces(const PointsView& points, const PlaneTruth& truth, int min_points);
/// The same of segments; only `plane` (the segment's) and `inliers` of the result are filled.
/// \throws InputError if an inlier is outside the cloud; ParameterError
std::vector<PlaneSegment> splitFaces(const PointsView& points,
                                     const std::vector<PlaneSegment>& segments, int min_points);

/// Segments and true planes by the definitions of Hoover et al. ("An experimental comparison of
/// range image segmentation algorithms", PAMI 18(7), 1996) for an overlap T > 0.5.
struct PlaneQuality {
  int true_planes = 0;
  int segments = 0;  ///< with at least half of their points on points that are judged
  int correct = 0;   ///< pairs that share T of the points of both
  int over = 0;      ///< planes of which several segments, each T inside it, hold T together
  int under = 0;     ///< segments that consist to T of several planes, T of each
  int missed = 0;    ///< planes in none of these
  int noise = 0;     ///< segments in none of these
  std::vector<double> angles;        ///< of each correct pair, radians, by true plane
  std::size_t points_on_planes = 0;  ///< of true planes
  std::size_t points_found = 0;      ///< of those, in the segment that holds most of their plane

  /// correct / true_planes; 1 if there are none.
  double recall() const;
  /// correct / segments; 1 if there are none.
  double precision() const;
  /// points_found / points_on_planes; 1 if there are none.
  double pointRecall() const;
  /// Of the correct pairs, radians; 0 if there are none.
  double meanAngle() const;

  /// Adds the counts of another cloud, so that every plane counts the same.
  void add(const PlaneQuality& other);
};

/// Judges the planes found in a cloud. Correct pairs come first; over- and under-segmentation are
/// looked for among the rest. Points that are not judged count nowhere.
/// \param overlap T, in (0.5, 1]
/// \throws InputError if an inlier is outside the cloud or in two segments; ParameterError
PlaneQuality judgePlanes(const PlaneTruth& truth, const std::vector<PlaneSegment>& segments,
                         double overlap = 0.8);

}  // namespace planar_mapping::evaluation
