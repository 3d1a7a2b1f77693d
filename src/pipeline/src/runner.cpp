// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/runner.h"

#include <chrono>
#include <filesystem>
#include <sstream>

#include "planar_mapping/core/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/io/map_json.h"
#include "planar_mapping/io/pose_file.h"
#include "planar_mapping/io/sequence.h"
#include "planar_mapping/pipeline/output.h"
#include "run_statistics.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;

/// A resolved configuration without what does not change the map.
std::string comparable(const std::string& yaml) {
  std::istringstream lines(yaml);
  std::string out;
  for (std::string line; std::getline(lines, line);) {
    if (line.compare(0, 8, "threads:") != 0) out += line + "\n";
  }
  return out;
}

/// One run from input to files.
class Run {
 public:
  Run(Configuration configuration, const RunOptions& options)
      : options_(options),
        pipeline_(prepared(std::move(configuration))),
        sequence_(pipeline_.configuration().inputs, pipeline_.configuration().poses) {}

  RunResult execute();

 private:
  static Configuration prepared(Configuration configuration);
  std::vector<std::size_t> selectedFrames() const;
  std::size_t loadEarlierRun(const std::vector<std::size_t>& frames);
  void replayFrame(std::size_t index);
  void processFrames(const std::vector<std::size_t>& frames);
  void processFrame(std::size_t index);
  Frame readFrame(std::size_t index) const;
  void save(bool interrupted);
  void checkResult();
  bool stopRequested() const { return options_.stop != nullptr && *options_.stop; }
  void log(const std::string& line);
  void warn(const std::string& text);

  const RunOptions& options_;
  Pipeline pipeline_;
  io::Sequence sequence_;
  detail::RunStatistics statistics_;
  std::string log_text_;
  std::size_t skipped_ = 0;  ///< frames an earlier run has done
  RunResult result_;
};

/// Paths made absolute, so that config.resolved.yaml works from anywhere.
Configuration Run::prepared(Configuration configuration) {
  if (configuration.inputs.empty()) {
    throw InputError("there is no input; give it with -i FILE_OR_FOLDER or as 'inputs' in " +
                     configuration.path);
  }
  for (std::string& input : configuration.inputs) {
    input = fs::absolute(input).lexically_normal().string();
  }
  if (!configuration.poses.empty()) {
    configuration.poses = fs::absolute(configuration.poses).lexically_normal().string();
  }
  return configuration;
}

std::vector<std::size_t> Run::selectedFrames() const {
  const FrameSelection& selection = pipeline_.configuration().frames;
  std::vector<std::size_t> frames;
  const auto size = static_cast<std::int64_t>(sequence_.size());
  const std::int64_t last = selection.last < 0 ? size : std::min(selection.last, size);
  for (std::int64_t i = selection.first; i < last; i += selection.step) {
    frames.push_back(static_cast<std::size_t>(i));
  }
  if (frames.empty()) {
    throw InputError("frames " + selection.text() + " select none of the " + std::to_string(size) +
                     " frames of the input");
  }
  return frames;
}

RunResult Run::execute() {
  if (sequence_.poseSource() == io::PoseSource::None) {
    throw InputError(pipeline_.configuration().inputs.front() +
                     ": there are no poses; put poses.txt (TUM: timestamp tx ty tz qx qy qz qw) "
                     "into the folder or give --poses FILE. Estimating the motion comes with the "
                     "stereo front-end");
  }
  const std::vector<std::size_t> frames = selectedFrames();
  const OutputDirectory directory(options_.output, outputFileNames(),
                                  options_.overwrite || options_.resume);
  result_.output = directory.path();
  if (options_.resume) skipped_ = loadEarlierRun(frames);
  log("planar_map " PLANAR_MAPPING_VERSION ", configuration " + pipeline_.configuration().path);
  for (const std::string& input : pipeline_.configuration().inputs) log("input " + input);
  try {
    processFrames(frames);
  } catch (const Error& error) {
    // What was done so far is worth keeping; without any frame there is nothing to save.
    if (statistics_.frames() == 0) throw;
    log(std::string("failed: ") + error.what());
    save(true);
    throw;
  }
  checkResult();
  save(result_.interrupted);
  return std::move(result_);
}

/// \return how many of the frames an earlier run has done
std::size_t Run::loadEarlierRun(const std::vector<std::size_t>& frames) {
  const OutputDirectory directory(options_.output, outputFileNames(), true);
  std::error_code ignored;
  const std::string path = directory.pathOf("map.pmap");
  if (!fs::exists(path, ignored)) return 0;
  const auto text = [&directory](const std::string& name) {
    const std::vector<std::uint8_t> bytes = io::readWholeFile(directory.pathOf(name));
    return std::string(bytes.begin(), bytes.end());
  };
  try {
    const std::string bytes = text("map.pmap");
    pipeline_.continueFrom(
        PlanarMap::deserialize(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()));
    statistics_.restore(pipeline_.configuration(), text("frames.csv"), text("metrics.json"));
    const std::size_t done = statistics_.frames();
    if (done > frames.size()) throw InputError("it holds more frames than are asked for");
    for (std::size_t i = 0; i < done; ++i) replayFrame(frames[i]);
    if (comparable(effectiveYaml(pipeline_.configuration())) !=
        comparable(text("config.resolved.yaml"))) {
      throw InputError("it was made with another configuration or input");
    }
    log_text_ = text("run.log");
    return done;
  } catch (const IoError&) {
    throw;
  } catch (const Error& error) {
    throw InputError(directory.path() + ": this run cannot be resumed: " + error.what() +
                     "; start again with --force");
  }
}

void Run::replayFrame(std::size_t index) {
  Frame frame = readFrame(index);
  pipeline_.replay(frame);
  if (!frame.indices.empty()) statistics_.replay(frame, pipeline_.map());
}

void Run::processFrames(const std::vector<std::size_t>& frames) {
  for (std::size_t i = skipped_; i < frames.size(); ++i) {
    if (stopRequested()) {
      result_.interrupted = true;
      log("interrupted after " + std::to_string(i) + " of " + std::to_string(frames.size()) +
          " frames");
      return;
    }
    processFrame(frames[i]);
  }
}

void Run::processFrame(std::size_t index) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  Frame frame = readFrame(index);
  const double read_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  FrameReport report = pipeline_.process(frame);
  report.read_ms = read_ms;
  for (const std::string& note : frame.notes) log(note);
  for (const std::string& warning : frame.warnings) warn(warning);
  statistics_.add(report, frame, pipeline_.map());
  log("frame " + std::to_string(index) + " " + report.source + ": " +
      std::to_string(report.points_valid) + " points, " + std::to_string(report.planes) +
      " planes, " + std::to_string(report.cuboids) + " cuboids");
  if (options_.progress) {
    options_.progress(statistics_.frames(), selectedFrames().size(), report);
  }
}

Frame Run::readFrame(std::size_t index) const {
  io::Frame read = sequence_.read(index, io::CloudChannels::none());
  Frame frame;
  frame.number = index;
  frame.source = sequence_.path(index);
  frame.timestamp = read.timestamp;
  frame.T_world_sensor = read.T_world_sensor.value_or(Pose::Identity());
  frame.camera = read.camera;
  if (sequence_.calibration()) frame.baseline = sequence_.calibration()->baseline;
  frame.cloud = pcl::make_shared<FrameCloud>();
  const std::size_t count = read.cloud.size();
  frame.cloud->points.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float* p = &read.cloud.xyz[3 * i];
    frame.cloud->points[i] = pcl::PointXYZ(p[0], p[1], p[2]);
  }
  frame.cloud->width = read.cloud.width;
  frame.cloud->height = read.cloud.height;
  frame.cloud->is_dense = false;
  return frame;
}

void Run::checkResult() {
  if (result_.interrupted || skipped_ > 0) return;
  if (statistics_.validPoints() == 0) {
    throw InputError(pipeline_.configuration().inputs.front() +
                     ": no point is finite, so there is nothing to map; check how it was recorded");
  }
  const PlanarMap& map = pipeline_.map();
  if (map.empty()) {
    warn(
        "the map is empty: no cell got enough points; look at the stages before the last and at "
        "min_points_per_cell");
  } else if (map.planes().empty()) {
    warn(
        "no plane was found: the map holds non-planar cuboids only; look at min_inliers and "
        "distance_threshold_m");
  }
}

void Run::save(bool interrupted) {
  const OutputDirectory directory(options_.output, outputFileNames(), true);
  const PlanarMap& map = pipeline_.map();
  const Configuration& configuration = pipeline_.configuration();
  const std::vector<std::uint8_t> bytes = map.serialize();
  std::vector<io::StampedPose> trajectory;
  for (const auto& stamped : map.trajectory())
    trajectory.push_back({stamped.first, stamped.second});
  log("saved to " + directory.path() + ": " + std::to_string(map.planes().size()) + " planes, " +
      std::to_string(map.cuboids().size()) + " cuboids, " + std::to_string(bytes.size()) +
      " bytes");
  directory.write("config.resolved.yaml", effectiveYaml(configuration));
  directory.write("trajectory_tum.txt", io::toTum(trajectory));
  directory.write("frames.csv", statistics_.framesCsv(configuration));
  directory.write("run.log", log_text_);
  directory.write("map.json", io::mapToJson(map));
  result_.metrics_json = statistics_.metricsJson(configuration, map, bytes.size(), interrupted);
  directory.write("metrics.json", result_.metrics_json);
  directory.write("map.pmap", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

void Run::log(const std::string& line) {
  log_text_ += line + "\n";
  if (options_.log) options_.log(line);
}

void Run::warn(const std::string& text) {
  log("warning: " + text);
  result_.warnings.push_back(text);
}

}  // namespace

const std::vector<std::string>& outputFileNames() {
  static const std::vector<std::string> names = {"config.resolved.yaml",
                                                 "trajectory_tum.txt",
                                                 "frames.csv",
                                                 "run.log",
                                                 "map.json",
                                                 "metrics.json",
                                                 "map.pmap"};
  return names;
}

RunResult runPipeline(Configuration configuration, const RunOptions& options) {
  return Run(std::move(configuration), options).execute();
}

}  // namespace planar_mapping
