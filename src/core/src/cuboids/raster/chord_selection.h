// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

namespace planar_mapping::detail {

/// A chord of a raster: on grid line \p line from vertex \p from to vertex \p to.
struct Chord {
  std::int32_t line = 0;
  std::int32_t from = 0;
  std::int32_t to = 0;
};

struct ChordChoice {
  std::vector<char> horizontal;  ///< 1 = taken
  std::vector<char> vertical;
};

/// As many chords as possible of which no two share a point: the complement of a minimum vertex
/// cover of the bipartite graph "horizontal chord meets vertical chord" (Koenig), from a maximum
/// matching (Hopcroft and Karp).
///
/// Chords of one direction must be disjoint from each other. Then a raster vertex lies on at most
/// one chord of each direction, so the graph has no more edges than the raster has vertices (V),
/// and the time is O(V sqrt(chords)).
/// \param horizontal line = y, from and to = x; sorted by (y, x)
/// \param vertical   line = x, from and to = y
ChordChoice largestDisjointChords(const std::vector<Chord>& horizontal,
                                  const std::vector<Chord>& vertical, std::int32_t vertices_x,
                                  std::int32_t vertices_y);

}  // namespace planar_mapping::detail
