// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/simulated_features.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace evaluation {
namespace {

SimulationParams smallParams(const std::string& scene, int frames) {
  SimulationParams params;
  params.scene = scene;
  params.frames = frames;
  params.width = 160;
  params.height = 120;
  params.clouds = false;
  params.colors = false;
  return params;
}

SimulatedFeatureParams exact() {
  SimulatedFeatureParams params;
  params.noise_px = 0.0;
  params.miss_fraction = 0.0;
  return params;
}

TEST(SimulatedFeatures, StandWhereTheirLandmarksAre) {
  SimulationParams params = smallParams("corridor", 8);
  params.step = 0.1;
  const Simulation simulation(params);
  SimulatedFeatures features(simulation, exact());
  for (std::size_t k = 0; k < simulation.size(); ++k) {
    const SimulatedFrame frame = simulation.frame(k);
    const std::vector<SimulatedFeature> seen = features.next(frame);
    ASSERT_GT(seen.size(), 200u);
    std::set<std::int64_t> tracks;
    for (const SimulatedFeature& one : seen) {
      EXPECT_EQ(one.feature.track, one.identity);
      EXPECT_TRUE(tracks.insert(one.feature.track).second);
      const Vector3 world = frame.T_world_camera * one.feature.position;
      EXPECT_NEAR((world - features.position(one.identity)).norm(), 0.0, 1e-4);
      EXPECT_LE(one.feature.sightings, static_cast<std::int32_t>(k) + 1);
    }
  }
}

TEST(SimulatedFeatures, KeepTheirTracksOverFrames) {
  SimulationParams params = smallParams("room", 6);
  params.path = Path::Standing;
  const Simulation simulation(params);
  SimulatedFeatures features(simulation, exact());
  const std::vector<SimulatedFeature> first = features.next(simulation.frame(0));
  std::vector<SimulatedFeature> last;
  for (std::size_t k = 1; k < 6; ++k) last = features.next(simulation.frame(k));
  ASSERT_GE(last.size(), first.size()) << "new ones come at the end";
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(last[i].feature.track, first[i].feature.track);
    EXPECT_EQ(last[i].feature.sightings, 6);
    EXPECT_EQ(last[i].feature.position, first[i].feature.position);
  }
}

TEST(SimulatedFeatures, MistakesHaveTheSharesAskedFor) {
  SimulatedFeatureParams wanted;
  wanted.per_frame = 2000;
  wanted.miss_fraction = 0.2;
  wanted.wrong_disparity_fraction = 0.1;
  wanted.wrong_track_fraction = 0.05;
  SimulationParams params = smallParams("room", 4);
  params.path = Path::Standing;
  const Simulation simulation(params);
  SimulatedFeatures features(simulation, wanted);
  SimulatedFeatures truth(simulation, [&wanted]() {
    SimulatedFeatureParams all = wanted;
    all.miss_fraction = 0.0;
    return all;
  }());
  for (std::size_t k = 0; k < simulation.size(); ++k) {
    const SimulatedFrame frame = simulation.frame(k);
    const std::vector<SimulatedFeature> seen = features.next(frame);
    const double count = static_cast<double>(seen.size());
    EXPECT_NEAR(count, 0.8 * static_cast<double>(truth.next(frame).size()), 0.05 * count);
    double far = 0, swapped = 0;
    std::set<std::int64_t> tracks;
    for (const SimulatedFeature& one : seen) {
      EXPECT_TRUE(tracks.insert(one.feature.track).second);
      EXPECT_EQ(one.wrong_track, one.feature.track != one.identity);
      swapped += one.wrong_track ? 1 : 0;
      const Vector3 p = frame.T_world_camera.inverse() * features.position(one.identity);
      const double d = params.sensor.baseline * simulation.params().camera().fx / p.z();
      const bool is_far = std::abs(static_cast<double>(one.feature.disparity) - d) > 1.5;
      EXPECT_TRUE(!is_far || one.wrong_disparity);
      far += one.wrong_disparity ? 1 : 0;
    }
    EXPECT_NEAR(far / count, 0.1, 0.025);
    EXPECT_NEAR(swapped / count, 0.05, 0.02);
  }
}

TEST(SimulatedFeatures, TheSameParametersGiveTheSameFeatures) {
  const Simulation simulation(smallParams("outdoor", 3));
  SimulatedFeatureParams params;
  params.wrong_track_fraction = 0.1;
  SimulatedFeatures a(simulation, params);
  SimulatedFeatures b(simulation, params);
  for (std::size_t k = 0; k < 3; ++k) {
    const SimulatedFrame frame = simulation.frame(k);
    const auto of_a = a.next(frame);
    const auto of_b = b.next(frame);
    ASSERT_EQ(of_a.size(), of_b.size());
    for (std::size_t i = 0; i < of_a.size(); ++i) {
      EXPECT_EQ(of_a[i].feature.track, of_b[i].feature.track);
      EXPECT_EQ(of_a[i].feature.position, of_b[i].feature.position);
    }
  }
}

TEST(SimulatedFeatures, ThingsThatLeaveTakeTheirFeaturesAlong) {
  SimulationParams params = smallParams("corridor", 10);
  params.path = Path::Standing;
  params.moving = true;
  const Simulation simulation(params);
  const auto onPerson = [&](const SimulatedFrame& frame, const SimulatedFeature& one) {
    const auto column = static_cast<std::size_t>(std::lround(one.feature.column));
    const auto row = static_cast<std::size_t>(std::lround(one.feature.row));
    const std::int32_t object = frame.truth.object[row * 160 + column];
    return object >= 0 && simulation.scene().objects[static_cast<std::size_t>(object)].name.rfind(
                              "person", 0) == 0;
  };
  SimulatedFeatureParams many = exact();
  many.per_frame = 2000;
  SimulatedFeatures features(simulation, many);
  const SimulatedFrame before = simulation.frame(0);
  std::set<std::int64_t> of_person;
  for (const SimulatedFeature& one : features.next(before))
    if (onPerson(before, one)) of_person.insert(one.feature.track);
  EXPECT_GT(of_person.size(), 5u);
  for (const SimulatedFeature& one : features.next(simulation.frame(9)))
    EXPECT_EQ(of_person.count(one.feature.track), 0u);
}

TEST(SimulatedFeatures, RefuseBadParametersAndFramesOutOfOrder) {
  const Simulation simulation(smallParams("room", 2));
  SimulatedFeatureParams params;
  params.per_frame = 0;
  EXPECT_THROW(SimulatedFeatures(simulation, params), ParameterError);
  params = SimulatedFeatureParams();
  params.miss_fraction = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(SimulatedFeatures(simulation, params), ParameterError);
  SimulatedFeatures features(simulation, SimulatedFeatureParams());
  EXPECT_THROW(features.next(SimulatedFrame()), InputError);
  features.next(simulation.frame(1));
  EXPECT_THROW(features.next(simulation.frame(0)), InputError);
  EXPECT_THROW(features.next(simulation.frame(1)), InputError);
  EXPECT_THROW(features.position(-1), InputError);
  EXPECT_THROW(features.position(1 << 20), InputError);
}

}  // namespace
}  // namespace evaluation
}  // namespace planar_mapping
