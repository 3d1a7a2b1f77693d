// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/runner.h"

#include <chrono>
#include <filesystem>
#include <sstream>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/io/map_json.h"
#include "planar_mapping/io/pose_file.h"
#include "planar_mapping/pipeline/output.h"
#include "planar_mapping/pipeline/sequence_source.h"
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
  Run(Configuration configuration, FrameSource& source, const RunOptions& options)
      : options_(options), pipeline_(std::move(configuration)), source_(source) {}

  RunResult execute();

 private:
  void loadEarlierRun();
  void replayFrames(std::size_t count);
  void processFrames();
  void processFrame(Frame frame, double read_ms);
  void checkTimestamp(Frame& frame);
  void save(bool interrupted);
  void checkResult();
  void warnOfSkippedFrames();
  bool stopRequested() const { return options_.stop != nullptr && *options_.stop; }
  void log(const std::string& line);
  void warn(const std::string& text);

  const RunOptions& options_;
  Pipeline pipeline_;
  FrameSource& source_;
  detail::RunStatistics statistics_;
  std::string log_text_;
  std::size_t resumed_ = 0;  ///< frames an earlier run has done
  std::optional<double> last_timestamp_;
  bool warned_of_time_ = false;
  RunResult result_;
};

/// Paths made absolute, so that config.resolved.yaml works from anywhere.
Configuration withAbsolutePaths(Configuration configuration) {
  for (std::string& input : configuration.inputs) {
    input = fs::absolute(input).lexically_normal().string();
  }
  if (!configuration.poses.empty()) {
    configuration.poses = fs::absolute(configuration.poses).lexically_normal().string();
  }
  return configuration;
}

RunResult Run::execute() {
  requireStagesFor(source_, pipeline_.configuration());
  const OutputDirectory directory(options_.output, outputFileNames(),
                                  options_.overwrite || options_.resume);
  result_.output = directory.path();
  if (options_.resume) loadEarlierRun();
  log("planar_map " PLANAR_MAPPING_VERSION ", configuration " + pipeline_.configuration().path);
  for (const std::string& input : source_.names()) log("input " + input);
  try {
    processFrames();
  } catch (const Error& error) {
    // What was done so far is worth keeping; without any frame there is nothing to save.
    if (statistics_.usedFrames() == 0) throw;
    log(std::string("failed: ") + error.what());
    save(true);
    throw;
  }
  checkResult();
  save(result_.interrupted);
  return std::move(result_);
}

void Run::loadEarlierRun() {
  const OutputDirectory directory(options_.output, outputFileNames(), true);
  std::error_code ignored;
  const std::string path = directory.pathOf("map.pmap");
  if (!fs::exists(path, ignored)) return;
  const auto text = [&directory](const std::string& name) {
    const std::vector<std::uint8_t> bytes = io::readWholeFile(directory.pathOf(name));
    return std::string(bytes.begin(), bytes.end());
  };
  try {
    statistics_.restore(pipeline_.configuration(), text("frames.csv"), text("metrics.json"));
    const std::string bytes = text("map.pmap");
    PlanarMap map =
        PlanarMap::deserialize(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    // A map that no frame has reached has no parameters yet.
    if (statistics_.usedFrames() > 0) pipeline_.continueFrom(std::move(map));
    replayFrames(statistics_.frames());
    if (comparable(effectiveYaml(pipeline_.configuration())) !=
        comparable(text("config.resolved.yaml"))) {
      throw InputError("it was made with another configuration or input");
    }
    log_text_ = text("run.log");
  } catch (const IoError&) {
    throw;
  } catch (const Error& error) {
    throw InputError(directory.path() + ": this run cannot be resumed: " + error.what() +
                     "; start again with --force");
  }
}

/// Takes the stages to the state they had when the earlier run stopped.
void Run::replayFrames(std::size_t count) {
  for (; resumed_ < count; ++resumed_) {
    std::optional<Frame> frame = source_.next();
    if (!frame) throw InputError("it holds more frames than are asked for");
    checkTimestamp(*frame);
    pipeline_.replay(*frame);
    statistics_.replay(*frame, pipeline_.map());
    for (const auto& placed : pipeline_.takePlacedAgain()) {
      statistics_.replay(placed.first, pipeline_.map());
    }
  }
}

void Run::processFrames() {
  using Clock = std::chrono::steady_clock;
  for (;;) {
    if (!stopRequested()) {
      const Clock::time_point start = Clock::now();
      std::optional<Frame> frame = source_.next();
      const std::chrono::duration<double, std::milli> read = Clock::now() - start;
      if (frame) {
        processFrame(std::move(*frame), read.count());
        continue;
      }
    }
    if (!stopRequested()) return;
    const std::optional<std::size_t> all = source_.size();
    if (all && statistics_.frames() == *all) return;  // it came too late to matter
    result_.interrupted = true;
    log("interrupted after " + std::to_string(statistics_.frames()) +
        (all ? " of " + std::to_string(*all) : std::string()) + " frames");
    return;
  }
}

void Run::processFrame(Frame frame, double read_ms) {
  checkTimestamp(frame);
  FrameReport report = pipeline_.process(frame);
  report.read_ms = read_ms;
  for (const std::string& note : frame.notes) log(note);
  for (const std::string& warning : frame.warnings) warn(warning);
  statistics_.add(report, frame, pipeline_.map());
  const std::string name = "frame " + std::to_string(report.number) + " " + report.source + ": ";
  if (report.skip_reason.empty()) {
    log(name + std::to_string(report.points_valid) + " points, " + std::to_string(report.planes) +
        " planes, " + std::to_string(report.cuboids) + " cuboids");
  } else {
    log(name + "left out: " + report.skip_reason);
  }
  for (const auto& [placed, placed_report] : pipeline_.takePlacedAgain()) {
    statistics_.addAgain(placed_report, placed, pipeline_.map());
    log("frame " + std::to_string(placed_report.number) + " " + placed_report.source +
        ": found its place after all");
  }
  if (options_.progress) {
    options_.progress(statistics_.frames(), source_.size().value_or(0), report);
  }
}

/// Frames count in the order of the input; their times are labels. A clock that goes backwards is
/// worth a look all the same: lines of a pose file may have been mixed up.
void Run::checkTimestamp(Frame& frame) {
  if (last_timestamp_ && frame.timestamp < *last_timestamp_ && !warned_of_time_) {
    warned_of_time_ = true;
    frame.warnings.push_back(
        "frame " + std::to_string(frame.number) + " " + frame.source + ": its time, " +
        formatNumber(frame.timestamp) + " s, is before that of the frame before it, " +
        formatNumber(*last_timestamp_) + " s; frames are taken in the order of the input");
  }
  last_timestamp_ = frame.timestamp;
}

void Run::checkResult() {
  if (result_.interrupted) return;
  if (statistics_.usedFrames() == 0) {
    if (statistics_.frames() == 0) throw InputError(source_.names().front() + ": no frame came");
    const FrameReport& first = statistics_.firstSkipped();
    const std::string& reason = first.skip_reason;
    const bool names_it = reason.find(first.source) != std::string::npos;
    throw InputError((names_it ? "" : first.source + ": ") + reason +
                     (statistics_.frames() == 1 ? "" : "; nor can any other frame be used"));
  }
  warnOfSkippedFrames();
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

/// One sentence for all of them; run.log and frames.csv tell of each.
void Run::warnOfSkippedFrames() {
  const std::size_t skipped = statistics_.frames() - statistics_.usedFrames();
  if (skipped == 0) return;
  const FrameReport& first = statistics_.firstSkipped();
  warn(std::to_string(skipped) + " of " + std::to_string(statistics_.frames()) +
       " frames left out (see frames.csv), the first: frame " + std::to_string(first.number) +
       ", " + first.skip_reason);
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

void requireStagesFor(const FrameSource& source, const Configuration& configuration) {
  const std::string input = source.names().front();
  const bool makes_clouds = hasStage(configuration, StageKind::Images);
  if (source.kind() == io::SequenceKind::Stereo && !makes_clouds) {
    throw InputError(
        input + ": these are stereo images, and no stage of " + configuration.path +
        " makes clouds of them; add stereo_matching or take config/stereo_indoor.yaml");
  }
  if (source.kind() != io::SequenceKind::Stereo && makes_clouds) {
    throw InputError(input + ": there are no image pairs (left/, right/), which a stage of " +
                     configuration.path + " makes clouds of; take another configuration");
  }
  if (source.poseSource() == io::PoseSource::None && !hasStage(configuration, StageKind::Motion)) {
    throw InputError(input +
                     ": there are no poses; put poses.txt (TUM: timestamp tx ty tz qx qy qz qw) "
                     "into the folder, give --poses FILE, or add the stages key_features and "
                     "motion_estimation to " +
                     configuration.path);
  }
}

RunResult runPipeline(Configuration configuration, const RunOptions& options) {
  configuration = withAbsolutePaths(std::move(configuration));
  SequenceSource source(configuration);
  return runPipeline(std::move(configuration), source, options);
}

RunResult runPipeline(Configuration configuration, FrameSource& source, const RunOptions& options) {
  return Run(std::move(configuration), source, options).execute();
}

}  // namespace planar_mapping
