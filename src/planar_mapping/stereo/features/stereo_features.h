// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/stereo/features/feature_detection.h"

namespace planar_mapping::detail {

/// The point of an organized cloud at a place between pixels: between four points of one surface,
/// else the nearest of the points around, because a corner belongs to the surface in front. \return
/// nothing if none of them was measured
std::optional<Vector3> pointAt(const PointsView& cloud, float column, float row);

/// A square of gray values that is found again in another image below the pixel, by least squares
/// on the values freed of mean and contrast (inverse compositional: its gradients are made once).
class Patch {
 public:
  /// Around a place of the image; there is none (isUsable() is false) at its border and where the
  /// gray values do not change enough.
  /// \param image   gray, 8 bits
  /// \param window  side, odd
  Patch(const cv::Mat& image, cv::Point2f center, int window);

  bool isUsable() const { return usable_; }

  /// Place in another image, moved along the row only. \param start  where to begin
  /// \return nothing if it leaves the image, moves farther than `reach` pixels, or the values
  ///         differ by more than `max_residual` of their own deviation
  std::optional<cv::Point2f> findAlongRow(const cv::Mat& image, cv::Point2f start, float reach,
                                          float max_residual) const;
  /// As findAlongRow(), in both directions.
  std::optional<cv::Point2f> find(const cv::Mat& image, cv::Point2f start, float reach,
                                  float max_residual) const;

 private:
  std::optional<cv::Point2f> search(const cv::Mat& image, cv::Point2f start, float reach,
                                    float max_residual, bool along_row) const;

  int window_;
  bool usable_ = false;
  float deviation_ = 0.0f;     ///< root of the sum of squares
  std::vector<float> values_;  ///< freed of their mean
  std::vector<float> gradient_x_;
  std::vector<float> gradient_y_;
  float xx_ = 0.0f;
  float xy_ = 0.0f;
  float yy_ = 0.0f;
  mutable std::vector<float> sampled_;  ///< kept for its memory
};

/// Where a match may lie: column of the left minus column of the right feature.
struct RowSearch {
  double low = 0.0;
  double high = 0.0;
  double epipolar_tolerance = 2.0;
  double ratio = 0.9;
};

/// For each left feature the right one on its row with the nearest descriptor, or -1.
std::vector<int> matchAlongRows(const DetectedFeatures& left, const DetectedFeatures& right,
                                const RowSearch& search);

/// Columns in the right image below the pixel, of features in the left one of about these
/// disparities; NaN where the gray values do not agree or are too flat.
std::vector<float> refineAlongRows(const cv::Mat& left, const cv::Mat& right,
                                   const std::vector<Detection>& places,
                                   const std::vector<float>& disparities, int window,
                                   float max_residual, int threads);

}  // namespace planar_mapping::detail
