// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/runner.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <future>
#include <nlohmann/json.hpp>
#include <sstream>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/parallel.h"
#include "planar_mapping/io/map_json.h"
#include "planar_mapping/io/pose_file.h"
#include "planar_mapping/pipeline/output.h"
#include "planar_mapping/pipeline/run_atlas.h"
#include "planar_mapping/pipeline/run_statistics.h"
#include "planar_mapping/pipeline/run_summary.h"
#include "planar_mapping/pipeline/sequence_source.h"
#ifdef PLANAR_MAPPING_HAS_STEREO
#include "planar_mapping/stereo/opencv_threads.h"
#endif

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;

using Clock = std::chrono::steady_clock;

Clock::duration secondsOf(double seconds) {
  constexpr double kLongest = 1e8;  // years
  return std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(std::min(seconds, kLongest)));
}

/// The lines of a configuration that change the map.
std::vector<std::string> linesOf(const std::string& yaml) {
  std::istringstream in(withoutThreads(yaml));
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// Whether a configuration with `auto` in it may have become this one.
bool mayBecome(const std::string& asked, const std::string& resolved) {
  const std::vector<std::string> a = linesOf(asked);
  const std::vector<std::string> b = linesOf(resolved);
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& one, const auto& other) {
    const std::string key = one.substr(0, one.find(": ") + 2);
    const bool is_auto = one == key + "auto" || one == key + "\"auto\"";
    return one == other || (is_auto && other.compare(0, key.size(), key) == 0);
  });
}

/// One run from input to files.
class Run {
 public:
  /// \param from_files  the source never waits for frames that are still to come
  Run(Configuration configuration, FrameSource& source, const RunOptions& options, bool from_files)
      : options_(options),
        from_files_(from_files),
        pipeline_(std::move(configuration)),
        source_(source),
        directory_(options.output, outputFileNames(), options.overwrite || options.resume) {
    result_.output = directory_.path();
  }

  RunResult execute() {
    const bool own_atlas = options_.atlas.empty();
    const std::string atlas = !own_atlas     ? options_.atlas
                              : findsPoses() ? directory_.pathOf("map.atlas")
                                             : std::string();
    if (options_.resume && hasEarlierResult() && isFinished() &&
        !atlas_.wasInterrupted(atlas, source_.names())) {
      result_.was_finished = true;
      return std::move(result_);
    }
    log("planar_map " PLANAR_MAPPING_VERSION ", configuration " + pipeline_.configuration().path);
    for (const std::string& input : source_.names()) log("input " + input);
    for (const std::string& note : source_.notes()) log("input: " + note);
    if (const std::optional<ImagesUp> up = source_.meanUp()) pipeline_.setMeanUp(*up);
    if (!atlas.empty()) atlas_.open(atlas, own_atlas, options_, source_.names());
    try {
      processFrames();
    } catch (const Error& error) {
      // What was done so far is worth keeping; without any frame there is nothing to save.
      if (statistics_.usedFrames() == 0 || !mayReplace()) throw;
      source_.close();
      log(std::string("failed: ") + error.what());
      finishAtlas();
      save(true);
      throw;
    }
    source_.close();
    if (!result_.interrupted) requireMap();
    // A map of nothing, or of less, must not replace one of something.
    result_.saved =
        !result_.interrupted || (statistics_.frames() > 0 ? mayReplace() : !hasEarlierResult());
    finishAtlas();
    save(result_.interrupted);
    if (!result_.interrupted) atlas_.close();
    return std::move(result_);
  }

 private:
  bool hasEarlierResult() const {
    const std::vector<std::string>& names = outputFileNames();
    return std::any_of(names.begin(), names.end(), [this](const std::string& name) {
      std::error_code ignored;
      return fs::exists(directory_.pathOf(name), ignored);
    });
  }

  /// Whether an earlier run of this configuration is finished. Where it is not, all is done again,
  /// and replaces what that run has saved as soon as there is as much of it.
  bool isFinished() {
    try {
      const std::string yaml = io::readWholeText(directory_.pathOf("config.resolved.yaml"));
      if (!mayBecome(effectiveYaml(pipeline_.configuration()), yaml))
        throw InputError("it was made with another configuration or input");
      result_.metrics_json = io::readWholeText(directory_.pathOf("metrics.json"));
      const auto metrics = nlohmann::json::parse(result_.metrics_json);
      earlier_frames_ = metrics.at("frames");
      std::error_code error;
      return !metrics.at("interrupted") && source_.size() == earlier_frames_ &&
             metrics.at("file_bytes") == fs::file_size(directory_.pathOf("map.pmap"), error);
    } catch (const std::exception& error) {
      throw InputError(directory_.path() + ": this run cannot be resumed: " + error.what() +
                       "; start again and overwrite it (--force, in Python overwrite=True)");
    }
  }

  void processFrames() {
    next_checkpoint_ = Clock::now() + secondsOf(options_.checkpoint_s);
    try {
      while (!stopRequested()) {
        Read read = ahead_.valid() ? ahead_.get() : readFrame(false);
        if (!read.frame) break;
        if (worksAhead()) {
          if (!read.frame->is_prepared) pipeline_.prepare(*read.frame);
          ahead_ = std::async(std::launch::async, [this] { return readFrame(true); });
        }
        processFrame(std::move(*read.frame), read.ms);
        checkpoint();
      }
    } catch (...) {
      if (ahead_.valid()) ahead_.wait();
      finishFrame();
      throw;
    }
    if (ahead_.valid()) ahead_.wait();
    finishFrame();
    const std::optional<std::size_t> all = source_.size();
    // A signal after the last frame came too late to matter.
    result_.interrupted = stopRequested() && statistics_.frames() != all;
    if (!result_.interrupted) return;
    log("interrupted after " + std::to_string(statistics_.frames()) +
        (all ? " of " + std::to_string(*all) : std::string()) + " frames");
  }

  /// A disk that is full now may have room for the next submap.
  void storeSubmaps() {
    try {
      atlas_.storeSubmaps();
    } catch (const OutputError& error) {
      warn(std::string("a submap could not be saved on the way: ") + error.what());
    }
  }

  void finishAtlas() {
    const std::string has = atlas_.finish();
    if (!has.empty()) log(has);
  }

  /// Whether no pose is given, or none is used.
  bool findsPoses() const {
    return pipeline_.hasStage(StageKind::Motion) && source_.size() != std::size_t{1} &&
           (source_.poseSource() == io::PoseSource::None ||
            pipeline_.configuration().settings.ignores_poses);
  }

  /// Whether a frame is read and its images are matched, another one sensed, and one integrated at
  /// the same time: with more than one thread, where the frames are there already.
  bool worksAhead() const {
    return from_files_ && pipeline_.hasBegun() &&
           resolveThreads(pipeline_.configuration().settings.threads) > 1;
  }

  struct Read {
    std::optional<Frame> frame;
    double ms = 0.0;
  };
  Read readFrame(bool ahead) {
    const Clock::time_point start = Clock::now();
    Read read;
    read.frame = source_.next();
    read.ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    if (ahead && read.frame) pipeline_.prepare(*read.frame);
    return read;
  }

  /// A frame and what became of it.
  struct Processed {
    Frame frame;
    FrameReport report;
  };

  void processFrame(Frame frame, double read_ms) {
    checkTimestamp(frame);
    pipeline_.sense(frame);
    finishFrame();
    const bool ahead = worksAhead();
    at_work_ = std::async(ahead ? std::launch::async : std::launch::deferred,
                          [this, read_ms, sensed = std::move(frame)]() mutable {
                            FrameReport report = pipeline_.integrate(sensed);
                            report.read_ms = read_ms;
                            statistics_.add(report, sensed, *sensed.map);
                            return Processed{std::move(sensed), std::move(report)};
                          });
    if (!ahead) finishFrame();
  }

  /// Waits for the frame that is being integrated, and says what became of it.
  void finishFrame() {
    if (!at_work_.valid()) return;
    const Processed done = at_work_.get();
    reportOn(done.frame, done.report);
    storeSubmaps();
  }

  static std::string nameOf(const FrameReport& report) {
    return "frame " + std::to_string(report.number) + " " + report.source + ": ";
  }

  void reportOn(const Frame& frame, const FrameReport& report) {
    for (const std::string& note : frame.notes) log(note);
    for (const std::string& warning : frame.warnings) warn(warning);
    if (frame.without_sensor && !warned_of_sensor_) {
      warned_of_sensor_ = true;
      warn(frame.source +
           ": coordinates of the world in place of a sensor's: where the sensor "
           "stood is not known, so that no space is known to be free; if you know: --origin x,y,z");
    }
    if (frame.pose_assumed && report.skip_reason.empty() && statistics_.usedFrames() == 2 &&
        frame.T_world_sensor.matrix() == Pose::Identity().matrix())
      warn(frame.source +
           ": no VIEWPOINT, like the cloud before: both are taken to be seen from the same place; "
           "--poses FILE says where the sensor was, --set motion_estimation.enabled=true finds it");
    if (report.skip_reason.empty()) {
      log(nameOf(report) + std::to_string(report.points_valid) + " points, " +
          std::to_string(report.planes) + " planes, " + std::to_string(report.cuboids) +
          " cuboids");
    } else {
      log(nameOf(report) + "left out: " + report.skip_reason);
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
    if (start < next_checkpoint_) return;
    finishFrame();
    if (statistics_.usedFrames() == 0 || !mayReplace()) return;
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

  /// \param on_the_way  more frames were to come
  void save(bool on_the_way) {
    const PlanarMap& map = pipeline_.map();
    const Configuration& configuration = pipeline_.configuration();
    const std::vector<detail::MapPlace> places = atlas_.places();
    auto metrics = statistics_.metrics(configuration, map, places);
    metrics["interrupted"] = on_the_way;
    std::string bytes;
    if (result_.saved) {
      const std::vector<std::uint8_t> packed = map.serialize();
      // What cannot be read must not replace what can.
      PlanarMap::deserialize(packed.data(), packed.size());
      bytes.assign(packed.begin(), packed.end());
    }
    metrics["file_bytes"] = bytes.size();
    result_.metrics_json = metrics.dump(2) + "\n";
    if (!on_the_way) {
      for (const std::string& text : detail::warningsOn(pipeline_, statistics_, metrics))
        warn(text);
    }
    if (!result_.saved) return;
    result_.summary = detail::summaryOf(configuration, metrics);
    log("saved to " + directory_.path() + ": " + result_.summary);
    std::vector<OutputFile> files;  // moved, not copied: they may be large
    files.emplace_back("config.resolved.yaml", effectiveYaml(configuration));
    for (const auto& [component, poses] : atlas_.trajectories())
      files.emplace_back(trajectoryFile(component, files.size() == 1),
                         io::toTum(inWorld(poses, map.params().origin)));
    files.emplace_back("frames.csv", statistics_.framesCsv(configuration, places));
    files.emplace_back("run.log", log_text_);
    files.emplace_back("map.json", [&map](const io::ByteSink& sink) {
      constexpr std::size_t kMostUnknown = std::size_t{1} << 22;  // cells; some 20 MB
      io::writeMapJson(map, "map", sink, kMostUnknown);
    });
    files.emplace_back("metrics.json", result_.metrics_json);
    files.emplace_back("map.pmap", std::move(bytes));
    directory_.commit(files);
    directory_.removeOthers("trajectory_tum.", files);
  }

  /// That of the first frame's component has no number.
  static std::string trajectoryFile(std::int64_t component, bool is_first) {
    return "trajectory_tum." + (is_first ? "" : std::to_string(component) + ".") + "txt";
  }

  /// In the order of time, unless clocks go backwards: submaps of one place may lie apart in it.
  std::vector<io::StampedPose> inWorld(const std::vector<std::pair<double, Pose>>& poses,
                                       const Vector3& origin) const {
    std::vector<io::StampedPose> trajectory;
    trajectory.reserve(poses.size());
    for (const auto& [timestamp, pose] : poses)
      trajectory.push_back({timestamp, Eigen::Translation3d(origin) * pose});
    if (!warned_of_time_) {
      std::stable_sort(trajectory.begin(), trajectory.end(),
                       [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
    }
    return trajectory;
  }

  bool mayReplace() const { return statistics_.frames() >= earlier_frames_; }

  void requireMap() const {
    if (statistics_.usedFrames() > 0) return;
    if (statistics_.frames() == 0) throw InputError(source_.names().front() + ": no frame came");
    const FrameReport& first = statistics_.reports().front();
    const bool names_it = first.skip_reason.find(first.source) != std::string::npos;
    throw InputError((names_it ? "" : first.source + ": ") + first.skip_reason +
                     (statistics_.frames() == 1 ? "" : "; nor can any other frame be used"));
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

  const RunOptions& options_;
  const bool from_files_;
  Pipeline pipeline_;
  detail::RunAtlas atlas_{pipeline_};
  FrameSource& source_;
#ifdef PLANAR_MAPPING_HAS_STEREO
  /// Several frames are at work at once.
  const detail::OpenCvThreads opencv_threads_{pipeline_.configuration().settings.threads};
#endif
  const OutputDirectory directory_;
  detail::RunStatistics statistics_;
  std::string log_text_;
  std::size_t earlier_frames_ = 0;  ///< that the run which is resumed has saved
  std::optional<double> last_timestamp_;
  bool warned_of_time_ = false;
  bool warned_of_sensor_ = false;
  Clock::time_point next_checkpoint_;
  RunResult result_;
  std::future<Processed> at_work_;  ///< the frame that is being integrated
  std::future<Read> ahead_;         ///< the next frame
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
  requireStagesFor(source, configuration);
  return Run(std::move(configuration), source, options, true).execute();
}

RunResult runPipeline(Configuration configuration, FrameSource& source, const RunOptions& options) {
  requireStagesFor(source, configuration);
  return Run(std::move(configuration), source, options, false).execute();
}

}  // namespace planar_mapping
