// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/pose_graph.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <map>
#include <string>

#include "planar_mapping/atlas/atlas_parts.h"
#include "planar_mapping/atlas/graph_solver.h"
#include "planar_mapping/atlas/link_consistency.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"

namespace planar_mapping {
namespace {

using detail::GraphLink;
using detail::LinkSource;
using detail::SourceKind;

// One pair of keyframes joins components if so many features agree, and depths without doubt.
constexpr std::size_t kStrongInliers = 60;
constexpr double kStrongAgreement = 0.8;
constexpr double kStrongSeenThrough = 0.03;

/// Nodes by the ids of submaps, and the links that nobody refused.
struct Graph {
  std::vector<GraphLink> links;
  std::vector<std::size_t> origin;  ///< of each: its number in the data
};

void requireSound(const Link& link, bool known) {
  const std::string name = "link " + std::to_string(link.id);
  if (!known) throw InputError(name + " is not between two submaps that are there");
  requireRigid(("the motion of " + name).c_str(), link.T_to_from);
  if (!link.covariance.allFinite() ||
      Eigen::LLT<Matrix6>(link.covariance).info() != Eigen::Success) {
    throw InputError("the covariance of " + name + " is not positive definite");
  }
}

Graph graphOf(const AtlasData& data) {
  std::map<std::int64_t, std::size_t> nodes;
  for (const Submap& submap : data.submaps) nodes.emplace(submap.id, nodes.size());
  Graph graph;
  for (std::size_t i = 0; i < data.links.size(); ++i) {
    const Link& link = data.links[i];
    if (link.state == LinkState::Refused) continue;
    const auto from = nodes.find(link.from_submap);
    const auto to = nodes.find(link.to_submap);
    requireSound(link, from != nodes.end() && to != nodes.end() && from != to);
    GraphLink edge;
    edge.from = from->second;
    edge.to = to->second;
    edge.T_to_from = link.T_to_from;
    edge.covariance = link.covariance;
    edge.trusted = link.kind == LinkKind::Neighbour;
    edge.strong = link.kind == LinkKind::Loop && link.evidence.inliers >= kStrongInliers &&
                  link.evidence.agreement >= kStrongAgreement &&
                  link.evidence.seen_through <= kStrongSeenThrough;
    edge.doubtful = link.isDoubt();
    const auto sourceOf = [&](std::int64_t keyframe, std::size_t node) -> LinkSource {
      const bool is_surface = link.kind == LinkKind::Surface;
      if (is_surface) return {edge.doubtful ? SourceKind::Doubt : SourceKind::Surroundings, node};
      if (keyframe < 0) return {SourceKind::Link, i};
      return {SourceKind::Keyframe, keyframe};
    };
    edge.from_source = sourceOf(link.from_keyframe, edge.from);
    edge.to_source = sourceOf(link.to_keyframe, edge.to);
    graph.links.push_back(edge);
    graph.origin.push_back(i);
  }
  return graph;
}

/// Links that are used, by the first node of their part.
std::map<std::size_t, std::vector<std::size_t>> linksOfParts(const detail::LinkChoice& choice,
                                                             const std::vector<GraphLink>& links) {
  std::map<std::size_t, std::vector<std::size_t>> parts;
  for (std::size_t i = 0; i < links.size(); ++i) {
    if (choice.used[i] != 0) parts[choice.part[links[i].from]].push_back(i);
  }
  return parts;
}

/// Poses in the frames of the parts. Links that contradict the solution are taken out of the choice
/// and the rest is solved once more.
void solveParts(const std::vector<GraphLink>& links, detail::LinkChoice& choice) {
  const std::size_t nodes = choice.part.size();
  for (bool settled = false; !settled;) {
    settled = true;
    std::map<std::size_t, std::size_t> sizes;
    for (const std::size_t first : choice.part) ++sizes[first];
    std::vector<GraphLink> kept;
    std::vector<std::size_t> origin;
    for (const auto& [first, members] : linksOfParts(choice, links)) {
      std::vector<std::uint8_t> wrong(members.size(), 0);
      // Without a cycle the poses along the links are the solution.
      if (members.size() >= sizes[first]) {
        wrong = detail::solvePart(links, members, choice.T_part_node, first);
      }
      for (std::size_t i = 0; i < members.size(); ++i) {
        if (wrong[i] != 0) settled = false;
        if (wrong[i] == 0) kept.push_back(links[members[i]]);
        if (wrong[i] == 0) origin.push_back(members[i]);
      }
    }
    if (settled) break;
    const detail::LinkChoice again = detail::consistentLinks(nodes, kept);
    choice.used.assign(links.size(), 0);
    for (std::size_t i = 0; i < kept.size(); ++i) choice.used[origin[i]] = again.used[i];
    choice.T_part_node = again.T_part_node;
    choice.part = again.part;
  }
}

double residualOf(const GraphLink& link, const Pose& T_from, const Pose& T_to) {
  const Vector6 xi = detail::linkError(link.T_to_from.inverse(), T_from, T_to, nullptr, nullptr);
  return xi.dot(Eigen::LLT<Matrix6>(link.covariance).solve(xi));
}

bool isSame(const Pose& a, const Pose& b) {
  return a.matrix() == b.matrix();
}

}  // namespace

PoseGraphResult solvePoseGraph(AtlasData& data) {
  const auto start = std::chrono::steady_clock::now();
  const Graph graph = graphOf(data);
  detail::LinkChoice choice = detail::consistentLinks(data.submaps.size(), graph.links);
  solveParts(graph.links, choice);

  PoseGraphResult result;
  std::vector<Pose> fixed;
  for (const Submap& submap : data.submaps) {
    const bool began = submap.component == submap.id;
    fixed.push_back(began ? submap.T_world_submap : Pose(Pose::Identity()));
  }
  for (std::size_t node = 0; node < data.submaps.size(); ++node) {
    Submap& submap = data.submaps[node];
    const std::size_t first = choice.part[node];
    const Pose T_world_submap =
        node == first ? fixed[first] : fixed[first] * choice.T_part_node[node];
    if (!isSame(T_world_submap, submap.T_world_submap)) result.moved.push_back(submap.id);
    submap.T_world_submap = T_world_submap;
  }
  for (std::size_t i = 0; i < graph.links.size(); ++i) {
    const GraphLink& edge = graph.links[i];
    Link& link = data.links[graph.origin[i]];
    link.state = choice.used[i] != 0 ? LinkState::Used : LinkState::Rejected;
    const bool joined = choice.part[edge.from] == choice.part[edge.to];
    link.residual =
        joined ? residualOf(edge, choice.T_part_node[edge.from], choice.T_part_node[edge.to]) : 0.0;
  }
  numberComponents(data);
  result.ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace planar_mapping
