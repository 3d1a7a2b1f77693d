// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/features/feature_detection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include "planar_mapping/base/parallel.h"
#include "planar_mapping/base/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr std::int32_t kFar = std::numeric_limits<std::int32_t>::max();

PLANAR_MAPPING_MULTIVERSION
void squaredDistances(const std::int16_t* query, const std::int16_t* known, std::size_t count,
                      std::size_t length, std::int32_t* out) {
  for (std::size_t row = 0; row < count; ++row) {
    const std::int16_t* values = known + row * length;
    std::int32_t sum = 0;
    for (std::size_t k = 0; k < length; ++k) {
      const std::int32_t difference = static_cast<std::int16_t>(query[k] - values[k]);
      sum += difference * difference;
    }
    out[row] = sum;
  }
}

PLANAR_MAPPING_MULTIVERSION
void hammingDistances(const std::uint64_t* query, const std::uint64_t* known, std::size_t count,
                      std::size_t length, std::int32_t* out) {
  for (std::size_t row = 0; row < count; ++row) {
    const std::uint64_t* words = known + row * length;
    std::int32_t sum = 0;
    for (std::size_t k = 0; k < length; ++k) {
      sum += static_cast<std::int32_t>(__builtin_popcountll(query[k] ^ words[k]));
    }
    out[row] = sum;
  }
}

struct Nearest {
  int row = -1;
  std::int32_t best = kFar;
  std::int32_t second = kFar;

  void offer(int other, std::int32_t distance) {
    if (distance < best) {
      second = best;
      best = distance;
      row = other;
    } else if (distance < second) {
      second = distance;
    }
  }
};

/// \param rows  of the queries; the others find nothing
std::vector<Nearest> searchExactly(const Descriptors& queries, const std::vector<std::size_t>& rows,
                                   const Descriptors& known, int threads) {
  constexpr std::size_t kRowsPerChunk = 64;
  std::vector<Nearest> nearest(queries.size());
  const std::size_t chunks = (rows.size() + kRowsPerChunk - 1) / kRowsPerChunk;
  parallelFor(chunks, threads, [&](std::size_t chunk) {
    std::vector<std::int32_t> distances(known.size());
    const std::size_t last = std::min((chunk + 1) * kRowsPerChunk, rows.size());
    for (std::size_t k = chunk * kRowsPerChunk; k < last; ++k) {
      const std::size_t i = rows[k];
      queries.distances(i, known, distances.data());
      for (std::size_t j = 0; j < distances.size(); ++j)
        nearest[i].offer(static_cast<int>(j), distances[j]);
    }
  });
  return nearest;
}

}  // namespace

void Descriptors::addValues(const float* values) {
  for (std::size_t k = 0; k < length_; ++k)
    values_.push_back(static_cast<std::int16_t>(std::lround(values[k])));
}

void Descriptors::addBytes(const std::uint8_t* bytes, std::size_t count) {
  for (std::size_t word = 0; word < length_; ++word) {
    std::uint64_t value = 0;
    for (std::size_t k = 8 * word; k < std::min(8 * word + 8, count); ++k)
      value |= static_cast<std::uint64_t>(bytes[k]) << (8 * (k % 8));
    words_.push_back(value);
  }
}

void Descriptors::add(const Descriptors& other, std::size_t row) {
  if (length_ == 0) *this = Descriptors(other.binary_, other.length_);
  const auto append = [&](auto& to, const auto& from) {
    const auto first = from.begin() + static_cast<std::ptrdiff_t>(row * length_);
    to.insert(to.end(), first, first + static_cast<std::ptrdiff_t>(length_));
  };
  if (binary_) {
    append(words_, other.words_);
  } else {
    append(values_, other.values_);
  }
}

void Descriptors::compare(std::size_t row, const Descriptors& other, std::size_t first,
                          std::size_t count, std::int32_t* out) const {
  if (binary_) {
    hammingDistances(words_.data() + row * length_, other.words_.data() + first * length_, count,
                     length_, out);
  } else {
    squaredDistances(values_.data() + row * length_, other.values_.data() + first * length_, count,
                     length_, out);
  }
}

std::vector<int> matchDescriptors(const Descriptors& queries, const Descriptors& known,
                                  double ratio, int threads) {
  std::vector<int> matches(queries.size(), -1);
  if (queries.empty() || known.empty()) return matches;
  std::vector<std::size_t> all(queries.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const std::vector<Nearest> nearest = searchExactly(queries, all, known, threads);
  const auto isFound = [&](const Nearest& found) {
    return found.row >= 0 && isDistinct(found.best, found.second, ratio, queries.isBinary());
  };
  // The query that is nearest to each known row; the first of equals.
  std::vector<int> owner(known.size(), -1);
  std::vector<bool> is_wanted(known.size(), false);
  for (const Nearest& found : nearest)
    if (isFound(found)) is_wanted[static_cast<std::size_t>(found.row)] = true;
  std::vector<std::size_t> rows;
  for (std::size_t j = 0; j < is_wanted.size(); ++j)
    if (is_wanted[j]) rows.push_back(j);
  const std::vector<Nearest> back = searchExactly(known, rows, queries, threads);
  for (const std::size_t j : rows) owner[j] = back[j].row;
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    const Nearest& found = nearest[i];
    if (isFound(found) && owner[static_cast<std::size_t>(found.row)] == static_cast<int>(i))
      matches[i] = found.row;
  }
  return matches;
}

namespace {

std::vector<Detection> detectionsOf(const std::vector<cv::KeyPoint>& points) {
  std::vector<Detection> detections;
  detections.reserve(points.size());
  for (const cv::KeyPoint& point : points)
    detections.push_back({point.pt.x, point.pt.y, point.response});
  return detections;
}

/// Detects, chooses evenly, and describes what was chosen.
DetectedFeatures runDetector(cv::Feature2D& detector, const cv::Mat& gray, int count) {
  std::vector<cv::KeyPoint> points;
  detector.detect(gray, points);
  const std::vector<Detection> all = detectionsOf(points);
  std::vector<cv::KeyPoint> chosen;
  for (const std::size_t i : spreadEvenly(all, gray.cols, gray.rows, count))
    chosen.push_back(points[i]);
  cv::Mat rows;
  if (!chosen.empty()) detector.compute(gray, chosen, rows);

  DetectedFeatures features;
  features.places = detectionsOf(chosen);
  const bool binary = rows.type() == CV_8U;
  const auto columns = static_cast<std::size_t>(rows.cols);
  features.descriptors = Descriptors(binary, binary ? (columns + 7) / 8 : columns);
  for (int row = 0; row < rows.rows; ++row) {
    if (binary) {
      features.descriptors.addBytes(rows.ptr(row), columns);
    } else {
      features.descriptors.addValues(rows.ptr<float>(row));  // SIFT has whole numbers
    }
  }
  return features;
}

}  // namespace

std::vector<std::size_t> spreadEvenly(const std::vector<Detection>& detections, int width,
                                      int height, int count) {
  std::vector<std::size_t> order(detections.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto wanted = static_cast<std::size_t>(count);
  if (detections.size() <= wanted) return order;
  const auto stronger = [&](std::size_t a, std::size_t b) {
    const Detection& first = detections[a];
    const Detection& second = detections[b];
    if (first.response != second.response) return first.response > second.response;
    return a < b;
  };
  std::sort(order.begin(), order.end(), stronger);
  constexpr int kColumns = 8;
  constexpr int kRows = 6;
  const std::size_t quota = (wanted + kColumns * kRows - 1) / (kColumns * kRows);
  std::vector<std::size_t> taken_in_cell(kColumns * kRows, 0);
  std::vector<std::size_t> chosen;
  std::vector<std::size_t> rest;
  for (const std::size_t i : order) {
    const auto cellOf = [](float place, int side, int cells) {
      return std::clamp(
          static_cast<int>(place * static_cast<float>(cells) / static_cast<float>(side)), 0,
          cells - 1);
    };
    const int cell = cellOf(detections[i].row, height, kRows) * kColumns +
                     cellOf(detections[i].column, width, kColumns);
    std::size_t& taken = taken_in_cell[static_cast<std::size_t>(cell)];
    if (taken < quota && chosen.size() < wanted) {
      ++taken;
      chosen.push_back(i);
    } else {
      rest.push_back(i);
    }
  }
  const std::size_t missing = std::min(wanted - chosen.size(), rest.size());
  chosen.insert(chosen.end(), rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(missing));
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

DetectedFeatures detectFeatures(const cv::Mat& gray, const FeatureTrackerParams& params,
                                int count) {
  const double threshold = params.detection_threshold;
  // More candidates than wanted, so that there is a choice.
  const int candidates = 3 * count;
  switch (params.detector) {
    case FeatureDetector::Automatic:
    case FeatureDetector::Orb: {
      constexpr float kPyramidFactor = 1.2f;
      const auto orb =
          cv::ORB::create(candidates, kPyramidFactor, 8, 31, 0, 2, cv::ORB::HARRIS_SCORE, 31,
                          threshold > 0.0 ? static_cast<int>(threshold) : 12);
      return runDetector(*orb, gray, count);
    }
    case FeatureDetector::Akaze: {
      const auto akaze = cv::AKAZE::create(cv::AKAZE::DESCRIPTOR_MLDB, 0, 3,
                                           threshold > 0.0 ? static_cast<float>(threshold) : 5e-4f);
      return runDetector(*akaze, gray, count);
    }
    case FeatureDetector::Sift:
      break;
  }
  const auto sift = cv::SIFT::create(0, 3, threshold > 0.0 ? threshold : 0.03);
  return runDetector(*sift, gray, count);
}

}  // namespace planar_mapping::detail
