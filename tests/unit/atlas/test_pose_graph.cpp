// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/pose_graph.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "planar_mapping/atlas/graph_solver.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"

namespace planar_mapping {
namespace {

Matrix6 covarianceOf(double metres, double radians) {
  Vector6 variances;
  variances << Vector3::Constant(metres * metres), Vector3::Constant(radians * radians);
  return variances.asDiagonal();
}

Pose poseOf(const Vector3& position, const Vector3& turn = Vector3::Zero()) {
  Vector6 step;
  step << position, turn;
  return motionStep(step);
}

Pose noise(Random& random, double metres, double radians) {
  Vector6 step;
  for (int i = 0; i < 6; ++i) step[i] = random.normal() * (i < 3 ? metres : radians);
  return motionStep(step);
}

void addSubmaps(AtlasData& data, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    Submap submap;
    submap.id = static_cast<std::int64_t>(data.submaps.size());
    submap.component = submap.id;
    data.submaps.push_back(submap);
  }
}

Link& addLink(AtlasData& data, LinkKind kind, std::size_t from, std::size_t to,
              const Pose& T_to_from, const Matrix6& covariance) {
  Link link;
  link.id = static_cast<std::int64_t>(data.links.size());
  link.kind = kind;
  link.from_submap = static_cast<std::int64_t>(from);
  link.to_submap = static_cast<std::int64_t>(to);
  link.T_to_from = T_to_from;
  link.covariance = covariance;
  if (kind == LinkKind::Loop) {  // every one by keyframes of its own
    link.from_keyframe = 2 * link.id;
    link.to_keyframe = 2 * link.id + 1;
  }
  data.links.push_back(link);
  return data.links.back();
}

constexpr double kChainMetres = 0.01;
constexpr double kChainRadians = 0.002;
constexpr double kLoopMetres = 0.003;
constexpr double kLoopRadians = 0.001;

/// Rounds of 25 submaps on a circle of 8 m, a loop to the round before from every second one.
struct Walk {
  explicit Walk(std::size_t submaps, double chain_metres = kChainMetres,
                double chain_radians = kChainRadians) {
    Random random(7);
    addSubmaps(data, submaps);
    for (std::size_t i = 0; i < submaps; ++i) {
      const double angle = 2.0 * M_PI * static_cast<double>(i) / kRound;
      truth.push_back(poseOf({8.0 * std::cos(angle), 8.0 * std::sin(angle), 0.0},
                             {0.0, 0.0, std::remainder(angle, 2.0 * M_PI)}));
    }
    for (std::size_t i = 1; i < submaps; ++i) {
      add(LinkKind::Neighbour, i - 1, i, noise(random, chain_metres, chain_radians),
          covarianceOf(chain_metres, chain_radians));
    }
    for (std::size_t i = kRound; i < submaps; i += 2) {
      add(LinkKind::Loop, i - kRound, i, noise(random, kLoopMetres, kLoopRadians),
          covarianceOf(kLoopMetres, kLoopRadians));
    }
  }
  Link& add(LinkKind kind, std::size_t from, std::size_t to, const Pose& error,
            const Matrix6& covariance) {
    return addLink(data, kind, from, to, error * truth[to].inverse() * truth[from], covariance);
  }
  /// A wrong link at a random place: at least half a metre off.
  void addWrong(Random& random) {
    const auto count = static_cast<std::uint32_t>(truth.size());
    const std::size_t from = random.below(count);
    std::size_t to = random.below(count);
    while (to == from) to = random.below(count);
    Vector3 shift;
    do {
      shift = Vector3(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-2, 2));
    } while (shift.norm() < 0.5);
    const Vector3 turn(0.1 * random.normal(), 0.1 * random.normal(), random.uniform(-3, 3));
    add(LinkKind::Loop, from, to, poseOf(shift, turn), covarianceOf(kLoopMetres, kLoopRadians));
  }
  /// Six that agree with each other: they take a place for the one a metre or more beside it.
  void addAgreeing(Random& random, std::size_t from, std::size_t to) {
    const Vector3 shift = Vector3(random.uniform(-1, 1), random.uniform(-1, 1), 0.0).normalized() *
                          random.uniform(1.0, 3.0);
    for (int i = 0; i < 6; ++i) {
      const std::size_t a = from + static_cast<std::size_t>(i % 2);
      const std::size_t b = to + static_cast<std::size_t>(i / 2);
      const Pose moved = poseOf(shift);  // of the world that `from` is in
      addLink(data, LinkKind::Loop, a, b,
              noise(random, kLoopMetres, kLoopRadians) * truth[b].inverse() * moved * truth[a],
              covarianceOf(kLoopMetres, kLoopRadians));
    }
  }

  static constexpr std::size_t kRound = 25;
  AtlasData data;
  std::vector<Pose> truth;
};

double largestError(const Walk& walk) {
  double largest = 0.0;
  for (std::size_t i = 0; i < walk.truth.size(); ++i) {
    const Pose is =
        walk.data.submaps[0].T_world_submap.inverse() * walk.data.submaps[i].T_world_submap;
    const Pose should = walk.truth[0].inverse() * walk.truth[i];
    largest = std::max(largest, (is.translation() - should.translation()).norm());
  }
  return largest;
}

void expectSamePoses(const AtlasData& a, const AtlasData& b, double tolerance) {
  ASSERT_EQ(a.submaps.size(), b.submaps.size());
  for (std::size_t i = 0; i < a.submaps.size(); ++i) {
    EXPECT_LE((a.submaps[i].T_world_submap.matrix() - b.submaps[i].T_world_submap.matrix())
                  .cwiseAbs()
                  .maxCoeff(),
              tolerance)
        << i;
    EXPECT_EQ(a.submaps[i].component, b.submaps[i].component);
  }
}

TEST(PoseGraph, ASquareWithAnErrorOfScaleCloses) {
  AtlasData data;
  addSubmaps(data, 4);
  // Ten metres a side, a quarter turn at each corner; measured two per cent too long on one side.
  const Matrix6 covariance = covarianceOf(0.2, 0.01);
  for (std::size_t i = 1; i < 4; ++i) {
    const double length = i == 2 ? 10.2 : 10.0;
    const Pose T_from_to = poseOf({length, 0.0, 0.0}, {0.0, 0.0, M_PI / 2});
    addLink(data, LinkKind::Neighbour, i - 1, i, T_from_to.inverse(), covariance);
  }
  const Pose T_3_0 = poseOf({10.0, 0.0, 0.0}, {0.0, 0.0, M_PI / 2});
  addLink(data, LinkKind::Loop, 0, 3, T_3_0, covarianceOf(0.003, 0.001));
  const PoseGraphResult result = solvePoseGraph(data);
  EXPECT_EQ(result.moved, (std::vector<std::int64_t>{1, 2, 3}));
  const Pose is = data.submaps[3].T_world_submap.inverse() * data.submaps[0].T_world_submap;
  EXPECT_LT((is.translation() - T_3_0.translation()).norm(), 0.001);
  for (const Link& link : data.links) EXPECT_EQ(link.state, LinkState::Used);
  for (const Submap& submap : data.submaps) EXPECT_EQ(submap.component, 0);
  EXPECT_GT(data.links[1].residual, 0.1);
  EXPECT_TRUE(data.submaps[0].T_world_submap.matrix().isIdentity(0.0));
}

TEST(PoseGraph, JacobiansAreThoseOfDifferences) {
  Random random(3);
  for (int draw = 0; draw < 50; ++draw) {
    const Pose a = noise(random, 3.0, 0.8);
    const Pose b = noise(random, 3.0, 0.8);
    const Pose T_from_to = (noise(random, 0.3, draw < 10 ? 1e-7 : 0.3) * b.inverse() * a).inverse();
    Matrix6 by_a;
    Matrix6 by_b;
    detail::linkError(T_from_to, a, b, &by_a, &by_b);
    const double h = 1e-6;
    for (int i = 0; i < 6; ++i) {
      Vector6 step = Vector6::Zero();
      step[i] = h;
      const Pose up = motionStep(step);
      const Pose down = motionStep(-step);
      const Vector6 of_a = (detail::linkError(T_from_to, a * up, b, nullptr, nullptr) -
                            detail::linkError(T_from_to, a * down, b, nullptr, nullptr)) /
                           (2.0 * h);
      const Vector6 of_b = (detail::linkError(T_from_to, a, b * up, nullptr, nullptr) -
                            detail::linkError(T_from_to, a, b * down, nullptr, nullptr)) /
                           (2.0 * h);
      EXPECT_LT((of_a - by_a.col(i)).norm(), 1e-6);
      EXPECT_LT((of_b - by_b.col(i)).norm(), 1e-6);
    }
  }
}

TEST(PoseGraph, WithoutALoopNothingMoves) {
  AtlasData data;
  addSubmaps(data, 20);
  for (std::size_t i = 1; i < 20; ++i) {
    addLink(data, LinkKind::Neighbour, i - 1, i, Pose::Identity(), covarianceOf(0.01, 0.01));
  }
  EXPECT_TRUE(solvePoseGraph(data).moved.empty());
  for (const Submap& submap : data.submaps) EXPECT_EQ(submap.component, 0);
}

TEST(PoseGraph, ATaskSolvedTwiceMovesNothing) {
  Walk walk(100);
  EXPECT_EQ(solvePoseGraph(walk.data).moved.size(), 99u);
  const AtlasData before = walk.data;
  EXPECT_TRUE(solvePoseGraph(walk.data).moved.empty());
  expectSamePoses(walk.data, before, 0.0);
}

TEST(PoseGraph, LoopsTakeTheDriftAway) {
  Walk without(100);
  without.data.links.resize(99);
  Walk walk(100);
  solvePoseGraph(without.data);
  solvePoseGraph(walk.data);
  EXPECT_LT(largestError(walk), 0.5 * largestError(without));
}

/// Poses with so many wrong links, single ones and groups of six, are those without them.
void expectNoneSurvives(const Walk& clean, int single, int groups, std::uint64_t seed) {
  Walk walk = clean;
  Walk noisy = clean;
  solvePoseGraph(walk.data);
  const std::size_t right = noisy.data.links.size();
  Random random(seed);
  for (int i = 0; i < single; ++i) noisy.addWrong(random);
  for (int i = 0; i < groups; ++i) {
    const std::size_t from = random.below(40);
    noisy.addAgreeing(random, from, from + 10 + random.below(45));
  }
  solvePoseGraph(noisy.data);
  for (std::size_t i = 0; i < noisy.data.links.size(); ++i) {
    EXPECT_EQ(noisy.data.links[i].state, i < right ? LinkState::Used : LinkState::Rejected) << i;
  }
  expectSamePoses(walk.data, noisy.data, 1e-9);
}

TEST(PoseGraph, OfAThousandWrongLinksNoneSurvives) {
  expectNoneSurvives(Walk(100), 1000, 0, 11);
}

TEST(PoseGraph, GroupsOfWrongLinksThatAgreeDoNotSurvive) {
  expectNoneSurvives(Walk(100), 500, 80, 12);
}

TEST(PoseGraph, OfManyLinksBetweenTwoSubmapsTheRightOnesAreUsed) {
  Random random(3);
  Walk walk(2 * Walk::kRound);
  const std::size_t first = walk.data.links.size();
  for (int i = 0; i < 40; ++i) {
    const Pose error = i % 4 == 0 ? poseOf({1.0, 0.0, 0.0}) : Pose(Pose::Identity());
    walk.add(LinkKind::Loop, 1, Walk::kRound + 1, error * noise(random, kLoopMetres, kLoopRadians),
             covarianceOf(kLoopMetres * (i + 1), kLoopRadians));
  }
  solvePoseGraph(walk.data);
  for (std::size_t i = 0; i < 40; ++i)
    EXPECT_EQ(i % 4 == 0 ? LinkState::Rejected : LinkState::Used, walk.data.links[first + i].state)
        << i;
  EXPECT_LT(largestError(walk), 0.05);
}

TEST(PoseGraph, WrongLinksDoNotSurviveMetresOfDrift) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    expectNoneSurvives(Walk(100, 0.03, 0.006), 1000, 16, seed);
  }
}

/// Two chains, and links between them that see the second one shifted by so much.
struct TwoParts {
  TwoParts() {
    addSubmaps(data, 12);
    for (std::size_t i = 1; i < 12; ++i) {
      if (i == 6) continue;
      addLink(data, LinkKind::Neighbour, i - 1, i, poseOf({-1.0, 0.0, 0.0}),
              covarianceOf(kChainMetres, kChainRadians));
    }
  }
  void join(int links, double shift) {
    for (int i = 0; i < links; ++i) {
      const auto step = static_cast<std::size_t>(i);
      addLink(data, LinkKind::Loop, step, 6 + step,
              noise(random, kLoopMetres, kLoopRadians) * poseOf({0.0, shift, 0.0}),
              covarianceOf(kLoopMetres, kLoopRadians));
    }
  }
  std::size_t used() const {
    std::size_t count = 0;
    for (const Link& link : data.links) {
      if (link.kind == LinkKind::Loop && link.state == LinkState::Used) ++count;
    }
    return count;
  }
  Random random{5};
  AtlasData data;
};

TEST(PoseGraph, TwoLinksThatAgreeJoinComponents) {
  TwoParts parts;
  parts.join(2, 3.0);
  solvePoseGraph(parts.data);
  EXPECT_EQ(parts.used(), 2u);
  EXPECT_EQ(parts.data.submaps[11].component, 0);
  EXPECT_NEAR(parts.data.submaps[6].T_world_submap.translation().y(), -3.0, 0.05);
}

TEST(PoseGraph, OneLinkJoinsOnlyWithVeryMuchEvidence) {
  TwoParts parts;
  parts.join(1, 3.0);
  solvePoseGraph(parts.data);
  EXPECT_EQ(parts.used(), 0u);
  EXPECT_EQ(parts.data.submaps[11].component, 6);
  Link& link = parts.data.links.back();
  link.evidence.inliers = 100;
  link.evidence.agreement = 0.95;
  solvePoseGraph(parts.data);
  EXPECT_EQ(parts.used(), 1u);
  EXPECT_EQ(parts.data.submaps[11].component, 0);
}

TEST(PoseGraph, TheSameKeyframeTwiceIsOnePieceOfEvidence) {
  TwoParts parts;
  parts.join(2, 3.0);
  auto& links = parts.data.links;
  links.back().to_keyframe = links[links.size() - 2].to_keyframe;
  solvePoseGraph(parts.data);
  EXPECT_EQ(parts.used(), 0u);
}

TEST(PoseGraph, SixThatAgreeAgainstSixOthersJoinNothing) {
  TwoParts parts;
  parts.join(6, 3.0);
  parts.join(6, 4.0);
  solvePoseGraph(parts.data);
  EXPECT_EQ(parts.used(), 0u);
  EXPECT_EQ(parts.data.submaps[0].component, 0);
  EXPECT_EQ(parts.data.submaps[11].component, 6);
  parts.join(3, 3.0);
  solvePoseGraph(parts.data);
  EXPECT_EQ(parts.used(), 9u);
  EXPECT_EQ(parts.data.submaps[11].component, 0);
}

TEST(PoseGraph, ARefusedLoopLeavesNoTrace) {
  TwoParts never;
  never.join(2, 3.0);
  TwoParts refused = never;
  // One that joins far ends of a chain, and one without which the components are apart.
  addLink(refused.data, LinkKind::Loop, 0, 5, poseOf({-5.02, 0.0, 0.0}),
          covarianceOf(0.003, 0.001));
  solvePoseGraph(never.data);
  const PoseGraphResult with = solvePoseGraph(refused.data);
  EXPECT_FALSE(with.moved.empty());
  EXPECT_NE(refused.data.submaps[5].T_world_submap.translation().x(),
            never.data.submaps[5].T_world_submap.translation().x());
  refused.data.links.back().state = LinkState::Refused;
  EXPECT_FALSE(solvePoseGraph(refused.data).moved.empty());
  expectSamePoses(never.data, refused.data, 0.0);
  for (std::size_t i = 0; i < never.data.links.size(); ++i) {
    EXPECT_EQ(never.data.links[i].residual, refused.data.links[i].residual);
    EXPECT_EQ(never.data.links[i].state, refused.data.links[i].state);
  }
  EXPECT_EQ(refused.data.links.back().state, LinkState::Refused);

  TwoParts apart;
  solvePoseGraph(apart.data);
  for (Link& link : refused.data.links) {
    if (link.kind == LinkKind::Loop) link.state = LinkState::Refused;
  }
  solvePoseGraph(refused.data);
  expectSamePoses(apart.data, refused.data, 0.0);
}

TEST(PoseGraph, BadLinksAreNamed) {
  const auto message = [](const auto& spoil) {
    AtlasData data;
    addSubmaps(data, 2);
    spoil(addLink(data, LinkKind::Loop, 0, 1, Pose::Identity(), covarianceOf(0.1, 0.1)));
    try {
      solvePoseGraph(data);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(message([](Link& link) { link.to_submap = 9; }).find("link 0"), std::string::npos);
  EXPECT_NE(message([](Link& link) { link.to_submap = 0; }).find("link 0"), std::string::npos);
  EXPECT_NE(message([](Link& link) { link.covariance.setZero(); }).find("positive definite"),
            std::string::npos);
  EXPECT_NE(
      message([](Link& link) { link.T_to_from.translation().x() = std::nan(""); }).find("link 0"),
      std::string::npos);
}

TEST(PoseGraph, TimeOfAHundredAndAThousandSubmaps) {
  for (const auto& [submaps, limit_ms] :
       {std::pair<std::size_t, double>{100, 100.0}, {1000, 10000.0}}) {
    Walk walk(submaps);
    const PoseGraphResult result = solvePoseGraph(walk.data);
    std::printf("%zu submaps, %zu links: %.1f ms\n", submaps, walk.data.links.size(), result.ms);
    EXPECT_LT(largestError(walk), 0.3);
#ifndef PLANAR_MAPPING_SANITIZED
    EXPECT_LT(result.ms, limit_ms);
#endif
  }
}

}  // namespace
}  // namespace planar_mapping
