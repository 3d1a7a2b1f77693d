// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// The way of a frame through front-end, motion and mapping, watched by stages that only take notes.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/pipeline.h"

namespace planar_mapping {
namespace {

/// What the stages of the running test saw; a test starts with it empty.
std::vector<std::string> seen_by_stages;
std::vector<std::string> begun_by_stages;

template <StageKind kKindOfThis>
class Spy : public Stage {
 public:
  static constexpr StageKind kKind = kKindOfThis;
  explicit Spy(std::string name) : name_(std::move(name)) {}
  void declare(ParameterTable& table) override {
    table.text("skip", skip_, "reason given to each frame");
  }
  void adapt(const CloudScale& scale) override {
    seen_by_stages.push_back(name_ + " adapts to " + std::to_string(scale.points) +
                             (scale.stereo ? " of stereo" : ""));
  }
  void begin(const Frame& frame) override {
    begun_by_stages.push_back(name_ + " " + std::to_string(frame.number));
  }
  void process(Frame& frame) override {
    seen_by_stages.push_back(name_ + " " + std::to_string(frame.number));
    if (kKind == StageKind::Images) {
      frame.cloud = pcl::make_shared<FrameCloud>();
      for (int i = 0; i < 3; ++i) frame.cloud->push_back({0.1f * static_cast<float>(i), 0, 1});
    }
    if (kKind == StageKind::Motion) frame.T_world_sensor.translation().x() = 7.0;
    if (!skip_.empty()) frame.skip_reason = skip_;
  }
  bool usesKeyFeatures(const Frame& frame) const override {
    return kKind == StageKind::Motion && !frame.given_pose;
  }

 private:
  std::string name_;
  std::string skip_;
};

template <StageKind kKind>
void add(StageTable& table, const std::string& name) {
  table.add({name, "takes notes", kKind,
             [name]() -> std::unique_ptr<Stage> { return std::make_unique<Spy<kKind>>(name); }});
}

Pipeline parsedPipeline(const std::string& settings = "") {
  seen_by_stages.clear();
  begun_by_stages.clear();
  StageTable table;
  add<StageKind::Images>(table, "images");
  add<StageKind::Features>(table, "features");
  add<StageKind::Motion>(table, "motion");
  add<StageKind::Points>(table, "points");
  add<StageKind::Map>(table, "map");
  ConfigurationOverrides overrides;
  if (!settings.empty()) overrides.assignments = {settings};
  return Pipeline(
      parseConfiguration("version: 1\nstages:\n  - stage: images\n  - stage: features\n"
                         "  - stage: motion\n  - stage: points\n  - stage: map\n",
                         "test", table, overrides));
}

Frame frameOf(std::size_t number, std::uint8_t gray = 0) {
  Frame frame;
  frame.number = number;
  frame.source = "test";
  frame.cloud = pcl::make_shared<FrameCloud>();
  frame.camera = PinholeCamera();
  frame.camera->fx = frame.camera->fy = 100.0;
  frame.baseline = 0.1;
  frame.images.left.width = 4;
  frame.images.left.height = 1;
  frame.images.left.channels = 1;
  frame.images.left.pixels.assign(4, gray > 0 ? gray : static_cast<std::uint8_t>(10 + number));
  return frame;
}

using Notes = std::vector<std::string>;

TEST(Sections, StagesAreAdaptedWhenSomethingIsKnownAndOnce) {
  Pipeline pipeline = parsedPipeline();
  Frame first = frameOf(0);
  pipeline.process(first);
  EXPECT_EQ(
      (Notes{"images adapts to 0 of stereo", "images 0", "features adapts to 3 of stereo",
             "features 0", "motion adapts to 3 of stereo", "motion 0",
             "points adapts to 3 of stereo", "map adapts to 3 of stereo", "points 0", "map 0"}),
      seen_by_stages);
  EXPECT_EQ((Indices{0, 1, 2}), first.indices);
  EXPECT_EQ(7.0, first.T_world_sensor.translation().x());
  seen_by_stages.clear();
  Frame second = frameOf(1);
  pipeline.process(second);
  EXPECT_EQ((Notes{"images 1", "features 1", "motion 1", "points 1", "map 1"}), seen_by_stages);
}

TEST(Sections, SkippedFrameEndsAtTheStageThatSaysSo) {
  Pipeline pipeline = parsedPipeline("motion.skip=lost");
  Frame frame = frameOf(0);
  const FrameReport report = pipeline.process(frame);
  EXPECT_EQ("motion 0", seen_by_stages.back());
  EXPECT_EQ("lost", report.skip_reason);
  EXPECT_EQ(5u, report.stage_ms.size());
  EXPECT_EQ(0.0, report.stage_ms[4]);
}

TEST(Sections, FrameThatCannotBeReadReachesNoStage) {
  Pipeline pipeline = parsedPipeline();
  Frame frame = frameOf(0);
  frame.skip_reason = "damaged";
  EXPECT_EQ("damaged", pipeline.process(frame).skip_reason);
  EXPECT_TRUE(seen_by_stages.empty());
}

TEST(Sections, FrontEndAndTheRestInTwoPipelinesEqualOne) {
  Pipeline front = parsedPipeline();
  Frame frame = frameOf(0);
  const FrameReport half = front.processFrontEnd(frame);
  EXPECT_TRUE(frame.front_end_done);
  EXPECT_TRUE(half.skip_reason.empty());
  EXPECT_EQ((Notes{"images adapts to 0 of stereo", "images 0", "features adapts to 3 of stereo",
                   "features 0"}),
            seen_by_stages);
  Pipeline back = parsedPipeline();
  back.process(frame);
  EXPECT_EQ((Notes{"motion adapts to 3 of stereo", "motion 0", "points adapts to 3 of stereo",
                   "map adapts to 3 of stereo", "points 0", "map 0"}),
            seen_by_stages);
}

TEST(Sections, FramesCanBeSensedAheadOfTheMap) {
  Pipeline pipeline = parsedPipeline();
  EXPECT_FALSE(pipeline.hasBegun());
  Frame first = frameOf(0);
  pipeline.sense(first);
  EXPECT_TRUE(pipeline.hasBegun());
  EXPECT_EQ("points 0", seen_by_stages.back());
  EXPECT_EQ(nullptr, first.map);
  seen_by_stages.clear();
  Frame next = frameOf(1);
  pipeline.prepare(next);
  EXPECT_EQ("images 1", seen_by_stages.back());
  pipeline.sense(next);
  EXPECT_EQ("", pipeline.integrate(first).skip_reason);
  EXPECT_EQ("", pipeline.integrate(next).skip_reason);
  EXPECT_EQ((Notes{"images 1", "features 1", "motion 1", "points 1", "map 0", "map 1"}),
            seen_by_stages);
  EXPECT_EQ(&pipeline.map(), next.map);
  EXPECT_EQ((Notes{"images 0", "features 0", "images 1", "features 1"}), begun_by_stages);
}

/// A given pose needs no features; for another process they are found all the same.
TEST(Sections, FeaturesAreFoundOnlyWhereAStageUsesThem) {
  Pipeline pipeline = parsedPipeline();
  Frame frame = frameOf(0);
  frame.given_pose = Pose::Identity();
  pipeline.process(frame);
  EXPECT_EQ(0, std::count(seen_by_stages.begin(), seen_by_stages.end(), "features 0"));
  EXPECT_EQ("map 0", seen_by_stages.back());
  Frame sent = frameOf(1);
  sent.given_pose = Pose::Identity();
  pipeline.processFrontEnd(sent);
  EXPECT_EQ("features 1", seen_by_stages.back());
  Frame lost = frameOf(2);
  pipeline.process(lost);
  EXPECT_EQ(1, std::count(seen_by_stages.begin(), seen_by_stages.end(), "features 2"));
}

TEST(Sections, ReportSaysHowManyPointsEachStageRemoved) {
  StageTable table;
  registerBuiltinStages(table);
  add<StageKind::Map>(table, "map");
  Pipeline pipeline(parseConfiguration(
      "version: 1\nstages:\n  - stage: pass_through\n    max_m: 1.5\n  - stage: map\n", "test",
      table));
  Frame frame = frameOf(0);
  for (const float z : {1.0f, 2.0f, 3.0f}) frame.cloud->push_back({0.0f, 0.0f, z});
  EXPECT_EQ((std::vector<std::size_t>{2, 0}), pipeline.process(frame).stage_removed);
}

TEST(Sections, DisabledStageIsLeftOut) {
  Pipeline pipeline = parsedPipeline("motion.enabled=false");
  EXPECT_FALSE(pipeline.hasStage(StageKind::Motion));
  EXPECT_TRUE(pipeline.hasStage(StageKind::Features));
  Frame frame = frameOf(0);
  pipeline.process(frame);
  EXPECT_EQ(0, std::count(seen_by_stages.begin(), seen_by_stages.end(), "motion 0"));
  EXPECT_EQ("map 0", seen_by_stages.back());
  const std::string yaml = effectiveYaml(pipeline.configuration());
  EXPECT_NE(std::string::npos, yaml.find("  - stage: motion\n    enabled: false\n")) << yaml;
  EXPECT_THROW(parsedPipeline("motion.enabled=perhaps"), ConfigError);
}

TEST(Sections, SameImageTwiceIsAFrozenCamera) {
  Pipeline pipeline = parsedPipeline();
  Frame first = frameOf(0, 50);
  Frame same = frameOf(1, 50);
  Frame other = frameOf(2, 51);
  Frame back = frameOf(3, 50);
  EXPECT_EQ("", pipeline.process(first).skip_reason);
  EXPECT_NE(std::string::npos, pipeline.process(same).skip_reason.find("frozen"));
  EXPECT_EQ("", pipeline.process(other).skip_reason);
  EXPECT_EQ("", pipeline.process(back).skip_reason);
  Frame prepared = frameOf(4, 50);
  pipeline.prepare(prepared);
  EXPECT_NE(std::string::npos, pipeline.process(prepared).skip_reason.find("frozen"));
}

TEST(Sections, SameImageWithOtherDepthsIsNoFrozenCamera) {
  Pipeline pipeline = parsedPipeline();
  for (int i = 0; i < 3; ++i) {
    Frame dark = frameOf(static_cast<std::size_t>(i), 1);
    dark.cloud->push_back({0.0f, 0.0f, 1.0f + 0.001f * static_cast<float>(i)});
    EXPECT_EQ("", pipeline.process(dark).skip_reason) << i;
  }
}

TEST(Sections, CloudWithoutAFinitePointIsSkipped) {
  seen_by_stages.clear();
  StageTable table;
  add<StageKind::Points>(table, "points");
  Pipeline pipeline(parseConfiguration("version: 1\nstages:\n  - stage: points\n", "test", table));
  Frame frame = frameOf(0);
  frame.cloud->push_back({std::numeric_limits<float>::quiet_NaN(), 0.0f, 0.0f});
  const FrameReport report = pipeline.process(frame);
  EXPECT_NE(std::string::npos, report.skip_reason.find("finite"));
  EXPECT_EQ(1u, report.points_input);
  EXPECT_EQ(0u, report.points_valid);
  EXPECT_TRUE(seen_by_stages.empty());
}

}  // namespace
}  // namespace planar_mapping
