// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/runs/place_source.h"

#include <algorithm>
#include <limits>
#include <mutex>
#include <utility>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/runner.h"
#include "planar_mapping/pipeline/sequence_source.h"

namespace planar_mapping::tools {
namespace {

bool isMapping(const ConfiguredStage& stage) {
  return stage.kind == StageKind::Planes || stage.kind == StageKind::Beliefs ||
         stage.kind == StageKind::Map;
}

/// Takes out what needs images or finds poses; simulated clouds come with poses.
void dropSensingStages(Configuration& configuration) {
  const auto isSensing = [](const ConfiguredStage& stage) {
    return stage.kind == StageKind::Images || stage.kind == StageKind::Features ||
           stage.kind == StageKind::Motion;
  };
  auto& stages = configuration.stages;
  stages.erase(std::remove_if(stages.begin(), stages.end(), isSensing), stages.end());
}

auto firstMapping(Configuration& configuration) {
  return std::find_if(configuration.stages.begin(), configuration.stages.end(), isMapping);
}

/// Frames of the whole path of a simulated scene: at 0.4 m/s, ten places of ten frames.
constexpr std::size_t kSimulatedFrames = 100;

struct Stretch {
  std::size_t first = 0;
  std::size_t length = 0;
};

/// Stretches of equal length that do not overlap, each in the middle of its fraction of the frames.
std::vector<Stretch> stretchesOf(std::size_t frames, const PlaceOptions& options) {
  if (options.frames_per_place == 0) return {{0, frames}};
  const std::size_t length = std::min(options.frames_per_place, frames);
  const std::size_t count = std::min(options.places, frames / length);
  std::vector<Stretch> stretches;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t share_begin = i * frames / count;
    const std::size_t share_end = (i + 1) * frames / count;
    stretches.push_back({share_begin + (share_end - share_begin - length) / 2, length});
  }
  return stretches;
}

std::vector<Vector3> inWorld(const Frame& frame, const Indices& indices,
                             const Pose& T_world_sensor) {
  std::vector<Vector3> points;
  points.reserve(indices.size());
  const PointsView view = pointsOf(*frame.cloud);
  for (const int i : indices)
    points.push_back(T_world_sensor * view.point(static_cast<std::size_t>(i)));
  return points;
}

/// Where the frame truly was: the given pose where there is one, in the world of the first frame
/// of the place as that was placed.
Pose truePose(const Frame& frame, Place& place) {
  if (!frame.given_pose) return frame.T_world_sensor;
  if (frame.given_pose->matrix() == frame.T_world_sensor.matrix()) return frame.T_world_sensor;
  if (place.frames.empty())
    place.T_world_given = frame.T_world_sensor * frame.given_pose->inverse();
  const Pose T_world_sensor = place.T_world_given * *frame.given_pose;
  const Vector3 error = T_world_sensor.translation() - frame.T_world_sensor.translation();
  place.position_errors.push_back(error.norm());
  return T_world_sensor;
}

/// What the pixels of the points hit, without noise; flying pixels, too, hit something.
std::vector<Vector3> trulyInWorld(const Frame& frame, const Indices& indices,
                                  const evaluation::Rendering& truth) {
  std::vector<Vector3> points;
  points.reserve(indices.size());
  const PinholeCamera& camera = truth.camera;
  for (const int i : indices) {
    const int row = i / camera.width;
    const Vector3 direction = camera.rayOf(i % camera.width, row);
    const auto depth = static_cast<double>(truth.depth[static_cast<std::size_t>(i)]);
    points.push_back(frame.T_world_sensor * (depth * direction));
  }
  return points;
}

/// Every so many-th obstacle point goes to the place's points to check. Where there is no truth to
/// look it up in, it is held back: taken out of the frame, so that no method and no stage gets to
/// see it.
void chooseCheckedPoints(Frame& frame, std::size_t step, const evaluation::Rendering* truth,
                         Place& place) {
  Indices chosen;
  Indices kept;
  for (std::size_t k = 0; k < frame.indices.size(); ++k)
    (k % step == step - 1 ? chosen : kept).push_back(frame.indices[k]);
  const Pose T_world_sensor = truePose(frame, place);
  const std::vector<Vector3> measured = inWorld(frame, chosen, T_world_sensor);
  for (const Vector3& point : measured) place.rays.push_back({T_world_sensor.translation(), point});
  const std::vector<Vector3> checked =
      truth != nullptr ? trulyInWorld(frame, chosen, *truth) : measured;
  place.checked.insert(place.checked.end(), checked.begin(), checked.end());
  if (truth != nullptr) return;
  frame.cloud = pcl::make_shared<FrameCloud>(*frame.cloud);
  for (const int i : chosen) {
    constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
    (*frame.cloud)[static_cast<std::size_t>(i)] = pcl::PointXYZ(kNothing, kNothing, kNothing);
  }
  frame.indices = std::move(kept);
}

/// A frame as the stages before the planes leave it becomes one of the place.
/// \param truth what it saw without noise; null where that is not known
void addFrame(Frame frame, const PlaceOptions& options, const evaluation::Rendering* truth,
              Place& place) {
  frame.images = FrameImages();
  frame.front_end_done = true;
  chooseCheckedPoints(frame, options.check_step, truth, place);
  PreparedFrame prepared;
  prepared.obstacles = inWorld(frame, frame.indices, frame.T_world_sensor);
  prepared.ground = inWorld(frame, frame.ground, frame.T_world_sensor);
  frame.given_pose = frame.T_world_sensor;  // the mapping stages look for no motion
  prepared.frame = std::move(frame);
  place.frames.push_back(std::move(prepared));
}

/// Up to where points are used: 99 % of them have less depth. Depth, not the length of the ray, is
/// what stages limit and what the noise grows with.
double usedDepth(const Place& place) {
  std::vector<double> depths;
  for (const PreparedFrame& prepared : place.frames) {
    const PointsView view = pointsOf(*prepared.frame.cloud);
    for (const int i : prepared.frame.indices)
      depths.push_back(view.point(static_cast<std::size_t>(i)).z());
  }
  if (depths.empty()) return evaluation::VisibleSurfaceParams().max_depth;
  const double rank = 0.99 * static_cast<double>(depths.size());
  return detail::ranked(depths, static_cast<std::size_t>(rank));
}

class SimulatedPlaces : public PlaceSource {
 public:
  SimulatedPlaces(evaluation::SimulationParams params, const PlaceOptions& options,
                  ConfigurationLoader load)
      : simulation_(withFrames(std::move(params), options)),
        options_(options),
        stretches_(stretchesOf(simulation_.size(), options)),
        load_(std::move(load)) {}

  std::size_t size() const override { return stretches_.size(); }

  std::unique_ptr<Place> next() override {
    auto place = std::make_unique<Place>();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (position_ == stretches_.size()) return nullptr;
      place->number = position_++;
    }
    Configuration configuration = load_();
    keepPreparingStages(configuration);
    dropSensingStages(configuration);
    Pipeline pipeline(std::move(configuration));
    const Stretch& stretch = stretches_[place->number];
    std::vector<std::pair<evaluation::Rendering, Pose>> views;
    const evaluation::StereoSensorParams& sensor = simulation_.params().sensor;
    for (std::size_t i = stretch.first; i < stretch.first + stretch.length; ++i) {
      evaluation::SimulatedFrame seen = simulation_.frame(i);
      Frame frame = measured(seen);
      pipeline.process(frame);
      if (frame.skip_reason.empty()) addFrame(std::move(frame), options_, &seen.truth, *place);
      views.emplace_back(evaluation::matchablePart(std::move(seen.truth), sensor),
                         seen.T_world_camera);
    }
    auto truth = std::make_shared<evaluation::SurfaceTruth>(
        simulation_.scene(), static_cast<int>(stretch.first),
        static_cast<int>(stretch.first + stretch.length - 1));
    evaluation::VisibleSurfaceParams visible;
    visible.max_depth = usedDepth(*place);
    for (const auto& [view, T_world_camera] : views) truth->addView(view, T_world_camera, visible);
    place->truth = std::move(truth);
    return place;
  }

 private:
  static evaluation::SimulationParams withFrames(evaluation::SimulationParams params,
                                                 const PlaceOptions& options) {
    const std::size_t wanted = options.places * options.frames_per_place;
    params.frames = static_cast<int>(std::max(kSimulatedFrames, wanted));
    params.colors = false;
    params.threads = 1;
    return params;
  }

  Frame measured(const evaluation::SimulatedFrame& seen) const {
    Frame frame;
    frame.number = seen.index;
    frame.source = simulation_.params().scene + " " + std::to_string(seen.index);
    frame.timestamp = seen.timestamp;
    frame.T_world_sensor = seen.T_world_camera;
    frame.given_pose = seen.T_world_camera;
    frame.camera = simulation_.params().camera();
    frame.baseline = simulation_.params().sensor.baseline;
    frame.cloud = cloudOf(seen.xyz, static_cast<std::uint32_t>(frame.camera->width),
                          static_cast<std::uint32_t>(frame.camera->height));
    return frame;
  }

  evaluation::Simulation simulation_;
  PlaceOptions options_;
  std::vector<Stretch> stretches_;
  ConfigurationLoader load_;
  std::mutex mutex_;
  std::size_t position_ = 0;
};

/// With poses each place is read by itself. Without, the motion needs all frames, so that one
/// pipeline reads the input from its beginning.
class RecordedPlaces : public PlaceSource {
 public:
  RecordedPlaces(const PlaceOptions& options, ConfigurationLoader load)
      : options_(options), load_(std::move(load)) {
    const Configuration configuration = load_();
    const SequenceSource whole(configuration);
    requireStagesFor(whole, configuration);
    selection_ = configuration.frames;
    has_poses_ = whole.poseSource() != io::PoseSource::None;
    stretches_ = stretchesOf(*whole.size(), options);
  }

  std::size_t size() const override { return stretches_.size(); }

  std::unique_ptr<Place> next() override {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (position_ == stretches_.size()) return nullptr;
    auto place = std::make_unique<Place>();
    place->number = position_++;
    const Stretch& stretch = stretches_[place->number];
    if (has_poses_ || reader_ == nullptr) open(has_poses_ ? stretch : Stretch{});
    place->mean_up = reader_->meanUp();
    while (read_ < stretch.first + stretch.length) {
      std::optional<Frame> frame = reader_->next();
      if (!frame) break;
      const bool belongs = read_++ >= stretch.first;
      pipeline_->process(*frame);
      if (belongs && frame->skip_reason.empty())
        addFrame(std::move(*frame), options_, nullptr, *place);
    }
    return place;
  }

 private:
  /// A stretch without length is everything.
  void open(const Stretch& stretch) {
    Configuration configuration = load_();
    if (stretch.length > 0) {
      const auto first = static_cast<std::int64_t>(stretch.first);
      const auto length = static_cast<std::int64_t>(stretch.length);
      configuration.frames.first = selection_.first + first * selection_.step;
      configuration.frames.last = configuration.frames.first + (length - 1) * selection_.step + 1;
    }
    read_ = stretch.first;
    reader_ = std::make_unique<SequenceSource>(configuration);
    keepPreparingStages(configuration);
    pipeline_ = std::make_unique<Pipeline>(std::move(configuration));
    if (const std::optional<ImagesUp> up = reader_->meanUp()) pipeline_->setMeanUp(*up);
  }

  PlaceOptions options_;
  ConfigurationLoader load_;
  FrameSelection selection_;
  bool has_poses_ = false;
  std::vector<Stretch> stretches_;
  std::mutex mutex_;
  std::size_t position_ = 0;
  std::size_t read_ = 0;  ///< number of the next frame of the input
  std::unique_ptr<SequenceSource> reader_;
  std::unique_ptr<Pipeline> pipeline_;
};

}  // namespace

std::unique_ptr<PlaceSource> simulatedPlaces(const evaluation::SimulationParams& params,
                                             const PlaceOptions& options,
                                             ConfigurationLoader load) {
  return std::make_unique<SimulatedPlaces>(params, options, std::move(load));
}

std::unique_ptr<PlaceSource> recordedPlaces(const PlaceOptions& options, ConfigurationLoader load) {
  return std::make_unique<RecordedPlaces>(options, std::move(load));
}

void keepPreparingStages(Configuration& configuration) {
  configuration.stages.erase(firstMapping(configuration), configuration.stages.end());
}

void keepMappingStages(Configuration& configuration) {
  configuration.stages.erase(configuration.stages.begin(), firstMapping(configuration));
}

}  // namespace planar_mapping::tools
