// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause

// Planes and cuboids of fixed simulated frames, compared with simulated_scenes.txt beside this
// file. `golden_scenes_slow --update` rewrites that file; the commit says why it moved.
// Numbers are compared with tolerances, as instruction sets differ in the last digits.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "evaluation/simulation/simulation.h"
#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping {
namespace {

constexpr int kMinInliers = 1000;
constexpr double kCoefficientTolerance = 0.02;
constexpr double kCountTolerance = 0.03;  ///< of the count, at least 2

const std::string kGoldenFile =
    std::string(PLANAR_MAPPING_SOURCE_DIR) + "/tests/golden/simulated_scenes.txt";

struct Line {
  std::string name;
  std::vector<double> counts;
  std::vector<double> coefficients;
};

/// Planes of the truth that many measured pixels show, and how many of those were found.
Line check(const evaluation::Simulation& simulation, const evaluation::SimulatedFrame& frame,
           const PlaneSet& found, const std::string& name) {
  std::map<std::uint32_t, int> shown;
  for (std::size_t i = 0; i < frame.labels.size(); ++i)
    if (frame.labels[i] > 0 && frame.disparity[i] > 0.0f) ++shown[frame.labels[i]];
  double large = 0, recovered = 0;
  for (const auto& [label, pixels] : shown) {
    if (pixels < 6 * kMinInliers) continue;
    ++large;
    const Plane truth = transformed(simulation.planes()[label - 1], frame.T_world_camera.inverse());
    for (const PlaneSegment& segment : found.planes) {
      int common = 0;
      for (const int i : segment.inliers)
        common += frame.labels[static_cast<std::size_t>(i)] == label ? 1 : 0;
      if (truth.normal.dot(segment.plane.normal) > 0.999 && 2 * common > pixels) {
        ++recovered;
        break;
      }
    }
  }
  return {name + " large_planes shown found", {large, recovered}, {}};
}

std::vector<Line> resultsOf(const std::string& scene, std::size_t index) {
  evaluation::SimulationParams params;
  params.scene = scene;
  params.frames = 12;
  params.yaw = 0.2;
  params.sensor.noise_px = 0.1;  // the figures on record are of it
  const evaluation::Simulation simulation(params);
  const evaluation::SimulatedFrame frame = simulation.frame(index);
  const PointsView points(frame.xyz.data(), static_cast<std::uint32_t>(params.width),
                          static_cast<std::uint32_t>(params.height), 3);
  MultiPlaneParams search;
  search.min_inliers = kMinInliers;
  const PlaneSet found = findPlanes(points, nullptr, search);

  const std::string name = scene + " " + std::to_string(index);
  std::vector<Line> lines;
  lines.push_back(check(simulation, frame, found, name));
  lines.push_back({name + " planes", {static_cast<double>(found.planes.size())}, {}});
  for (std::size_t i = 0; i < found.planes.size() && i < 4; ++i) {
    const Vector4 c = found.planes[i].plane.coefficients();
    lines.push_back({name + " plane " + std::to_string(i),
                     {static_cast<double>(found.planes[i].inliers.size())},
                     {c[0], c[1], c[2], c[3]}});
  }
  for (const Profile profile : {Profile::Paper, Profile::Compact}) {
    PlanarMapParams map_params = PlanarMapParams::of(profile);
    map_params.unknown_space = false;
    PlanarMap map(map_params);
    FrameObservation observation;
    observation.T_world_sensor = frame.T_world_camera;
    observation.points = points;
    observation.planes = &found.planes;
    map.insert(observation);
    const std::vector<Cuboid>& cuboids = map.cuboids();
    const auto planar = std::count_if(cuboids.begin(), cuboids.end(),
                                      [](const Cuboid& c) { return c.plane_id >= 0; });
    lines.push_back(
        {name + (profile == Profile::Paper ? " paper" : " compact") + " cuboids planar all",
         {static_cast<double>(planar), static_cast<double>(cuboids.size())},
         {}});
  }
  return lines;
}

std::vector<Line> allResults() {
  std::vector<Line> lines;
  for (const std::string& scene : evaluation::sceneNames())
    for (const std::size_t frame : {std::size_t{1}, std::size_t{6}})
      for (const Line& line : resultsOf(scene, frame)) lines.push_back(line);
  return lines;
}

std::string textOf(const Line& line) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << line.name << " :";
  for (const double count : line.counts) out << ' ' << std::llround(count);
  out << " :";
  for (const double value : line.coefficients) {
    char text[32];
    std::snprintf(text, sizeof text, " %.3f", value);
    out << text;
  }
  return out.str();
}

std::vector<double> numbersOf(const std::string& text) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  std::vector<double> values;
  for (double value = 0; in >> value;) values.push_back(value);
  return values;
}

Line lineOf(const std::string& text) {
  const std::size_t first = text.find(" :");
  const std::size_t second = text.find(" :", first + 1);
  if (second == std::string::npos) return {text, {}, {}};
  return {text.substr(0, first), numbersOf(text.substr(first + 2, second - first - 2)),
          numbersOf(text.substr(second + 2))};
}

TEST(SimulatedScenes, PlanesAndCuboidsAreThoseOnRecord) {
  std::ifstream in(kGoldenFile);
  ASSERT_TRUE(in) << kGoldenFile << " is missing: run with --update";
  std::vector<Line> golden;
  for (std::string text; std::getline(in, text);)
    if (!text.empty() && text[0] != '#') golden.push_back(lineOf(text));
  const std::vector<Line> results = allResults();
  ASSERT_EQ(results.size(), golden.size());
  for (std::size_t i = 0; i < results.size(); ++i) {
    EXPECT_EQ(results[i].name, golden[i].name);
    ASSERT_EQ(results[i].counts.size(), golden[i].counts.size()) << textOf(results[i]);
    ASSERT_EQ(results[i].coefficients.size(), golden[i].coefficients.size());
    for (std::size_t k = 0; k < results[i].counts.size(); ++k)
      EXPECT_NEAR(results[i].counts[k], golden[i].counts[k],
                  std::max(2.0, kCountTolerance * golden[i].counts[k]))
          << textOf(results[i]);
    for (std::size_t k = 0; k < results[i].coefficients.size(); ++k)
      EXPECT_NEAR(results[i].coefficients[k], golden[i].coefficients[k], kCoefficientTolerance)
          << textOf(results[i]);
  }
}

void update() {
  std::ofstream out(kGoldenFile);
  out << "# Written by golden_scenes_slow --update; name : counts : coefficients\n";
  for (const Line& line : allResults()) out << textOf(line) << '\n';
}

}  // namespace
}  // namespace planar_mapping

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--update") {
      planar_mapping::update();
      return 0;
    }
  }
  return RUN_ALL_TESTS();
}
