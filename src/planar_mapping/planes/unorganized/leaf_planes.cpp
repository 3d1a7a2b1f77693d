// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/unorganized/leaf_planes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/base/simd.h"
#include "planar_mapping/grid/cell_table.h"
#include "planar_mapping/planes/unorganized/leaf_voters.h"

namespace planar_mapping::detail {

namespace {

// Blocks of 4, 2 and 1 cells a side propose planes, in this order: the larger, the surer.
constexpr int kLargestBlockLevel = 2;
// Beyond these numbers proposals and voters are drawn at random.
constexpr std::size_t kMaxProposals = 4096;
constexpr std::size_t kMaxVoters = 16384;
// Least fraction of the leaves around that agree, over the whole plane and for a single voter.
constexpr double kMinCoherence = 0.6;
constexpr double kMinLeafCoherence = 0.3;
constexpr int kCoherenceRounds = 4;
// Along the sides of cells there is no leaf around that could agree: half of those of a flat place.
constexpr int kAgreeAlongSides = 4;
constexpr int kBlockRefits = 3;
constexpr int kLocalRefits = 4;
// A proposal this close to a rejected plane, radians, is not tried again.
constexpr double kSameDirection = 0.1;
constexpr int kRefits = 10;
// Leaves at the border of a plane are mixed and do not vote: half the points must.
constexpr double kVotingFraction = 0.5;
// A plane with more of its points within the threshold of a larger one is part of that.
constexpr double kMaxRimFraction = 0.5;

struct Proposal {
  Plane plane;
  Vector3 mean = Vector3::Zero();
  double reach = 0.0;  ///< metres around the mean in which it is trusted at first
  std::int64_t score = 0;
  std::size_t age = 0;  ///< planes accepted when the score was taken
};

/// Weight of the leaves within their band of the plane whose normals agree with it to \p cosine.
/// Integer weights: a float sum would not be vectorised without reordering it.
PLANAR_MAPPING_MULTIVERSION
std::int32_t scorePlane(const LeafColumns& leaves, std::size_t begin, std::size_t end, float a,
                        float b, float c, float d, float cosine) {
  const LeafColumns l = leaves;
  std::int32_t score = 0;
  for (std::size_t i = begin; i < end; ++i) {
    const float distance = a * l.x[i] + b * l.y[i] + c * l.z[i] + d;
    const float agreement = a * l.nx[i] + b * l.ny[i] + c * l.nz[i];
    const bool near = (distance < 0.0f ? -distance : distance) <= l.band[i];
    const bool agrees = (agreement < 0.0f ? -agreement : agreement) >= cosine;
    score += (near & agrees) ? l.weight[i] : 0;
  }
  return score;
}

/// Middle of the planar leaves by medians, so that a far point cannot take the precision away.
Vector3 medianOfMeans(const SurfaceLeaves& surface) {
  Vector3 middle = Vector3::Zero();
  std::vector<double> values;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    values.clear();
    for (const SurfaceLeaf& leaf : surface.leaves) {
      if (leaf.planar) values.push_back(leaf.mean[axis]);
    }
    if (values.empty()) return middle;
    middle[axis] = ranked(values, values.size() / 2);
  }
  return middle;
}

class LeafPlaneSearch {
 public:
  LeafPlaneSearch(const SurfaceLeaves& surface, const MultiPlaneParams& params,
                  PlaneSearchDiagnostics& diagnostics)
      : surface_(surface),
        params_(params),
        diagnostics_(diagnostics),
        origin_(medianOfMeans(surface)),
        cosine_(std::cos(params.max_normal_deviation)),
        voters_(surface, origin_, cosine_),
        random_(params.seed),
        least_(kVotingFraction * params.min_inliers) {}

  std::vector<LeafPlane> run() {
    for (int level = kLargestBlockLevel; level >= 0 && !stopped_; --level) {
      while (!stopped_ && voters_.size() > 0) {
        const std::size_t before = planes_.size();
        const bool all = searchAt(level);
        if (all || planes_.size() == before) break;
      }
    }
    return std::move(planes_);
  }

 private:
  /// Takes planes proposed by blocks of the level. \return whether no proposal was left out
  bool searchAt(int level) {
    bool all = true;
    std::vector<Proposal> proposals = propose(level);
    if (proposals.size() > kMaxProposals) {
      all = false;
      for (std::size_t i = 0; i < kMaxProposals; ++i) {
        const auto rest = static_cast<std::uint32_t>(proposals.size() - i);
        std::swap(proposals[i], proposals[i + random_.below(rest)]);
      }
      proposals.resize(kMaxProposals);
    }
    sampleVoters();
    // Votes only get fewer as planes are taken: re-count the best until it stays the best.
    const auto less = [](const Proposal& a, const Proposal& b) { return a.score < b.score; };
    std::priority_queue<Proposal, std::vector<Proposal>, decltype(less)> queue(less);
    for (Proposal& proposal : proposals) {
      score(proposal);
      if (static_cast<double>(proposal.score) >= least_) queue.push(proposal);
    }
    while (!queue.empty()) {
      Proposal best = queue.top();
      queue.pop();
      if (best.age != planes_.size()) {
        score(best);
        if (static_cast<double>(best.score) >= least_) queue.push(best);
        continue;
      }
      if (wasRejected(best)) continue;
      if (isOver()) {
        stopped_ = true;
        diagnostics_.stopped_by_itself = false;
        break;
      }
      take(best);
    }
    return all;
  }

  bool isOver() const {
    return (params_.max_planes > 0 &&
            planes_.size() >= static_cast<std::size_t>(params_.max_planes)) ||
           (params_.max_iterations > 0 &&
            diagnostics_.hypotheses >= static_cast<std::size_t>(params_.max_iterations));
  }

  /// One proposal per block of cells that holds a surface: fitted to its leaves, then to those of
  /// them that agree.
  std::vector<Proposal> propose(int level) const {
    const double block_side = surface_.side * (1 << level);
    CellTable blocks(voters_.size());
    std::vector<std::vector<std::int32_t>> members;
    for (std::size_t i = 0; i < voters_.size(); ++i) {
      const SurfaceLeaf& leaf = surface_.leaves[static_cast<std::size_t>(voters_.name(i))];
      if (leaf.level > level || leaf.twin >= 0) continue;
      CellKey key = leaf.key;
      for (int up = leaf.level; up < level; ++up) key = key.parent();
      const auto block = static_cast<std::size_t>(blocks.insert(key));
      if (block == members.size()) members.emplace_back();
      members[block].push_back(voters_.name(i));
    }
    std::vector<Proposal> proposals;
    for (std::size_t b = 0; b < members.size(); ++b) {
      const CellKey& key = blocks.key(b);
      const Vector3 centre = Vector3(key.x + 0.5, key.y + 0.5, key.z + 0.5) * block_side;
      offer(members[b], centre, block_side, proposals);
    }
    // Twins propose planes alone, and in the end the leaves larger than a cell do.
    for (std::size_t i = 0; i < voters_.size(); ++i) {
      const SurfaceLeaf& leaf = surface_.leaves[static_cast<std::size_t>(voters_.name(i))];
      if (leaf.twin < 0 && (leaf.level == 0 || level > 0)) continue;
      offer({voters_.name(i)}, surface_.centreOf(leaf), surface_.sideOf(leaf), proposals);
    }
    return proposals;
  }

  void offer(const std::vector<std::int32_t>& members, const Vector3& centre, double side,
             std::vector<Proposal>& proposals) const {
    Proposal proposal;
    for (int round = 0; round < kBlockRefits; ++round) {
      PointSums sums;
      double band = 0.0;
      for (const std::int32_t member : members) {
        const SurfaceLeaf& leaf = surface_.leaves[static_cast<std::size_t>(member)];
        if (round > 0 && (std::abs(proposal.plane.signedDistance(leaf.mean)) > leaf.band ||
                          std::abs(proposal.plane.normal.dot(leaf.normal)) < cosine_)) {
          continue;
        }
        sums.add(leaf.sums, surface_.centreOf(leaf) - centre);
        band = std::max(band, leaf.band);
      }
      if (!(sums.n > 0.0)) return;
      const LocalFit fit = fitLocally(sums);
      if (round + 1 == kBlockRefits && !isSurface(fit, side, band)) return;
      if (!(fit.normal.squaredNorm() > 0.5)) return;
      proposal.mean = centre + fit.mean;
      proposal.plane = {fit.normal, -fit.normal.dot(proposal.mean)};
    }
    proposal.reach = 2.0 * side;
    proposals.push_back(proposal);
  }

  void sampleVoters() {
    sampled_ = voters_.size() > kMaxVoters;
    if (sampled_) sample_ = voters_.sample(kMaxVoters, random_);
  }

  void score(Proposal& proposal) {
    ++diagnostics_.hypotheses;
    const Eigen::Vector3f n = proposal.plane.normal.cast<float>();
    const auto d = static_cast<float>(proposal.plane.signedDistance(origin_));
    const LeafColumns leaves = (sampled_ ? sample_ : voters_).columns();
    proposal.score = 0;
    // A block of 2^15 leaves of at most 2^15 each cannot overflow; larger leaves count as that
    // much.
    constexpr std::size_t kBlock = 1U << 15U;
    for (std::size_t begin = 0; begin < leaves.n; begin += kBlock) {
      proposal.score += scorePlane(leaves, begin, std::min(leaves.n, begin + kBlock), n[0], n[1],
                                   n[2], d, static_cast<float>(cosine_));
    }
    proposal.age = planes_.size();
  }

  /// Local optimisation: refit to the voters in a reach that doubles until it covers them all.
  bool optimize(Proposal& proposal, std::vector<std::int32_t>& voters) const {
    std::vector<std::int32_t> next;
    double reach = proposal.reach;
    voters.clear();
    for (int round = 0; round < kRefits; ++round, reach *= 2.0) {
      if (round == kLocalRefits) reach = std::numeric_limits<double>::infinity();
      voters_.agreeing(proposal.plane, proposal.mean, reach, cosine_, next);
      const bool same = next == voters;
      voters.swap(next);
      if (voters.empty()) return false;
      PlaneMoments moments = momentsOf(voters);
      const PlaneMoments::Fit fit = moments.fit();
      if (!fit.valid) return false;
      proposal.plane = fit.plane;
      if (same && round > kLocalRefits) break;
    }
    return true;
  }

  std::size_t nameOf(std::int32_t voter) const {
    return static_cast<std::size_t>(voters_.name(static_cast<std::size_t>(voter)));
  }
  const SurfaceLeaf& leafOf(std::int32_t voter) const { return surface_.leaves[nameOf(voter)]; }

  PlaneMoments momentsOf(const std::vector<std::int32_t>& voters) const {
    PointSums all;
    for (const std::int32_t i : voters) {
      const SurfaceLeaf& leaf = leafOf(i);
      all.add(leaf.sums, surface_.centreOf(leaf) - origin_);
    }
    return all.moments(origin_);
  }

  /// Drops voters that stand alone among leaves that disagree, until what is left agrees with
  /// itself. \return whether it is one surface rather than a cut through unrelated things
  bool keepCoherent(const Plane& plane, std::vector<std::int32_t>& voters) {
    for (const std::int32_t voter : voters) votes_[nameOf(voter)] = 1;
    bool coherent = false;
    std::vector<std::int32_t> kept;
    for (int round = 0; round < kCoherenceRounds && !coherent; ++round) {
      std::int64_t agreeing = 0, opposing = 0;
      kept.clear();
      for (const std::int32_t voter : voters) {
        int agree = 0, oppose = 0;
        const bool has_around =
            forEachNeighbour(surface_, leafOf(voter), plane, [&](std::int32_t other) {
              ++(votes_[static_cast<std::size_t>(other)] != 0 ? agree : oppose);
            });
        if (!has_around) agree = kAgreeAlongSides;
        agreeing += agree;
        opposing += oppose;
        if (agree >= kMinLeafCoherence * (agree + oppose)) kept.push_back(voter);
      }
      coherent =
          static_cast<double>(agreeing) >= kMinCoherence * static_cast<double>(agreeing + opposing);
      for (const std::int32_t voter : voters) votes_[nameOf(voter)] = 0;
      for (const std::int32_t voter : kept) votes_[nameOf(voter)] = 1;
      voters.swap(kept);
      if (static_cast<double>(voters_.weightOf(voters)) < least_) coherent = false;
      if (voters.empty()) break;
    }
    for (const std::int32_t voter : voters) votes_[nameOf(voter)] = 0;
    return coherent;
  }

  /// Whether most of the voters lie within the threshold of a plane found before: the rim of a
  /// surface that is bent a little, not one of its own.
  bool isRimOfAnother(const std::vector<std::int32_t>& voters) const {
    const double all = static_cast<double>(voters_.weightOf(voters));
    std::vector<std::int32_t> within;
    for (const LeafPlane& other : planes_) {
      within.clear();
      for (const std::int32_t i : voters) {
        const SurfaceLeaf& leaf = leafOf(i);
        if (std::abs(other.plane.signedDistance(leaf.mean)) <= leaf.band) within.push_back(i);
      }
      if (static_cast<double>(voters_.weightOf(within)) > kMaxRimFraction * all) return true;
    }
    return false;
  }

  bool wasRejected(const Proposal& proposal) const {
    const double cosine = std::cos(kSameDirection);
    for (const Plane& plane : rejected_) {
      if (std::abs(plane.normal.dot(proposal.plane.normal)) > cosine &&
          std::abs(plane.signedDistance(proposal.mean)) < params_.distance_threshold) {
        return true;
      }
    }
    return false;
  }

  void take(Proposal& proposal) {
    std::vector<std::int32_t> voters;
    if (!optimize(proposal, voters) || static_cast<double>(voters_.weightOf(voters)) < least_) {
      ++diagnostics_.rejected_too_small;
      return;
    }
    if (!keepCoherent(proposal.plane, voters) || isRimOfAnother(voters)) {
      rejected_.push_back(proposal.plane);
      ++diagnostics_.rejected_not_coherent;
      return;
    }
    LeafPlane found;
    found.plane = proposal.plane;
    std::vector<char> keep(voters_.size(), 1);
    for (const std::int32_t i : voters) {
      keep[static_cast<std::size_t>(i)] = 0;
      found.support.push_back(voters_.name(static_cast<std::size_t>(i)));
    }
    planes_.push_back(std::move(found));
    voters_.select(keep);
    sampleVoters();
  }

  const SurfaceLeaves& surface_;
  const MultiPlaneParams& params_;
  PlaneSearchDiagnostics& diagnostics_;
  const Vector3 origin_;
  const double cosine_;
  Voters voters_;
  Voters sample_ = voters_;
  bool sampled_ = false;
  bool stopped_ = false;
  Random random_;
  const double least_;
  std::vector<char> votes_ = std::vector<char>(surface_.leaves.size(), 0);
  std::vector<Plane> rejected_;
  std::vector<LeafPlane> planes_;
};

}  // namespace

std::vector<LeafPlane> findLeafPlanes(const SurfaceLeaves& surface, const MultiPlaneParams& params,
                                      PlaneSearchDiagnostics& diagnostics) {
  return LeafPlaneSearch(surface, params, diagnostics).run();
}

}  // namespace planar_mapping::detail
