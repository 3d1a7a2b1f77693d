// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/beliefs/occupancy.h"

namespace planar_mapping::detail {

/// Chi-squared with six degrees of freedom: 95 % and 99.9 % of right links are below. Neighbouring
/// links share errors, so that a link contradicts others only beyond twice the second.
constexpr double kTypicalChi2 = 12.59;
constexpr double kUnlikelyChi2 = 22.46;
constexpr double kContradiction = 2.0 * kUnlikelyChi2;

/// What an end of a link was found by: its keyframe; the surroundings of its submap, which all
/// clouds there share (those of links in doubt apart); or, by the number of the link, nothing that
/// others share.
enum class SourceKind : std::uint8_t { Keyframe, Surroundings, Doubt, Link };
using LinkSource = std::pair<SourceKind, std::int64_t>;

/// A link between two nodes of a graph.
struct GraphLink {
  std::size_t from = 0;  ///< number of its node
  std::size_t to = 0;
  Pose T_to_from = Pose::Identity();
  Matrix6 covariance = Matrix6::Identity();  ///< of T_to_from, see Matrix6
  bool trusted = false;                      ///< between neighbours
  bool strong = false;                       ///< one of them is enough to join components
  bool doubtful = false;                     ///< speaks against joining, and is never used
  LinkSource from_source;                    ///< what links share is one piece of evidence
  LinkSource to_source;
};

/// What holds together: parts of nodes, joined by links that agree with each other.
struct LinkChoice {
  std::vector<std::uint8_t> used;  ///< one per link
  /// Per node: the pose in the frame of the first node of its part, along the fewest links.
  std::vector<Pose> T_part_node;
  std::vector<std::size_t> part;  ///< per node: the first node of its part
};

/// Throws out links that contradict the others. Trusted links make trees; of all others those are
/// used that agree in pairs (pairwise consistency maximisation): a pair and the ways between its
/// ends along the tree must close within their covariance. Two trees are joined only by more
/// evidence than what contradicts it. Of many links between the same two nodes the surest are
/// judged so, the others by the ways. Depends on the links alone; time goes with the square of the
/// pairs of nodes.
LinkChoice consistentLinks(std::size_t nodes, const std::vector<GraphLink>& links);

}  // namespace planar_mapping::detail
