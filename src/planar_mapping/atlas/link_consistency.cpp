// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/link_consistency.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <queue>
#include <set>
#include <utility>

#include "planar_mapping/localization/odometry/motion_estimation.h"

namespace planar_mapping::detail {
namespace {

// Where a wrong link may lie: anywhere within a building's room and any turn.
constexpr double kExtent = 10.0;  // metres
// Wrong links agree with each other where things repeat: agreement says no more than this (150:1).
constexpr double kMaxSupport = 5.0;
// Sources on either side that must agree beyond those that say otherwise before two parts are
// joined.
constexpr int kJoiningSources = 2;

// Of the links between two nodes that share no source so many are judged: twice what joins.
constexpr std::size_t kJudged = 2 * kJoiningSources;

constexpr float kContradicts = -1.0F;  // beside supports, which are >= 0

/// Spanning trees over some links: poses of nodes and errors of the ways between them.
class Forest {
 public:
  Forest(std::size_t nodes, const std::vector<GraphLink>& links,
         const std::vector<std::size_t>& edges)
      : pose(nodes, Pose::Identity()),
        root(nodes, nodes),
        covariance_(nodes, Matrix6::Zero()),
        enter_(nodes),
        leave_(nodes),
        parent_(nodes) {
    std::vector<std::vector<std::size_t>> at(nodes);
    for (const std::size_t edge : edges) {
      at[links[edge].from].push_back(edge);
      at[links[edge].to].push_back(edge);
    }
    std::vector<std::vector<std::size_t>> children(nodes);
    for (std::size_t first = 0; first < nodes; ++first) {
      if (root[first] != nodes) continue;
      std::vector<std::size_t> queue = {first};
      root[first] = first;
      parent_[first] = first;
      for (std::size_t next = 0; next < queue.size(); ++next) {
        const std::size_t node = queue[next];
        for (const std::size_t edge : at[node]) {
          const GraphLink& link = links[edge];
          const bool forward = link.from == node;
          const std::size_t child = forward ? link.to : link.from;
          if (root[child] != nodes) continue;
          root[child] = first;
          parent_[child] = node;
          pose[child] =
              forward ? pose[node] * link.T_to_from.inverse() : pose[node] * link.T_to_from;
          covariance_[child] = covariance_[node] + turnedCovariance(pose[link.to], link.covariance);
          children[node].push_back(child);
          queue.push_back(child);
          used.push_back(edge);
        }
      }
      number(first, children);
    }
  }

  /// Covariance of the way between two nodes of one tree, as a disturbance in the root's frame.
  Matrix6 wayCovariance(std::size_t a, std::size_t b) const {
    std::size_t common = isAbove(b, a) ? b : a;
    while (!isAbove(common, b)) common = parent_[common];
    return covariance_[a] + covariance_[b] - 2.0 * covariance_[common];
  }

  std::vector<Pose> pose;         ///< root <- node
  std::vector<std::size_t> root;  ///< first node of the tree
  std::vector<std::size_t> used;  ///< links that are edges

 private:
  bool isAbove(std::size_t upper, std::size_t lower) const {
    return enter_[upper] <= enter_[lower] && leave_[lower] <= leave_[upper];
  }
  void number(std::size_t first, const std::vector<std::vector<std::size_t>>& children) {
    std::vector<std::pair<std::size_t, std::size_t>> open = {{first, 0}};
    enter_[first] = clock_++;
    while (!open.empty()) {
      auto& [node, next] = open.back();
      if (next < children[node].size()) {
        const std::size_t child = children[node][next++];
        enter_[child] = clock_++;
        open.emplace_back(child, 0);
      } else {
        leave_[node] = clock_++;
        open.pop_back();
      }
    }
  }

  std::vector<Matrix6> covariance_;  // of the way from the root
  std::vector<std::size_t> enter_;
  std::vector<std::size_t> leave_;
  std::vector<std::size_t> parent_;
  std::size_t clock_ = 0;
};

/// A density's logarithm at its peak: -1/2 log det(2 pi covariance).
double logPeak(const Eigen::LLT<Matrix6>& llt) {
  double log_peak = -3.0 * std::log(2.0 * M_PI);
  for (int i = 0; i < 6; ++i) log_peak -= std::log(llt.matrixLLT()(i, i));
  return log_peak;
}

/// Squared Mahalanobis distance of a motion that should be none.
double chi2Of(const Pose& motion, const Eigen::LLT<Matrix6>& llt) {
  if (llt.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
  const Vector6 xi = motionDifference(Pose::Identity(), motion);
  const Vector6 whitened = llt.matrixL().solve(xi);
  return whitened.squaredNorm();
}

/// The smaller the surer, square metres.
double uncertaintyOf(const GraphLink& link) {
  const Vector6 variances = link.covariance.diagonal();
  return variances.head<3>().sum() + kExtent * kExtent * variances.tail<3>().sum();
}

/// The surest links between each two nodes, one per link: what they find holds for the others, and
/// the time goes with the square of their number.
std::vector<std::uint8_t> judgedLinks(const std::vector<GraphLink>& links) {
  std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> pairs;
  for (std::size_t i = 0; i < links.size(); ++i)
    pairs[std::minmax(links[i].from, links[i].to)].push_back(i);
  std::vector<std::uint8_t> judged(links.size(), 0);
  for (auto& [nodes, members] : pairs) {
    std::stable_sort(members.begin(), members.end(), [&](std::size_t i, std::size_t j) {
      return uncertaintyOf(links[i]) < uncertaintyOf(links[j]);
    });
    std::set<LinkSource> sources;
    std::size_t count = 0;
    for (const std::size_t i : members) {
      if (count == kJudged ||
          sources.count(links[i].from_source) + sources.count(links[i].to_source) > 0)
        continue;
      sources.insert({links[i].from_source, links[i].to_source});
      judged[i] = 1;
      ++count;
    }
  }
  return judged;
}

/// The surest way between two nodes along links that are used.
class Ways {
 public:
  Ways(std::size_t nodes, const std::vector<GraphLink>& links) : links_(links), at_(nodes) {
    for (const GraphLink& link : links) lengths_.push_back(uncertaintyOf(link));
  }
  void add(std::size_t edge) {
    at_[links_[edge].from].push_back(edge);
    at_[links_[edge].to].push_back(edge);
  }
  /// Whether a link closes with the way between its ends.
  bool agree(const GraphLink& link) const {
    Pose T = Pose::Identity();
    Matrix6 covariance = Matrix6::Zero();
    std::size_t node = link.from;
    for (const std::size_t edge : way(link.from, link.to)) {
      const GraphLink& step = links_[edge];
      const bool forward = step.from == node;
      node = forward ? step.to : step.from;
      const Pose motion = forward ? step.T_to_from : step.T_to_from.inverse();
      // Of a step backwards the covariance is in the frame that it leaves.
      if (!forward) covariance += step.covariance;
      covariance = turnedCovariance(motion, covariance);
      if (forward) covariance += step.covariance;
      T = motion * T;
    }
    covariance += link.covariance;
    return chi2Of(link.T_to_from * T.inverse(), Eigen::LLT<Matrix6>(covariance)) <= kUnlikelyChi2;
  }

 private:
  std::vector<std::size_t> way(std::size_t from, std::size_t to) const {
    const std::size_t none = links_.size();
    std::vector<double> reached(at_.size(), std::numeric_limits<double>::infinity());
    std::vector<std::size_t> by(at_.size(), none);
    using Open = std::pair<double, std::size_t>;
    std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
    reached[from] = 0.0;
    open.emplace(0.0, from);
    while (!open.empty() && open.top().second != to) {
      const auto [length, node] = open.top();
      open.pop();
      if (length > reached[node]) continue;
      for (const std::size_t edge : at_[node]) {
        const std::size_t next = links_[edge].from == node ? links_[edge].to : links_[edge].from;
        const double total = length + lengths_[edge];
        if (total >= reached[next]) continue;
        reached[next] = total;
        by[next] = edge;
        open.emplace(total, next);
      }
    }
    std::vector<std::size_t> edges;
    for (std::size_t node = to; by[node] != none && node != from;) {
      edges.push_back(by[node]);
      node = links_[by[node]].from == node ? links_[by[node]].to : links_[by[node]].from;
    }
    std::reverse(edges.begin(), edges.end());
    return edges;
  }

  const std::vector<GraphLink>& links_;
  std::vector<std::vector<std::size_t>> at_;
  std::vector<double> lengths_;
};

/// Links between two trees, or within one, that may agree.
class LinkGroup {
 public:
  LinkGroup(const Forest& forest, const std::vector<GraphLink>& links,
            std::vector<std::size_t> members)
      : links_(links), members_(std::move(members)), supports_(members_.size() * members_.size()) {
    const std::size_t count = members_.size();
    // Motion from the tree of `from` to that of `to` that a link asks for, the ends in one order.
    std::vector<Pose> motions;
    std::vector<Matrix6> covariances;
    std::vector<std::pair<std::size_t, std::size_t>> ends;
    for (const std::size_t member : members_) {
      const GraphLink& link = links[member];
      Pose motion = forest.pose[link.to] * link.T_to_from * forest.pose[link.from].inverse();
      Pose behind = forest.pose[link.to];
      ends.emplace_back(link.from, link.to);
      if (forest.root[link.from] > forest.root[link.to]) {
        motion = motion.inverse();
        behind = motion * behind;
        std::swap(ends.back().first, ends.back().second);
      }
      motions.push_back(motion);
      covariances.push_back(turnedCovariance(behind, link.covariance));
    }
    // Within a tree the motions are next to none: both ways may be added as they are.
    const bool within = count > 0 && forest.root[ends[0].first] == forest.root[ends[0].second];
    // How far a wrong link may be off that closes with the way between its own ends.
    std::vector<Matrix6> cycles;
    for (std::size_t i = 0; within && i < count; ++i) {
      cycles.push_back(covariances[i] + forest.wayCovariance(ends[i].first, ends[i].second));
    }
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const Matrix6 way = forest.wayCovariance(ends[i].first, ends[j].first);
        Matrix6 covariance = covariances[i] + covariances[j];
        covariance += forest.wayCovariance(ends[i].second, ends[j].second);
        covariance += within ? way : turnedCovariance(motions[i], way);
        const Eigen::LLT<Matrix6> llt(covariance);
        const double chi2 = chi2Of(motions[i] * motions[j].inverse(), llt);
        float support = kContradicts;
        if (chi2 <= kContradiction) {
          double anywhere = -3.0 * std::log(2.0 * M_PI * kExtent);
          if (within) {
            const Matrix6 alone = cycles[i] + cycles[j];
            anywhere = std::max(anywhere, logPeak(Eigen::LLT<Matrix6>(alone)));
          }
          const double gain = logPeak(llt) - 0.5 * chi2 - anywhere;
          support = static_cast<float>(std::clamp(gain, 0.0, kMaxSupport));
        }
        supports_[i * count + j] = support;
        supports_[j * count + i] = support;
      }
    }
  }

  /// Members that agree in pairs: the best supported one first, then those that agree with it.
  /// \param accept  asked of each before it is taken
  template <typename Accept>
  std::vector<std::size_t> agreeing(std::vector<std::size_t> candidates,
                                    const Accept& accept) const {
    std::vector<double> support(members_.size(), 0.0);
    const std::vector<std::size_t> by_from = sortedBy(&GraphLink::from, candidates);
    const std::vector<std::size_t> by_to = sortedBy(&GraphLink::to, candidates);
    for (const std::size_t i : candidates) support[i] = supportOf(i, by_from, by_to);
    std::stable_sort(candidates.begin(), candidates.end(),
                     [&](std::size_t i, std::size_t j) { return support[i] > support[j]; });
    std::vector<std::size_t> chosen;
    for (const std::size_t i : candidates) {
      const bool contradicts = std::any_of(chosen.begin(), chosen.end(),
                                           [&](std::size_t j) { return of(i, j) == kContradicts; });
      if (!contradicts && accept(i)) chosen.push_back(i);
    }
    return chosen;
  }

  std::vector<std::size_t> everyMember() const {
    std::vector<std::size_t> all(members_.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
    return all;
  }

  const GraphLink& link(std::size_t member) const { return links_[members_[member]]; }
  std::size_t number(std::size_t member) const { return members_[member]; }

 private:
  /// What speaks for a member, each node counted once, on the side that has less: what deceives one
  /// link deceives those beside it as well.
  double supportOf(std::size_t i, const std::vector<std::size_t>& by_from,
                   const std::vector<std::size_t>& by_to) const {
    const auto sum = [&](const std::vector<std::size_t>& sorted, std::size_t GraphLink::*end) {
      double total = 0.0;
      float most = 0.0F;
      for (std::size_t k = 0; k < sorted.size(); ++k) {
        if (k > 0 && link(sorted[k]).*end != link(sorted[k - 1]).*end) {
          total += most;
          most = 0.0F;
        }
        if (sorted[k] != i) most = std::max(most, of(i, sorted[k]));
      }
      return total + most;
    };
    return std::min(sum(by_from, &GraphLink::from), sum(by_to, &GraphLink::to));
  }
  std::vector<std::size_t> sortedBy(std::size_t GraphLink::*end,
                                    std::vector<std::size_t> members) const {
    std::stable_sort(members.begin(), members.end(),
                     [&](std::size_t i, std::size_t j) { return link(i).*end < link(j).*end; });
    return members;
  }
  float of(std::size_t i, std::size_t j) const { return supports_[i * members_.size() + j]; }

  const std::vector<GraphLink>& links_;
  std::vector<std::size_t> members_;
  std::vector<float> supports_;
};

/// Distinct sources on the side that has fewer.
int sourcesOf(const LinkGroup& group, const std::vector<std::size_t>& members) {
  std::set<LinkSource> from;
  std::set<LinkSource> to;
  for (const std::size_t member : members) {
    from.insert(group.link(member).from_source);
    to.insert(group.link(member).to_source);
  }
  return static_cast<int>(std::min(from.size(), to.size()));
}

/// Links that join two trees, and by how many sources more than what contradicts them.
struct Join {
  int margin = 0;
  std::size_t edge = 0;
};

std::optional<Join> joinOf(const LinkGroup& group) {
  const auto any = [](std::size_t) { return true; };
  std::vector<std::size_t> sound, others;
  for (const std::size_t member : group.everyMember())
    if (!group.link(member).doubtful) sound.push_back(member);
  const std::vector<std::size_t> best = group.agreeing(sound, any);
  for (const std::size_t member : group.everyMember()) {
    if (std::find(best.begin(), best.end(), member) == best.end()) others.push_back(member);
  }
  int evidence = sourcesOf(group, best);
  for (const std::size_t member : best) {
    if (group.link(member).strong) evidence = std::max(evidence, kJoiningSources);
  }
  Join join;
  join.margin = evidence - sourcesOf(group, group.agreeing(others, any));
  if (join.margin < kJoiningSources) return std::nullopt;
  join.edge = group.number(best.front());
  return join;
}

/// Judged links that are no edges of the forest, by the two trees that they are between.
std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> otherLinks(
    const Forest& forest, const std::vector<GraphLink>& links,
    const std::vector<std::uint8_t>& judged) {
  std::vector<std::uint8_t> is_edge(links.size(), 0);
  for (const std::size_t edge : forest.used) is_edge[edge] = 1;
  std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < links.size(); ++i) {
    if (is_edge[i] != 0 || judged[i] == 0) continue;
    groups[std::minmax(forest.root[links[i].from], forest.root[links[i].to])].push_back(i);
  }
  return groups;
}

}  // namespace

LinkChoice consistentLinks(std::size_t nodes, const std::vector<GraphLink>& links) {
  const std::vector<std::uint8_t> judged = judgedLinks(links);
  std::vector<std::size_t> edges;
  for (std::size_t i = 0; i < links.size(); ++i) {
    if (links[i].trusted) edges.push_back(i);
  }
  // The strongest join first: it may tell which of the others are right.
  std::map<std::pair<std::size_t, std::size_t>, std::optional<Join>> joins;  // of trees as they are
  while (true) {
    const Forest forest(nodes, links, edges);
    std::optional<Join> best;
    for (const auto& [trees, members] : otherLinks(forest, links, judged)) {
      if (trees.first == trees.second) continue;
      const auto [known, is_new] = joins.try_emplace(trees);
      if (is_new) known->second = joinOf(LinkGroup(forest, links, members));
      const std::optional<Join>& join = known->second;
      if (join && (!best || join->margin > best->margin)) best = join;
    }
    if (!best) break;
    edges.push_back(best->edge);
    const std::size_t a = forest.root[links[best->edge].from];
    const std::size_t b = forest.root[links[best->edge].to];
    for (auto it = joins.begin(); it != joins.end();) {
      const auto [one, other] = it->first;
      const bool changes = one == a || one == b || other == a || other == b;
      it = changes ? joins.erase(it) : std::next(it);
    }
  }

  const Forest forest(nodes, links, edges);
  Ways ways(nodes, links);
  LinkChoice choice;
  choice.used.assign(links.size(), 0);
  const auto use = [&](std::size_t link) {
    choice.used[link] = 1;
    ways.add(link);
  };
  for (const std::size_t edge : forest.used) use(edge);
  for (const auto& [trees, members] : otherLinks(forest, links, judged)) {
    if (trees.first != trees.second) continue;
    std::vector<std::size_t> close;
    for (const std::size_t member : members) {
      if (!links[member].doubtful && ways.agree(links[member])) close.push_back(member);
    }
    const LinkGroup group(forest, links, std::move(close));
    // Links that were accepted make the ways surer, which shows others to be wrong.
    group.agreeing(group.everyMember(), [&](std::size_t member) {
      const std::size_t link = group.number(member);
      if (!ways.agree(links[link])) return false;
      use(link);
      return true;
    });
  }

  for (std::size_t i = 0; i < links.size(); ++i) {
    const bool is_other =
        judged[i] == 0 && !links[i].trusted && !links[i].doubtful && choice.used[i] == 0;
    if (is_other && forest.root[links[i].from] == forest.root[links[i].to] && ways.agree(links[i]))
      use(i);
  }

  // Along the fewest links: errors add up least.
  edges.clear();
  for (std::size_t i = 0; i < links.size(); ++i) {
    if (choice.used[i] != 0) edges.push_back(i);
  }
  Forest shortest(nodes, links, edges);
  choice.T_part_node = std::move(shortest.pose);
  choice.part = std::move(shortest.root);
  return choice;
}

}  // namespace planar_mapping::detail
