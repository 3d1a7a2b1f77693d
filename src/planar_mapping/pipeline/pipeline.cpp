// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/pipeline.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <string_view>

#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/keyframe_view.h"
#include "planar_mapping/pipeline/run_summary.h"
#include "planar_mapping/pipeline/vertical.h"

namespace planar_mapping {
namespace {

using Clock = std::chrono::steady_clock;

double millisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// A number for the pictures of a frame and the depth that came with them: the same pictures give
/// the same number, and others hardly ever; noise alone makes pictures differ. 0 without pictures.
std::uint64_t pictureFingerprint(const Frame& frame) {
  if (frame.images.left.empty()) return 0;
  std::uint64_t value = 0;
  const auto add = [&value](const void* bytes, std::size_t size) {
    value = 31 * value + std::hash<std::string_view>()({static_cast<const char*>(bytes), size});
  };
  for (const io::Image* image : {&frame.images.left, &frame.images.right})
    add(image->pixels.data(), image->pixels.size());
  // Enough of the depths to see their noise.
  constexpr std::size_t kStep = 16;
  for (std::size_t i = 0; i < frame.cloud->size(); i += kStep)
    add((*frame.cloud)[i].data, 3 * sizeof(float));
  return value;
}

/// Stages through the last one of these kinds.
std::size_t sizeThrough(const Configuration& configuration,
                        std::initializer_list<StageKind> kinds) {
  std::size_t size = 0;
  for (std::size_t i = 0; i < configuration.stages.size(); ++i) {
    const ConfiguredStage& stage = configuration.stages[i];
    const bool counts = std::find(kinds.begin(), kinds.end(), stage.kind) != kinds.end();
    if (counts && stage.enabled) size = i + 1;
  }
  return size;
}

/// What `auto` becomes is the input's fault, not that of the configuration.
void adaptStage(const ConfiguredStage& stage, const CloudScale& scale, const std::string& source) {
  try {
    stage.stage->adapt(scale);
  } catch (const InputError& error) {
    throw InputError(source + ": " + error.what());
  } catch (const ParameterError& error) {
    const std::string resolution =
        scale.resolution ? " at resolution_m = " + formatNumber(*scale.resolution) : "";
    throw InputError(source + ": this input, " + formatNumber(scale.extent) +
                     " m across, leaves no value of " + stage.name + " that can be used" +
                     resolution + ": " + error.what() + "; is it in metres? scale it, or write " +
                     (scale.resolution ? "another resolution_m or " : "") +
                     "the value into the configuration");
  }
}

/// Motion stages take every finite point of the cloud.
void hideRemovedPoints(Frame& frame) {
  if (!frame.skip_reason.empty()) return;
  if (frame.indices.empty()) frame.skip_reason = "no point is left to find its pose by";
  const auto hidden = pcl::make_shared<FrameCloud>(frame.cloud->width, frame.cloud->height,
                                                   pcl::PointXYZ(NAN, NAN, NAN));
  hidden->header = frame.cloud->header;
  for (const int i : frame.indices) {
    const auto at = static_cast<std::size_t>(i);
    (*hidden)[at] = (*frame.cloud)[at];
  }
  hidden->is_dense = false;
  frame.cloud = hidden;
}

std::size_t pointsLeft(const Frame& frame) {
  return frame.indices.size() + frame.ground.size();
}

/// How many features a frame has, and how many of them were seen before.
void countFeatures(const std::vector<KeyFeature>& all, std::size_t& features,
                   std::size_t& matches) {
  if (all.empty()) return;
  features = all.size();
  matches = static_cast<std::size_t>(std::count_if(
      all.begin(), all.end(), [](const KeyFeature& one) { return one.sightings > 1; }));
}

}  // namespace

Pipeline::Pipeline(Configuration configuration)
    : configuration_(std::move(configuration)),
      front_end_size_(sizeThrough(configuration_, {StageKind::Images, StageKind::Features})),
      sensing_size_(std::max(front_end_size_, sizeThrough(configuration_, {StageKind::Motion}))),
      integration_(std::max(
          sensing_size_,
          sizeThrough(configuration_, {StageKind::Points, StageKind::Planes, StageKind::Any}))),
      is_adapted_(sensing_size_, 0) {
  const auto& stages = configuration_.stages;
  while (images_size_ < front_end_size_ && stages[images_size_].kind == StageKind::Images)
    ++images_size_;
}

FrameReport Pipeline::process(Frame& frame) {
  sense(frame);
  return integrate(frame);
}

void Pipeline::sense(Frame& frame) {
  const Clock::time_point start = Clock::now();
  if (!frame.front_end_done) runFrontEnd(frame, false);  // dense cloud, key features (III-B)
  if (!usesKeyFeatures(frame, 0)) frame.key_features.clear();
  moveToOrigin(frame);
  findUsablePoints(frame);
  if (frame.skip_reason.empty() && waitsForMore(frame))
    frame.skip_reason = "hardly any pixel of its image has a depth (" +
                        std::to_string(frame.points_valid) + "); the map begins with another";
  runMotion(frame);   // its pose (Eq. 8)
  runMapping(frame);  // ground, planes (III-C)
  frame.sensing_ms += millisecondsSince(start);
}

/// Beliefs (III-D, E), cuboids (III-F), map (IV).
FrameReport Pipeline::integrate(Frame& frame) {
  const Clock::time_point start = Clock::now();
  frame.map = &mapFor(frame);
  for (std::size_t i = integration_; i < configuration_.stages.size(); ++i) runStage(i, frame);
#ifdef PLANAR_MAPPING_HAS_ATLAS
  if (atlas_ && frame.inserted) addToAtlas(frame);
#endif
  FrameReport result = report(frame);
  result.frame_ms = frame.sensing_ms + millisecondsSince(start);
  return result;
}

FrameReport Pipeline::processFrontEnd(Frame& frame) {
  const Clock::time_point start = Clock::now();
  runFrontEnd(frame, true);
  FrameReport result = report(frame);
  result.frame_ms = millisecondsSince(start);
  return result;
}

void Pipeline::checkPictures(Frame& frame) {
  const std::uint64_t pictures = pictureFingerprint(frame);
  if (pictures != 0 && pictures == last_pictures_ && frame.skip_reason.empty())
    frame.skip_reason =
        "the image is that of the frame before, pixel for pixel; is the camera frozen?";
  if (pictures != 0) last_pictures_ = pictures;
}

void Pipeline::prepare(Frame& frame) {
  if (frame.front_end_done) return;
  const Clock::time_point start = Clock::now();
  checkPictures(frame);
  beginAndRun(0, images_size_, frame, false);
  frame.is_prepared = true;
  frame.sensing_ms = millisecondsSince(start);
}

/// \param for_others  another process does the rest: it may use key features
void Pipeline::runFrontEnd(Frame& frame, bool for_others) {
  if (!frame.is_prepared) checkPictures(frame);
  beginAndRun(frame.is_prepared ? images_size_ : 0, front_end_size_, frame,
              for_others || usesKeyFeatures(frame, 0));
  frame.front_end_done = true;
}

/// Stages of the front-end from \p first to before \p last.
void Pipeline::beginAndRun(std::size_t first, std::size_t last, Frame& frame, bool with_features) {
  const auto& stages = configuration_.stages;
  const auto runs = [&](const ConfiguredStage& stage) {
    return stage.enabled && (with_features || stage.kind != StageKind::Features);
  };
  for (std::size_t i = first; i < last && frame.skip_reason.empty(); ++i)
    if (runs(stages[i])) stages[i].stage->begin(frame);
  for (std::size_t i = first; i < last; ++i)
    if (runs(stages[i])) runStage(i, frame);
}

void Pipeline::findUsablePoints(Frame& frame) const {
  if (!frame.skip_reason.empty()) return;
  frame.indices = usablePoints(pointsOf(*frame.cloud));
  frame.points_input = frame.cloud->size();
  frame.points_valid = frame.indices.size();
  if (frame.indices.empty())
    frame.skip_reason = "no point of its cloud is finite; check how it was recorded";
}

void Pipeline::runMotion(Frame& frame) {
  for (std::size_t i = front_end_size_; i < sensing_size_; ++i) {
    runStage(i, frame);
    const ConfiguredStage& stage = configuration_.stages[i];
    if (stage.kind == StageKind::Points && stage.enabled) hideRemovedPoints(frame);
  }
  if (frame.skip_reason.empty() && frame.track != 0 && !keepsAtlas())
    frame.skip_reason = "nothing tells where it is among the frames before; an atlas keeps it";
  countFeatures(frame.key_features, frame.features, frame.matches);
}

void Pipeline::runMapping(Frame& frame) {
  if (frame.skip_reason.empty() && !has_begun_) {
    CloudScale scale = knownScale(frame);
    scale.has_sensor = !frame.pose_assumed || !isMerged(pointsOf(*frame.cloud), &frame.indices);
    detail::remarkOnFirst(frame, scale);
    if (!configuration_.settings.up) detail::findVertical(mean_up_, scale, frame);
    beginMap(frame, scale);
  }
  for (std::size_t i = sensing_size_; i < integration_; ++i) runStage(i, frame);
}

void Pipeline::runStage(std::size_t index, Frame& frame) {
  const ConfiguredStage& configured = configuration_.stages[index];
  frame.stage_ms.resize(configuration_.stages.size(), 0.0);
  frame.stage_removed.resize(configuration_.stages.size(), 0);
  if (!frame.skip_reason.empty() || !configured.enabled) return;
  const Clock::time_point start = Clock::now();
  if (index < sensing_size_ && is_adapted_[index] == 0) {
    adaptStage(configured, knownScale(frame), frame.source);
    is_adapted_[index] = 1;
  }
  const std::size_t points = pointsLeft(frame);
  try {
    configured.stage->process(frame);
  } catch (const InputError& error) {
    const std::string what = error.what();
    if (what.find(frame.source) != std::string::npos) throw;
    throw InputError(frame.source + ": " + what);
  }
  frame.stage_removed[index] = points - std::min(points, pointsLeft(frame));
#ifdef __GLIBC__
  constexpr std::size_t kHuge = std::size_t{1} << 21;  // points; usual frames need it all again
  if (frame.cloud->size() > kHuge) ::malloc_trim(0);
#endif
  frame.stage_ms[index] = millisecondsSince(start);
}

bool Pipeline::hasStage(StageKind kind) const {
  return planar_mapping::hasStage(configuration_, kind);
}

/// Whether a stage from \p first on does.
bool Pipeline::usesKeyFeatures(const Frame& frame, std::size_t first) const {
  return std::any_of(configuration_.stages.begin() + static_cast<std::ptrdiff_t>(first),
                     configuration_.stages.end(), [&frame](const ConfiguredStage& configured) {
                       return configured.enabled && configured.stage->usesKeyFeatures(frame);
                     });
}

/// Of the map, where the configuration says it.
std::optional<double> Pipeline::givenResolution() const {
  std::optional<double> given;
  for (const ConfiguredStage& configured : configuration_.stages) {
    const std::optional<double> one = configured.stage->resolution();
    if (configured.enabled && one) given = one;
  }
  return given ? given : atlas_resolution_;
}

CloudScale Pipeline::knownScale(const Frame& frame) const {
  const PointsView points = pointsOf(*frame.cloud);
  CloudScale scale = scaleOf(points, usablePoints(points), frame.T_world_sensor);
  scale.resolution = givenResolution();
  // Heights above the sea are no depths, and z of the world is none.
  if (frame.without_sensor || configuration_.sensor_origin) {
    scale.optical = false;
    scale.up = Vector3::UnitZ();
  }
  scale.up = configuration_.settings.up.value_or(scale.up);
  if (frame.camera && frame.baseline) {
    scale.stereo = StereoNoise();
    scale.stereo->baseline = *frame.baseline;
    scale.stereo->focal_length = frame.camera->fx;
  }
  return scale;
}

/// With the first frame to be mapped.
void Pipeline::beginMap(const Frame& frame, CloudScale scale) {
  has_begun_ = true;
  is_optical_ = scale.optical;
  for (std::size_t i = sensing_size_; i < configuration_.stages.size(); ++i) {
    const ConfiguredStage& configured = configuration_.stages[i];
    adaptStage(configured, scale, frame.source);
    if (configured.enabled) configured.stage->limit(scale);
  }
  PlanarMapParams params;
  for (const ConfiguredStage& stage : configuration_.stages) {
    if (stage.enabled) stage.stage->configureMap(params);
  }
  params.origin = origin_.value_or(Vector3::Zero());
  if (frame.starts_world) params.frame = MapFrame::Start;
  if (frame.without_sensor) params.unknown_space = false;
#ifdef PLANAR_MAPPING_HAS_ATLAS
  if (atlas_plan_) {
    try {
      atlas_ = std::make_unique<AtlasBuilder>(atlas_plan_->params, params,
                                              std::move(atlas_plan_->session),
                                              std::move(atlas_plan_->known));
    } catch (const InputError& error) {
      throw InputError(atlas_plan_->name + ": " + error.what() +
                       " as this run has: set them alike (resolution_m), or take another atlas");
    }
    atlas_plan_.reset();
    atlas_->mapForNext();
  }
#endif
  map_ = PlanarMap(params);
}

bool Pipeline::keepsAtlas() const {
#ifdef PLANAR_MAPPING_HAS_ATLAS
  return atlas_ || atlas_plan_;
#else
  return false;
#endif
}

PlanarMap& Pipeline::mapFor(const Frame& frame) {
#ifdef PLANAR_MAPPING_HAS_ATLAS
  if (atlas_ && frame.skip_reason.empty()) return atlas_->mapForNext(frame.track);
#endif
  static_cast<void>(frame);
  return map_;
}

const PlanarMap& Pipeline::map() const {
#ifdef PLANAR_MAPPING_HAS_ATLAS
  if (atlas_) return atlas_->map();
#endif
  return map_;
}

#ifdef PLANAR_MAPPING_HAS_ATLAS
void Pipeline::keepAtlas(const SubmapParams& params, AtlasSession session, AtlasData known,
                         std::string name) {
  if (!known.submaps.empty()) {
    const PlanarMapParams& theirs = known.submaps.front().map->params();
    atlas_resolution_ = theirs.approximation.resolution;
    atlas_origin_ = theirs.origin;
  }
  atlas_plan_ = AtlasPlan{params, std::move(session), std::move(known), std::move(name)};
}

void Pipeline::addToAtlas(Frame& frame) {
  AtlasBuilder::Seen seen;
  seen.frame = frame.number;
  seen.source = frame.source;
  seen.timestamp = frame.timestamp;
  seen.T_track_sensor = frame.T_world_sensor;
  seen.drift = frame.drift;
  seen.joined = frame.joined;
  const std::optional<KeyframeView> view = keyframeViewOf(frame);
  if (view) {
    seen.gray = &view->gray;
    seen.cloud = view->cloud;
    seen.camera = view->camera;
  } else if (!frame.without_sensor) {
    seen.cloud = pointsOf(*frame.cloud);
    seen.is_scan = !is_optical_;
  }
  const AtlasBuilder::Update update = atlas_->add(seen);
  for (const Link& link : update.links) {
    if (link.isDoubt()) continue;
    const char* const states[] = {"used", "not used: others contradict it, or too few agree"};
    frame.notes.push_back(
        frame.source + ": loop " + std::to_string(link.id) + " between submaps " +
        std::to_string(link.from_submap) + " and " + std::to_string(link.to_submap) + ", " +
        std::to_string(link.evidence.inliers) + (view ? " features, " : " planes, ") +
        states[link.state == LinkState::Used ? 0 : 1]);
  }
  if (!update.moved.empty())
    frame.notes.push_back(frame.source + ": " + std::to_string(update.moved.size()) +
                          " submaps moved");
}
#endif

/// Coordinates of countries and the Earth are too large for cells: the map gets an origin of its
/// own next to the first pose.
void Pipeline::moveToOrigin(Frame& frame) {
  if (!frame.given_pose) return;
  const Vector3 place = frame.given_pose->translation();
  if (!origin_)
    origin_ = originNear(place - atlas_origin_).isZero() ? atlas_origin_ : originNear(place);
  frame.given_pose->pretranslate(-*origin_);
  frame.T_world_sensor = *frame.given_pose;
}

/// Whether a frame has far fewer points than images have, and a map that begins with it, and
/// parameters that follow from it, would be no good to the frames after it.
bool Pipeline::waitsForMore(const Frame& frame) {
  constexpr double kMinMeasured = 0.02;  // of the pixels
  constexpr int kMaxWaits = 4;           // frames
  return !has_begun_ && frame.camera && !frame.is_last &&
         static_cast<double>(frame.points_valid) <
             kMinMeasured * static_cast<double>(frame.points_input) &&
         waits_++ < kMaxWaits;
}

FrameReport Pipeline::report(const Frame& frame) {
  const PlanarMap& map = frame.map != nullptr ? *frame.map : map_;
  if (map.frames() < counted_frames_) counted_frames_ = 0;  // the next submap
  // Counting takes as long as many frames once the map is large.
  if (2 * map.frames() >= 3 * counted_frames_ && map.frames() > counted_frames_) {
    counted_frames_ = map.frames();
    cuboids_ = map.cuboidCountAtMost();
  }
  FrameReport report;
  report.number = frame.number;
  report.source = frame.source;
  report.timestamp = frame.timestamp;
  report.stage_ms = frame.stage_ms;
  report.stage_ms.resize(configuration_.stages.size(), 0.0);
  report.stage_removed = frame.stage_removed;
  report.stage_removed.resize(configuration_.stages.size(), 0);
  report.skip_reason = frame.skip_reason;
  report.statistics = frame.statistics;
  report.points_input = frame.points_input;
  report.points_valid = frame.points_valid;
  report.points_ground = frame.ground.size();
  for (const PlaneSegment& plane : frame.planes) report.points_planar += plane.inliers.size();
  report.points_planar = std::min(report.points_planar, frame.indices.size());
  report.points_non_planar = frame.indices.size() - report.points_planar;
  report.points_rejected = frame.points_valid - std::min(frame.points_valid, pointsLeft(frame));
  report.points_beyond = frame.update.points_beyond;
  report.features = frame.features;
  report.matches = frame.matches;
  countFeatures(frame.key_features, report.features, report.matches);
  report.inliers = frame.inliers;
  report.planes = frame.planes.size();
  report.planes_new = frame.update.planes_new;
  report.planes_matched = frame.update.planes_matched;
  report.cuboids = cuboids_;
  report.map_bytes = map.memoryBytes();
#ifdef PLANAR_MAPPING_HAS_ATLAS
  if (atlas_) report.map_bytes += atlas_->memoryBytes();
#endif
  return report;
}

}  // namespace planar_mapping
