// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/ModelCoefficients.h>
#include <pcl/PointIndices.h>
#include <pcl/memory.h>
#include <pcl/pcl_base.h>
#include <pcl/point_cloud.h>

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/pcl/point_types.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping {

/// Finds all planes of a cloud in one call (the paper, III-C): sparse feature clouds, unorganized
/// clouds and organized ones, each by the search that suits it.
///
/// \code
/// planar_mapping::MultiPlaneSACSegmentation<pcl::PointXYZ> segmentation;
/// segmentation.setDistanceThreshold(0.05);  // d_T, metres
/// segmentation.setMinInliers(1000);
/// segmentation.setInputCloud(cloud);
/// std::vector<pcl::PointIndices> inliers;
/// std::vector<pcl::ModelCoefficients> planes;
/// segmentation.segment(inliers, planes);
/// \endcode
///
/// Planes come largest first, their inlier sets are disjoint, ascending and refer to the input
/// cloud. Every inlier lies within the threshold of its plane, or within the noise there where that
/// is larger: of an organized cloud it is measured, a depth camera's is 0.2 m and more at 7 m. The
/// points of a cloud are in the sensor's frame, and so are the planes: normals point towards its
/// origin, whatever the cloud's sensor_origin_ and sensor_orientation_ say of the sensor in the
/// world. Points that are not finite are skipped and counted. The same input and parameters give
/// the same result on any number of threads. The class prints nothing and keeps nothing between
/// runs but the last result.
///
/// setSource() and setInputFeatures() find planes of key features first, as the stage of
/// `planar_map run` does.
template <typename PointT>
class PLANAR_MAPPING_EXPORT MultiPlaneSACSegmentation : public pcl::PCLBase<PointT> {
 public:
  using Ptr = pcl::shared_ptr<MultiPlaneSACSegmentation<PointT>>;
  using ConstPtr = pcl::shared_ptr<const MultiPlaneSACSegmentation<PointT>>;
  using PointCloud = typename pcl::PCLBase<PointT>::PointCloud;
  using PointCloudPtr = typename pcl::PCLBase<PointT>::PointCloudPtr;
  using PointCloudConstPtr = typename pcl::PCLBase<PointT>::PointCloudConstPtr;

  /// Segments the input cloud, or the points of setIndices().
  /// \param[out] inliers indices into the input cloud, one set per plane; header of the cloud
  /// \param[out] planes  (a, b, c, d) of a x + b y + c z + d = 0, unit normal towards the sensor
  /// \throws InputError without an input cloud, for an index outside it, or if the cloud is not in
  ///         metres
  void segment(std::vector<pcl::PointIndices>& inliers,
               std::vector<pcl::ModelCoefficients>& planes);
  /// As above, for getPlanes() alone: in double precision, and without copies.
  void segment();

  /// The planes of the last segment(), with covariance, residual, tilt and patches.
  const std::vector<PlaneSegment>& getPlanes() const { return result_.planes; }
  /// The same without a copy; none are left.
  std::vector<PlaneSegment> takePlanes() { return std::exchange(result_.planes, {}); }
  /// What the last segment() did.
  const PlaneSearchDiagnostics& getDiagnostics() const { return result_.diagnostics; }

  // Every setter throws ParameterError, and changes nothing, if the value is out of range.

  /// All parameters at once.
  void setParams(const MultiPlaneParams& params);
  const MultiPlaneParams& getParams() const { return params_; }

  /// d_T, metres, > 0 (the paper, Eq. 11). Until it is set it follows from each cloud, half of
  /// automaticResolution(), as in single_pcd.yaml; getDistanceThreshold() has that of the last one.
  void setDistanceThreshold(double metres);
  double getDistanceThreshold() const { return params_.distance_threshold; }
  /// Smallest plane that counts, points, >= 3. Until it is set it follows from each cloud likewise:
  /// a 300th of its points, at least 50.
  void setMinInliers(int points);
  int getMinInliers() const { return params_.min_inliers; }
  /// 0 = as many as there are.
  void setMaxPlanes(int planes);
  int getMaxPlanes() const { return params_.max_planes; }
  /// What planes are found in; Dense is the default.
  void setSource(PlaneSource source);
  PlaneSource getSource() const { return params_.source; }
  /// Key features in the frame of the cloud, for sources other than Dense; none (the default) =
  /// points sampled from the cloud.
  void setInputFeatures(const std::vector<KeyFeature>& features) { features_ = features; }
  const std::vector<KeyFeature>& getInputFeatures() const { return features_; }
  void setMethod(PlaneSearchMethod method);
  PlaneSearchMethod getMethod() const { return params_.method; }
  /// Lets the threshold follow the noise of a stereo camera, d_T(z) = max(d_T, k dz(z)), z along
  /// the third axis of the cloud; std::nullopt keeps it constant.
  void setNoiseModel(const std::optional<StereoNoise>& noise);
  const std::optional<StereoNoise>& getNoiseModel() const { return params_.noise; }
  /// k of the threshold that follows the noise, >= 0.
  void setNoiseFactor(double factor);
  double getNoiseFactor() const { return params_.noise_factor; }
  /// Gap between separate patches of a plane, metres, >= 0; 0 = from the density.
  void setPatchGap(double metres);
  double getPatchGap() const { return params_.patch_gap; }
  /// W of multi-RANSAC, >= 0; 0 = by significance.
  void setNumberOfModels(int models);
  int getNumberOfModels() const { return params_.number_of_models; }
  /// Hypotheses of the random search, >= 0; 0 = from the miss probability.
  void setMaxIterations(int iterations);
  int getMaxIterations() const { return params_.max_iterations; }
  /// Probability to miss a plane that is there, in (0, 1).
  void setMissProbability(double probability);
  double getMissProbability() const { return params_.miss_probability; }
  /// Standard deviations by which a plane must exceed clutter, >= 0.
  void setSignificance(double deviations);
  double getSignificance() const { return params_.significance; }
  /// Largest angle between a plane and the surface where its points lie, radians in (0, pi / 2].
  void setMaxNormalDeviation(double radians);
  double getMaxNormalDeviation() const { return params_.max_normal_deviation; }
  void setSeed(std::uint64_t seed);
  std::uint64_t getSeed() const { return params_.seed; }
  /// 0 = all cores; never changes the result.
  void setNumberOfThreads(int threads);
  int getNumberOfThreads() const { return params_.threads; }

 private:
  MultiPlaneParams params_;
  bool finds_threshold_ = true;
  bool finds_smallest_ = true;
  std::vector<KeyFeature> features_;
  PlaneSet result_;
};

PLANAR_MAPPING_FOR_POINT_TYPES(extern template class PLANAR_MAPPING_EXPORT,
                               MultiPlaneSACSegmentation)

}  // namespace planar_mapping

#include "planar_mapping/segmentation/impl/multi_plane_sac_segmentation.hpp"
