// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "planar_mapping/map/sensor/frame_observation.h"

namespace planar_mapping::detail {

/// Smallest and largest depth of a pinhole image over rectangles of pixels, by a pyramid.
///
/// What a pixel without a measurement says is nothing: it counts neither as near nor as far.
class DepthImage {
 public:
  /// What the image says about a box in front of the camera.
  struct Look {
    bool visible = false;  ///< part of the box projects into the image
    bool inside = false;   ///< all of it does
    double near = 0.0;     ///< depth of the box, metres
    double far = 0.0;
    float nearest = 0.0f;   ///< smallest depth measured over the box; 0 if a pixel has none
    float farthest = 0.0f;  ///< largest depth measured over the box; 0 if there is none
  };

  /// \param camera   of the image
  /// \param rotation camera to world, \param position of the camera in the world
  /// \param shared   one of several images side by side, each responsible for its own quadrant
  DepthImage(const PinholeCamera& camera, const Matrix3& rotation, const Vector3& position,
             bool shared);

  /// Depths of an organized cloud in the camera's own frame, and which of them went into the map.
  /// \param use one byte per point, 0 = not mapped; empty = all are
  void fill(const PointsView& points, const std::vector<std::uint8_t>& use);
  /// Adds a single measurement, camera frame, where it projects into the image.
  void add(const Vector3& point);
  /// Must be called once after all measurements.
  void finish();
  /// Which measurements over a box went into the map.
  struct Use {
    bool any = false;
    bool all = false;  ///< there are some, and all did
  };
  /// Of the box (inside the image); none without fill().
  Use useOver(const Vector3& centre, const Vector3& half) const;
  /// Pixels that a square of the given side covers, facing the camera at this depth.
  double pixelsOf(double side, double depth) const {
    return camera_.fx * camera_.fy * side * side / (depth * depth);
  }

  /// Looks at the box of the given half extents along the camera's axes.
  /// \param whole  what the image cuts is of no interest: then the depths are not looked up
  Look look(const Vector3& centre, const Vector3& half, bool whole) const;
  Vector3 toCamera(const Vector3& world) const { return inverse_ * (world - position_); }
  /// Is this image the one to look at for a box at this place (camera frame)?
  bool isResponsible(const Vector3& centre) const {
    return !shared_ || (std::abs(centre.x()) <= centre.z() && std::abs(centre.y()) <= centre.z());
  }
  /// Half extents along the camera's axes of a box with these half extents along the world's.
  Vector3 extentInCamera(const Vector3& half) const { return turn_ * half; }
  const Matrix3& inverseRotation() const { return inverse_; }
  /// World bounds of what the image sees up to a depth.
  void bounds(double depth, Vector3& low, Vector3& high) const;
  float farthest() const { return levels_.back().tiles.front().farthest; }

 private:
  /// Corners in pixels of what the box covers; false if it reaches behind the camera.
  bool footprint(const Vector3& centre, const Vector3& half, double corners[4]) const;
  void sumUses();

  struct Tile {
    float nearest = 0.0f;
    float farthest = 0.0f;
  };
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
  int shift_;  ///< log2 of the side of the tiles of the lowest level, pixels
  /// Tiles above and left of each corner that hold a measurement that went into the map and, in
  /// the upper half, one that did not.
  std::vector<std::uint64_t> use_;
  std::vector<Level> levels_;
};

/// The images that cells are tested against: one of the camera's, or for a cloud without a camera
/// the six faces of a cube around the sensor, along the world's axes. \param use see
/// DepthImage::fill()
std::vector<DepthImage> makeDepthImages(const FrameObservation& observation,
                                        const Matrix3& rotation, const Vector3& position,
                                        const std::vector<std::uint8_t>& use, double step);

/// Pinhole model that explains an organized cloud to a fraction of a pixel, if there is one.
std::optional<PinholeCamera> estimateCamera(const PointsView& points);

}  // namespace planar_mapping::detail
