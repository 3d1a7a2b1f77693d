// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/planes/organized/metric_fit.h"

namespace planar_mapping::detail {

/// A few planes, in the order they were added.
struct PlaneList {
  static constexpr int kMax = 6;
  std::int16_t size = 0;
  std::int16_t label[kMax] = {};

  bool holds(std::int16_t plane) const;
  void add(std::int16_t plane);
  /// Does the target of any plane differ from it?
  bool isRenamed(const std::vector<std::int16_t>& target) const;
  /// Each plane becomes its target; -1 = none.
  void rename(const std::vector<std::int16_t>& target);
};

/// Which plane the pixels of each tile have. Knows what every tile holds, so that what has not
/// changed is not looked at again.
class PixelLabels {
 public:
  /// \param tiles          the sums of the tiles of \p cloud
  /// \param by_quarters    parts count the finite pixels of their quarters, not of the whole tile
  PixelLabels(const TiledCloud& cloud, const CellGrid& tiles, bool by_quarters, int threads);

  /// Label per pixel in tile order, -1 = none.
  const std::vector<std::int16_t>& labels() const { return labels_; }
  /// Cells of \p grid (tiles or quarters of them) are part of planes, -1 = of none.
  void addCells(const CellGrid& grid, const std::vector<std::int16_t>& cell_labels);
  /// Renames labels; -1 frees the pixels.
  void relabel(const std::vector<std::int16_t>& target);
  /// Number of pixels of each plane.
  std::vector<std::int64_t> counts(std::size_t planes) const;
  /// The pixels of each plane in each tile, ascending by tile; until something changes.
  const std::vector<TilePart>& parts();

  const std::int16_t* labelsOf(int tile) const {
    return labels_.data() + static_cast<std::size_t>(tile) * kTileArea;
  }
  bool holdsPlane(int tile) const {
    return summaries_[static_cast<std::size_t>(tile)].planes.size > 0;
  }
  /// The plane of all pixels of a tile, or -1.
  std::int16_t wholePlane(int tile) const {
    const Summary& summary = summaries_[static_cast<std::size_t>(tile)];
    return summary.count[0] == kTileArea ? summary.planes.label[0] : std::int16_t{-1};
  }
  /// Whether a tile and those around it are all of one plane.
  bool isInside(int tile) const;

 protected:
  static constexpr int kMaxAround = 12;  ///< planes in a tile and those around it

  /// What the pixels of a tile have.
  struct Summary {
    PlaneList planes;
    std::int16_t count[PlaneList::kMax] = {};
    std::int16_t free = 0;  ///< finite pixels without a plane
  };

  std::int16_t* labelsOf(int tile) {
    return labels_.data() + static_cast<std::size_t>(tile) * kTileArea;
  }
  /// Planes present in a tile and those up to \p reach tiles away, its own first. \return number
  int planesAround(int tile, int reach, std::int16_t* planes) const;
  void summarize(int tile);
  /// A tile holds the planes of at least so many of its pixels, besides those it held or \p anew.
  void updatePresence(int min_pixels, bool anew);

  const TiledCloud& cloud_;
  const CellGrid& tiles_;
  int threads_;
  std::vector<std::int16_t> labels_;
  std::vector<Summary> summaries_;
  std::vector<PlaneList> presence_;  ///< planes whose pixels or cells a tile holds
  std::vector<PlaneList> grown_;     ///< planes that have grown over a whole tile
  std::vector<char> changed_;        ///< presence or labels changed since the last assignment

 private:
  bool by_quarters_;
  std::vector<TilePart> parts_;  ///< as of the last parts()
  std::vector<char> stale_;      ///< tiles whose labels changed since then
};

struct EdgePlane;
struct EdgeNoise;

/// Gives the pixels of grown cells and around them to their nearest plane in metres.
class PixelAssigner : public PixelLabels {
 public:
  PixelAssigner(const TiledCloud& cloud, const CellGrid& tiles, const MetricFit& fit, int threads)
      : PixelLabels(cloud, tiles, false, threads), fit_(fit) {}

  /// Frees the pixels of the tiles these cells lie in or next to.
  void reopen(const CellGrid& grid, const std::vector<std::int16_t>& cell_labels);
  /// Assigns free pixels of the tiles that hold a plane and of those next to them.
  void assign(const std::vector<PlaneCandidate>& planes);
  /// Assigns what is free within d_T of the planes a tile holds.
  void fill(const std::vector<PlaneCandidate>& planes);
  /// Whether noise blurs edges: it is white and in some tile larger than the unevenness of
  /// surfaces.
  bool isNoisy() const;
  /// Settles which side of an edge the pixels near it are on, in tiles where noise blurs edges.
  void settleEdges(const std::vector<PlaneCandidate>& planes);
  /// Frees the pixels of a plane in quarter 0 to 3 of a tile; recount() has to follow.
  void free(int tile, int quarter, std::int16_t label);
  /// Counts the pixels of the tiles that were freed from.
  void recount();

 private:
  static constexpr int kEdgePlanes = 3;  ///< that may meet in a tile
  struct EdgeTile;

  void assignTile(int tile, const std::vector<PlaneCandidate>& planes, int reach);
  /// ... in this one.
  bool isNoisy(int tile) const;
  /// Planes that hold most pixels of a tile and those around it, at most kEdgePlanes. \return
  /// number
  int commonestAround(int tile, std::int16_t* planes) const;
  void describe(const EdgeTile& at, const std::vector<PlaneCandidate>& planes,
                EdgePlane* edge) const;
  EdgeNoise edgeNoise() const;
  void vote(const std::vector<PlaneCandidate>& planes,
            std::vector<std::vector<EdgeTile>>& rows) const;
  void voteOf(int tile, const std::vector<PlaneCandidate>& planes,
              const std::vector<EdgeTile*>& edge_of) const;
  void settle(const std::vector<PlaneCandidate>& planes, EdgeTile& at);
  bool changedAround(int tile) const;

  const MetricFit& fit_;
};

/// Frees the pixels whose surroundings do not lie as their plane does: what a plane cuts out of
/// objects it passes through, and what of a bent surface has turned away from it. Surroundings are
/// all measured points near a quarter of a tile, of the plane or not, so that a thin slice cannot
/// vouch for itself. They are wider where the noise is too large for a small window. A plane nearly
/// all of whose pixels agree keeps them all, one that few agree with loses them all.
void freeDisagreeing(const TiledCloud& cloud, const std::vector<PlaneCandidate>& planes,
                     const MetricFit& fit, int threads, PixelAssigner& pixels);

}  // namespace planar_mapping::detail
