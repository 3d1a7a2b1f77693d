// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/ground/up.h"
#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/frame.h"
#ifdef PLANAR_MAPPING_HAS_ATLAS
#include "planar_mapping/atlas/atlas_builder.h"
#endif

namespace planar_mapping {

/// What became of one frame: a row of frames.csv.
struct FrameReport {
  std::size_t number = 0;
  std::string source;
  double timestamp = 0.0;
  double read_ms = 0.0;          ///< filled in by who reads the frame
  std::vector<double> stage_ms;  ///< in the order of the configuration
  double frame_ms = 0.0;         ///< frame in memory to map updated
  std::string skip_reason;       ///< why the frame is not in the map; empty = it is
  std::size_t points_input = 0;
  std::size_t points_valid = 0;  ///< finite
  std::size_t points_ground = 0;
  std::size_t points_planar = 0;
  std::size_t points_non_planar = 0;
  std::size_t points_rejected = 0;         ///< valid, but removed or merged by a stage
  std::vector<std::size_t> stage_removed;  ///< of those, by the stages in their order
  std::size_t points_beyond = 0;  ///< farther from the map's origin than it reaches; dropped
  std::size_t features = 0;       ///< key features, else those that kl_occupancy follows
  std::size_t matches = 0;        ///< of those, seen before
  std::size_t inliers = 0;        ///< of those, in agreement with the motion that was found
  std::size_t planes = 0;
  std::size_t planes_new = 0;
  std::size_t planes_matched = 0;
  /// In the map, or the submap, PlanarMap::cuboidCountAtMost(): of the last of the frames after
  /// which they were counted, which get rarer as the map grows.
  std::size_t cuboids = 0;
  std::size_t map_bytes = 0;
  std::vector<FrameStatistic> statistics;  ///< of the stages
};

/// The stages of a configuration and the map they build (the paper, Fig. 2).
/// One frame after the other, from one thread.
///
/// A frame passes three sections, each of which some configurations lack:
/// 1. front-end: Images and Features stages, where the cloud and key features come from;
/// 2. motion: Motion stages, which settle T_world_sensor;
/// 3. mapping: all others, on the usable points.
/// Stages of section 3 get adapt() together, with the first frame that comes so far. Each one
/// before gets it right before its first frame: with the scale of the cloud if there is one by
/// then, else with what the calibration says (CloudScale::points = 0).
/// A Features stage runs only for frames whose features another stage uses.
///
/// A stage that sets Frame::skip_reason ends the frame there; the map does not change.
class PLANAR_MAPPING_EXPORT Pipeline {
 public:
  explicit Pipeline(Configuration configuration);

  /// Tells `up: auto` where the images have upwards on average over the given poses, world frame;
  /// otherwise the first frame alone says it. Before the first frame.
  void setMeanUp(const ImagesUp& up) { mean_up_ = up; }
  /// Takes one frame through all stages, the front-end left out where it was done elsewhere
  /// (Frame::front_end_done); they change it in place.
  /// A frame without a single usable point is skipped; one of an image with hardly any waits until
  /// another one has begun the map, unless it is the fifth or the last.
  /// \throws InputError, ParameterError; the map is then as the stage left it
  FrameReport process(Frame& frame);

  /// process() in three parts, each of which one thread may run while others run the other parts of
  /// other frames: prepare(), which may be left out, runs Images stages, sense() the stages up to
  /// the last one that is neither for beliefs nor for the map, integrate() the rest. Frames pass
  /// each part in the same order. As long as hasBegun() is false only one part may run.
  void prepare(Frame& frame);
  void sense(Frame& frame);
  FrameReport integrate(Frame& frame);
  /// Whether a frame got as far as the stages for points: the map begins with it.
  bool hasBegun() const { return has_begun_; }

  /// The front-end alone, for a process that hands the frame on; process() of the same
  /// configuration, in this or another process, does the rest.
  FrameReport processFrontEnd(Frame& frame);

  /// Of all submaps that are joined with those of this run, where keepAtlas() was called; no other
  /// thread may run a part of a frame then.
  const PlanarMap& map() const;
#ifdef PLANAR_MAPPING_HAS_ATLAS
  /// The map is made of submaps, places are recognised by the images, and loops move the submaps.
  /// Before the first frame.
  /// \param known  what earlier runs left: cells that are `auto` are as large as theirs, and
  ///               coordinates have their origin where that is near. Others are refused with the
  ///               first frame
  /// \param name   of the atlas, for messages
  void keepAtlas(const SubmapParams& params, AtlasSession session, AtlasData known = {},
                 std::string name = "");
  /// Null without keepAtlas(), and before the first frame in the map.
  AtlasBuilder* atlas() const {
    return atlas_.get();
  }
#endif
  /// With the values that `auto` took, once a frame has been processed.
  const Configuration& configuration() const {
    return configuration_;
  }
  /// Whether any stage is of this kind.
  bool hasStage(StageKind kind) const;

 private:
  void checkPictures(Frame& frame);
  void runFrontEnd(Frame& frame, bool for_others);
  void beginAndRun(std::size_t first, std::size_t last, Frame& frame, bool with_features);
  void findUsablePoints(Frame& frame) const;
  void runMotion(Frame& frame);
  void runMapping(Frame& frame);
  void runStage(std::size_t index, Frame& frame);
  bool usesKeyFeatures(const Frame& frame, std::size_t first) const;
  std::optional<double> givenResolution() const;
  CloudScale knownScale(const Frame& frame) const;
  void beginMap(const Frame& frame, CloudScale scale);
  void moveToOrigin(Frame& frame);
  bool waitsForMore(const Frame& frame);
  bool keepsAtlas() const;
  FrameReport report(const Frame& frame);

#ifdef PLANAR_MAPPING_HAS_ATLAS
  void addToAtlas(Frame& frame);
  struct AtlasPlan {
    SubmapParams params;
    AtlasSession session;
    AtlasData known;
    std::string name;
  };
  std::optional<AtlasPlan> atlas_plan_;  ///< until the map begins
  std::unique_ptr<AtlasBuilder> atlas_;
#endif
  PlanarMap& mapFor(const Frame& frame);

  Configuration configuration_;
  PlanarMap map_;                    ///< without an atlas
  std::size_t images_size_ = 0;      ///< stages before the first that is no Images stage
  std::size_t front_end_size_ = 0;   ///< stages through the last Images or Features stage
  std::size_t sensing_size_ = 0;     ///< and through the last Motion stage
  std::size_t integration_ = 0;      ///< the first of the stages that integrate() runs
  std::uint64_t last_pictures_ = 0;  ///< fingerprint of the images of the frame before; 0 = none
  std::vector<char> is_adapted_;     ///< of the stages of sections 1 and 2
  bool has_begun_ = false;           ///< the map; the stages of section 3 are adapted
  bool is_optical_ = true;           ///< CloudScale::optical of the first frame
  std::optional<ImagesUp> mean_up_;  ///< of the images of all given poses
  std::optional<Vector3> origin_;    ///< PlanarMapParams::origin, once there was a pose
  std::optional<double> atlas_resolution_;  ///< of the maps of earlier runs
  Vector3 atlas_origin_ = Vector3::Zero();  ///< likewise
  std::size_t counted_frames_ = 0;          ///< in the map when its cuboids were counted
  std::size_t cuboids_ = 0;
  int waits_ = 0;  ///< frames for which a better one was waited
};

}  // namespace planar_mapping
