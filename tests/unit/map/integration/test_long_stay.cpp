// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <vector>

#include "noisy_sequence.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {
namespace {

/// Of places in the air of the room, the fraction that the map holds for occupied.
double phantoms(const PlanarMap& map, const test::Scene& scene) {
  constexpr double kStep = 0.07, kMargin = 0.16;  // metres; of surfaces and their noise
  std::size_t places = 0, occupied = 0;
  const test::SceneBox& room = scene.boxes.front();
  for (double z = room.low.z() + kMargin; z < room.high.z() - kMargin; z += kStep) {
    for (double y = room.low.y() + kMargin; y < room.high.y() - kMargin; y += kStep) {
      for (double x = room.low.x() + kMargin; x < room.high.x() - kMargin; x += kStep) {
        const Vector3 p(x, y, z);
        if (test::distanceToScene(scene, p) < kMargin) continue;
        ++places;
        occupied += map.stateAt(p) == CellState::Occupied ? 1 : 0;
      }
    }
  }
  return static_cast<double>(occupied) / static_cast<double>(places);
}

/// A robot that goes round in one room, with noise: it sees nothing new after the first rounds.
/// PLANAR_MAPPING_LONG_STAY=10000: so many frames.
TEST(LongStay, InOneRoomNothingGrows) {
  const test::Scene scene;
  test::StereoErrors errors;
  errors.noise_px = 0.5;
  errors.flying = 0.3;
  errors.pose_position = 0.005;
  errors.pose_angle = 0.003;
  Random random(11);
  PlanarMapParams params;
  params.approximation.resolution = 0.1;
  PlanarMap map(params);
  constexpr int kRound = 100, kKnown = 400;
  const char* asked = std::getenv("PLANAR_MAPPING_LONG_STAY");
  const int frames = asked != nullptr ? std::atoi(asked) : 1000;
  struct Round {
    double cuboids = 0.0, bytes = 0.0, phantoms = 0.0;
  };
  std::vector<Round> rounds;
  for (int i = 0; i < frames; ++i) {
    const double a = 2.0 * M_PI * i / kRound;
    const Pose pose = test::lookFrom({0.8 * std::cos(a), 1.2 + 0.6 * std::sin(a), 1.1}, a, 0.15);
    const test::View view = test::lookNoisy(scene, pose, errors, random, 300, i);
    FrameObservation frame = view.frame();
    frame.noise = StereoNoise{errors.baseline, scene.camera.fx, 0.5};
    map.insert(frame);
    if (i % kRound == kRound - 1)
      rounds.push_back({static_cast<double>(map.cuboids().size()),
                        static_cast<double>(map.serialize().size()), phantoms(map, scene)});
  }
  constexpr std::size_t kFirst = kKnown / kRound;
  ASSERT_GT(rounds.size(), kFirst);
  const Round& known = rounds[kFirst - 1];
  Round later;  // means
  for (std::size_t i = kFirst; i < rounds.size(); ++i) {
    const double share = 1.0 / static_cast<double>(rounds.size() - kFirst);
    later.cuboids += share * rounds[i].cuboids;
    later.phantoms += share * rounds[i].phantoms;
  }
  double before = 0.0;  // the number of cuboids moves by some per cent from round to round
  for (std::size_t i = 0; i < kFirst; ++i) before += rounds[i].cuboids / kFirst;
  EXPECT_LT(later.cuboids, 1.05 * before);
  EXPECT_LE(later.phantoms, known.phantoms);
  EXPECT_LT(known.phantoms, 0.005);
  RecordProperty("cuboids",
                 std::to_string(known.cuboids) + " > " + std::to_string(rounds.back().cuboids));
  RecordProperty("bytes",
                 std::to_string(known.bytes) + " > " + std::to_string(rounds.back().bytes));
  RecordProperty("phantoms",
                 std::to_string(known.phantoms) + " > " + std::to_string(rounds.back().phantoms));
  // What the file grows by are the poses of the trajectory.
  constexpr double kBytesOfPose = 10.0;
  EXPECT_LT(rounds.back().bytes - known.bytes, kBytesOfPose * (frames - kKnown));
}

}  // namespace
}  // namespace planar_mapping
