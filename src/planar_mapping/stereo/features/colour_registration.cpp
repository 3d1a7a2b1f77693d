// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/features/colour_registration.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "planar_mapping/stereo/cv_image.h"

namespace planar_mapping::detail {
namespace {

// Scales about the middle of the image, in powers; shifts in pixels of an image of 640 columns.
constexpr int kScales = 21;  // to either side
constexpr double kScaleStep = 1.025;
constexpr int kColumns = 12;
constexpr int kColumnStep = 2;
constexpr int kRows = 4;
constexpr int kRowStep = 4;
constexpr double kWidth = 640.0;

constexpr int kScaleCount = 2 * kScales + 1;
constexpr int kColumnCount = 2 * kColumns + 1;
constexpr int kRowCount = 2 * kRows + 1;

std::size_t placeOf(int scale, int row, int column) {
  return static_cast<std::size_t>((scale * kRowCount + row) * kColumnCount + column);
}

struct Pixel {
  int column = 0;
  int row = 0;
  bool along_rows = true;  ///< the depth jumps
};

/// Pixels of the surface in front, along rows or columns where the depth jumps by a tenth.
void addJumps(const PointsView& cloud, bool along_rows, std::vector<Pixel>& edges) {
  constexpr float kJump = 0.1f;
  constexpr double kLargestGap = 16.0;  // pixels without depth between the two
  const int width = static_cast<int>(cloud.width);
  const int height = static_cast<int>(cloud.height);
  const int gap = static_cast<int>(kLargestGap * width / kWidth);
  const int lines = along_rows ? height : width;
  const int length = along_rows ? width : height;
  for (int line = 0; line < lines; ++line) {
    int before = -1;
    float depth_before = 0.0f;
    for (int k = 0; k < length; ++k) {
      const auto i = static_cast<std::size_t>(along_rows ? line * width + k : k * width + line);
      const float depth = cloud[i][2];
      if (!(depth > 0.0f) || !std::isfinite(depth)) continue;
      if (before >= 0 && k - before <= gap &&
          std::abs(depth - depth_before) > kJump * std::min(depth, depth_before)) {
        const int front = depth < depth_before ? k : before;
        edges.push_back(along_rows ? Pixel{front, line, true} : Pixel{line, front, false});
      }
      before = k;
      depth_before = depth;
    }
  }
}

/// How much gray values change along rows, or columns, at each pixel, cut off and divided by the
/// mean; empty where they do not.
std::vector<float> contrastOf(const io::Image& gray, bool along_rows) {
  constexpr float kLargest = 30.0f;
  const int step = along_rows ? 1 : gray.width;
  std::vector<float> contrast(gray.pixels.size(), 0.0f);
  double sum = 0.0;
  for (int row = 1; row + 1 < gray.height; ++row) {
    for (int column = 1; column + 1 < gray.width; ++column) {
      const auto i = static_cast<std::ptrdiff_t>(row) * gray.width + column;
      const std::uint8_t* own = gray.pixels.data() + i;
      const float value =
          std::min(0.5f * std::abs(static_cast<float>(own[step] - own[-step])), kLargest);
      contrast[static_cast<std::size_t>(i)] = value;
      sum += static_cast<double>(value);
    }
  }
  if (sum == 0.0) return {};
  const auto mean = static_cast<float>(sum / static_cast<double>(contrast.size()));
  for (float& value : contrast) value /= mean;
  return contrast;
}

struct Place {
  int scale = 0;
  int row = 0;
  int column = 0;
};

Place placeAt(int index) {
  return {index / (kColumnCount * kRowCount), index / kColumnCount % kRowCount,
          index % kColumnCount};
}

bool areNear(const Place& a, const Place& b) {
  return std::abs(a.scale - b.scale) <= 2 && std::abs(a.row - b.row) <= 1 &&
         std::abs(a.column - b.column) <= 6;
}

/// Whether it is at most a tenth of the scale, 8 rows and 14 columns of an image of 640 columns
/// from where the images are: features near edges of the depth are off, others are not.
bool isNearHere(const Place& place) {
  return std::abs(place.scale - kScales) <= 4 && std::abs(place.row - kRows) <= 2 &&
         std::abs(place.column - kColumns) <= 7;
}

/// What is best may lie beyond.
bool isAtBound(const Place& place) {
  return place.scale == 0 || place.scale == kScaleCount - 1 || place.row == 0 ||
         place.row == kRowCount - 1 || place.column == 0 || place.column == kColumnCount - 1;
}

double scaleOf(int scale) {
  return std::pow(kScaleStep, scale - kScales);
}

/// The largest of a place and its neighbours.
double largestAbout(const std::vector<double>& sums, int scale, int row, int column) {
  const auto from = [](int place, int reach) { return std::max(place - reach, 0); };
  const auto to = [](int place, int reach, int count) {
    return std::min(place + reach, count - 1);
  };
  double largest = 0.0;
  for (int s = from(scale, 1); s <= to(scale, 1, kScaleCount); ++s)
    for (int r = from(row, 1); r <= to(row, 1, kRowCount); ++r)
      for (int c = from(column, 2); c <= to(column, 2, kColumnCount); ++c)
        largest = std::max(largest, sums[placeOf(s, r, c)]);
  return largest;
}

}  // namespace

void ColourRegistration::look(const io::Image& image, const PointsView& cloud) {
  constexpr std::size_t kEdges = 2500;  // of a frame
  constexpr std::size_t kFewest = 50;   // fewer say nothing
  constexpr double kTile = 40.0;        // pixels; black and white tiles are apart
  if (state_ != State::Unknown || frames_ >= kMaxFrames) return;
  std::vector<Pixel> edges;
  addJumps(cloud, true, edges);
  addJumps(cloud, false, edges);
  if (edges.size() < kFewest) return;
  const io::Image gray = io::toGray(image);
  const std::vector<float> across = contrastOf(gray, true);
  const std::vector<float> down = contrastOf(gray, false);
  if (across.empty() || down.empty()) return;
  ++frames_;
  const double unit = gray.width / kWidth;
  const double middle_column = 0.5 * gray.width;
  const double middle_row = 0.5 * gray.height;
  double scales[kScaleCount];
  int column_shifts[kColumnCount];
  int row_shifts[kRowCount];
  for (int s = 0; s < kScaleCount; ++s) scales[s] = scaleOf(s);
  for (int c = 0; c < kColumnCount; ++c)
    column_shifts[c] = static_cast<int>(std::lround((c - kColumns) * kColumnStep * unit));
  for (int r = 0; r < kRowCount; ++r)
    row_shifts[r] = static_cast<int>(std::lround((r - kRows) * kRowStep * unit));
  for (std::vector<double>& half : sums_)
    half.resize(static_cast<std::size_t>(kScaleCount * kColumnCount * kRowCount), 0.0);
  const std::size_t step = edges.size() / kEdges + 1;
  for (std::size_t e = 0; e < edges.size(); e += step) {
    const Pixel edge = edges[e];
    const std::vector<float>& contrast = edge.along_rows ? across : down;
    const auto tile = static_cast<int>(edge.column / (kTile * unit)) +
                      static_cast<int>(edge.row / (kTile * unit));
    std::vector<double>& sums = sums_[static_cast<std::size_t>(tile % 2)];
    ++counts_[static_cast<std::size_t>(tile % 2)];
    for (int s = 0; s < kScaleCount; ++s) {
      const auto at = [&](int place, double middle) {
        return static_cast<int>(std::floor((place - middle) * scales[s] + middle + 0.5));
      };
      const int column = at(edge.column, middle_column);
      const int row = at(edge.row, middle_row);
      for (int r = 0; r < kRowCount; ++r) {
        const int y = row + row_shifts[r];
        const bool is_inside = y >= 0 && y < gray.height;
        const float* line =
            contrast.data() + static_cast<std::ptrdiff_t>(is_inside ? y : 0) * gray.width;
        double* out = &sums[placeOf(s, r, 0)];
        for (int c = 0; c < kColumnCount; ++c) {
          const int x = column + column_shifts[c];
          // What lies outside the image says nothing, like a place of mean contrast.
          out[c] += is_inside && x >= 0 && x < gray.width ? static_cast<double>(line[x]) : 1.0;
        }
      }
    }
  }
  decide();
}

/// Where edges of one half meet edges of the image must be where those of the other half do.
void ColourRegistration::decide() {
  constexpr std::int64_t kEnough = 1000;  // edges of each half
  constexpr double kBetter = 1.15;        // contrast at another place, of that here
  // Straight lines meet others by chance: more is asked for where there is this contrast here.
  constexpr double kMeeting = 2.7;
  constexpr double kMuchBetter = 2.0;
  constexpr double kSignificant = 5.0;  // standard deviations of all places
  if (std::min(counts_[0], counts_[1]) < kEnough) return;
  int here_is_best = 0;
  int elsewhere_is_best = 0;
  std::array<Place, 2> places;
  for (std::size_t half = 0; half < 2; ++half) {
    const std::vector<double>& sums = sums_[half];
    const std::vector<double>& others = sums_[1 - half];
    const auto best = static_cast<int>(std::max_element(sums.begin(), sums.end()) - sums.begin());
    const double here = largestAbout(others, kScales, kRows, kColumns);
    const Place& place = places[half] = placeAt(best);
    const double there = largestAbout(others, place.scale, place.row, place.column);
    const bool meets = here >= kMeeting * static_cast<double>(counts_[1 - half]);
    here_is_best += meets && there < kBetter * here ? 1 : 0;
    elsewhere_is_best += there >= (meets ? kMuchBetter : kBetter) * here ? 1 : 0;
  }
  std::vector<double> all(sums_[0].size());
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i] = sums_[0][i] / static_cast<double>(counts_[0]) +
             sums_[1][i] / static_cast<double>(counts_[1]);
    sum += all[i];
    squares += all[i] * all[i];
  }
  const double mean = sum / static_cast<double>(all.size());
  const double deviation = std::sqrt(squares / static_cast<double>(all.size()) - mean * mean);
  const auto peak = std::max_element(all.begin(), all.end());
  meets_nothing_ = here_is_best == 0 && !isNearHere(placeAt(static_cast<int>(peak - all.begin())));
  if (here_is_best == 2) state_ = State::Registered;
  if (elsewhere_is_best == 2 && areNear(places[0], places[1]) && !isAtBound(places[0]) &&
      !isAtBound(places[1]) && *peak > mean + kSignificant * deviation) {
    state_ = State::Apart;
    const Place place = placeAt(static_cast<int>(peak - all.begin()));
    scale_ = scaleOf(place.scale);
    column_shift_ = (place.column - kColumns) * kColumnStep / kWidth;
    row_shift_ = (place.row - kRows) * kRowStep / kWidth;
  }
  if (state_ == State::Unknown && frames_ < kMaxFrames) return;
  for (std::vector<double>& half : sums_) half = {};
}

io::Image ColourRegistration::aligned(const io::Image& image) const {
  io::Image out = image;
  const double moved_column = 0.5 * image.width * (1.0 - scale_) + column_shift_ * image.width;
  const double moved_row = 0.5 * image.height * (1.0 - scale_) + row_shift_ * image.width;
  const cv::Matx23d source(scale_, 0.0, moved_column, 0.0, scale_, moved_row);
  cv::Mat to(image.height, image.width, CV_8UC(image.channels), out.pixels.data());
  cv::warpAffine(matOf(image), to, source, to.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                 cv::BORDER_REPLICATE);
  return out;
}

std::string ColourRegistration::describe() const {
  const auto rounded = [](double value) { return std::to_string(std::lround(value)); };
  return rounded(100.0 * scale_) + " % as large as in these and shifted by " +
         rounded(100.0 * column_shift_) + " and " + rounded(100.0 * row_shift_) + " % of the width";
}

}  // namespace planar_mapping::detail
