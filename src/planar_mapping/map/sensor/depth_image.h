// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "planar_mapping/base/summed_area.h"
#include "planar_mapping/map/sensor/frame_observation.h"

namespace planar_mapping::detail {

constexpr double kNearPlane = 1e-3;  ///< metres; boxes that reach closer are skipped

/// From the middle of a block of 4 x 4 x 4 cells to those of its cells, bit 16 z + 4 y + x.
struct CellOffsets {
  static constexpr std::size_t kCells = 64;
  float x[kCells], y[kCells], z[kCells];

  /// \param axes from cell to cell along x, y, z
  explicit CellOffsets(const Matrix3& axes) {
    for (std::size_t i = 0; i < kCells; ++i) {
      const Vector3 to = axes * Vector3((i & 3u) - 1.5, (i >> 2u & 3u) - 1.5, (i >> 4u) - 1.5);
      x[i] = static_cast<float>(to.x());
      y[i] = static_cast<float>(to.y());
      z[i] = static_cast<float>(to.z());
    }
  }
};

/// Up to which depth the ray of a measurement clears space.
struct Clearing {
  float range = 0.0f;  ///< metres
  float error = 0.0f;  ///< what is measured at 1 m may be nearer by so much; it grows with z^2
  float sure = 0.0f;   ///< metres: up to here the error is no more than points of the map may have

  /// Metres: of a far point less what its error is larger. Beyond half of one over the error all
  /// that is known is that it is farther.
  float upTo(float depth) const {
    if (error > 0.0f) depth = std::min(depth, std::max(0.5f / error, sure));
    const float beyond = std::max(depth * depth - sure * sure, 0.0f);
    return std::min(depth - error * beyond, range);
  }
};

/// Smallest and largest depth of a pinhole image over rectangles of pixels, by a pyramid.
///
/// What a pixel without a measurement says is nothing: it counts neither as near nor as far.
///
/// The lowest tiles also have the depth up to which they are *clear*: rays passed there. It is that
/// of the nearest measurement less its error; 0 where too few pixels have one.
class DepthImage {
 public:
  /// What the image says about a box in front of the camera.
  struct Look {
    bool visible = false;  ///< part of the box projects into the image
    bool inside = false;   ///< all of it does
    double near = 0.0;     ///< depth of the box, metres
    double far = 0.0;
    float nearest = 0.0f;   ///< smallest depth measured over the box; infinite if there is none
    float farthest = 0.0f;  ///< largest depth measured over the box; 0 if there is none
    float clear = 0.0f;     ///< depth up to which all tiles over the box are clear
    float clearest = 0.0f;  ///< the same of any of them
  };

  /// \param camera   of the image
  /// \param rotation camera to world, \param position of the camera in the world
  /// \param shared   one of several images side by side, each responsible for its own quadrant
  DepthImage(const PinholeCamera& camera, const Matrix3& rotation, const Vector3& position,
             bool shared, const Clearing& clearing);

  /// Depths of an organized cloud in the camera's own frame, and which of them went into the map.
  /// \param use one byte per point, 0 = not mapped; empty = all are
  void fill(const PointsView& points, const std::vector<std::uint8_t>& use);
  /// Adds a single measurement, camera frame, where it projects into the image.
  void add(const Vector3& point);
  /// Must be called once after all measurements. \param counted  coverOf() will be asked
  void finish(bool counted);
  /// What of the image there is over a box.
  struct Cover {
    double measured = 0.0;     ///< fraction of the pixels with a measurement; sparse: of the tiles
    bool is_complete = false;  ///< all pixels have one
    bool is_used = false;      ///< some measurement went into the map; false without fill()
    bool is_all_used = false;  ///< there are some, and all did
  };
  /// Of a box inside the image.
  Cover coverOf(const Vector3& centre, const Vector3& half) const;
  /// Of the tiles with a measurement over a box, how many have all of theirs before a depth, beyond
  /// another, and neither.
  struct Sides {
    int before = 0;
    int beyond = 0;
    int at = 0;
  };
  Sides sidesOf(const Vector3& centre, const Vector3& half, double near, double far) const;
  /// The rays of the lowest tiles that cross a disc, and those of them that are measured to end
  /// beyond it. What the image cuts off has none.
  struct Crossing {
    int rays = 0;
    int beyond = 0;
  };
  /// \param normal  of the disc, camera frame
  /// \param behind  metres along the optical axis from the disc on that are not beyond it
  Crossing crossingOf(const Vector3& centre, const Vector3& normal, double radius,
                      double behind) const;
  /// Of a sparse image: does a ray pass within \p reach of a place, along the image's axes?
  bool isPassedWithin(const Vector3& centre, double reach) const;
  /// Pixels that a square of the given side covers, facing the camera at this depth.
  double pixelsOf(double side, double depth) const {
    return camera_.fx * camera_.fy * side * side / (depth * depth);
  }

  /// Metres from one of the lowest tiles to the next, at a depth.
  double tileSide(double depth) const { return depth * (1 << shift_) / camera_.fx; }

  /// Looks at the box of the given half extents along the camera's axes.
  /// \param whole  what the image cuts is of no interest: then the depths are not looked up
  Look look(const Vector3& centre, const Vector3& half, bool whole) const;
  Vector3 toCamera(const Vector3& world) const { return inverse_ * (world - position_); }
  bool isOfScan() const { return shared_; }
  /// Is this image the one to look at for a box at this place (camera frame)?
  bool isResponsible(const Vector3& centre) const {
    return !isOfScan() ||
           (std::abs(centre.x()) <= centre.z() && std::abs(centre.y()) <= centre.z());
  }
  /// Half extents along the camera's axes of a box with these half extents along the world's.
  Vector3 extentInCamera(const Vector3& half) const { return turn_ * half; }
  const Matrix3& inverseRotation() const { return inverse_; }
  /// World bounds of what the image sees up to a depth.
  Eigen::AlignedBox3d bounds(double depth) const;
  const Vector3& position() const { return position_; }
  float farthest() const { return -levels_.back().tiles.front()[kFarthest]; }
  float clearest() const { return -levels_.back().tiles.front()[kClearest]; }
  /// Are there rays for some tiles only, with gaps between them?
  bool isSparse() const { return is_sparse_; }
  /// Which cells about the middle of a block (camera frame) are clear: the tile at their own is.
  std::uint64_t clearCells(const Vector3& centre, const CellOffsets& offsets) const;
  /// Calls visit(ray, depth) for rays (world, 1 long along the optical axis) that are clear up to a
  /// depth: a few across the image, of a sparse one that of the nearest measurement of each tile.
  template <typename Visit>
  void forEachRay(Visit&& visit) const {
    constexpr int kRays = 16;  ///< across the image
    const Level& level = levels_.front();
    const int step = is_sparse_ ? 1 : std::max(1, level.width / kRays);
    const double middle = 0.5 * ((1 << shift_) - 1);
    for (int row = step / 2; row < level.height; row += step) {
      for (int column = step / 2; column < level.width; column += step) {
        const auto tile = static_cast<std::size_t>(row * level.width + column);
        const float clear = level.tiles[tile][kClear];
        if (!(clear > 0.0f)) continue;
        const Vector3 ray =
            is_sparse_ ? Vector3(rays_[tile].homogeneous().cast<double>())
                       : camera_.rayOf((column << shift_) + middle, (row << shift_) + middle);
        visit(Vector3(inverse_.transpose() * ray), static_cast<double>(clear));
      }
    }
  }

 private:
  /// Corners in pixels of what the box covers; false if it reaches behind the camera.
  bool footprint(const Vector3& centre, const Vector3& half, double corners[4]) const;
  /// The lowest tiles of that, first and last of each axis.
  struct TileRange {
    std::size_t left = 0, right = 0, top = 0, bottom = 0;
  };
  std::optional<TileRange> tilesOf(const Vector3& centre, const Vector3& half) const;
  template <typename Is>
  bool anyMeasured(const Vector3& centre, const Vector3& half, const Is& is) const;

  /// All four as something of which the smallest counts, so that they are compared at once.
  using Tile = Eigen::Array4f;
  enum { kNearest, kClear, kFarthest, kClearest };  ///< the last two negative
  struct Level {
    int width = 0;
    int height = 0;
    std::vector<Tile> tiles;
  };
  PinholeCamera camera_;
  Matrix3 inverse_;
  Matrix3 turn_;
  Vector3 position_;
  bool shared_;
  bool is_sparse_ = true;
  Clearing clearing_;
  int shift_;  ///< log2 of the side of the tiles of the lowest level, pixels
  /// Measured pixels, and how many tiles have one in each pixel, one that went into the map, one
  /// that did not.
  enum { kMeasured, kComplete, kUsed, kUnused };
  using Counts = Eigen::Array4i;
  std::vector<Counts> counts_;  ///< of each of the lowest tiles, until finish()
  SummedArea<Counts> sums_;     ///< of these
  std::vector<Level> levels_;
  std::vector<Eigen::Vector2f> rays_;  ///< of a sparse image: to the nearest measurement of a tile
};

/// The images that cells are tested against: one of the camera's, or for a cloud without a camera
/// the six faces of a cube around the sensor, along the world's axes. \param use see
/// DepthImage::fill(), \param counted see DepthImage::finish()
std::vector<DepthImage> makeDepthImages(const FrameObservation& observation,
                                        const Matrix3& rotation, const Vector3& position,
                                        const std::vector<std::uint8_t>& use, double step,
                                        const Clearing& clearing, bool counted);

}  // namespace planar_mapping::detail
