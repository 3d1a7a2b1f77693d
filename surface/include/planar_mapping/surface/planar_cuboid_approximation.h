// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/ModelCoefficients.h>
#include <pcl/PointIndices.h>
#include <pcl/PolygonMesh.h>
#include <pcl/memory.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/surface/reconstruction.h>

#include <string>
#include <vector>

#include "planar_mapping/core/cuboids/cuboid_approximation.h"
#include "planar_mapping/core/base/export.h"

namespace planar_mapping {

/// Approximates a cloud by oriented rectangular cuboids (the paper, III-F): the points of each
/// plane by cuboids that lie in it, the rest of the cloud by cuboids of its own.
///
/// \code
/// planar_mapping::PlanarCuboidApproximation<pcl::PointXYZ> approximation;
/// approximation.setInputCloud(cloud);
/// approximation.setPlanes(inliers, planes);  // as MultiPlaneSACSegmentation returns them
/// approximation.setResolution(0.1);          // s, metres
/// std::vector<planar_mapping::Cuboid> cuboids;
/// approximation.approximate(cuboids);
/// \endcode
///
/// Cuboids are in the frame of the cloud. The front of a planar cuboid is its plane, from where it
/// extends away from the sensor (the cloud's sensor_origin_); Cuboid::plane_id is the position in
/// setPlanes(). Points that are not finite are skipped and counted. The same input and parameters
/// give the same result on any number of threads. The class prints nothing and keeps nothing
/// between runs but the last diagnostics.
template <typename PointT>
class PLANAR_MAPPING_EXPORT PlanarCuboidApproximation : public pcl::PCLSurfaceBase<PointT> {
 public:
  using Ptr = pcl::shared_ptr<PlanarCuboidApproximation<PointT>>;
  using ConstPtr = pcl::shared_ptr<const PlanarCuboidApproximation<PointT>>;
  using PointCloud = typename pcl::PCLBase<PointT>::PointCloud;
  using PointCloudPtr = typename pcl::PCLBase<PointT>::PointCloudPtr;
  using PointCloudConstPtr = typename pcl::PCLBase<PointT>::PointCloudConstPtr;

  /// Approximates the input cloud, or the points of setIndices().
  /// \param[out] cuboids planar ones plane by plane, then the non-planar ones
  /// \throws InputError without an input cloud, for an index or inlier outside it, or for
  ///                    probabilities that are not one per point
  void approximate(std::vector<Cuboid>& cuboids);

  /// As approximate(), as a mesh: eight vertices and six outward quadrilaterals for each cuboid.
  void reconstruct(pcl::PolygonMesh& mesh) override;

  /// Planes of the cloud with their inliers; the points in none of them are the non-planar part.
  /// \param inliers indices into the input cloud, disjoint, one set per plane
  /// \param planes  (a, b, c, d) of a x + b y + c z + d = 0, of any length and orientation
  /// \throws InputError if the sizes disagree or a plane has not four coefficients,
  ///         ParameterError if its normal is zero or something is not finite
  void setPlanes(const std::vector<pcl::PointIndices>& inliers,
                 const std::vector<pcl::ModelCoefficients>& planes);
  /// As above, from MultiPlaneSACSegmentation::getPlanes() or findPlanes().
  void setPlanes(const std::vector<PlaneSegment>& planes) { planes_ = planes; }
  /// Position in this list = Cuboid::plane_id.
  const std::vector<PlaneSegment>& getPlanes() const { return planes_; }

  /// Belief for each point of the input cloud, in [0, 1]; empty (the default) = 1.
  /// A cuboid gets the mean over its cells, a cell the mean over its points.
  void setPointProbabilities(const std::vector<float>& probabilities) {
    probabilities_ = probabilities;
  }
  const std::vector<float>& getPointProbabilities() const { return probabilities_; }

  /// What the last run did.
  const CuboidApproximationDiagnostics& getDiagnostics() const { return diagnostics_; }

  // Every setter below throws ParameterError, and changes nothing, if the value is out of range.

  /// All parameters at once.
  void setParams(const CuboidApproximationParams& params);
  const CuboidApproximationParams& getParams() const { return params_; }

  /// Paper: nothing beyond the paper. Compact (the default): as few cuboids as we can.
  void setProfile(Profile profile);
  Profile getProfile() const { return params_.profile; }
  /// s, side of the smallest cell, metres, > 0.
  void setResolution(double metres);
  double getResolution() const { return params_.resolution; }
  /// Extension away from the sensor, metres, >= 0; 0 = the resolution.
  void setThickness(double metres);
  double getThickness() const { return params_.thickness; }
  /// D_T, density below which the paper's split goes on, in (0, 1].
  void setDensityThreshold(double density);
  double getDensityThreshold() const { return params_.density_threshold; }
  /// W_T, metres, >= 0; 0 = the resolution.
  void setMinWidth(double metres);
  double getMinWidth() const { return params_.min_width; }
  /// H_T, metres, >= 0; 0 = the resolution.
  void setMinHeight(double metres);
  double getMinHeight() const { return params_.min_height; }
  /// Cells with fewer points are empty, >= 1.
  void setMinPointsPerCell(int points);
  int getMinPointsPerCell() const { return params_.min_points_per_cell; }
  /// Holes in a plane up to this side are filled (Compact), metres, >= 0; 0 = the resolution, less
  /// than the resolution = none.
  void setHoleSize(double metres);
  double getHoleSize() const { return params_.hole_size; }
  /// Points within this many cells of a cuboid need none of their own (Compact), in [0, 0.5].
  void setAbsorption(double cells);
  double getAbsorption() const { return params_.absorption; }
  /// Vertical direction in the frame of the cloud, of any length > 0; (0, -1, 0) for a camera's
  /// optical frame. The first axis of a planar cuboid is horizontal with respect to it.
  void setUpDirection(const Vector3& up);
  const Vector3& getUpDirection() const { return params_.up; }
  /// 0 = all cores; never changes the result.
  void setNumberOfThreads(int threads);
  int getNumberOfThreads() const { return params_.threads; }

  PCL_MAKE_ALIGNED_OPERATOR_NEW

 protected:
  std::string getClassName() const override { return "PlanarCuboidApproximation"; }

 private:
  CuboidApproximationParams params_;
  std::vector<PlaneSegment> planes_;
  std::vector<float> probabilities_;
  CuboidApproximationDiagnostics diagnostics_;
};

extern template class PLANAR_MAPPING_EXPORT PlanarCuboidApproximation<pcl::PointXYZ>;
extern template class PLANAR_MAPPING_EXPORT PlanarCuboidApproximation<pcl::PointXYZI>;
extern template class PLANAR_MAPPING_EXPORT PlanarCuboidApproximation<pcl::PointXYZL>;
extern template class PLANAR_MAPPING_EXPORT PlanarCuboidApproximation<pcl::PointXYZRGB>;
extern template class PLANAR_MAPPING_EXPORT PlanarCuboidApproximation<pcl::PointXYZRGBA>;
extern template class PLANAR_MAPPING_EXPORT PlanarCuboidApproximation<pcl::PointNormal>;
extern template class PLANAR_MAPPING_EXPORT PlanarCuboidApproximation<pcl::PointXYZRGBNormal>;
extern template class PLANAR_MAPPING_EXPORT PlanarCuboidApproximation<pcl::PointXYZINormal>;

}  // namespace planar_mapping

#include "planar_mapping/surface/impl/planar_cuboid_approximation.hpp"
