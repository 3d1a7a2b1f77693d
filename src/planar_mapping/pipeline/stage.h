// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "planar_mapping/base/export.h"
#include "planar_mapping/cuboids/cuboid_approximation.h"
#include "planar_mapping/pipeline/frame.h"
#include "planar_mapping/pipeline/parameter.h"

namespace planar_mapping {

/// What a stage does to a frame; stages of a chain must stand in this order, those of one kind in
/// any order. Points stages that say so may stand before a Motion stage too.
enum class StageKind : std::uint8_t {
  Images,    ///< makes the cloud of a frame from its images
  Features,  ///< finds key features and follows them over frames
  Motion,    ///< finds the pose of a frame
  Points,    ///< removes or replaces points: filters, ground removal
  Planes,    ///< finds planes
  Beliefs,   ///< decides on points
  Map,       ///< puts the frame into the map
  Any,       ///< anywhere
};

/// What holds for a whole run.
struct RunSettings {
  static constexpr std::int64_t kLargestSeed = (std::int64_t{1} << 53U) - 1;  ///< exact as a double

  Profile profile = Profile::Compact;
  std::uint64_t seed = 12345;
  int threads = 0;  ///< 0 = all cores; changes no result
  /// Upwards for all stages, an axis of the world; absent = found (upOf()).
  std::optional<Vector3> up;
  bool ignores_poses = false;  ///< `poses: ignore` of a Motion stage: no other uses them either
};

/// A step of the pipeline with its own parameters. To write one: derive, name it, declare the
/// parameters, process frames, and `table.add<MyStage>()` (examples/own_stage).
///
///     class MyStage : public Stage {
///      public:
///       static constexpr const char* kName = "my_stage";
///       static constexpr const char* kSummary = "what it does, in one line";
///       static constexpr StageKind kKind = StageKind::Points;
///       void declare(ParameterTable& table) override;
///       void process(Frame& frame) override;
///     };
///
/// A stage may keep state between frames: one object lives as long as the run, and a resumed run
/// shows it the earlier frames again. It must do the same with the same frames. It is called from
/// one thread at a time. What it throws (InputError, ParameterError, ...) ends the run.
class PLANAR_MAPPING_EXPORT Stage {
 public:
  virtual ~Stage();

  /// Sets the defaults of a profile; called before declare(). `paper` is nothing beyond the paper.
  virtual void applyProfile(Profile /*profile*/) {}
  /// Binds the parameters to members that live as long as the stage.
  virtual void declare(ParameterTable& table) = 0;
  /// Called once, after the parameters are set; for checks that involve several of them.
  /// \throws ParameterError
  virtual void configure(const RunSettings& /*settings*/) {}
  /// Called once, before the first frame that gets to the stage: the place to resolve `auto`. Up to
  /// Motion stages, \p scale may hold only what the calibration says (points = 0); later ones get
  /// the scale of the first cloud to be mapped.
  virtual void adapt(const CloudScale& /*scale*/) {}
  /// Called once, after adapt(): lets a stage that is enabled narrow the scale that the stages
  /// after it adapt to, by what it leaves of a cloud.
  virtual void limit(CloudScale& /*scale*/) const {}
  /// Side of the cells of the map, metres, where the configuration of the stage says it: whatever
  /// is `auto` in the stages before it follows that; called before adapt().
  virtual std::optional<double> resolution() const { return std::nullopt; }
  /// Lets a stage set parameters of the map; called once, after adapt().
  virtual void configureMap(PlanarMapParams& /*params*/) const {}
  /// Of stages up to Features: called before any of them works on the frame, but for Images stages
  /// that Pipeline::prepare() ran, to begin in the background what needs only the images. A frame
  /// that is left out on the way does not get to process().
  virtual void begin(const Frame& /*frame*/) {}
  /// Does the work on one frame.
  virtual void process(Frame& frame) = 0;
  /// Whether the stage reads Frame::key_features of this frame, which is about to enter the
  /// pipeline. Features stages do not run for frames of which no stage does.
  virtual bool usesKeyFeatures(const Frame& /*frame*/) const { return false; }
  /// Of a Points stage, with its parameters set: whether it may stand before a Motion stage, which
  /// then does not see the points that it removes. It needs no pose, and may see a frame again.
  virtual bool worksBeforeMotion() const { return false; }
};

}  // namespace planar_mapping
