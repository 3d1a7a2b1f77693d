// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "planar_mapping/planes/multi_plane.h"
#include "planar_mapping/planes/tiles/organized_tiles.h"

namespace planar_mapping::detail {

/// Parameters of both searches over images beyond MultiPlaneParams; all [ours].
struct SearchParams {
  explicit SearchParams(const MultiPlaneParams& params)
      : distance_threshold(params.distance_threshold),
        max_normal_deviation(params.max_normal_deviation),
        noise_factor(params.noise_factor) {}

  double distance_threshold;    ///< d_T, metres
  double max_normal_deviation;  ///< radians
  double noise_factor;          ///< k of d_T(z) = max(d_T, k sigma(z))
  /// Fraction of d_T by which the mean of a cell may lie off the plane it joins: real surfaces are
  /// flat to a part of d_T only.
  double growing_fraction = 0.4;
  /// Sigmas of residual up to which the neighbourhood of a cell counts as planar.
  double planar_factor = 1.6;
  /// Fraction of d_T within which surfaces are flat.
  double flat_fraction = 0.1;
  /// Quantile of the residuals of windows that is taken for the noise of the sensor.
  double noise_quantile = 0.35;
  /// Radians between either plane and their common one.
  double merging_angle = 0.15;
  /// Radians between the neighbourhood of a point and its plane.
  double coherent_angle = 0.35;

  double flatDistance() const { return flat_fraction * distance_threshold; }
  double growingDistance() const { return growing_fraction * distance_threshold; }
  /// Planes that touch are one, and pixels beside grown cells theirs, within half of what grows.
  double touchingDistance() const { return 0.5 * growingDistance(); }
};

/// Errors of matching and of depth cameras are smooth: so many pixels count as one measurement of a
/// slope.
constexpr double kCorrelatedPixels = 25.0;
constexpr std::size_t kMaxCandidates = 4096;  ///< planes a frame may hold before merging

/// A plane while it is looked for, in the space of the tiled cloud: normal . p + offset is the
/// error of a point, in metres across the plane or in pixels of disparity.
struct PlaneCandidate {
  MomentSums sums = {};
  Vector3 normal = Vector3::Zero();
  double offset = 0.0;
  Vector3 direction = Vector3::Zero();  ///< unit normal in metres, whatever the space
  double height = 0.0;                  ///< signed distance of the sensor, metres
  double residual = 0.0;                ///< root mean square error
  double width = 0.0;  ///< root mean square extent along the shorter axis, metres or pixels
  bool valid = false;

  double distance(const Vector3& point) const {
    return normal[0] * point[0] + normal[1] * point[1] + normal[2] * point[2] + offset;
  }
  /// Error of the mean of other sums.
  double meanError(const MomentSums& other) const {
    return (normal[0] * other[kX] + normal[1] * other[kY] + normal[2] * other[kZ]) / other[kN] +
           offset;
  }
  /// Mean square error of other sums.
  double meanSquare(const MomentSums& other) const;
  /// |cosine| between the plane and a direction of unit length.
  template <typename Direction>
  double cosine(const Direction& other) const {
    return std::fabs(direction[0] * other[0] + direction[1] * other[1] + direction[2] * other[2]);
  }
};

/// The pixels of one plane in one tile.
struct TilePart {
  std::int32_t tile = 0;
  std::int16_t label = -1;
  std::int16_t finite = 0;  ///< finite pixels of the tile, of this plane or not
  MomentSums sums = {};
};

/// Parts of one plane: indices into the list of all parts, ascending by tile.
using PartList = std::vector<std::size_t>;
/// The parts of each plane.
std::vector<PartList> partsOfPlanes(const std::vector<TilePart>& parts, std::size_t planes);

/// How much better a quadratic surface explains the means of the parts of a plane than the plane.
struct Bend {
  double slope = 0.0;      ///< between both, root mean square, error per unit of place
  double advantage = 0.0;  ///< variance ratio (F) in favour of the quadratic surface
  double bow = 0.0;        ///< root mean square error that the quadratic surface explains
};

/// What must hold of a plane that is no slice through unrelated objects.
struct CoherenceTest {
  /// Fraction of the points in its tiles that are on it and whose surroundings lie as it does.
  double min_agreement = 0.0;
  bool own_points_only = false;  ///< points of the tiles that are not on the plane do not count
  bool may_bend = true;          ///< is not tested for a quadratic surface
  Vector3 axes[2];               ///< of the places of parts, for the quadratic surface
};

/// What the searches in metres and in disparity space do not share: fits and their noise.
class PlaneFit {
 public:
  virtual ~PlaneFit() = default;

  /// Fits the plane to its sums; valid is false if they are too few or collinear.
  virtual void fit(PlaneCandidate& plane) const = 0;
  /// Improves a fitted plane by the noise of each of its parts.
  virtual void refine(PlaneCandidate& /*plane*/, const std::vector<TilePart>& /*parts*/,
                      const PartList& /*list*/) const {}
  /// Whether two planes fit their common one within what noise and the flatness of surfaces allow.
  /// \param adjacent their cells touch or have one cell between them
  /// \param joined   becomes the common plane
  virtual bool areOne(const PlaneCandidate& one, const PlaneCandidate& other, bool adjacent,
                      PlaneCandidate& joined) const = 0;
  virtual CoherenceTest coherenceTest(const PlaneCandidate& plane,
                                      const std::vector<TilePart>& parts,
                                      const PartList& list) const = 0;
  /// Which of the windows, each the sums of points of the plane, lie as the plane does.
  virtual std::vector<char> agree(const PlaneCandidate& plane, const CellGrid& windows) const = 0;
  virtual bool isBent(const PlaneCandidate& /*plane*/, const Bend& /*bend*/) const { return false; }
};

/// Tells planes from bent surfaces and from slices through unrelated objects: the tiles of a plane
/// must be filled with points whose neighbourhoods lie as the plane does, and a quadratic surface
/// must not explain them better.
/// \param parts ascending by tile
/// \return true per plane that is one
std::vector<char> coherentPlanes(const std::vector<PlaneCandidate>& planes,
                                 const std::vector<TilePart>& parts, int columns, int tiles,
                                 const PlaneFit& fit);

/// Writes inliers and patches of \p segments, one per label, null for a label without pixels.
/// \param parts     what of each tile has which label, ascending by tile
/// \param patch_gap metres that separate patches; 0 = patches are connected over adjacent tiles
void listSegments(const PointsView& points, const TiledCloud& cloud,
                  const std::vector<std::int16_t>& labels, const std::vector<TilePart>& parts,
                  double patch_gap, const std::vector<PlaneSegment*>& segments);

}  // namespace planar_mapping::detail
