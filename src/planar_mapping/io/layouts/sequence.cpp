// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/layouts/sequence.h"

#include <cmath>
#include <filesystem>
#include <iterator>
#include <mutex>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/layouts/layout.h"

namespace planar_mapping::io {
namespace {

/// Images of a camera with lens distortion as the same camera without it sees them. Images of
/// another size are returned as they are: who uses them says so.
class Undistorter {
 public:
  Undistorter(const PinholeCamera& camera, const LensDistortion& lens)
      : width_(camera.width), height_(camera.height) {
    for (int row = 0; row < height_; ++row) {
      for (int column = 0; column < width_; ++column) {
        const double x = (column - camera.cx) / camera.fx, y = (row - camera.cy) / camera.fy;
        const double r2 = x * x + y * y;
        const double radial = 1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
        const double from_x = x * radial + 2.0 * lens.p1 * x * y + lens.p2 * (r2 + 2.0 * x * x);
        const double from_y = y * radial + lens.p1 * (r2 + 2.0 * y * y) + 2.0 * lens.p2 * x * y;
        const double u = camera.fx * from_x + camera.cx, v = camera.fy * from_y + camera.cy;
        const bool is_inside = u >= 0.0 && v >= 0.0 && u <= width_ - 1 && v <= height_ - 1;
        columns_.push_back(is_inside ? static_cast<float>(u) : -1.0f);
        rows_.push_back(is_inside ? static_cast<float>(v) : -1.0f);
      }
    }
  }

  /// The nearest pixel's depth: one between two surfaces is none of both.
  DepthImage undistorted(const DepthImage& image) const {
    if (image.values.size() != columns_.size() || static_cast<int>(image.width) != width_)
      return image;
    DepthImage out{image.width, image.height, std::vector<std::uint16_t>(columns_.size(), 0)};
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (columns_[i] < 0.0f) continue;
      const auto column = static_cast<std::size_t>(columns_[i] + 0.5f);
      const auto row = static_cast<std::size_t>(rows_[i] + 0.5f);
      out.values[i] = image.values[row * image.width + column];
    }
    return out;
  }

  /// Linear between pixels; black outside.
  Image undistorted(const Image& image) const {
    if (image.width != width_ || image.height != height_) return image;
    Image out = image;
    const auto channels = static_cast<std::size_t>(image.channels);
    const auto stride = static_cast<std::size_t>(width_) * channels;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const bool is_inside = columns_[i] >= 0.0f;
      const auto column = static_cast<std::size_t>(is_inside ? columns_[i] : 0.0f);
      const auto row = static_cast<std::size_t>(is_inside ? rows_[i] : 0.0f);
      const float a = columns_[i] - static_cast<float>(column);
      const float b = rows_[i] - static_cast<float>(row);
      const std::size_t right = static_cast<int>(column) + 1 < width_ ? channels : 0;
      const std::size_t below = static_cast<int>(row) + 1 < height_ ? stride : 0;
      for (std::size_t c = 0; c < channels; ++c) {
        const std::uint8_t* p = &image.pixels[row * stride + column * channels + c];
        const float value = (1.0f - b) * ((1.0f - a) * p[0] + a * p[right]) +
                            b * ((1.0f - a) * p[below] + a * p[below + right]);
        out.pixels[i * channels + c] = is_inside ? static_cast<std::uint8_t>(value + 0.5f) : 0;
      }
    }
    return out;
  }

 private:
  int width_, height_;
  std::vector<float> columns_, rows_;  ///< where each pixel comes from; -1 = from outside
};

std::string sizeText(const Image& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height);
}

std::unique_ptr<const FrameMaker> (*open_maker)(const std::string&) = nullptr;

/// 0xRRGGBB a pixel.
std::vector<std::uint32_t> packedColors(const Image& image) {
  std::vector<std::uint32_t> colors;
  const auto channels = static_cast<std::size_t>(image.channels);
  colors.reserve(image.pixels.size() / channels);
  for (std::size_t i = 0; i < image.pixels.size(); i += channels) {
    const std::uint8_t* pixel = &image.pixels[i];
    const std::uint8_t* last = pixel + channels - 1;  // of gray, the same as the first
    colors.push_back(std::uint32_t{pixel[0]} << 16u | std::uint32_t{pixel[channels / 2]} << 8u |
                     *last);
  }
  return colors;
}

}  // namespace

struct Sequence::Impl {
  layouts::Description sequence{"cloud files"};
  SequenceOptions options;
  std::optional<DepthProjector> projector;
  std::optional<Undistorter> undistorter;
  mutable std::once_flag maker_opened;
  mutable std::unique_ptr<const FrameMaker> maker;

  void addInput(const std::string& input, bool only_input) {
    if (!layouts::exists(input)) throw IoError(input, "no such file or directory");
    if (!layouts::isDirectory(input)) {
      // Recognised when it is read; here only what would not be readable at all is refused early.
      if (recognizeCloudFile(input) == CloudFormat::None) readCloudFileInfo(input);
      sequence.frames.push_back({input, {}, {}, {}});
      return;
    }
    if (only_input) {
      sequence = layouts::readFolder(input, options);
      return;
    }
    if (layouts::isSequenceFolder(input))
      throw IoError(input, "a sequence folder must be the only input");
    SequenceOptions without_poses = options;
    without_poses.poses_file = input;  // poses.txt is of one directory's files only
    layouts::Description folder = layouts::readFolder(input, without_poses);
    std::move(folder.frames.begin(), folder.frames.end(), std::back_inserter(sequence.frames));
  }

  /// What images need to be of use.
  void requireCalibration(const std::string& input) const {
    if (sequence.kind == SequenceKind::Clouds) return;
    const std::string file = options.calibration_file.empty() ? layouts::joined(input, "calib.yaml")
                                                              : options.calibration_file;
    const Calibration& known = *sequence.calibration;
    if (sequence.kind == SequenceKind::Rgbd && !known.depth_scale)
      throw IoError(file, "has no key 'depth_scale', which depth images need");
    if (sequence.kind == SequenceKind::Stereo && !known.baseline)
      throw IoError(file, "has no key 'baseline_m', which image pairs need");
  }

  void requireWorldClouds(const std::string& input) const {
    if (sequence.kind == SequenceKind::Clouds) return;
    throw InputError(input +
                     ": these are images, in the frame of their camera; the position of the sensor "
                     "(--origin, sensor_origin_m) is for clouds in the coordinates of the world");
  }

  void makeFrame(const std::string& path, const CloudChannels& channels, Frame& frame) const {
    if (open_maker == nullptr)
      throw IoError(path, "its frames can be made by the program planar_map only");
    std::call_once(maker_opened, [&]() { maker = open_maker(path); });
    maker->make(frame.index, frame);
    if (channels.colors) frame.cloud.colors = packedColors(frame.left);
  }

  void readRgbd(const layouts::FrameEntry& entry, const CloudChannels& channels, bool images,
                Frame& frame) const {
    const std::string& path = entry.file;
    const PinholeCamera& camera = sequence.calibration->camera;
    try {
      DepthImage depth = readDepthPng(path);
      if (undistorter) depth = undistorter->undistorted(depth);
      projector->project(depth, frame.cloud);
    } catch (const InputError& error) {
      throw IoError(path, error.what());
    }
    if (!sequence.has_color || !(images || channels.colors)) return;
    const std::string& partner = entry.partner;
    if (partner.empty()) throw IoError(path, "has no image of the same name in rgb/");
    Image image = readImage(partner);
    if (image.width != camera.width || image.height != camera.height) {
      // Of the same shape it shows about the same: many colour cameras have more pixels.
      constexpr double kSameShape = 0.01;
      const double across = static_cast<double>(image.width) / camera.width;
      const double down = static_cast<double>(image.height) / camera.height;
      if (!(std::abs(across - down) <= kSameShape * down))
        throw IoError(partner, "is " + sizeText(image) +
                                   ", another shape than its depth image: resample it to what the "
                                   "depth camera sees, or remove rgb/ to map depth alone");
      image = scaledTo(image, camera.width, camera.height);
    }
    if (undistorter) image = undistorter->undistorted(image);
    if (channels.colors) frame.cloud.colors = packedColors(image);
    if (images) frame.left = std::move(image);
  }

  void readPair(const layouts::FrameEntry& entry, Frame& frame) const {
    const std::string& path = entry.file;
    const std::string& partner = entry.partner;
    if (partner.empty()) throw IoError(path, "has no right image of the same name");
    if (!layouts::exists(path))
      throw IoError(path, "no such file, but there is a right image of this name");
    frame.left = readImage(path);
    frame.right = readImage(partner);
    const PinholeCamera& camera = sequence.calibration->camera;
    if (frame.right.width != frame.left.width || frame.right.height != frame.left.height)
      throw IoError(partner,
                    "is " + sizeText(frame.right) + ", its left image " + sizeText(frame.left));
    if (frame.left.width != camera.width || frame.left.height != camera.height)
      throw IoError(path, "is " + sizeText(frame.left) + ", but its calibration says " +
                              std::to_string(camera.width) + " x " + std::to_string(camera.height));
  }
};

FrameMaker::~FrameMaker() = default;

void setFrameMaker(std::unique_ptr<const FrameMaker> (*open)(const std::string&)) {
  open_maker = open;
}

Sequence::Sequence(const std::vector<std::string>& inputs, const SequenceOptions& options)
    : impl_(std::make_unique<Impl>()) {
  if (inputs.empty()) throw InputError("no input given");
  impl_->options = options;
  layouts::Description& sequence = impl_->sequence;
  sequence.pose_source = PoseSource::Viewpoint;
  for (const std::string& input : inputs) impl_->addInput(input, inputs.size() == 1);
  if (!options.calibration_file.empty())
    sequence.calibration = readCalibration(options.calibration_file);
  impl_->requireCalibration(inputs.front());
  if (sequence.kind == SequenceKind::Rgbd) {
    const Calibration& calibration = *sequence.calibration;
    impl_->projector.emplace(calibration.camera, *calibration.depth_scale,
                             calibration.depth_along_ray);
    if (calibration.distortion)
      impl_->undistorter.emplace(calibration.camera, *calibration.distortion);
  }
  if (options.sensor_origin) {
    impl_->requireWorldClouds(inputs.front());
    sequence.pose_source = PoseSource::Origin;
  } else if (!options.poses_file.empty()) {
    layouts::addPoses(options.poses_file, readTrajectory(options.poses_file),
                      layouts::PosesBy::Line, Pose::Identity(), options, sequence);
  }
}

Sequence::~Sequence() = default;
Sequence::Sequence(Sequence&& other) noexcept = default;
Sequence& Sequence::operator=(Sequence&& other) noexcept = default;

const std::string& Sequence::layout() const {
  return impl_->sequence.layout;
}
const std::vector<std::string>& Sequence::notes() const {
  return impl_->sequence.notes;
}
SequenceKind Sequence::kind() const {
  return impl_->sequence.kind;
}
PoseSource Sequence::poseSource() const {
  return impl_->sequence.pose_source;
}
std::size_t Sequence::size() const {
  return impl_->sequence.frames.size();
}
const std::optional<Calibration>& Sequence::calibration() const {
  return impl_->sequence.calibration;
}

const std::string& Sequence::path(std::size_t index) const {
  if (index >= size())
    throw InputError("frame " + std::to_string(index) + " of " + std::to_string(size()));
  return impl_->sequence.frames[index].file;
}

std::vector<std::string> Sequence::files(std::size_t index) const {
  std::vector<std::string> files = {path(index)};
  const std::string& partner = impl_->sequence.frames[index].partner;
  if (!partner.empty()) files.push_back(partner);
  return files;
}

Frame Sequence::describe(std::size_t index) const {
  Frame frame;
  frame.index = index;
  frame.name = std::filesystem::path(path(index)).filename().string();
  const layouts::FrameEntry& entry = impl_->sequence.frames[index];
  frame.timestamp = entry.timestamp.value_or(static_cast<double>(index));
  frame.T_world_sensor = entry.T_world_sensor;
  if (calibration()) frame.camera = calibration()->camera;
  return frame;
}

Frame Sequence::read(std::size_t index, const CloudChannels& channels, bool images) const {
  Frame frame = describe(index);
  const layouts::FrameEntry& entry = impl_->sequence.frames[index];
  switch (kind()) {
    case SequenceKind::Rgbd:
      if (impl_->sequence.is_made) {
        impl_->makeFrame(entry.file, channels, frame);
      } else {
        impl_->readRgbd(entry, channels, images, frame);
      }
      break;
    case SequenceKind::Stereo:
      impl_->readPair(entry, frame);
      break;
    case SequenceKind::Clouds:
      frame.cloud = readCloudFile(entry.file, channels);
      if (impl_->options.scale != 1.0) scaleCloud(frame.cloud, impl_->options.scale);
      if (impl_->options.sensor_origin) placeSensor(frame.cloud, *impl_->options.sensor_origin);
      // The calibration speaks of organized clouds of its own size only.
      if (frame.camera && (frame.cloud.width != static_cast<std::uint32_t>(frame.camera->width) ||
                           frame.cloud.height != static_cast<std::uint32_t>(frame.camera->height)))
        frame.camera.reset();
      break;
  }
  if (poseSource() == PoseSource::Viewpoint || poseSource() == PoseSource::Origin) {
    frame.T_world_sensor = frame.cloud.T_world_sensor;
  } else if (frame.T_world_sensor) {
    frame.T_world_sensor->translate(frame.cloud.origin);
  }
  constexpr double kFarthest = 1e9;  // metres, as PlanarMapParams::origin
  if (frame.T_world_sensor &&
      !(frame.T_world_sensor->translation().cwiseAbs().maxCoeff() <= kFarthest))
    throw IoError(entry.file, "its pose is farther than 1e9 m from the origin of the world");
  return frame;
}

}  // namespace planar_mapping::io
