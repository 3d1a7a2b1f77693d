// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Whatever is asked of a map between frames, and whether it is copied, saved and loaded meanwhile,
// it goes on as if nothing had happened.
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "noisy_sequence.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {
namespace {

/// There and back again, so that patches that were left are touched once more.
const std::vector<int> kWalk = {0, 1, 2, 3, 3, 2, 1, 0};

void insert(PlanarMap& map, const test::View& view) {
  FrameObservation frame = view.frame();
  frame.noise = StereoNoise{0.25, view.camera.fx, 0.5};
  map.insert(frame);
}

/// Everything that can be told of a map, as numbers to be compared exactly.
std::vector<double> answersOf(const PlanarMap& map, const std::vector<Vector3>& places) {
  std::vector<double> answers;
  for (const Vector3& place : places) {
    answers.push_back(static_cast<double>(map.stateAt(place)));
    answers.push_back(map.occupancyAt(place));
  }
  for (const Cuboid& c : map.cuboids()) {
    for (int i = 0; i < 3; ++i) {
      answers.push_back(c.center[i]);
      answers.push_back(c.size[i]);
    }
    for (int i = 0; i < 4; ++i) answers.push_back(c.orientation.coeffs()[i]);
    answers.push_back(c.plane_id);
    answers.push_back(static_cast<double>(c.probability));
  }
  for (const MapPlane& p : map.planes()) {
    answers.push_back(p.id);
    answers.push_back(p.frames);
    answers.push_back(p.plane.signedDistance(Vector3::Zero()));
    answers.push_back(p.moments.weight());
    answers.push_back(p.rms());
  }
  answers.push_back(static_cast<double>(map.unknownCells()));
  return answers;
}

std::vector<Vector3> placesIn(Random& random) {
  std::vector<Vector3> places;
  for (int i = 0; i < 500; ++i) {
    places.emplace_back(random.uniform(-2.2, 2.2), random.uniform(-1.2, 5.2),
                        random.uniform(-0.2, 2.8));
  }
  return places;
}

TEST(MapState, GoesOnAsIfNothingHadBeenAsked) {
  const std::vector<test::View> views = test::noisyWalk(kWalk);
  Random random(4);
  const std::vector<Vector3> places = placesIn(random);
  std::vector<std::vector<std::uint8_t>> files;
  std::vector<std::vector<double>> answers;
  PlanarMap undisturbed;
  for (const test::View& view : views) {
    insert(undisturbed, view);
    files.push_back(undisturbed.serialize());
    answers.push_back(answersOf(PlanarMap(undisturbed), places));
  }
  ASSERT_GT(undisturbed.cuboidCount(), 30u);
  ASSERT_GT(undisturbed.unknownCells(), 1000u);

  for (int run = 0; run < 4; ++run) {
    PlanarMap map;
    for (std::size_t i = 0; i < views.size(); ++i) {
      insert(map, views[i]);
      for (int act = 0; act < 2; ++act) {
        const double draw = random.uniform(0.0, 6.0);
        if (draw < 1.0) {
          EXPECT_EQ(answersOf(map, places), answers[i]);
        } else if (draw < 2.0) {
          map = PlanarMap(map);
        } else if (draw < 3.0) {
          map = PlanarMap::deserialize(files[i].data(), files[i].size());
        } else if (draw < 4.0) {
          static_cast<void>(map.cuboidCount());
        } else if (draw < 5.0) {
          EXPECT_EQ(map.serialize(), files[i]);
        }
      }
    }
    EXPECT_EQ(map.serialize(), files.back()) << "run " << run;
    EXPECT_EQ(answersOf(map, places), answers.back()) << "run " << run;
  }
}

TEST(MapState, AnswersSeveralThreadsAtOnce) {
  const std::vector<test::View> views = test::noisyWalk(kWalk);
  Random random(5);
  const std::vector<Vector3> places = placesIn(random);
  PlanarMap map;
  for (const test::View& view : views) insert(map, view);
  const std::vector<std::uint8_t> file = map.serialize();
  const std::vector<double> expected = answersOf(PlanarMap(map), places);
  std::vector<std::vector<double>> answers(4);
  std::vector<std::vector<std::uint8_t>> files(answers.size());
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    threads.emplace_back([&, i] {
      if (i % 2 == 0) files[i] = map.serialize();
      answers[i] = answersOf(map, places);
      if (i % 2 == 1) files[i] = PlanarMap(map).serialize();
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const std::vector<double>& given : answers) EXPECT_EQ(given, expected);
  for (const std::vector<std::uint8_t>& given : files) EXPECT_EQ(given, file);
}

}  // namespace
}  // namespace planar_mapping
