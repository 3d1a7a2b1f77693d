// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>
#include <utility>

#include "planar_mapping/atlas/atlas_parts.h"
#include "planar_mapping/atlas/atlas_store.h"
#include "planar_mapping/atlas/pose_graph.h"
#include "planar_mapping/pipeline/output.h"
#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/runner.h"
#include "planar_mapping/pipeline/sequence_source.h"
#include "planar_mapping/stereo/opencv_threads.h"
#include "planar_mapping/survey/survey_jobs.h"
#include "planar_mapping/survey/survey_records.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;
using detail::SurveyJson;
using detail::SurveyRecord;
using detail::writingResult;

/// A frame that two pieces share, as one of them has it.
SurveyJson tieOf(std::int64_t submap, const Pose& T_session_frame) {
  return {{"submap", submap}, {"T_session_frame", detail::toJson(T_session_frame)}};
}

/// Maps the frames of a piece. The last one, with which the next piece begins, is in a submap of
/// its own that is left out: what is kept of it is its pose.
AtlasData mapFrames(SequenceSource& source, Pipeline& pipeline, bool has_next, SurveyJson& said) {
  std::size_t frames = 0;
  std::size_t left_out = 0;
  std::optional<std::int64_t> last;  // submap of the shared frame
  while (std::optional<Frame> frame = source.next()) {
    const bool is_shared = has_next && frame->is_last;
    if (is_shared && pipeline.atlas() != nullptr) pipeline.atlas()->closeSubmap();
    const FrameReport report = pipeline.process(*frame);
    const bool is_in = report.skip_reason.empty();
    if (!is_in && left_out++ == 0)
      said["first_left_out"] = report.source + ": " + report.skip_reason;
    if (is_in && frames == 0)
      said["begin"] = tieOf(pipeline.atlas()->data().submaps.back().id, frame->T_world_sensor);
    if (is_in && is_shared) {
      last = pipeline.atlas()->data().submaps.back().id;
      said["end"] = tieOf(*last, frame->T_world_sensor);
    }
    ++frames;
  }
  said["frames"] = frames;
  said["left_out"] = left_out;
  if (pipeline.atlas() == nullptr) return {};
  pipeline.atlas()->finish();
  AtlasData data = pipeline.atlas()->data();
  if (!last) return data;
  const auto into = std::find_if(data.links.begin(), data.links.end(), [&](const Link& link) {
    return link.kind == LinkKind::Neighbour && link.to_submap == *last &&
           link.T_to_from.matrix().isIdentity(0.0);  // of one track
  });
  if (into == data.links.end()) {  // its pose has nothing to do with those before
    said.erase("end");
    return data;
  }
  said["end"]["covariance"] = detail::toJson(into->covariance);
  if (data.submaps.back().map->frames() > 1) return data;  // others found their place with it
  said["end"]["submap"] = into->from_submap;
  data = partOf(data, [&](const Submap& submap) { return submap.id != *last; });
  solvePoseGraph(data);
  return data;
}

}  // namespace

SurveyReport SurveyJobs::submap(std::size_t piece, int threads) const {
  Configuration configuration = plan_.configurationOf(piece);
  const std::string name = plan_.nameOf(piece);
  const SurveyPiece& cut = plan_.pieces[piece];
  const SurveyRecord record(pieceOf(piece, "json"), plan_.checksum,
                            {{"input", plan_.sequences[cut.sequence]},
                             {"frames", cut.frames.text()},
                             {"files", cut.files},
                             {"stamp", cut.stamp}});
  return detail::doJob(name, record, [&]() {
    plan_.requireUnchanged(piece);
    configuration.settings.threads = threads;
    const detail::OpenCvThreads opencv_threads(threads);
    SequenceSource source(configuration);
    requireStagesFor(source, configuration);
    Pipeline pipeline(std::move(configuration));
    if (const std::optional<ImagesUp> up = source.meanUp()) pipeline.setMeanUp(*up);
    pipeline.keepAtlas(plan_.params.submaps, {0, name, plan_.configuration});
    SurveyJson said;
    const AtlasData data = mapFrames(source, pipeline, cut.has_next, said);
    const std::string file = pieceOf(piece, "atlas");
    writingResult([&]() { saveAtlas(data, file, io::Overwrite::Allow); });
    said["submaps"] = data.submaps.size();
    said["keyframes"] = data.keyframes.size();
    return std::make_pair(said, fs::path(file).filename().string());
  });
}

}  // namespace planar_mapping
