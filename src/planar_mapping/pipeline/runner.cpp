// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/runner.h"

#include <zstd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "planar_mapping/base/state_archive.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/map_json.h"
#include "planar_mapping/io/pose_file.h"
#include "planar_mapping/pipeline/output.h"
#include "planar_mapping/pipeline/sequence_source.h"
#include "planar_mapping/pipeline/run_advice.h"
#include "planar_mapping/pipeline/run_statistics.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;

/// First line of run.state.
constexpr const char* kStateFormat = "planar_map run state 9, version " PLANAR_MAPPING_VERSION "\n";

std::chrono::steady_clock::duration secondsOf(double seconds) {
  constexpr double kLongest = 1e8;  // years
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(std::min(seconds, kLongest)));
}

std::string packed(const std::string& bytes) {
  constexpr int kFastest = 1;
  std::string out(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size =
      ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kFastest);
  if (ZSTD_isError(size) != 0) throw Error("the state of the run cannot be compressed");
  out.resize(size);
  return out;
}

std::string unpacked(std::string_view bytes) {
  const unsigned long long size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  std::string out(size < ZSTD_CONTENTSIZE_ERROR ? size : 0, '\0');
  if (ZSTD_decompress(out.data(), out.size(), bytes.data(), bytes.size()) != out.size())
    throw Error("the saved state is damaged");
  return out;
}

/// A configuration without what does not change the map.
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
      : options_(options),
        pipeline_(std::move(configuration)),
        source_(source),
        directory_(options.output, outputFileNames(), options.overwrite || options.resume) {
    result_.output = directory_.path();
    asked_for_ = comparable(effectiveYaml(pipeline_.configuration()));
  }

  RunResult execute() {
    if (options_.resume && resume()) {
      result_.was_finished = true;
      return std::move(result_);
    }
    log("planar_map " PLANAR_MAPPING_VERSION ", configuration " + pipeline_.configuration().path);
    for (const std::string& input : source_.names()) log("input " + input);
    for (const std::string& note : source_.notes()) log("input: " + note);
    if (statistics_.frames() > 0)
      log("resumed after " + std::to_string(statistics_.frames()) + " frames");
    if (const std::optional<Vector3> up = source_.meanUp()) pipeline_.setMeanUp(*up);
    try {
      processFrames();
    } catch (const Error& error) {
      // What was done so far is worth keeping; without any frame there is nothing to save.
      if (statistics_.usedFrames() == 0) throw;
      source_.close();
      log(std::string("failed: ") + error.what());
      save(true);
      throw;
    }
    source_.close();
    checkResult();
    // A map of nothing must not replace one of something.
    result_.saved = !result_.interrupted || statistics_.frames() > 0 || !hasEarlierResult();
    if (result_.saved) {
      save(result_.interrupted);
    } else {
      result_.metrics_json =
          statistics_.metricsJson(pipeline_.configuration(), pipeline_.map(), 0, true);
    }
    return std::move(result_);
  }

 private:
  using Clock = std::chrono::steady_clock;

  bool hasEarlierResult() const {
    const std::vector<std::string>& names = outputFileNames();
    return std::any_of(names.begin(), names.end(), [this](const std::string& name) {
      std::error_code ignored;
      return fs::exists(directory_.pathOf(name), ignored);
    });
  }

  /// Takes over what an earlier run has saved. \return whether it was finished
  bool resume() {
    if (!hasEarlierResult()) return false;
    try {
      loadState(directory_.read("run.state"));
      log_text_ = directory_.read("run.log");
      const std::string metrics = directory_.read("metrics.json");
      const std::size_t done = statistics_.frames();
      if (source_.skip(done) < done) throw InputError("it holds more frames than are asked for");
      const bool was_interrupted =
          nlohmann::json::parse(metrics, nullptr, false).value("interrupted", true);
      if (was_interrupted || source_.size() != done) return false;
      result_.metrics_json = metrics;
      return true;
    } catch (const IoError&) {
      throw;
    } catch (const Error& error) {
      throw InputError(directory_.path() + ": this run cannot be resumed: " + error.what() +
                       "; start again and overwrite it (--force, in Python overwrite=True)");
    }
  }

  void loadState(const std::string& state) {
    constexpr std::string_view kStart = kStateFormat;
    if (state.compare(0, kStart.size(), kStart) != 0)
      throw InputError("it was made by another version, not " PLANAR_MAPPING_VERSION);
    const std::string wanted = asked_for_;
    std::string stages;
    const std::string bytes = unpacked(std::string_view(state).substr(kStart.size()));
    detail::StateReader reader(bytes);
    visitState(reader);
    reader(stages);
    reader.finish();
    if (wanted != asked_for_ && wanted != comparable(directory_.read("config.resolved.yaml")))
      throw InputError("it was made with another configuration or input");
    const std::string map = directory_.read("map.pmap");
    pipeline_.loadState(
        stages, PlanarMap::deserialize(reinterpret_cast<const std::uint8_t*>(map.data()),
                                       map.size(), pipeline_.configuration().settings.threads));
  }

  void processFrames() {
    next_checkpoint_ = Clock::now() + secondsOf(options_.checkpoint_s);
    for (;;) {
      if (!stopRequested()) {
        const Clock::time_point start = Clock::now();
        std::optional<Frame> frame = source_.next();
        const std::chrono::duration<double, std::milli> read = Clock::now() - start;
        if (frame) {
          processFrame(std::move(*frame), read.count());
          checkpoint();
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

  void processFrame(Frame frame, double read_ms) {
    checkTimestamp(frame);
    FrameReport report = pipeline_.process(frame);
    report.read_ms = read_ms;
    if (frame.without_sensor && !warned_of_sensor_) {
      warned_of_sensor_ = true;
      frame.warnings.push_back(
          frame.source +
          ": coordinates of the world in place of a sensor's: where the sensor "
          "stood is not known, so that no space is known to be free");
    }
    for (const std::string& note : frame.notes) log(note);
    for (const std::string& warning : frame.warnings) warn(warning);
    statistics_.add(report, frame, pipeline_.map());
    const std::string name = "frame " + std::to_string(report.number) + " " + report.source + ": ";
    if (report.skip_reason.empty()) {
      for (const std::string& advice : watch_.adviceOn(frame, pipeline_.map())) warn(advice);
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
    if (options_.progress)
      options_.progress(statistics_.frames(), source_.size().value_or(0), report);
  }

  /// Frames count in the order of the input; their times are labels. A clock that goes backwards is
  /// worth a look all the same: lines of a pose file may have been mixed up.
  void checkTimestamp(Frame& frame) {
    if (last_timestamp_ && frame.timestamp < *last_timestamp_ && !warned_of_time_) {
      warned_of_time_ = true;
      frame.warnings.push_back(
          "frame " + std::to_string(frame.number) + " " + frame.source + ": its time, " +
          formatNumber(frame.timestamp) + " s, is before that of the frame before it, " +
          formatNumber(*last_timestamp_) + " s; frames are taken in the order of the input");
    }
    last_timestamp_ = frame.timestamp;
  }

  /// Saves from time to time. A disk that is full now may have room at the end.
  void checkpoint() {
    constexpr double kOtherWork = 9.0;  // times that of saving
    const Clock::time_point start = Clock::now();
    if (start < next_checkpoint_ || statistics_.usedFrames() == 0) return;
    try {
      save(true);
    } catch (const OutputError& error) {
      warn(std::string("nothing could be saved on the way: ") + error.what());
    }
    const std::chrono::duration<double> taken = Clock::now() - start;
    const bool always = options_.checkpoint_s <= 0.0;
    next_checkpoint_ =
        Clock::now() +
        secondsOf(always ? 0.0 : std::max(options_.checkpoint_s, kOtherWork * taken.count()));
  }

  void save(bool interrupted) {
    const PlanarMap& map = pipeline_.map();
    const Configuration& configuration = pipeline_.configuration();
    const std::vector<std::uint8_t> bytes = map.serialize();
    // What cannot be read must not replace what can.
    PlanarMap::deserialize(bytes.data(), bytes.size());
    std::vector<io::StampedPose> trajectory;
    for (const auto& [timestamp, pose] : map.trajectory())
      trajectory.push_back({timestamp, Eigen::Translation3d(map.params().origin) * pose});
    // Frames that were left out at first come last in the map.
    if (!warned_of_time_) {
      std::stable_sort(trajectory.begin(), trajectory.end(),
                       [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
    }
    log("saved to " + directory_.path() + ": " + detail::savedText(map, bytes.size()));
    detail::StateWriter state;
    visitState(state);
    state(pipeline_.saveState());
    result_.metrics_json = statistics_.metricsJson(configuration, map, bytes.size(), interrupted);
    std::vector<OutputFile> files;  // moved, not copied: they may be large
    files.emplace_back("config.resolved.yaml", effectiveYaml(configuration));
    files.emplace_back("trajectory_tum.txt", io::toTum(trajectory));
    files.emplace_back("frames.csv", statistics_.framesCsv(configuration));
    files.emplace_back("run.log", log_text_);
    files.emplace_back("map.json", [&map](const io::ByteSink& sink) {
      io::writeMapJson(map, "map", sink, detail::kMostUnknownInJson);
    });
    files.emplace_back("metrics.json", result_.metrics_json);
    files.emplace_back("map.pmap", std::string(bytes.begin(), bytes.end()));
    files.emplace_back("run.state", kStateFormat + packed(state.take()));
    directory_.commit(files);
  }

  void checkResult() {
    if (result_.interrupted) return;
    if (statistics_.usedFrames() == 0) {
      if (statistics_.frames() == 0) throw InputError(source_.names().front() + ": no frame came");
      const FrameReport& first = statistics_.firstSkipped();
      const std::string& reason = first.skip_reason;
      const bool names_it = reason.find(first.source) != std::string::npos;
      throw InputError((names_it ? "" : first.source + ": ") + reason +
                       (statistics_.frames() == 1 ? "" : "; nor can any other frame be used"));
    }
    for (const std::string& advice :
         detail::adviceOn(pipeline_, statistics_, source_, watch_.isCamera()))
      warn(advice);
  }

  bool stopRequested() const { return options_.stop != nullptr && *options_.stop; }
  void log(const std::string& line) {
    log_text_ += line + "\n";
    if (options_.log) options_.log(line);
  }

  void warn(const std::string& text) {
    log("warning: " + text);
    result_.warnings.push_back(text);
  }

  template <typename Archive>
  void visitState(Archive& archive) {
    archive(asked_for_, statistics_, last_timestamp_, warned_of_time_, warned_of_sensor_, watch_,
            result_.warnings);
  }

  const RunOptions& options_;
  Pipeline pipeline_;
  FrameSource& source_;
  const OutputDirectory directory_;
  detail::RunStatistics statistics_;
  std::string log_text_;
  std::string asked_for_;  ///< the configuration before any `auto` is resolved
  std::optional<double> last_timestamp_;
  bool warned_of_time_ = false;
  bool warned_of_sensor_ = false;
  detail::FrameWatch watch_;
  Clock::time_point next_checkpoint_;
  RunResult result_;
};

/// Paths made absolute, so that config.resolved.yaml works from anywhere.
Configuration withAbsolutePaths(Configuration configuration) {
  for (std::string& input : configuration.inputs)
    input = fs::absolute(input).lexically_normal().string();
  for (std::string* path : {&configuration.poses, &configuration.calibration}) {
    if (!path->empty()) *path = fs::absolute(*path).lexically_normal().string();
  }
  return configuration;
}
}  // namespace

const std::vector<std::string>& outputFileNames() {
  static const std::vector<std::string> names = {
      "config.resolved.yaml", "trajectory_tum.txt", "frames.csv", "run.log",      "map.json",
      "metrics.json",         "map.pmap",           "run.state",  "manifest.json"};
  return names;
}

void requireStagesFor(const FrameSource& source, const Configuration& configuration) {
  const std::string input = source.names().front();
  const bool makes_clouds = hasStage(configuration, StageKind::Images);
  if (source.kind() == io::SequenceKind::Stereo && !makes_clouds)
    throw InputError(
        input + ": these are stereo images, and no stage of " + configuration.path +
        " makes clouds of them; add stereo_matching or take config/stereo_indoor.yaml");
  if (source.kind() != io::SequenceKind::Stereo && makes_clouds)
    throw InputError(input + ": there are no image pairs (left/, right/), which a stage of " +
                     configuration.path + " makes clouds of; take another configuration");
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
  requireStagesFor(source, configuration);
  return Run(std::move(configuration), source, options).execute();
}

}  // namespace planar_mapping
