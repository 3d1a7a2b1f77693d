// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "planar_mapping/atlas/atlas_data.h"
#include "planar_mapping/base/export.h"
#include "planar_mapping/io/pose_file.h"

namespace planar_mapping {

/// Numbers the components: what used links join is one, with the lowest number of its submaps.
PLANAR_MAPPING_EXPORT void numberComponents(AtlasData& data);

/// The components, ascending.
PLANAR_MAPPING_EXPORT std::vector<std::int64_t> componentsOf(const AtlasData& data);

/// Refuses maps that cannot be joined with one of these parameters.
/// \throws InputError with the number of the submap and what differs
PLANAR_MAPPING_EXPORT void requireFits(const AtlasData& data, const PlanarMapParams& params);

/// One map of the submaps of a component, in its world, as JoinedMap has it.
/// \throws InputError if there is no such component, or submaps do not fit together: their numbers
///         and what differs
PLANAR_MAPPING_EXPORT PlanarMap joinSubmaps(const AtlasData& data, std::int64_t component);

/// T_world_keyframe of the keyframes of a component, in the order of their numbers; in the
/// coordinates of the poses that were given, if the maps are there to say where their origin is.
PLANAR_MAPPING_EXPORT std::vector<io::StampedPose> keyframePoses(const AtlasData& data,
                                                                 std::int64_t component);

/// Refuses loops for good (LinkState::Refused), or takes them back (Used).
/// \throws InputError if one of the numbers is that of no loop; links to neighbours are none
PLANAR_MAPPING_EXPORT void setLoopStates(AtlasData& data, const std::vector<std::int64_t>& loops,
                                         LinkState state);

/// The submaps that \p kept holds for, with their sessions, keyframes and the links among them.
/// Numbers stay, but for components: what used links do not join any more are two.
PLANAR_MAPPING_EXPORT AtlasData partOf(const AtlasData& data,
                                       const std::function<bool(const Submap&)>& kept);

/// Adds everything of another atlas, numbered on from what there is. Components stay apart.
PLANAR_MAPPING_EXPORT void addAtlas(AtlasData& data, AtlasData added);

/// One atlas of several: everything of the second is numbered on from what the first has, and so
/// on. Components of different ones stay apart until links are found.
PLANAR_MAPPING_EXPORT AtlasData mergeAtlases(const std::vector<AtlasData>& atlases);

/// Adds the loops from the keyframes from number \p first of the list on to those before it. They
/// are to be solved: solvePoseGraph().
/// \return how many
PLANAR_MAPPING_EXPORT std::size_t addLoops(AtlasData& data, std::size_t first, int threads = 1);

}  // namespace planar_mapping
