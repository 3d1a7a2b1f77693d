// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "organized_growing.h"

namespace planar_mapping::detail {

/// Gives the pixels around grown cells to their nearest plane.
class PixelAssigner {
 public:
  PixelAssigner(const TiledCloud& cloud, const CellGrid& tiles, const RangeNoise& noise,
                const OrganizedParams& params, int threads);

  /// Label per pixel in tile order, -1 = none.
  const std::vector<std::int16_t>& labels() const { return labels_; }
  /// Finite pixels of a tile without a label.
  int freePixels(int tile) const;

  /// Tiles or quarters of tiles were found to be part of planes.
  void addCells(const CellGrid& grid, const std::vector<std::int16_t>& cell_labels);
  /// Assigns free pixels of the tiles beside those that hold a plane.
  void assign(const std::vector<PlaneCandidate>& planes);
  /// Planes refitted to the pixels they got.
  void refit(std::vector<PlaneCandidate>& planes) const;
  /// Renames labels; -1 frees the pixels.
  void relabel(const std::vector<std::int16_t>& target);
  /// Forgets all pixels but not which tiles hold which plane.
  void clearLabels();

  /// Planes a tile holds.
  struct Presence {
    static constexpr int kMost = 4;
    std::int16_t label[kMost] = {-1, -1, -1, -1};
    void add(std::int16_t plane);
    bool empty() const { return label[0] < 0; }
  };
  const std::vector<Presence>& presence() const { return presence_; }

 private:
  void assignTile(int tile, const std::vector<PlaneCandidate>& planes,
                  const std::vector<Presence>& before);

  const TiledCloud& cloud_;
  const CellGrid& tiles_;
  RangeNoise noise_;
  OrganizedParams params_;
  int threads_;
  std::vector<std::int16_t> labels_;
  std::vector<Presence> presence_;
};

}  // namespace planar_mapping::detail
