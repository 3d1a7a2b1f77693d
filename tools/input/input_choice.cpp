// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "input_choice.h"

#include <algorithm>
#include <filesystem>

#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/sequence_source.h"

namespace planar_mapping::tools {
namespace {

namespace fs = std::filesystem;

struct Ready {
  const char* name;
  std::vector<std::string> assignments;
  std::string why;
};

Ready choosePair(const io::Sequence& sequence) {
  constexpr double kCarBaseline = 0.3;  // metres; wider pairs are mounted on cars
  const double baseline = *sequence.calibration()->baseline;
  if (baseline > kCarBaseline) return {"stereo_outdoor.yaml", {}, "baseline above 0.3 m"};
  return {"stereo_indoor.yaml", {}, "stereo_outdoor.yaml is for wide places"};
}

/// Do the files say where the sensor was? The first ones are enough to know.
bool haveViewpoints(const io::Sequence& sequence) {
  constexpr std::size_t kMaxFiles = 10;
  for (std::size_t i = 0; i < std::min(kMaxFiles, sequence.size()); ++i) {
    const Pose pose = io::readCloudFileInfo(sequence.path(i)).T_world_sensor;
    if (pose.matrix() != Pose::Identity().matrix()) return true;
  }
  return false;
}

Ready chooseClouds(const io::Sequence& sequence) {
  const bool has_poses = sequence.poseSource() == io::PoseSource::File || haveViewpoints(sequence);
  if (sequence.size() == 1)
    return {"single_pcd.yaml",
            {},
            has_poses ? "" : "none is given: the sensor is taken to be at the origin"};
  Ready ready = {"pcd_sequence.yaml", {}, ""};
  if (!has_poses) {
    ready.assignments.emplace_back("motion_estimation.enabled=true");
    ready.why = "without poses their motion is estimated; --poses FILE gives them";
  }
  return ready;
}

}  // namespace

InputChoice chooseConfiguration(const std::string& input, const io::Sequence& sequence) {
  Ready ready;
  switch (sequence.kind()) {
    case io::SequenceKind::Stereo:
      ready = choosePair(sequence);
      break;
    case io::SequenceKind::Rgbd:
      ready = {"rgbd_indoor.yaml", {}, ""};
      break;
    case io::SequenceKind::Clouds:
      ready = chooseClouds(sequence);
      break;
  }
  InputChoice choice;
  choice.configuration = findConfiguration(ready.name);
  choice.assignments = ready.assignments;
  std::string settings;
  for (const std::string& assignment : ready.assignments) settings += " --set " + assignment;
  for (const std::string& note : describe(sequence))
    choice.sentence += (choice.sentence.empty() ? input + ": " : "; ") + note;
  choice.sentence += "; configuration " + choice.configuration + settings +
                     (ready.why.empty() ? "" : " (" + ready.why + ")");
  return choice;
}

bool isConfigurationName(const std::string& word) {
  const std::string extension = fs::path(word).extension().string();
  return extension == ".yaml" || extension == ".yml";
}

}  // namespace planar_mapping::tools
