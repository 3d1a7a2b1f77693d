// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/sequence.h"

#include <algorithm>
#include <filesystem>

#include "planar_mapping/core/error.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/pose_file.h"

namespace planar_mapping {
namespace io {
namespace {

namespace fs = std::filesystem;

bool isDirectory(const std::string& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

bool exists(const std::string& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

std::string joined(const std::string& directory, const std::string& name) {
  return (fs::path(directory) / name).string();
}

/// The regular files of a directory in name order, hidden ones (and so temporary ones) left out.
std::vector<std::string> filesOf(const std::string& directory) {
  std::vector<std::string> names;
  std::error_code error;
  fs::directory_iterator entry(directory, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    std::error_code ignored;
    const std::string name = entry->path().filename().string();
    if (name.front() != '.' && entry->is_regular_file(ignored)) names.push_back(name);
  }
  if (error) throw IoError(directory, "cannot be listed: " + error.message());
  std::sort(names.begin(), names.end());
  for (std::string& name : names) name = joined(directory, name);
  return names;
}

std::vector<std::string> cloudFilesOf(const std::string& directory) {
  std::vector<std::string> files;
  for (const std::string& file : filesOf(directory))
    if (recognizeCloudFile(file) != CloudFormat::None) files.push_back(file);
  return files;
}

std::vector<std::string> imageFilesOf(const std::string& directory) {
  std::vector<std::string> files;
  for (const std::string& file : filesOf(directory)) {
    const std::string extension = fs::path(file).extension().string();
    if (extension == ".png" || extension == ".jpg" || extension == ".jpeg") files.push_back(file);
  }
  return files;
}

std::string stemOf(const std::string& path) {
  return fs::path(path).stem().string();
}

}  // namespace

struct Sequence::Impl {
  SequenceKind kind = SequenceKind::Clouds;
  PoseSource pose_source = PoseSource::Viewpoint;
  std::vector<std::string> files;
  std::vector<std::string> color_files;  ///< of RGB-D; as many as files, or none
  std::vector<StampedPose> poses;
  std::string poses_file;
  std::optional<Calibration> calibration;
  std::optional<DepthProjector> projector;

  void addInput(const std::string& input, bool only_input);
  void addFolder(const std::string& folder);
  void openRgbd(const std::string& folder);
  void readPoses();
  void readRgbd(std::size_t index, const CloudChannels& channels, Frame& frame) const;
};

void Sequence::Impl::addInput(const std::string& input, bool only_input) {
  if (!exists(input)) throw IoError(input, "no such file or directory");
  if (!isDirectory(input)) {
    // Recognised when it is read; here only what would not be readable at all is refused early.
    if (recognizeCloudFile(input) == CloudFormat::None) readCloudFileInfo(input);
    files.push_back(input);
    return;
  }
  const bool is_sequence =
      exists(joined(input, "calib.yaml")) || isDirectory(joined(input, "clouds")) ||
      isDirectory(joined(input, "depth")) || isDirectory(joined(input, "left"));
  if (is_sequence) {
    if (!only_input) throw IoError(input, "a sequence folder must be the only input");
    addFolder(input);
    return;
  }
  const std::vector<std::string> clouds = cloudFilesOf(input);
  if (clouds.empty())
    throw IoError(input,
                  "holds neither PCD or PLY files nor a sequence (calib.yaml with clouds/, "
                  "depth/ or left/ and right/)");
  files.insert(files.end(), clouds.begin(), clouds.end());
  const std::string own_poses = joined(input, "poses.txt");
  if (only_input && poses_file.empty() && exists(own_poses)) poses_file = own_poses;
}

void Sequence::Impl::addFolder(const std::string& folder) {
  const std::string calib = joined(folder, "calib.yaml");
  if (exists(calib)) calibration = readCalibration(calib);
  const std::string own_poses = joined(folder, "poses.txt");
  if (poses_file.empty() && exists(own_poses)) poses_file = own_poses;

  const std::string clouds = joined(folder, "clouds");
  if (isDirectory(clouds)) {
    files = cloudFilesOf(clouds);
    if (files.empty()) throw IoError(clouds, "holds no PCD or PLY files");
  } else if (isDirectory(joined(folder, "depth"))) {
    openRgbd(folder);
  } else if (isDirectory(joined(folder, "left"))) {
    throw IoError(folder,
                  "is a stereo sequence (left/, right/), and this build has no stereo "
                  "front-end; give clouds/ or depth/ instead");
  } else {
    throw IoError(folder, "has a calib.yaml, but neither clouds/ nor depth/ nor left/ and right/");
  }
}

void Sequence::Impl::openRgbd(const std::string& folder) {
  const std::string calib = joined(folder, "calib.yaml");
  if (!calibration) throw IoError(calib, "no such file; an RGB-D sequence needs it");
  if (!calibration->depth_scale)
    throw IoError(calib, "has no key 'depth_scale', which depth/ needs");
  kind = SequenceKind::Rgbd;
  pose_source = PoseSource::None;
  projector.emplace(calibration->camera, *calibration->depth_scale);
  const std::string depth = joined(folder, "depth");
  files = imageFilesOf(depth);
  if (files.empty()) throw IoError(depth, "holds no PNG images");

  const std::string rgb = joined(folder, "rgb");
  if (!isDirectory(rgb)) return;
  const std::vector<std::string> colors = imageFilesOf(rgb);
  const bool match =
      std::equal(files.begin(), files.end(), colors.begin(), colors.end(),
                 [](const std::string& a, const std::string& b) { return stemOf(a) == stemOf(b); });
  if (!match)
    throw IoError(folder, "rgb/ (" + std::to_string(colors.size()) + " images) and depth/ (" +
                              std::to_string(files.size()) + ") do not match by file name");
  color_files = colors;
}

void Sequence::Impl::readPoses() {
  if (poses_file.empty()) return;
  poses = readTumPoses(poses_file);
  if (poses.size() != files.size())
    throw IoError(poses_file, "holds " + std::to_string(poses.size()) + " poses for " +
                                  std::to_string(files.size()) +
                                  " frames; it needs a line for each, in their order");
  pose_source = PoseSource::File;
}

void Sequence::Impl::readRgbd(std::size_t index, const CloudChannels& channels,
                              Frame& frame) const {
  const std::string& path = files[index];
  const DepthImage depth = readDepthPng(path);
  try {
    projector->project(depth, frame.cloud);
  } catch (const InputError& error) {
    throw IoError(path, error.what());
  }
  // JPEG colours are left out: colour is for display only, and not worth another library here.
  if (!channels.colors || color_files.empty() || fs::path(color_files[index]).extension() != ".png")
    return;
  ColorImage color = readColorPng(color_files[index]);
  if (color.width != depth.width || color.height != depth.height)
    throw IoError(color_files[index], "has another size than its depth image");
  frame.cloud.colors = std::move(color.pixels);
}

Sequence::Sequence(const std::vector<std::string>& inputs, const std::string& poses_file)
    : impl_(std::make_unique<Impl>()) {
  if (inputs.empty()) throw InputError("no input given");
  impl_->poses_file = poses_file;
  for (const std::string& input : inputs) impl_->addInput(input, inputs.size() == 1);
  impl_->readPoses();
}

Sequence::~Sequence() = default;
Sequence::Sequence(Sequence&& other) noexcept = default;
Sequence& Sequence::operator=(Sequence&& other) noexcept = default;

SequenceKind Sequence::kind() const {
  return impl_->kind;
}
PoseSource Sequence::poseSource() const {
  return impl_->pose_source;
}
std::size_t Sequence::size() const {
  return impl_->files.size();
}
const std::optional<Calibration>& Sequence::calibration() const {
  return impl_->calibration;
}

const std::string& Sequence::path(std::size_t index) const {
  if (index >= size())
    throw InputError("frame " + std::to_string(index) + " of " + std::to_string(size()));
  return impl_->files[index];
}

Frame Sequence::read(std::size_t index, const CloudChannels& channels) const {
  Frame frame;
  frame.index = index;
  frame.name = fs::path(path(index)).filename().string();
  frame.timestamp = static_cast<double>(index);
  if (impl_->calibration) frame.camera = impl_->calibration->camera;
  if (impl_->kind == SequenceKind::Rgbd) {
    impl_->readRgbd(index, channels, frame);
  } else {
    frame.cloud = readCloudFile(impl_->files[index], channels);
    // The calibration speaks of organized clouds of its own size only.
    if (frame.camera && (frame.cloud.width != static_cast<std::uint32_t>(frame.camera->width) ||
                         frame.cloud.height != static_cast<std::uint32_t>(frame.camera->height)))
      frame.camera.reset();
  }
  if (impl_->pose_source == PoseSource::File) {
    frame.timestamp = impl_->poses[index].timestamp;
    frame.T_world_sensor = impl_->poses[index].pose;
  } else if (impl_->pose_source == PoseSource::Viewpoint) {
    frame.T_world_sensor = frame.cloud.T_world_sensor;
  }
  return frame;
}

}  // namespace io
}  // namespace planar_mapping
