// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/runs/evaluation_run.h"
#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/sequence_source.h"
#include "temporary_directory.h"

namespace planar_mapping::tools {
namespace {

const std::string kConfigurations = std::string(PLANAR_MAPPING_SOURCE_DIR) + "/config/";

/// The map of `planar_map run`.
std::vector<std::uint8_t> runMap(const Configuration& read, Configuration configuration) {
  SequenceSource source(read);
  Pipeline pipeline(std::move(configuration));
  if (const std::optional<ImagesUp> up = source.meanUp()) pipeline.setMeanUp(*up);
  while (std::optional<Frame> frame = source.next()) pipeline.process(*frame);
  return pipeline.map().serialize();
}

struct Case {
  const char* name;
  const char* scene;
  const char* configuration;
  std::vector<std::string> assignments;
};

class EvaluatedMaps : public ::testing::TestWithParam<Case> {};

TEST_P(EvaluatedMaps, AreThoseOfARunAtEveryCellSize) {
  const TemporaryDirectory directory;
  evaluation::SimulationParams scene;
  scene.scene = GetParam().scene;
  scene.frames = 3;
  scene.step = 0.1;
  scene.seed = 3;
  scene.images = std::string(GetParam().configuration) == "stereo_indoor";
  scene.clouds = !scene.images;
  scene.right_exposure = 1.05;
  evaluation::writeSequence(evaluation::Simulation(scene), directory.path(), true);
  const auto load = [&](std::optional<double> cell) {
    std::vector<std::string> assignments = GetParam().assignments;
    if (cell) {
      for (const char* stage : {"kl_occupancy", "planar_cuboid_approximation"})
        assignments.push_back(std::string(stage) + ".resolution_m=" + std::to_string(*cell));
    }
    StageTable table;
    registerBuiltinStages(table);
    ConfigurationOverrides overrides;
    overrides.assignments = assignments;
    Configuration configuration =
        loadConfiguration(kConfigurations + GetParam().configuration + ".yaml", table, overrides);
    configuration.inputs = {directory.path()};
    configuration.frames.last = 3;
    return configuration;
  };
  PlaceOptions options;
  options.frames_per_place = 0;
  options.check_step = std::numeric_limits<std::size_t>::max();  // no point is held back
  const std::unique_ptr<Place> place = recordedPlaces(options, [&]() { return load({}); })->next();
  PlanarRuns runs(*place);
  for (const double cell : {0.1, 0.2, 0.3}) {
    const PlanarMap map = runs.make(load(cell)).map;
    EXPECT_GT(map.cuboids().size(), 3u);
    EXPECT_TRUE(runMap(load(cell), load(cell)) == map.serialize()) << cell;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Inputs, EvaluatedMaps,
    ::testing::Values(Case{"stereo", "white", "stereo_indoor", {}},
                      Case{"clouds", "corridor", "pcd_sequence", {}},
                      Case{"automatic_threshold",
                           "corridor",
                           "pcd_sequence",
                           {"multi_plane_segmentation.distance_threshold_m=auto"}}),
    [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace planar_mapping::tools
