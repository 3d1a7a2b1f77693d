// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/sequence.h"

#include <algorithm>
#include <filesystem>
#include <map>

#include "planar_mapping/core/base/error.h"
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

/// Paths by file name without extension.
using ImagesByName = std::map<std::string, std::string>;

ImagesByName imagesByName(const std::string& directory) {
  ImagesByName images;
  for (const std::string& file : imageFilesOf(directory)) {
    if (!images.emplace(stemOf(file), file).second)
      throw IoError(file, "another image of this name stands beside it");
  }
  return images;
}

std::string sizeText(const Image& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height);
}

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
  SequenceKind kind = SequenceKind::Clouds;
  PoseSource pose_source = PoseSource::Viewpoint;
  std::vector<std::string> files;
  /// Colour images of RGB-D or right images of pairs, one a file; "" where it is missing.
  std::vector<std::string> partners;
  std::vector<StampedPose> poses;
  SequenceOptions options;
  std::optional<Calibration> calibration;
  std::string calibration_file;
  std::optional<DepthProjector> projector;

  void addInput(const std::string& input, bool only_input);
  void addFolder(const std::string& folder);
  void openClouds(const std::string& folder);
  void openRgbd(const std::string& folder);
  void openStereo(const std::string& folder);
  const Calibration& requireCalibration(const char* kind) const;
  void readPoses();
  void readRgbd(std::size_t index, const CloudChannels& channels, bool images, Frame& frame) const;
  void readPair(std::size_t index, Frame& frame) const;
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
  if (only_input && options.poses_file.empty() && exists(own_poses)) options.poses_file = own_poses;
}

void Sequence::Impl::addFolder(const std::string& folder) {
  calibration_file = joined(folder, "calib.yaml");
  if (exists(calibration_file)) calibration = readCalibration(calibration_file);
  const std::string own_poses = joined(folder, "poses.txt");
  if (options.poses_file.empty() && exists(own_poses)) options.poses_file = own_poses;

  std::vector<SequenceKind> kinds;
  if (isDirectory(joined(folder, "clouds"))) kinds.push_back(SequenceKind::Clouds);
  if (isDirectory(joined(folder, "depth"))) kinds.push_back(SequenceKind::Rgbd);
  if (isDirectory(joined(folder, "left"))) kinds.push_back(SequenceKind::Stereo);
  if (kinds.empty()) {
    const char* problem = isDirectory(joined(folder, "right"))
                              ? "has right/ but no left/, which a stereo sequence needs"
                              : "has a calib.yaml, but neither clouds/ nor depth/ nor left/ and "
                                "right/";
    throw IoError(folder, problem);
  }
  const bool has_preferred =
      options.preferred && std::find(kinds.begin(), kinds.end(), *options.preferred) != kinds.end();
  kind = has_preferred ? *options.preferred : kinds.front();
  switch (kind) {
    case SequenceKind::Clouds:
      openClouds(folder);
      break;
    case SequenceKind::Rgbd:
      openRgbd(folder);
      break;
    case SequenceKind::Stereo:
      openStereo(folder);
      break;
  }
}

void Sequence::Impl::openClouds(const std::string& folder) {
  const std::string clouds = joined(folder, "clouds");
  files = cloudFilesOf(clouds);
  if (files.empty()) throw IoError(clouds, "holds no PCD or PLY files");
}

const Calibration& Sequence::Impl::requireCalibration(const char* sequence_kind) const {
  if (!calibration)
    throw IoError(calibration_file, std::string("no such file; ") + sequence_kind + " needs it");
  return *calibration;
}

void Sequence::Impl::openRgbd(const std::string& folder) {
  const Calibration& camera = requireCalibration("an RGB-D sequence");
  if (!camera.depth_scale)
    throw IoError(calibration_file, "has no key 'depth_scale', which depth/ needs");
  pose_source = PoseSource::None;
  projector.emplace(camera.camera, *camera.depth_scale);
  const std::string depth = joined(folder, "depth");
  files = imageFilesOf(depth);
  if (files.empty()) throw IoError(depth, "holds no PNG images");

  const std::string rgb = joined(folder, "rgb");
  if (!isDirectory(rgb)) return;
  const ImagesByName colors = imagesByName(rgb);
  std::size_t matches = 0;
  for (const std::string& file : files) {
    const auto color = colors.find(stemOf(file));
    partners.push_back(color == colors.end() ? "" : color->second);
    if (color != colors.end()) ++matches;
  }
  if (matches == 0)
    throw IoError(folder, "rgb/ (" + std::to_string(colors.size()) + " images) and depth/ (" +
                              std::to_string(files.size()) + ") do not match by file name");
}

void Sequence::Impl::openStereo(const std::string& folder) {
  const std::string left = joined(folder, "left");
  const std::string right = joined(folder, "right");
  if (!isDirectory(right)) throw IoError(right, "no such directory; a stereo sequence needs it");
  if (!requireCalibration("a stereo sequence").baseline)
    throw IoError(calibration_file, "has no key 'baseline_m', which left/ and right/ need");
  pose_source = PoseSource::None;
  const ImagesByName left_images = imagesByName(left);
  const ImagesByName right_images = imagesByName(right);
  ImagesByName all = left_images;
  all.insert(right_images.begin(), right_images.end());
  std::size_t pairs = 0;
  for (const auto& entry : all) {
    const auto in_left = left_images.find(entry.first);
    const auto in_right = right_images.find(entry.first);
    files.push_back(in_left == left_images.end()
                        ? joined(left, fs::path(entry.second).filename().string())
                        : in_left->second);
    partners.push_back(in_right == right_images.end() ? "" : in_right->second);
    if (in_left != left_images.end() && in_right != right_images.end()) ++pairs;
  }
  if (pairs == 0)
    throw IoError(folder, "left/ (" + std::to_string(left_images.size()) + " images) and right/ (" +
                              std::to_string(right_images.size()) +
                              ") have no file name in common");
}

void Sequence::Impl::readPoses() {
  if (options.poses_file.empty()) return;
  poses = readTumPoses(options.poses_file);
  if (poses.size() != files.size())
    throw IoError(options.poses_file, "holds " + std::to_string(poses.size()) + " poses for " +
                                          std::to_string(files.size()) +
                                          " frames; it needs a line for each, in their order");
  pose_source = PoseSource::File;
}

void Sequence::Impl::readRgbd(std::size_t index, const CloudChannels& channels, bool images,
                              Frame& frame) const {
  const std::string& path = files[index];
  try {
    projector->project(readDepthPng(path), frame.cloud);
  } catch (const InputError& error) {
    throw IoError(path, error.what());
  }
  if (partners.empty() || !(images || channels.colors)) return;
  const std::string& partner = partners[index];
  if (partner.empty()) throw IoError(path, "has no image of the same name in rgb/");
  Image image = readImage(partner);
  if (image.width != calibration->camera.width || image.height != calibration->camera.height)
    throw IoError(partner, "is " + sizeText(image) + ", another size than its depth image");
  if (channels.colors) frame.cloud.colors = packedColors(image);
  if (images) frame.left = std::move(image);
}

void Sequence::Impl::readPair(std::size_t index, Frame& frame) const {
  const std::string& path = files[index];
  const std::string& partner = partners[index];
  if (!exists(path)) throw IoError(path, "no such file, but right/ has an image of this name");
  if (partner.empty()) throw IoError(path, "has no image of the same name in right/");
  frame.left = readImage(path);
  frame.right = readImage(partner);
  const PinholeCamera& camera = calibration->camera;
  if (frame.right.width != frame.left.width || frame.right.height != frame.left.height)
    throw IoError(partner,
                  "is " + sizeText(frame.right) + ", its left image " + sizeText(frame.left));
  if (frame.left.width != camera.width || frame.left.height != camera.height)
    throw IoError(path, "is " + sizeText(frame.left) + ", but calib.yaml says " +
                            std::to_string(camera.width) + " x " + std::to_string(camera.height));
}

Sequence::Sequence(const std::vector<std::string>& inputs, const SequenceOptions& options)
    : impl_(std::make_unique<Impl>()) {
  if (inputs.empty()) throw InputError("no input given");
  impl_->options = options;
  for (const std::string& input : inputs) impl_->addInput(input, inputs.size() == 1);
  impl_->readPoses();
}

Sequence::Sequence(const std::vector<std::string>& inputs, const std::string& poses_file)
    : Sequence(inputs, SequenceOptions{poses_file, std::nullopt}) {}

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

Frame Sequence::describe(std::size_t index) const {
  Frame frame;
  frame.index = index;
  frame.name = fs::path(path(index)).filename().string();
  frame.timestamp = static_cast<double>(index);
  if (impl_->calibration) frame.camera = impl_->calibration->camera;
  if (impl_->pose_source == PoseSource::File) {
    frame.timestamp = impl_->poses[index].timestamp;
    frame.T_world_sensor = impl_->poses[index].pose;
  }
  return frame;
}

Frame Sequence::read(std::size_t index, const CloudChannels& channels, bool images) const {
  Frame frame = describe(index);
  switch (impl_->kind) {
    case SequenceKind::Rgbd:
      impl_->readRgbd(index, channels, images, frame);
      break;
    case SequenceKind::Stereo:
      impl_->readPair(index, frame);
      break;
    case SequenceKind::Clouds:
      frame.cloud = readCloudFile(impl_->files[index], channels);
      // The calibration speaks of organized clouds of its own size only.
      if (frame.camera && (frame.cloud.width != static_cast<std::uint32_t>(frame.camera->width) ||
                           frame.cloud.height != static_cast<std::uint32_t>(frame.camera->height)))
        frame.camera.reset();
      break;
  }
  if (impl_->pose_source == PoseSource::Viewpoint)
    frame.T_world_sensor = frame.cloud.T_world_sensor;
  return frame;
}

}  // namespace io
}  // namespace planar_mapping
