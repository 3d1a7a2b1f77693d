// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "store/cell_layer.h"
#include "planar_mapping/map/planar_map.h"
#include "store/plane_layer.h"
#include "store/resting.h"
#include "store/trajectory.h"
#include "store/unknown_space.h"

namespace planar_mapping::detail {

/// All that a map knows: plain values, copied with it and written to its file.
struct MapData {
  PlanarMapParams params;
  RestingPlanes resting;
  /// The planes while they are worked on, by id, ascending. Copies of the map are at rest.
  class WorkingPlanes {
   public:
    bool areAwake() const { return layers_ != nullptr; }
    void wake(std::vector<PlaneLayer> layers) {
      layers_.reset(new std::vector<PlaneLayer>(std::move(layers)));
    }
    /// Gives the planes away; they are at rest then.
    std::vector<PlaneLayer> take() {
      std::vector<PlaneLayer> layers = std::move(*layers_);
      layers_.reset();
      return layers;
    }
    // While they are awake:
    std::size_t size() const { return layers_->size(); }
    PlaneLayer& operator[](std::size_t i) { return (*layers_)[i]; }
    const PlaneLayer& operator[](std::size_t i) const { return (*layers_)[i]; }
    auto begin() { return layers_->begin(); }
    auto end() { return layers_->end(); }
    auto begin() const { return layers_->cbegin(); }
    auto end() const { return layers_->cend(); }
    void push_back(PlaneLayer layer) { layers_->push_back(std::move(layer)); }
    void resize(std::size_t count) { layers_->resize(count); }

   private:
    Resting<std::vector<PlaneLayer>> layers_;
  };
  WorkingPlanes planes;
  std::int32_t next_plane_id = 0;
  CellLayer cells;
  UnknownSpace unknown;
  Trajectory trajectory;

  double resolution() const { return params.approximation.resolution; }
  double unknownResolution() const {
    return params.unknown_resolution > 0.0 ? params.unknown_resolution : resolution();
  }
  double thickness() const {
    const CuboidApproximationParams& p = params.approximation;
    return p.thickness > 0.0 ? p.thickness : p.resolution;
  }
  /// Stamp of what changes now: another one after each frame.
  std::uint32_t revision() const { return static_cast<std::uint32_t>(trajectory.size() + 1); }
  bool isCompact() const { return params.approximation.profile == Profile::Compact; }
};

/// Opens the planes; tidyMap() closes them.
void wakePlanes(MapData& map);
/// Lets the planes rest, stamps what was touched, for those who derive cuboids from it, and forgets
/// what is empty.
void tidyMap(MapData& map, FrameUpdate& update);

}  // namespace planar_mapping::detail
