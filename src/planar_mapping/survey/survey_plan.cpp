// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/survey/survey_plan.h"

#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "planar_mapping/base/crc32.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/runner.h"
#include "planar_mapping/pipeline/sequence_source.h"
#include "planar_mapping/pipeline/stage_table.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kPlanFormat = 2;

std::uint32_t checksumOf(const std::string& text, std::uint32_t before = 0) {
  return detail::crc32(before, reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
}

/// Name, size and time of a file, to the nanosecond.
std::string stampOf(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return path + " missing\n";
  return path + " " + std::to_string(status.st_size) + " " + std::to_string(status.st_mtim.tv_sec) +
         "." + std::to_string(status.st_mtim.tv_nsec) + "\n";
}

std::vector<std::size_t> framesOf(const FrameSelection& frames, std::size_t count) {
  std::vector<std::size_t> numbers;
  const auto end = frames.last < 0 ? count : std::min(count, static_cast<std::size_t>(frames.last));
  for (auto i = static_cast<std::size_t>(frames.first); i < end;
       i += static_cast<std::size_t>(frames.step))
    numbers.push_back(i);
  return numbers;
}

/// Counts and stamps the files of the frames, and those beside them: calibration, poses, times.
void stampFiles(const io::Sequence& sequence, const std::string& input, SurveyPiece& piece) {
  std::vector<std::string> files;
  for (const std::size_t frame : framesOf(piece.frames, sequence.size()))
    for (std::string& file : sequence.files(frame)) files.push_back(std::move(file));
  std::error_code ignored;
  std::vector<std::string> beside;
  for (const auto& entry : fs::directory_iterator(input, ignored))
    if (entry.is_regular_file(ignored)) beside.push_back(entry.path().string());
  std::sort(beside.begin(), beside.end());
  if (sequence.kind() != io::SequenceKind::Clouds || fs::exists(input + "/clouds", ignored))
    files.insert(files.end(), beside.begin(), beside.end());
  piece.files = files.size();
  piece.stamp = 0;
  for (const std::string& file : files) piece.stamp = checksumOf(stampOf(file), piece.stamp);
}

/// The first frames, until the map has begun, say what `auto` is.
std::string resolved(Configuration configuration) {
  SequenceSource source(configuration);
  requireStagesFor(source, configuration);
  const std::string input = configuration.inputs.front();
  Pipeline pipeline(std::move(configuration));
  if (const std::optional<ImagesUp> up = source.meanUp()) pipeline.setMeanUp(*up);
  while (!pipeline.hasBegun()) {
    std::optional<Frame> frame = source.next();
    if (!frame) throw InputError(input + ": no frame of it can be mapped");
    pipeline.process(*frame);
  }
  StageTable table;
  registerBuiltinStages(table);
  Configuration found = parseConfiguration(effectiveYaml(pipeline.configuration()),
                                           pipeline.configuration().path, table);
  found.inputs.clear();
  found.frames = FrameSelection();
  return effectiveYaml(found);
}

/// What all sequences of a survey have in common.
class Common {
 public:
  void require(const io::Sequence& sequence, const std::string& input) {
    const std::string calibration =
        sequence.calibration() ? io::toYaml(*sequence.calibration()) : std::string();
    if (input_.empty()) {
      input_ = input;
      kind_ = sequence.kind();
      calibration_ = calibration;
    }
    if (sequence.kind() != kind_)
      throw InputError(input + ": its frames are of another kind than those of " + input_ +
                       "; plan them apart and merge the atlases");
    if (calibration != calibration_)
      throw InputError(input + ": its calibration is not that of " + input_ +
                       "; plan them apart and merge the atlases");
  }
  /// A map has one origin.
  void requireNear(const io::Sequence& sequence, const std::string& input, std::size_t frame) {
    const std::optional<Pose> pose = sequence.describe(frame).T_world_sensor;
    if (!pose) return;
    const Vector3 origin = originNear(pose->translation());
    if (!origin_) origin_ = origin;
    if (origin != *origin_)
      throw InputError(input + ": the poses of frame " + std::to_string(frame) +
                       " are too far from those of the first frame for one map; subtract a "
                       "position near both from all poses");
  }

 private:
  std::string input_, calibration_;
  io::SequenceKind kind_ = io::SequenceKind::Clouds;
  std::optional<Vector3> origin_;
};

void cut(const io::Sequence& sequence, const FrameSelection& all, int piece_frames,
         std::vector<SurveyPiece>& pieces, std::size_t number) {
  const std::size_t count = framesOf(all, sequence.size()).size();
  const auto step = static_cast<std::size_t>(piece_frames);
  for (std::size_t first = 0; first == 0 || first + 1 < count; first += step) {
    SurveyPiece piece;
    piece.sequence = number;
    const std::size_t last = std::min(first + step, count - 1);  // the first of the next
    piece.frames.step = all.step;
    piece.frames.first = all.first + all.step * static_cast<std::int64_t>(first);
    piece.frames.last = all.first + all.step * static_cast<std::int64_t>(last) + 1;
    piece.has_next = last + 1 < count;
    pieces.push_back(piece);
  }
}

}  // namespace

void SurveyParams::validate() const {
  if (piece_frames < 1) throw ParameterError("SurveyParams: piece_frames must be at least 1");
  if (link_pieces < 1) throw ParameterError("SurveyParams: link_pieces must be at least 1");
  requireInRange("SurveyParams: tile", tile, 0.0, 1e6, "m");
  submaps.validate();
}

std::string SurveyPlan::nameOf(std::size_t piece) const {
  return "piece " + std::to_string(piece) + " (" + sequences[pieces[piece].sequence] + " frames " +
         pieces[piece].frames.text() + ")";
}

Configuration SurveyPlan::configurationOf(std::size_t piece) const {
  if (piece >= pieces.size())
    throw InputError("there is no piece " + std::to_string(piece) + ": the plan has " +
                     detail::counted(pieces.size(), "piece"));
  StageTable table;
  registerBuiltinStages(table);
  Configuration made = parseConfiguration(configuration, "the configuration of the plan", table);
  made.inputs = {sequences[pieces[piece].sequence]};
  made.frames = pieces[piece].frames;
  return made;
}

void SurveyPlan::requireUnchanged(std::size_t piece) const {
  SurveyPiece now = pieces[piece];
  const std::string& input = sequences[now.sequence];
  stampFiles(io::Sequence({input}, sequenceOptions(configurationOf(piece))), input, now);
  if (now.files != pieces[piece].files || now.stamp != pieces[piece].stamp)
    throw InputError(nameOf(piece) +
                     ": its files have changed since the plan was made; plan the survey again, "
                     "into another folder");
}

SurveyPlan planSurvey(const std::vector<std::string>& sequences, Configuration configuration,
                      const SurveyParams& params) {
  params.validate();
  SurveyPlan plan;
  plan.program = PLANAR_MAPPING_VERSION;
  plan.params = params;
  Common common;
  for (const std::string& given : sequences) {
    const std::string input = fs::absolute(given).lexically_normal().string();
    configuration.inputs = {input};
    const io::Sequence sequence(configuration.inputs, sequenceOptions(configuration));
    common.require(sequence, input);
    if (framesOf(configuration.frames, sequence.size()).empty())
      throw InputError(input + ": frames " + configuration.frames.text() + " select none of its " +
                       std::to_string(sequence.size()));
    const std::size_t begin = plan.pieces.size();
    cut(sequence, configuration.frames, params.piece_frames, plan.pieces, plan.sequences.size());
    for (std::size_t i = begin; i < plan.pieces.size(); ++i) {
      common.requireNear(sequence, input, static_cast<std::size_t>(plan.pieces[i].frames.first));
      stampFiles(sequence, input, plan.pieces[i]);
    }
    plan.sequences.push_back(input);
  }
  if (plan.sequences.empty()) throw InputError("there is no sequence to plan");
  configuration.inputs = {plan.sequences.front()};
  plan.configuration = resolved(std::move(configuration));
  return plan;
}

std::string toJson(const SurveyPlan& plan) {
  Json json = {{"type", "planar_mapping survey plan"},
               {"format", kPlanFormat},
               {"program", plan.program},
               {"piece_frames", plan.params.piece_frames},
               {"link_pieces", plan.params.link_pieces},
               {"tile_m", plan.params.tile},
               {"submap_frames", plan.params.submaps.frames},
               {"submap_path_m", plan.params.submaps.path},
               {"sequences", plan.sequences},
               {"configuration", plan.configuration}};
  for (const SurveyPiece& piece : plan.pieces)
    json["pieces"].push_back({{"sequence", piece.sequence},
                              {"frames", piece.frames.text()},
                              {"has_next", piece.has_next},
                              {"files", piece.files},
                              {"stamp", piece.stamp}});
  return json.dump(1) + "\n";
}

SurveyPlan parseSurveyPlan(const std::string& text, const std::string& path) {
  SurveyPlan plan;
  plan.checksum = checksumOf(text);
  try {
    const Json json = Json::parse(text);
    if (json.at("format") != kPlanFormat) throw InputError("it is of another format");
    plan.program = json.at("program");
    if (plan.program != PLANAR_MAPPING_VERSION)
      throw InputError("it was made by planar_map " + plan.program + ", and this is planar_map " +
                       PLANAR_MAPPING_VERSION +
                       ": install the same version everywhere, or plan "
                       "again");
    plan.params.piece_frames = json.at("piece_frames");
    plan.params.link_pieces = json.at("link_pieces");
    plan.params.tile = json.at("tile_m");
    plan.params.submaps.frames = json.at("submap_frames");
    plan.params.submaps.path = json.at("submap_path_m");
    plan.params.validate();
    plan.sequences = json.at("sequences").get<std::vector<std::string>>();
    plan.configuration = json.at("configuration");
    for (const Json& row : json.at("pieces")) {
      SurveyPiece piece;
      piece.sequence = row.at("sequence");
      if (piece.sequence >= plan.sequences.size()) throw InputError("a piece has no sequence");
      piece.frames = parseFrameSelection(row.at("frames"));
      piece.has_next = row.at("has_next");
      piece.files = row.at("files");
      piece.stamp = row.at("stamp");
      plan.pieces.push_back(piece);
    }
  } catch (const Json::exception&) {
    throw InputError(path + ": is no plan of planar_map atlas plan, or damaged");
  } catch (const Error& error) {
    throw InputError(path + ": this plan cannot be used: " + error.what());
  }
  return plan;
}

}  // namespace planar_mapping
