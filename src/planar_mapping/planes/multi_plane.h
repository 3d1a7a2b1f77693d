// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/geometry/plane.h"
#include "planar_mapping/geometry/plane_moments.h"

namespace planar_mapping {

/// How planes are looked for.
enum class PlaneSearchMethod : std::uint8_t {
  /// By the cloud: MultiRansac up to 5,000 points, then for images that do not look all around, as
  /// lists on the lattice of a camera or scanner are, in any order, Disparity where the noise is
  /// given and the sensor at the origin and Organized where not, else, or where that finds none,
  /// Sequential. If that puts less than half of fewer than 100,000 points on planes, cells of 3 d_T
  /// with fewer than 11, MultiRansac too: taken if it puts more there, or Sequential < a quarter.
  Automatic,
  MultiRansac,  ///< W models at once, disjoint sets, fusion (Zuliani et al., ICIP 2005)
  Sequential,   ///< one plane after the other with local optimisation, on local cells
  Organized,    ///< cell grid of the image, region growing and pixel refinement
  /// The same in disparity space, where planes are planes and the noise of a stereo camera is the
  /// same everywhere: needs MultiPlaneParams::noise, a sensor at the origin that looks along z.
  Disparity,
};

/// What segmentPlanes() finds planes in.
enum class PlaneSource : std::uint8_t {
  Dense,     ///< the points of the cloud
  Features,  ///< key features; points are then given to their planes (Eq. 11)
  Auto,      ///< [ours] key features, then the points on none of their planes
};

/// Parameters of planes from key features, see segmentPlanes().
struct PLANAR_MAPPING_EXPORT FeaturePlaneParams {
  /// [ours] points sampled evenly from the cloud where there are no key features, >= 0
  int samples = 1000;
  int min_features = 8;  ///< [ours] features on a plane, fewer could be chance; >= 3
  /// [ours] Disparity errors a feature may lie off its plane where the noise is given; without, it
  /// is d_T. > 0
  double feature_error_factor = 1.5;
  /// [ours] A plane is kept only where it is a surface (min_dominance), and is refitted to its
  /// points. Without, points only belong, as in the paper.
  bool refine = true;
  /// [ours] Times as many points as in either slab of the same thickness beside it that a plane
  /// must hold, >= 1: a plane through unrelated objects has as many beside it as on it.
  double min_dominance = 1.5;
  /// [ours] Largest turn of a plane when it is refitted to its points, radians, in (0, pi/2]: one
  /// that turns farther stood on features of several surfaces.
  double max_refit_turn = 0.2;
  /// [ours] Radians up to which a plane of the dense search continues one of features, in
  /// [0, pi/2], if it also lies within d_T of it.
  double joining_angle = 0.1;

  /// \throws ParameterError
  void validate() const;
};

/// Parameters of findPlanes() and segmentPlanes(). Lengths in metres.
struct PLANAR_MAPPING_EXPORT MultiPlaneParams {
  PlaneSearchMethod method = PlaneSearchMethod::Automatic;
  double distance_threshold = 0.05;  ///< d_T, Eq. 11, > 0
  int min_inliers = 100;             ///< smallest plane that counts, >= 3
  int max_planes = 0;                ///< 0 = as many as there are
  /// [ours] the threshold follows the noise: d_T(z) = max(d_T, noise_factor * dz(z)).
  std::optional<StereoNoise> noise;
  double noise_factor = 3.0;  ///< k, >= 0
  /// [ours] points of one plane farther apart than this are separate patches; 0 = from the density.
  double patch_gap = 0.0;
  int number_of_models = 0;        ///< W, at most, of MultiRansac; 0 = by significance
  int max_iterations = 0;          ///< of the random search; 0 = from the miss probability
  double miss_probability = 0.01;  ///< eps of the stopping rule of MultiRansac, in (0, 1)
  /// [ours] inliers must exceed what clutter of the density beside the plane would give by this
  /// many standard deviations.
  double significance = 5.0;
  double max_normal_deviation = 0.5;  ///< [ours] radians between a cell's normal and its plane's
  std::uint64_t seed = 12345;
  int threads = 1;                          ///< 0 = all cores; never changes the result
  PlaneSource source = PlaneSource::Dense;  ///< of segmentPlanes()
  FeaturePlaneParams features;              ///< of sources other than Dense

  /// \throws ParameterError
  void validate() const;
};

/// One plane and the points on it.
struct PlaneSegment {
  Plane plane;                           ///< least squares, normal towards the sensor
  Matrix4 covariance = Matrix4::Zero();  ///< of (a, b, c, d)
  double rms = 0.0;                      ///< residual of the inliers, metres
  double tilt = 0.0;                     ///< normalizedTilt() of plane, radians, frame of the cloud
  PlaneMoments moments;                  ///< of the inliers
  Indices inliers;                       ///< ascending, into the cloud
  /// Connected patch of each inlier, 0 = the largest; empty if there is only one.
  std::vector<std::int32_t> patches;
  int number_of_patches = 1;
};

/// What segmentPlanes() did with key features.
struct FeaturePlaneDiagnostics {
  std::size_t features_considered = 0;
  std::size_t features_not_finite = 0;
  std::size_t planes_of_features = 0;      ///< that multi-RANSAC proposed
  std::size_t rejected_too_small = 0;      ///< fewer than min_inliers points
  std::size_t planes_of_dense_points = 0;  ///< in the result
  std::size_t points_of_features = 0;      ///< points on planes found by features
};

/// What findPlanes() did.
struct PlaneSearchDiagnostics {
  PlaneSearchMethod method = PlaneSearchMethod::Automatic;  ///< the one that ran
  std::size_t points_considered = 0;
  std::size_t points_not_measured = 0;
  std::size_t duplicate_points = 0;  ///< counted by MultiRansac, which samples each once
  std::size_t hypotheses = 0;
  std::size_t rejected_too_small = 0;
  std::size_t rejected_not_significant = 0;
  std::size_t rejected_not_coherent = 0;  ///< planes through unrelated objects
  bool stopped_by_itself = true;     ///< false if max_planes or max_iterations ended the search
  FeaturePlaneDiagnostics features;  ///< of segmentPlanes()
};

struct PlaneSet {
  std::vector<PlaneSegment> planes;  ///< by number of inliers, largest first
  PlaneSearchDiagnostics diagnostics;
};

/// Finds the planes of a cloud (the paper, III-C).
/// \param points  the cloud; non-finite points are skipped and counted
/// \param indices the points that count, or null for all
/// \param sensor  position of the sensor in the cloud's frame; orients normals
/// \return disjoint inlier sets, each within d_T(z) of its plane (Organized: within the noise it
///         measures, where that is larger); empty if nothing is found
/// \throws ParameterError for bad parameters, InputError for an index outside the cloud, a view
///         without data or a sensor that is not finite
/// \note The order of the points changes sums in their last digits only, and with them a point on
///       the border of a band; draws of MultiRansac do not depend on it. In clouds of more than
///       some 16,000 cells Sequential draws its voters by \p params.seed in the order of the cells,
///       so there the order may decide about planes near the limits.
/// Time grows linearly with the points (Sequential), about 8 bytes a point are needed besides the
/// result.
PLANAR_MAPPING_EXPORT PlaneSet findPlanes(const PointsView& points, const Indices* indices,
                                          const MultiPlaneParams& params,
                                          const Vector3& sensor = Vector3::Zero());

/// Finds the planes of a frame in what params.source names (the paper, III-C).
///
/// Dense: findPlanes(). Else multi-RANSAC on the key features proposes planes, points are clustered
/// to them (Eq. 11, clusterByPlane()), and [ours] each plane that is a surface is refitted to its
/// points; Auto then searches the points on none of these planes: a plain wall has no features.
/// Where there are no key features, features.samples points spread evenly over the indices take
/// their place.
/// \param features positions in the frame of \p points; non-finite ones are skipped and counted
/// \return planes as findPlanes() returns them: inliers are points of the cloud, largest first
/// \throws ParameterError, InputError as findPlanes()
PLANAR_MAPPING_EXPORT PlaneSet segmentPlanes(const PointsView& points, const Indices* indices,
                                             const std::vector<KeyFeature>& features,
                                             const MultiPlaneParams& params,
                                             const Vector3& sensor = Vector3::Zero());

/// Gives every point to its nearest plane within d_T(z) (the paper, Eq. 11).
/// \return plane per point, -1 = none
PLANAR_MAPPING_EXPORT std::vector<std::int32_t> clusterByPlane(const PointsView& points,
                                                               const std::vector<Plane>& planes,
                                                               const MultiPlaneParams& params);

}  // namespace planar_mapping
