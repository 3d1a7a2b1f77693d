// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <iostream>
#include <map>
#include <memory>

#include "evaluation/simulation/simulated_sequence.h"
#include "frame_command.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/io/pose_file.h"

namespace planar_mapping::tools {
namespace {

const std::map<std::string, evaluation::Path> kPaths = {{"forward", evaluation::Path::Forward},
                                                        {"return", evaluation::Path::Return},
                                                        {"back", evaluation::Path::Back},
                                                        {"standing", evaluation::Path::Standing}};

struct SimulateArguments {
  evaluation::SimulationParams params;
  std::string directory;
  std::string content = "clouds", path = "forward";
  double yaw_deg = 0.0;
  std::vector<double> drift;  // metres, degrees
  int walks = 1;
  bool perfect = false;
  bool force = false;
  bool quiet = false;
};

void addOptions(CLI::App& command, SimulateArguments& arguments) {
  evaluation::SimulationParams& params = arguments.params;
  std::string scenes;
  for (const std::string& name : evaluation::sceneNames())
    scenes += (scenes.empty() ? "" : ", ") + name;
  command.add_option("scene", params.scene, "Scene: " + scenes)
      ->required()
      ->check(CLI::IsMember(evaluation::sceneNames()));
  command.add_option("-o,--output", arguments.directory, "Directory the sequence is written to")
      ->required();
  command.option_defaults()->always_capture_default();
  command
      .add_option(
          "--write", arguments.content,
          "clouds: measured clouds; images: rectified pairs with the truth of their pixels; "
          "both: images, and the clouds in DIR/measured; description: nothing but what RGB-D "
          "frames "
          "are made from by whoever reads DIR")
      ->transform(CLI::IsMember({"clouds", "images", "both", "description"}, CLI::ignore_case))
      ->option_text("clouds|images|both|description [clouds]");
  command.add_option("--frames", params.frames, "Frames along the path, >= 1");
  command
      .add_option("--path", arguments.path,
                  "forward: once through the scene; return: there, a turn, and back (room: two "
                  "rounds); back: there and back without a turn; standing: all frames from the "
                  "first place")
      ->transform(CLI::IsMember(kPaths, CLI::ignore_case))
      ->option_text("forward|return|back|standing [forward]");
  command.add_option("--step", params.step,
                     "Metres between frames, >= 0; 0 = the frames are spread over the whole path");
  command.add_option("--length", params.length,
                     "Length of the corridor, metres, 8 to 1000; 0 = the hand-made one of 16 m");
  command.add_option("--floors", params.floors, "Storeys of the building, 1 to 20");
  command.add_option("--rooms", params.rooms, "Rooms on each floor of the building, 2 to 200");
  command
      .add_option("--walks", arguments.walks,
                  "Ways through the building, each a sequence DIR/walk_N; 1 = DIR itself")
      ->check(CLI::Range(1, 10000));
  command
      .add_option("--odometry-drift", arguments.drift,
                  "Also writes odometry.txt, the poses as an odometer has them: off by so many "
                  "metres and degrees in the end, growing evenly, every second walk the other way")
      ->delimiter(',')
      ->expected(2)
      ->option_text("METRES,DEGREES");
  command.add_flag("--moving", params.moving,
                   "Adds a person who leaves, in the corridor a door that opens, in the building "
                   "people who walk about");
  command
      .add_option("--seed", params.seed,
                  "Seed of the noise, and of the layout of white and building")
      ->check(CLI::Range(std::int64_t{0}, RunSettings::kLargestSeed));
  addChecked(command, "--yaw-deg", arguments.yaw_deg, numberIn(-3600.0, 3600.0),
             "Turns the whole world about z, degrees");
  command.add_option("--width", params.width, "Image width, pixels, 8 to 8192");
  command.add_option("--height", params.height, "Image height, pixels, 8 to 8192");
  command.add_option("--focal-length", params.focal_length,
                     "Focal length, pixels; 0 = 500 for a width of 640, in proportion");
  command.add_option("--baseline", params.sensor.baseline, "Stereo baseline, metres, > 0");
  command.add_option("--noise-px", params.sensor.noise_px,
                     "Standard deviation of the disparity, pixels, >= 0");
  addChecked(command, "--wrong-matches", params.sensor.wrong_fraction, numberIn(0.0, 1.0),
             "Fraction of the measured pixels with a random disparity instead");
  addChecked(command, "--plain-share", params.plain_fraction, numberIn(0.0, 1.0),
             "Fraction of all surface that has no texture, in patches");
  command.add_option("--image-noise", params.image_noise,
                     "Standard deviation of the images' pixels, gray levels of 255");
  command.add_option("--right-exposure", params.right_exposure,
                     "Brightness of the right images, where the left ones have 1, > 0");
  command.add_flag("--color", params.color_images, "Images in RGB instead of gray");
  command.add_flag("--perfect", arguments.perfect, "No noise, holes or flying pixels");
  command.add_option("--threads", params.threads, "0 = all cores; changes nothing but the time");
  command.add_flag("--force", arguments.force, "Overwrite files that exist");
  command.add_flag("-q,--quiet", arguments.quiet, "No progress");
}

/// \param drift  metres and degrees after the last pose
void writeOdometry(const std::string& directory, const std::vector<double>& drift, bool force) {
  std::vector<io::StampedPose> poses = io::readTumPoses(directory + "/poses.txt");
  const Vector3 axis = Vector3(0.4, 0.2, 0.9).normalized();
  const Vector3 shift = drift[0] * Vector3(0.6, 0.5, 0.6).normalized();
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(poses.size() - 1);
    poses[i].pose.prerotate(Eigen::AngleAxisd(drift[1] * kRadiansPerDegree * part, axis));
    poses[i].pose.pretranslate(part * shift);
  }
  io::writeTumPoses(directory + "/odometry.txt", poses,
                    force ? io::Overwrite::Allow : io::Overwrite::Refuse);
}

void simulate(const SimulateArguments& arguments) {
  if (arguments.walks > 1) {
    SimulateArguments one = arguments;
    one.walks = 1;
    for (int walk = 0; walk < arguments.walks; ++walk) {
      one.params.walk = walk;
      for (double& drift : one.drift) drift *= walk > 0 ? -1.0 : 1.0;
      one.directory = arguments.directory + "/walk_" + std::to_string(walk);
      simulate(one);
    }
    return;
  }
  const evaluation::SimulationParams& params = arguments.params;
  const evaluation::Simulation simulation(params);
  const bool show = !arguments.quiet && ::isatty(STDERR_FILENO) == 1;
  const auto progress = [&](std::size_t done) {
    if (show) countFrames(done, simulation.size());
  };
  writeResults([&]() {
    if (arguments.content == "description") {
      evaluation::writeDescription(simulation, arguments.directory, arguments.force);
    } else {
      evaluation::writeSequence(simulation, arguments.directory, arguments.force, progress);
    }
    if (!arguments.drift.empty())
      writeOdometry(arguments.directory, arguments.drift, arguments.force);
  });
  if (!arguments.quiet)
    std::cout << arguments.directory << ": " << detail::counted(simulation.size(), "frame")
              << " of " << params.width << " x " << params.height << ", "
              << simulation.scene().objects.size() << " objects, " << simulation.planes().size()
              << " planes\n";
}

}  // namespace

void addSimulateCommand(CLI::App& app, int&) {
  auto* command =
      app.add_subcommand("simulate", "A stereo sequence of a generated scene with exact truth");
  const auto arguments = std::make_shared<SimulateArguments>();
  arguments->params.threads = 0;
  io::setFrameMaker(evaluation::openSimulation);
  addOptions(*command, *arguments);
  command->callback([arguments]() {
    evaluation::SimulationParams& params = arguments->params;
    params.yaw = arguments->yaw_deg * kRadiansPerDegree;
    params.path = kPaths.at(arguments->path);
    if (arguments->walks > 1 && params.scene != "building")
      throw UsageError("--walks is of the building");
    params.clouds = arguments->content != "images";
    params.images = arguments->content == "images" || arguments->content == "both";
    if (arguments->perfect) {
      const double baseline = params.sensor.baseline;
      params.sensor = evaluation::StereoSensorParams::perfect();
      params.sensor.baseline = baseline;
      params.image_noise = 0.0;
    }
    try {
      simulate(*arguments);
    } catch (const ParameterError& error) {
      throw UsageError(error.what());
    }
  });
}

}  // namespace planar_mapping::tools
