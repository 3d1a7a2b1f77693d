// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/sequence_source.h"

#include <algorithm>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/pipeline/frame.h"

namespace planar_mapping {
namespace {

std::vector<std::size_t> select(const FrameSelection& selection, std::size_t count) {
  std::vector<std::size_t> frames;
  const auto step = static_cast<std::size_t>(selection.step);
  const auto last =
      selection.last < 0 ? count : std::min(static_cast<std::size_t>(selection.last), count);
  for (auto i = static_cast<std::size_t>(selection.first); i < last; i += step) frames.push_back(i);
  if (frames.empty())
    throw InputError("frames " + selection.text() + " select none of the " + std::to_string(count) +
                     " frames of the input");
  return frames;
}

}  // namespace

io::SequenceOptions sequenceOptions(const Configuration& configuration) {
  if (configuration.inputs.empty())
    throw InputError("there is no input; give it with -i FILE_OR_FOLDER or as 'inputs' in " +
                     configuration.path);
  io::SequenceOptions options;
  options.poses_file = configuration.poses;
  options.calibration_file = configuration.calibration;
  options.scale = configuration.scale;
  options.sensor_origin = configuration.sensor_origin;
  options.ignore_poses = configuration.settings.ignores_poses;
  if (hasStage(configuration, StageKind::Images)) {
    options.preferred = io::SequenceKind::Stereo;
  } else if (hasStage(configuration, StageKind::Features)) {
    options.preferred = io::SequenceKind::Rgbd;
  }
  return options;
}

std::vector<std::string> describe(const io::Sequence& sequence) {
  const std::size_t count = sequence.size();
  const char* const frames[] = {"cloud", "RGB-D frame", "image pair"};
  const char* const poses[] = {"no poses", "poses by VIEWPOINT", "poses of a file",
                               "the position of the sensor is given"};
  std::vector<std::string> notes = sequence.notes();
  notes.insert(notes.begin(),
               sequence.layout() + ": " +
                   detail::counted(count, frames[static_cast<int>(sequence.kind())]) + ", " +
                   poses[static_cast<int>(sequence.poseSource())]);
  return notes;
}

Frame readFrame(const io::Sequence& sequence, std::size_t index, bool with_images) {
  Frame frame;
  io::Frame read;
  try {
    read = sequence.read(index, io::CloudChannels::none(), with_images);
  } catch (const IoError& error) {
    if (sequence.kind() == io::SequenceKind::Clouds) throw;
    read = sequence.describe(index);
    frame.skip_reason = error.what();
  }
  frame.number = index;
  frame.source = sequence.path(index);
  frame.timestamp = read.timestamp;
  frame.given_pose = read.T_world_sensor;
  frame.T_world_sensor = read.T_world_sensor.value_or(Pose::Identity());
  frame.pose_assumed = sequence.poseSource() == io::PoseSource::Viewpoint &&
                       frame.T_world_sensor.matrix() == Pose::Identity().matrix();
  frame.camera = read.camera;
  if (sequence.calibration()) frame.baseline = sequence.calibration()->baseline;
  frame.images.left = std::move(read.left);
  frame.images.right = std::move(read.right);
  if (with_images) frame.images.calibration = sequence.calibration();
  frame.cloud = cloudOf(read.cloud.xyz, read.cloud.width, read.cloud.height);
  frame.without_sensor = !read.cloud.origin.isZero(0.0);
  return frame;
}

SequenceSource::SequenceSource(const Configuration& configuration)
    : names_(configuration.inputs),
      sequence_(configuration.inputs, sequenceOptions(configuration)),
      with_images_(usesImages(configuration)),
      selected_(select(configuration.frames, sequence_.size())) {}

std::optional<ImagesUp> SequenceSource::meanUp() const {
  if (sequence_.poseSource() != io::PoseSource::File) return std::nullopt;
  constexpr double kLevel = M_PI / 180.0;  // recorded poses start next to the identity
  const std::optional<Pose> first = sequence_.describe(0).T_world_sensor;
  ImagesUp images;
  images.starts_at_identity = first && Eigen::AngleAxisd(first->linear()).angle() < kLevel;
  Vector3 sum = Vector3::Zero();
  for (const std::size_t index : selected_) {
    const std::optional<Pose> pose = sequence_.describe(index).T_world_sensor;
    if (pose) sum -= pose->linear().col(1);
  }
  images.mean = sum;
  return images;
}

std::optional<Frame> SequenceSource::next() {
  if (position_ == selected_.size()) return std::nullopt;
  Frame frame = readFrame(sequence_, selected_[position_++], with_images_);
  frame.is_last = position_ == selected_.size();
  return frame;
}

FrameCloud::Ptr cloudOf(const std::vector<float>& xyz, std::uint32_t width, std::uint32_t height) {
  FrameCloud::Ptr cloud = pcl::make_shared<FrameCloud>();
  cloud->points.resize(xyz.size() / 3);
  for (std::size_t i = 0; i < cloud->size(); ++i)
    cloud->points[i] = pcl::PointXYZ(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
  cloud->width = width;
  cloud->height = height;
  cloud->is_dense = false;
  return cloud;
}

PointsView pointsOf(const FrameCloud& cloud) {
  static_assert(sizeof(pcl::PointXYZ) % sizeof(float) == 0, "points are read as rows of floats");
  PointsView view(reinterpret_cast<const float*>(cloud.points.data()), cloud.size());
  view.stride = sizeof(pcl::PointXYZ) / sizeof(float);
  view.width = cloud.width;
  view.height = cloud.height;
  return view;
}

FrameSource::~FrameSource() = default;

std::optional<ImagesUp> FrameSource::meanUp() const {
  return std::nullopt;
}

std::vector<std::string> FrameSource::notes() const {
  return {};
}

}  // namespace planar_mapping
