// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "planar_mapping/stereo/features/feature_tracker.h"

namespace planar_mapping::detail {

/// Descriptors of one kind, one row each. Floats are kept as whole numbers: sums of integers do not
/// depend on their order, so that every instruction set finds the same nearest neighbour.
class Descriptors {
 public:
  Descriptors() = default;
  /// \param length  16-bit values a row, or 64-bit words where binary
  Descriptors(bool binary, std::size_t length) : binary_(binary), length_(length) {}

  bool isBinary() const { return binary_; }
  std::size_t size() const { return length_ == 0 ? 0 : stored() / length_; }
  bool empty() const { return size() == 0; }

  /// \param values  whole numbers; a row's squared length stays below 2^28
  void addValues(const float* values);
  /// \param bytes  padded with zeros to whole words
  void addBytes(const std::uint8_t* bytes, std::size_t count);
  /// A row of another set of the same kind; an empty set becomes of that kind.
  void add(const Descriptors& other, std::size_t row);

  /// Squared Euclidean or Hamming distance.
  std::int32_t distance(std::size_t row, const Descriptors& other, std::size_t other_row) const {
    std::int32_t out = 0;
    compare(row, other, other_row, 1, &out);
    return out;
  }
  /// Of one row to all rows of another set.
  void distances(std::size_t row, const Descriptors& other, std::int32_t* out) const {
    compare(row, other, 0, other.size(), out);
  }

 private:
  void compare(std::size_t row, const Descriptors& other, std::size_t first, std::size_t count,
               std::int32_t* out) const;
  std::size_t stored() const { return binary_ ? words_.size() : values_.size(); }

  bool binary_ = false;
  std::size_t length_ = 0;
  std::vector<std::int16_t> values_;
  std::vector<std::uint64_t> words_;
};

/// Best over second-best distance must stay below the ratio; squared distances know it squared.
inline bool isDistinct(std::int32_t best, std::int32_t second, double ratio, bool binary) {
  const double factor = binary ? ratio : ratio * ratio;
  return static_cast<double>(best) < factor * static_cast<double>(second);
}

/// For each row of `queries` the row of `known` it matches, or -1; a known row matches at most one
/// query. \param ratio  see isDistinct()
std::vector<int> matchDescriptors(const Descriptors& queries, const Descriptors& known,
                                  double ratio, int threads);

struct Detection {
  float column = 0.0f;
  float row = 0.0f;
  float response = 0.0f;
};

struct DetectedFeatures {
  std::vector<Detection> places;
  Descriptors descriptors;

  std::size_t size() const { return places.size(); }
};

/// \param gray   8 bits, without padding
/// \param count  at most
DetectedFeatures detectFeatures(const cv::Mat& gray, const FeatureTrackerParams& params, int count);

/// Positions of up to `count` detections: the strongest of each cell of a grid over the image
/// first, then the strongest of the rest. Ascending.
PLANAR_MAPPING_EXPORT std::vector<std::size_t> spreadEvenly(
    const std::vector<Detection>& detections, int width, int height, int count);

}  // namespace planar_mapping::detail
