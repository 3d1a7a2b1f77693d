// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/atlas_parts.h"

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>

#include "planar_mapping/atlas/atlas_rows.h"
#include "planar_mapping/atlas/place_finder.h"
#include "planar_mapping/base/disjoint_parts.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/number_text.h"
#include "planar_mapping/base/parallel.h"
#include "planar_mapping/map/joined_map.h"

namespace planar_mapping {
void numberComponents(AtlasData& data) {
  std::unordered_map<std::int64_t, std::uint32_t> index_of;
  for (std::size_t i = 0; i < data.submaps.size(); ++i)
    index_of[data.submaps[i].id] = static_cast<std::uint32_t>(i);
  DisjointParts parts(data.submaps.size());
  for (const Link& link : data.links) {
    if (link.state == LinkState::Used)
      parts.unite(index_of.at(link.from_submap), index_of.at(link.to_submap));
  }
  std::unordered_map<std::uint32_t, std::int64_t> lowest;
  for (std::size_t i = 0; i < data.submaps.size(); ++i) {  // ascending
    const std::uint32_t part = parts.of(static_cast<std::uint32_t>(i));
    data.submaps[i].component = lowest.emplace(part, data.submaps[i].id).first->second;
  }
}

std::vector<std::int64_t> componentsOf(const AtlasData& data) {
  std::vector<std::int64_t> components;
  for (const Submap& submap : data.submaps) components.push_back(submap.component);
  detail::makeDistinct(components);
  return components;
}

void requireFits(const AtlasData& data, const PlanarMapParams& params) {
  const auto sidesOf = [](const PlanarMapParams& of) {
    const CuboidApproximationParams& a = of.approximation;
    const auto side = [&](double own) { return own > 0.0 ? own : a.resolution; };
    return std::array<double, 3>{a.resolution, side(of.unknown_resolution), side(a.thickness)};
  };
  constexpr std::array<const char*, 3> kNames = {"cells", "cells of space", "surfaces"};
  for (const Submap& submap : data.submaps) {
    const std::string name = "submap " + std::to_string(submap.id) + " has ";
    const PlanarMapParams& theirs = submap.map->params();
    if (theirs.approximation.profile != params.approximation.profile)
      throw InputError(name + "another profile");
    const std::array<double, 3> sides = sidesOf(theirs), ours = sidesOf(params);
    for (std::size_t i = 0; i < sides.size(); ++i)
      if (sides[i] != ours[i])
        throw InputError(name + kNames[i] + " of " + detail::numberText(sides[i]) + " m, not of " +
                         detail::numberText(ours[i]) + " m");
  }
}

PlanarMap joinSubmaps(const AtlasData& data, std::int64_t component) {
  JoinedMap joined;
  const Submap* first = nullptr;
  for (const Submap& submap : data.submaps) {
    if (submap.component != component) continue;
    if (first == nullptr) first = &submap;
    try {
      joined.set(static_cast<std::int32_t>(submap.id), submap.map, submap.T_world_submap);
    } catch (const InputError& error) {
      throw InputError("submap " + std::to_string(submap.id) + " does not fit to submap " +
                       std::to_string(first->id) + ": " + error.what());
    }
  }
  if (first == nullptr) throw InputError("there is no component " + std::to_string(component));
  return joined.map();
}

std::vector<io::StampedPose> keyframePoses(const AtlasData& data, std::int64_t component) {
  std::unordered_map<std::int64_t, const Submap*> submap_of;
  for (const Submap& submap : data.submaps) submap_of[submap.id] = &submap;
  Eigen::Translation3d origin = Eigen::Translation3d::Identity();
  const auto first = submap_of.find(component);
  if (first != submap_of.end() && first->second->map != nullptr)
    origin = Eigen::Translation3d(first->second->map->params().origin);
  std::vector<io::StampedPose> poses;
  for (const Keyframe& keyframe : data.keyframes) {
    const Submap& submap = *submap_of.at(keyframe.submap);
    if (submap.component == component)
      poses.push_back(
          {keyframe.timestamp, origin * submap.T_world_submap * keyframe.T_submap_keyframe});
  }
  return poses;
}

void setLoopStates(AtlasData& data, const std::vector<std::int64_t>& loops, LinkState state) {
  for (const std::int64_t loop : loops) {
    const auto link = std::find_if(data.links.begin(), data.links.end(), [loop](const Link& one) {
      return one.id == loop && one.kind != LinkKind::Neighbour;
    });
    if (link == data.links.end()) throw InputError("there is no loop " + std::to_string(loop));
    link->state = state;
  }
}

AtlasData partOf(const AtlasData& data, const std::function<bool(const Submap&)>& kept) {
  AtlasData part;
  std::set<std::int64_t> submaps, sessions;
  for (const Submap& submap : data.submaps) {
    if (!kept(submap)) continue;
    part.submaps.push_back(submap);
    submaps.insert(submap.id);
    sessions.insert(submap.session);
  }
  const auto copyIf = [](const auto& rows, auto& copies, const auto& holds) {
    std::copy_if(rows.begin(), rows.end(), std::back_inserter(copies), holds);
  };
  copyIf(data.sessions, part.sessions,
         [&](const AtlasSession& session) { return sessions.count(session.id) > 0; });
  copyIf(data.keyframes, part.keyframes,
         [&](const Keyframe& keyframe) { return submaps.count(keyframe.submap) > 0; });
  copyIf(data.links, part.links, [&](const Link& link) {
    return submaps.count(link.from_submap) > 0 && submaps.count(link.to_submap) > 0;
  });
  numberComponents(part);
  return part;
}

void addAtlas(AtlasData& data, AtlasData added) {
  const std::int64_t session = detail::nextId(data.sessions);
  const std::int64_t submap = detail::nextId(data.submaps);
  const std::int64_t keyframe = detail::nextId(data.keyframes);
  const std::int64_t link = detail::nextId(data.links);
  for (AtlasSession& row : added.sessions) {
    row.id += session;
    data.sessions.push_back(std::move(row));
  }
  for (Submap& row : added.submaps) {
    row.id += submap;
    row.session += session;
    row.component += submap;
    data.submaps.push_back(std::move(row));
  }
  for (Keyframe& row : added.keyframes) {
    row.id += keyframe;
    row.submap += submap;
    data.keyframes.push_back(std::move(row));
  }
  for (Link& row : added.links) {
    row.id += link;
    row.from_submap += submap;
    row.to_submap += submap;
    if (row.from_keyframe >= 0) row.from_keyframe += keyframe;
    if (row.to_keyframe >= 0) row.to_keyframe += keyframe;
    data.links.push_back(row);
  }
}

AtlasData mergeAtlases(const std::vector<AtlasData>& atlases) {
  AtlasData merged;
  for (const AtlasData& atlas : atlases) addAtlas(merged, atlas);
  return merged;
}

std::size_t addLoops(AtlasData& data, std::size_t first, int threads) {
  PlaceFinder places;
  for (std::size_t i = 0; i < first; ++i)
    if (PlaceFinder::knows(data.keyframes[i])) places.add(data.keyframes[i]);
  std::vector<std::vector<Link>> found(data.keyframes.size() - first);
  parallelFor(found.size(), threads, [&](std::size_t i) {
    const Keyframe& key = data.keyframes[first + i];
    if (PlaceFinder::knows(key)) found[i] = places.links(key, data);
  });
  const std::size_t before = data.links.size();
  for (std::vector<Link>& links : found) {
    for (Link& link : links) {
      link.id = detail::nextId(data.links);
      data.links.push_back(link);
    }
  }
  return data.links.size() - before;
}

}  // namespace planar_mapping
