// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <pcl/impl/pcl_base.hpp>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/cloud_scale.h"
#include "planar_mapping/pcl/parameter_setter.h"
#include "planar_mapping/pcl/points_view.h"
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"

namespace planar_mapping {

template <typename PointT>
void MultiPlaneSACSegmentation<PointT>::segment() {
  result_ = PlaneSet();
  if (!this->input_) throw InputError("MultiPlaneSACSegmentation has no input cloud");
  const Indices* indices = this->use_indices_ && this->indices_ ? this->indices_.get() : nullptr;
  const CloudView points = viewOf(*this->input_);
  if (finds_threshold_ || finds_smallest_) {
    const CloudScale scale = scaleOf(points, usablePoints(points));
    if (finds_threshold_) params_.distance_threshold = automaticThreshold(scale);
    if (finds_smallest_) params_.min_inliers = automaticSmallestPlane(scale);
  }
  result_ = segmentPlanes(points, indices, features_, params_);
}

template <typename PointT>
void MultiPlaneSACSegmentation<PointT>::segment(std::vector<pcl::PointIndices>& inliers,
                                                std::vector<pcl::ModelCoefficients>& planes) {
  inliers.clear();
  planes.clear();
  segment();
  inliers.resize(result_.planes.size());
  planes.resize(result_.planes.size());
  for (std::size_t i = 0; i < result_.planes.size(); ++i) {
    const Vector4 coefficients = result_.planes[i].plane.coefficients();
    inliers[i].header = planes[i].header = this->input_->header;
    inliers[i].indices = result_.planes[i].inliers;
    planes[i].values.assign(coefficients.data(), coefficients.data() + 4);
  }
}

template <typename PointT>
void MultiPlaneSACSegmentation<PointT>::setParams(const MultiPlaneParams& params) {
  params.validate();
  params_ = params;
  finds_threshold_ = finds_smallest_ = false;
}

template <typename PointT>
void MultiPlaneSACSegmentation<PointT>::setDistanceThreshold(double metres) {
  requirePositive("distance_threshold", metres, "m");
  params_.distance_threshold = metres;
  finds_threshold_ = false;
}

template <typename PointT>
void MultiPlaneSACSegmentation<PointT>::setMinInliers(int points) {
  requireInRange("min_inliers", points, 3, std::numeric_limits<int>::max(), "points");
  params_.min_inliers = points;
  finds_smallest_ = false;
}

PLANAR_MAPPING_TEMPLATE_SETTER(MultiPlaneSACSegmentation, setMaxPlanes, int, max_planes)
PLANAR_MAPPING_TEMPLATE_SETTER(MultiPlaneSACSegmentation, setSource, PlaneSource, source)
PLANAR_MAPPING_TEMPLATE_SETTER(MultiPlaneSACSegmentation, setMethod, PlaneSearchMethod, method)
PLANAR_MAPPING_TEMPLATE_SETTER(MultiPlaneSACSegmentation, setNoiseModel,
                               const std::optional<StereoNoise>&, noise)
PLANAR_MAPPING_TEMPLATE_SETTER(MultiPlaneSACSegmentation, setNoiseFactor, double, noise_factor)
PLANAR_MAPPING_TEMPLATE_SETTER(MultiPlaneSACSegmentation, setPatchGap, double, patch_gap)
PLANAR_MAPPING_TEMPLATE_SETTER(MultiPlaneSACSegmentation, setNumberOfModels, int, number_of_models)
PLANAR_MAPPING_TEMPLATE_SETTER(MultiPlaneSACSegmentation, setMaxIterations, int, max_iterations)
PLANAR_MAPPING_TEMPLATE_SETTER(MultiPlaneSACSegmentation, setMissProbability, double,
                               miss_probability)
PLANAR_MAPPING_TEMPLATE_SETTER(MultiPlaneSACSegmentation, setSignificance, double, significance)
PLANAR_MAPPING_TEMPLATE_SETTER(MultiPlaneSACSegmentation, setMaxNormalDeviation, double,
                               max_normal_deviation)
PLANAR_MAPPING_TEMPLATE_SETTER(MultiPlaneSACSegmentation, setSeed, std::uint64_t, seed)
PLANAR_MAPPING_TEMPLATE_SETTER(MultiPlaneSACSegmentation, setNumberOfThreads, int, threads)

}  // namespace planar_mapping
