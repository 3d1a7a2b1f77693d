// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/sensor/depth_image.h"

#include <cmath>
#include <limits>

#include "planar_mapping/base/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr int kTileShift = 2;  ///< 4 x 4 pixels
/// A tile is clear only if at least this fraction of its pixels is measured.
constexpr float kMinMeasured = 0.5f;

/// Depths of a row; 0 where there is none.
PLANAR_MAPPING_MULTIVERSION
void readRow(const float* points, std::size_t stride, std::size_t n, float* depth) {
  constexpr float kMaxDepth = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < n; ++i) {
    const float z = points[i * stride + 2];
    depth[i] = (z > 0.0f) & (z <= kMaxDepth) ? z : 0.0f;
  }
}

/// Sets bit 0 where a measurement is used, bit 1 where one is not.
PLANAR_MAPPING_MULTIVERSION
void markUse(const std::uint8_t* used, const float* depth, std::size_t n, std::uint8_t* marks) {
  for (std::size_t i = 0; i < n; ++i) {
    const auto mark = static_cast<std::uint8_t>(2 - used[i]);
    marks[i] |= depth[i] > 0.0f ? mark : std::uint8_t{0};
  }
}

PLANAR_MAPPING_MULTIVERSION
void widenRow(const float* depth, std::size_t n, float* nearest, float* farthest, float* measured) {
  constexpr float kMaxDepth = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < n; ++i) {
    const float z = depth[i];
    const float near = z > 0.0f ? z : kMaxDepth;
    nearest[i] = near < nearest[i] ? near : nearest[i];
    farthest[i] = z > farthest[i] ? z : farthest[i];
    measured[i] += z > 0.0f ? 1.0f : 0.0f;
  }
}

/// Depths of the cells about a middle and the tiles that they are seen in, -1 if in none.
PLANAR_MAPPING_MULTIVERSION
void tilesOfCells(const CellOffsets& offsets, const float* centre, const float* intrinsics,
                  int width, int height, int shift, int tiles_in_row, float* depth,
                  std::int32_t* tile) {
  const auto right = static_cast<float>(width), bottom = static_cast<float>(height);
  for (std::size_t i = 0; i < CellOffsets::kCells; ++i) {
    const float z = centre[2] + offsets.z[i];
    const float inverse = 1.0f / z;
    const float column = intrinsics[0] * (centre[0] + offsets.x[i]) * inverse + intrinsics[2];
    const float row = intrinsics[1] * (centre[1] + offsets.y[i]) * inverse + intrinsics[3];
    const bool is_seen = (z > static_cast<float>(kNearPlane)) & (column >= 0.0f) & (row >= 0.0f) &
                         (column < right) & (row < bottom);
    const auto c = static_cast<std::int32_t>(is_seen ? column : 0.0f);
    const auto r = static_cast<std::int32_t>(is_seen ? row : 0.0f);
    depth[i] = z;
    tile[i] = is_seen ? (r >> shift) * tiles_in_row + (c >> shift) : -1;
  }
}

}  // namespace

DepthImage::DepthImage(const PinholeCamera& camera, const Matrix3& rotation,
                       const Vector3& position, bool shared, const Clearing& clearing)
    : camera_(camera),
      inverse_(rotation.transpose()),
      turn_(rotation.transpose().cwiseAbs()),
      position_(position),
      shared_(shared),
      clearing_(clearing),
      shift_(shared ? 0 : kTileShift) {
  Level level;
  level.width = (camera.width + (1 << shift_) - 1) >> shift_;
  level.height = (camera.height + (1 << shift_) - 1) >> shift_;
  level.tiles.assign(static_cast<std::size_t>(level.width) * level.height,
                     Tile(std::numeric_limits<float>::infinity(), 0.0f, 0.0f, 0.0f));
  levels_.push_back(std::move(level));
}

void DepthImage::fill(const PointsView& points, const std::vector<std::uint8_t>& use) {
  const std::size_t width = points.width;
  std::vector<float> depth(width);
  std::vector<float> nearest(width), farthest(width), measured(width);
  is_sparse_ = false;
  Level& level = levels_.front();
  const auto tiles = static_cast<std::size_t>(level.width);
  // What is beyond the image is no measurement.
  std::vector<std::uint8_t> marks(tiles << shift_);
  const std::vector<std::uint8_t> all(use.empty() ? width : 0, 1);
  counts_.reserve(level.tiles.size());
  for (int tile_row = 0; tile_row < level.height; ++tile_row) {
    std::fill(nearest.begin(), nearest.end(), std::numeric_limits<float>::infinity());
    std::fill(farthest.begin(), farthest.end(), 0.0f);
    std::fill(measured.begin(), measured.end(), 0.0f);
    std::fill(marks.begin(), marks.end(), std::uint8_t{0});
    const std::uint32_t first = static_cast<std::uint32_t>(tile_row) << shift_;
    const std::uint32_t last = std::min(first + (1u << shift_), points.height);
    for (std::uint32_t row = first; row < last; ++row) {
      readRow(points[row * width], points.stride, width, depth.data());
      widenRow(depth.data(), width, nearest.data(), farthest.data(), measured.data());
      markUse(use.empty() ? all.data() : &use[row * width], depth.data(), width, marks.data());
    }
    Tile* row_of_tiles = &level.tiles[static_cast<std::size_t>(tile_row) * tiles];
    for (std::size_t t = 0; t < tiles; ++t) {
      const std::size_t begin = t << shift_;
      const std::size_t end = std::min(begin + (std::size_t{1} << shift_), width);
      float near = nearest[begin], far = farthest[begin], pixels = measured[begin];
      std::uint8_t marked = marks[begin];
      for (std::size_t i = begin + 1; i < end; ++i) {
        near = std::min(near, nearest[i]);
        far = std::max(far, farthest[i]);
        pixels += measured[i];
        marked |= marks[i];
      }
      const auto all_pixels = static_cast<float>((end - begin) * (last - first));
      const float clear = pixels >= kMinMeasured * all_pixels ? clearing_.upTo(near) : 0.0f;
      near = pixels > 0.0f ? near : std::numeric_limits<float>::infinity();
      row_of_tiles[t] = {near, clear, -far, -clear};
      counts_.emplace_back(static_cast<int>(pixels), pixels < all_pixels ? 0 : 1, marked & 1,
                           marked >> 1);
    }
  }
}

void DepthImage::add(const Vector3& point) {
  const auto depth = static_cast<float>(point.z());
  if (!(depth > kNearPlane && std::isfinite(depth))) return;
  const Vector2 pixel = camera_.project(point);
  const double column = std::floor(pixel.x() + 0.5);
  const double row = std::floor(pixel.y() + 0.5);
  if (!(column >= 0.0 && row >= 0.0 && column < camera_.width && row < camera_.height)) return;
  Level& level = levels_.front();
  Tile& tile = level.tiles[(static_cast<std::size_t>(row) >> shift_) * level.width +
                           (static_cast<std::size_t>(column) >> shift_)];
  if (!(tile[kNearest] <= depth)) {
    rays_.resize(level.tiles.size());
    rays_[static_cast<std::size_t>(&tile - level.tiles.data())] = point.hnormalized().cast<float>();
  }
  tile[kNearest] = std::min(tile[kNearest], depth);
  tile[kFarthest] = std::min(tile[kFarthest], -depth);
  tile[kClear] = clearing_.upTo(tile[kNearest]);
  tile[kClearest] = -tile[kClear];
}

void DepthImage::finish(bool counted) {
  if (counted && is_sparse_) {
    // No more than one measurement a tile is expected.
    for (const Tile& tile : levels_.front().tiles) {
      const int has_one = tile[kFarthest] < 0.0f ? 1 : 0;
      counts_.emplace_back(has_one, has_one, 0, 0);
    }
  }
  if (counted) {
    const Level& level = levels_.front();
    sums_ = SummedArea<Counts>(counts_, level.width, level.height, Counts::Zero());
  }
  counts_ = {};
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& fine = levels_.back();
    Level coarse;
    coarse.width = (fine.width + 1) / 2;
    coarse.height = (fine.height + 1) / 2;
    coarse.tiles.resize(static_cast<std::size_t>(coarse.width) * coarse.height);
    for (int row = 0; row < coarse.height; ++row) {
      const int below = std::min(2 * row + 1, fine.height - 1);
      const Tile* upper = &fine.tiles[static_cast<std::size_t>(2 * row) * fine.width];
      const Tile* lower = &fine.tiles[static_cast<std::size_t>(below) * fine.width];
      for (int column = 0; column < coarse.width; ++column) {
        const int left = 2 * column;
        const int right = std::min(left + 1, fine.width - 1);
        Tile& tile = coarse.tiles[static_cast<std::size_t>(row) * coarse.width + column];
        tile = upper[left].min(upper[right]).min(lower[left].min(lower[right]));
      }
    }
    levels_.push_back(std::move(coarse));
  }
}

inline bool DepthImage::footprint(const Vector3& c, const Vector3& half, double corners[4]) const {
  const double near = c.z() - half.z();
  if (near <= kNearPlane) return false;
  const double by_near = 1.0 / near;
  const double by_far = 1.0 / (c.z() + half.z());
  const auto edges = [&](double centre, double reach, double f, double offset, double* low_high) {
    const double low = centre - reach;
    const double high = centre + reach;
    low_high[0] = f * low * (low < 0.0 ? by_near : by_far) + offset + 0.5;
    low_high[1] = f * high * (high > 0.0 ? by_near : by_far) + offset + 0.5;
  };
  edges(c.x(), half.x(), camera_.fx, camera_.cx, corners);
  edges(c.y(), half.y(), camera_.fy, camera_.cy, corners + 2);
  return true;
}

std::optional<DepthImage::TileRange> DepthImage::tilesOf(const Vector3& centre,
                                                         const Vector3& half) const {
  double edges[4];
  if (!footprint(centre, half, edges)) return std::nullopt;
  const auto tile = [&](double edge, int tiles) {
    return static_cast<std::size_t>(std::clamp(static_cast<int>(edge) >> shift_, 0, tiles - 1));
  };
  const Level& level = levels_.front();
  return TileRange{tile(edges[0], level.width), tile(edges[1], level.width),
                   tile(edges[2], level.height), tile(edges[3], level.height)};
}

/// Calls is(number) for the lowest tiles with a measurement over a box, until that is true.
template <typename Is>
bool DepthImage::anyMeasured(const Vector3& centre, const Vector3& half, const Is& is) const {
  const std::optional<TileRange> range = tilesOf(centre, half);
  const Level& level = levels_.front();
  if (!range) return false;
  for (std::size_t y = range->top; y <= range->bottom; ++y) {
    for (std::size_t x = range->left; x <= range->right; ++x) {
      const std::size_t i = y * static_cast<std::size_t>(level.width) + x;
      if (level.tiles[i][kFarthest] < 0.0f && is(i)) return true;
    }
  }
  return false;
}

DepthImage::Cover DepthImage::coverOf(const Vector3& centre, const Vector3& half) const {
  if (sums_.empty()) return {};
  const std::optional<TileRange> range = tilesOf(centre, half);
  if (!range) return {};
  const std::size_t x0 = range->left, x1 = range->right + 1;
  const std::size_t y0 = range->top, y1 = range->bottom + 1;
  const Counts counts = sums_.over(x0, y0, x1, y1);
  const auto tiles = static_cast<int>((x1 - x0) * (y1 - y0));
  const bool is_used = counts[kUsed] > 0;
  const auto side = [this](std::size_t first, std::size_t last, int size) {
    return std::min(static_cast<double>(last << shift_), static_cast<double>(size)) -
           static_cast<double>(first << shift_);
  };
  const double pixels =
      is_sparse_ ? tiles : side(x0, x1, camera_.width) * side(y0, y1, camera_.height);
  return {counts[kMeasured] / pixels, counts[kComplete] == tiles, is_used,
          is_used && counts[kUnused] == 0};
}

DepthImage::Sides DepthImage::sidesOf(const Vector3& centre, const Vector3& half, double near,
                                      double far) const {
  Sides sides;
  anyMeasured(centre, half, [&](std::size_t i) {
    const Tile& t = levels_.front().tiles[i];
    ++(-t[kFarthest] < near ? sides.before : t[kNearest] > far ? sides.beyond : sides.at);
    return false;
  });
  return sides;
}

DepthImage::Crossing DepthImage::crossingOf(const Vector3& centre, double radius,
                                            double behind) const {
  Crossing crossing;
  const std::optional<TileRange> range = tilesOf(centre, Vector3(radius, radius, 0.0));
  if (!range) return crossing;
  const Level& level = levels_.front();
  const double middle = 0.5 * ((1 << shift_) - 1);
  const double square = centre.squaredNorm();
  const bool is_small = radius * camera_.fx < centre.z() * (1 << shift_);
  for (std::size_t row = range->top; row <= range->bottom; ++row) {
    for (std::size_t column = range->left; column <= range->right; ++column) {
      const Vector3 ray = camera_.rayOf(static_cast<double>(column << shift_) + middle,
                                        static_cast<double>(row << shift_) + middle);
      const double depth = square / centre.dot(ray);
      if (!is_small && !((depth * ray - centre).squaredNorm() <= radius * radius)) continue;
      const float nearest =
          level.tiles[row * static_cast<std::size_t>(level.width) + column][kNearest];
      ++crossing.rays;
      if (nearest > depth + behind && std::isfinite(nearest)) ++crossing.beyond;
    }
  }
  return crossing;
}

bool DepthImage::isPassedWithin(const Vector3& centre, double reach) const {
  return !rays_.empty() && anyMeasured(centre, {reach, reach, 0.0}, [&](std::size_t i) {
    const Vector2 off = centre.z() * rays_[i].cast<double>() - centre.head<2>();
    return off.cwiseAbs().maxCoeff() <= reach;
  });
}

DepthImage::Look DepthImage::look(const Vector3& c, const Vector3& half, bool whole) const {
  Look result;
  result.near = c.z() - half.z();
  result.far = c.z() + half.z();
  if (result.far <= kNearPlane) return result;
  if (result.near <= kNearPlane) {  // around the camera: seen, but not to be told apart
    const auto meets = [&](double nearest, double farthest, double f, double low, double high) {
      return f * farthest >= -low * result.far && f * nearest <= high * result.far;
    };
    result.visible = meets(c.x() - half.x(), c.x() + half.x(), camera_.fx, camera_.cx + 0.5,
                           camera_.width - camera_.cx - 0.5) &&
                     meets(c.y() - half.y(), c.y() + half.y(), camera_.fy, camera_.cy + 0.5,
                           camera_.height - camera_.cy - 0.5);
    result.farthest = farthest();
    result.clearest = clearest();
    return result;
  }
  double edges[4];
  footprint(c, half, edges);
  const double left = edges[0], right = edges[1], top = edges[2], bottom = edges[3];
  if (!(right >= 0.0 && bottom >= 0.0 && left < camera_.width && top < camera_.height)) {
    return result;
  }
  result.visible = true;
  result.inside = left >= 0.0 && top >= 0.0 && right < camera_.width && bottom < camera_.height;
  if (whole && !result.inside) return result;

  const auto pixel = [](double edge, int size) {
    return static_cast<int>(std::min(std::max(edge, 0.0), size - 1.0));
  };
  int x0 = pixel(left, camera_.width) >> shift_;
  int x1 = pixel(right, camera_.width) >> shift_;
  int y0 = pixel(top, camera_.height) >> shift_;
  int y1 = pixel(bottom, camera_.height) >> shift_;
  // A level at which one side may be no more than three tiles, and on from there.
  const int widest = std::max(x1 - x0, y1 - y0);
  int l = widest > 1 ? 30 - __builtin_clz(static_cast<unsigned>(widest)) : 0;
  while ((x1 >> l) - (x0 >> l) > 2 || (y1 >> l) - (y0 >> l) > 2) ++l;
  x0 >>= l;
  x1 >>= l;
  y0 >>= l;
  y1 >>= l;
  // At most 3 x 3 tiles; some are looked at twice rather than asking how many there are.
  const Level& level = levels_[static_cast<std::size_t>(l)];
  const int xs[3] = {x0, std::min(x0 + 1, x1), x1};
  const int ys[3] = {y0, std::min(y0 + 1, y1), y1};
  Tile all = Tile::Constant(std::numeric_limits<float>::infinity());
  for (const int y : ys) {
    // Of each row first: what need not wait for each other is computed together.
    const Tile* row = &level.tiles[static_cast<std::size_t>(y) * level.width];
    all = all.min(row[xs[0]].min(row[xs[1]]).min(row[xs[2]]));
  }
  result.nearest = all[kNearest];
  result.farthest = -all[kFarthest];
  result.clear = all[kClear];
  result.clearest = -all[kClearest];
  return result;
}

std::uint64_t DepthImage::clearCells(const Vector3& centre, const CellOffsets& offsets) const {
  const Level& level = levels_.front();
  const float intrinsics[4] = {static_cast<float>(camera_.fx), static_cast<float>(camera_.fy),
                               static_cast<float>(camera_.cx + 0.5),
                               static_cast<float>(camera_.cy + 0.5)};
  const Eigen::Vector3f at = centre.cast<float>();
  float depth[CellOffsets::kCells];
  std::int32_t tile[CellOffsets::kCells];
  tilesOfCells(offsets, at.data(), intrinsics, camera_.width, camera_.height, shift_, level.width,
               depth, tile);
  std::uint64_t clear = 0;
  for (std::size_t i = 0; i < CellOffsets::kCells; ++i) {
    const bool is_clear =
        tile[i] >= 0 && level.tiles[static_cast<std::size_t>(tile[i])][kClear] > depth[i];
    clear |= std::uint64_t{is_clear} << i;
  }
  return clear;
}

Eigen::AlignedBox3d DepthImage::bounds(double depth) const {
  Eigen::AlignedBox3d box(position_);
  for (const double column : {-0.5, camera_.width - 0.5}) {
    for (const double row : {-0.5, camera_.height - 0.5}) {
      box.extend(position_ + inverse_.transpose() * (depth * camera_.rayOf(column, row)));
    }
  }
  return box;
}

}  // namespace planar_mapping::detail
