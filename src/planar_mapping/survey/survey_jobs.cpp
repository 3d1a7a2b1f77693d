// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/survey/survey_jobs.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>
#include <utility>

#include "planar_mapping/atlas/atlas_parts.h"
#include "planar_mapping/atlas/atlas_rows.h"
#include "planar_mapping/atlas/atlas_store.h"
#include "planar_mapping/atlas/place_finder.h"
#include "planar_mapping/atlas/pose_graph.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"
#include "planar_mapping/map/joined_map.h"
#include "planar_mapping/map/map_tiles.h"
#include "planar_mapping/pipeline/output.h"
#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/runner.h"
#include "planar_mapping/pipeline/sequence_source.h"
#include "planar_mapping/stereo/opencv_threads.h"
#include "planar_mapping/survey/survey_records.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;
using detail::SurveyJson;
using detail::SurveyRecord;
using detail::writingResult;

constexpr const char* kPlanName = "plan.json";
constexpr const char* kAtlasName = "survey.atlas";

SurveyReport reportOf(const std::string& job, const SurveyRecord& record, const SurveyJson& said,
                      bool was_done) {
  const SurveyJson& read = said.at("read");
  const std::size_t files = read.is_array() ? read.size() : read.at("files").get<std::size_t>();
  const SurveyJson wrote =
      said.contains("wrote") ? said.at("wrote") : detail::fileRecord(record.path());
  return {was_done,
          job + ": read " + detail::counted(files, "file") + ", CRC-32 " +
              detail::checksumText(read.dump()) + "; " + (was_done ? "done before: " : "wrote ") +
              wrote.at("file").get<std::string>() + ", " + wrote.at("bytes").dump() +
              " bytes, CRC-32 " + wrote.at("crc32").get<std::string>(),
          said.dump(1)};
}

/// Does a job unless its result is there.
/// \param act  gives what is said in the record, and the name of the file that it wrote
template <typename Act>
SurveyReport doJob(const std::string& job, const SurveyRecord& record, const Act& act) {
  if (const std::optional<SurveyJson> done = record.done())
    return reportOf(job, record, *done, true);
  const std::pair<SurveyJson, std::string> made = act();
  return reportOf(job, record,
                  writingResult([&]() { return record.write(made.first, made.second); }), false);
}

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

/// The link from the last submap of a piece to the first one of the next, by the frame they share.
std::optional<Link> tieBetween(const SurveyJson& piece, const SurveyJson& next) {
  if (!piece.contains("end") || !next.contains("begin")) return std::nullopt;
  const SurveyJson& end = piece.at("end");
  Link link;
  link.kind = LinkKind::Neighbour;
  link.from_submap = end.at("submap");
  link.to_submap = next.at("begin").at("submap");
  link.T_to_from = detail::poseOf(next.at("begin").at("T_session_frame")) *
                   detail::poseOf(end.at("T_session_frame")).inverse();
  const Matrix6 A = adjoint(link.T_to_from);
  const Matrix6 moved = A * detail::matrixOf(end.at("covariance")) * A.transpose();
  link.covariance = 0.5 * (moved + moved.transpose());
  return link;
}

/// Where the rows of the pieces begin in one atlas of them all.
struct PieceRows {
  std::int64_t submap = 0;
  std::int64_t keyframe = 0;
  std::size_t first_submap = 0, end_submap = 0;  ///< in the list
  std::size_t first_keyframe = 0, end_keyframe = 0;
  std::size_t first_link = 0, end_link = 0;
};

PieceRows addPiece(AtlasData& all, AtlasData piece) {
  PieceRows rows;
  rows.submap = detail::nextId(all.submaps);
  rows.keyframe = detail::nextId(all.keyframes);
  rows.first_submap = all.submaps.size();
  rows.first_keyframe = all.keyframes.size();
  rows.first_link = all.links.size();
  addAtlas(all, std::move(piece));
  rows.end_submap = all.submaps.size();
  rows.end_keyframe = all.keyframes.size();
  rows.end_link = all.links.size();
  return rows;
}

void addLink(AtlasData& all, Link link, const PieceRows& from, const PieceRows& to) {
  link.id = detail::nextId(all.links);
  link.from_submap += from.submap;
  link.to_submap += to.submap;
  if (link.from_keyframe >= 0) link.from_keyframe += from.keyframe;
  if (link.to_keyframe >= 0) link.to_keyframe += to.keyframe;
  all.links.push_back(std::move(link));
}

/// Appends a piece whose rows are numbered and solved in \p all, with the maps and images of its
/// file.
void appendPiece(AtlasStore& store, const AtlasData& all, const PieceRows& rows, AtlasData piece) {
  AtlasData part;
  part.sessions.push_back(detail::rowOf(all.sessions, all.submaps[rows.first_submap].session));
  for (std::size_t i = rows.first_submap; i < rows.end_submap; ++i) {
    part.submaps.push_back(all.submaps[i]);
    part.submaps.back().map = std::move(piece.submaps[i - rows.first_submap].map);
  }
  for (std::size_t i = rows.first_keyframe; i < rows.end_keyframe; ++i) {
    part.keyframes.push_back(std::move(piece.keyframes[i - rows.first_keyframe]));
    part.keyframes.back().id = all.keyframes[i].id;
    part.keyframes.back().submap = all.keyframes[i].submap;
  }
  part.links.assign(all.links.begin() + static_cast<std::ptrdiff_t>(rows.first_link),
                    all.links.begin() + static_cast<std::ptrdiff_t>(rows.end_link));
  store.append(part);
}

}  // namespace

SurveyJobs::SurveyJobs(const std::string& plan, const std::string& path, std::string folder)
    : folder_(std::move(folder)), plan_(parseSurveyPlan(plan, path)) {
  const std::string own = pathOf(kPlanName);
  std::error_code error;
  if (fs::exists(own, error) && io::readWholeText(own) != plan)
    throw InputError(folder_ + ": has results of another plan; give another folder, or remove it");
  writingResult([&]() {
    fs::create_directories(folder_, error);
    if (error) throw IoError(folder_, "cannot be created: " + error.message());
    if (!fs::exists(own, error)) io::writeFileAtomically(own, plan, io::Overwrite::Allow);
  });
}

SurveyJobs::SurveyJobs(std::string folder) : folder_(std::move(folder)) {
  const std::string own = pathOf(kPlanName);
  std::error_code ignored;
  if (!fs::exists(own, ignored))
    throw InputError(folder_ +
                     ": is a directory without plan.json, or none: no folder of a survey");
  plan_ = parseSurveyPlan(io::readWholeText(own), own);
}

std::string SurveyJobs::pathOf(const std::string& name) const {
  return (fs::path(folder_) / name).string();
}

std::string SurveyJobs::recordOf(std::size_t piece) const {
  return pathOf("piece_" + std::to_string(piece) + ".json");
}

/// Whether a piece has been mapped. \throws InputError if it has not, and may not be left out
bool SurveyJobs::hasPiece(std::size_t piece, bool allow_missing) const {
  std::error_code ignored;
  if (fs::exists(recordOf(piece), ignored)) return true;
  if (allow_missing) return false;
  throw InputError(folder_ + ": " + plan_.nameOf(piece) +
                   " has not been mapped: planar_map atlas submap; --allow-missing leaves it out");
}

SurveyReport SurveyJobs::submap(std::size_t piece, int threads) const {
  Configuration configuration = plan_.configurationOf(piece);
  const std::string name = plan_.nameOf(piece);
  const SurveyPiece& cut = plan_.pieces[piece];
  const SurveyRecord record(recordOf(piece), plan_.checksum,
                            {{"input", plan_.sequences[cut.sequence]},
                             {"frames", cut.frames.text()},
                             {"files", cut.files},
                             {"stamp", cut.stamp}});
  return doJob(name, record, [&]() {
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
    const std::string file = "piece_" + std::to_string(piece) + ".atlas";
    writingResult([&]() { saveAtlas(data, pathOf(file), io::Overwrite::Allow); });
    said["submaps"] = data.submaps.size();
    said["keyframes"] = data.keyframes.size();
    return std::make_pair(said, file);
  });
}

SurveyReport SurveyJobs::links(const SurveySearch& search, bool allow_missing) const {
  const std::string name = "links_" + std::to_string(search.piece) + "_" +
                           std::to_string(search.first) + "_" + std::to_string(search.last);
  if (search.piece >= plan_.pieces.size() || search.first >= search.last ||
      search.last > search.piece)
    throw InputError("links are looked for between a piece and earlier ones, not " +
                     std::to_string(search.piece) + " and " + std::to_string(search.first) + ":" +
                     std::to_string(search.last) + " of " + std::to_string(plan_.pieces.size()));
  SurveyJson read = SurveyJson::array();
  std::vector<std::size_t> pieces;
  for (std::size_t piece = search.first; piece < search.last; ++piece)
    if (hasPiece(piece, allow_missing)) pieces.push_back(piece);
  if (hasPiece(search.piece, allow_missing)) pieces.push_back(search.piece);
  for (const std::size_t piece : pieces) read.push_back(detail::fileRecord(recordOf(piece)));
  const SurveyRecord record(pathOf(name + ".json"), plan_.checksum, read);
  return doJob(name, record, [&]() {
    AtlasData all;
    std::vector<PieceRows> rows;
    for (const std::size_t piece : pieces)
      rows.push_back(addPiece(all, loadAtlas(pathOf("piece_" + std::to_string(piece) + ".atlas"), 1,
                                             AtlasContent::WithoutMaps)));
    SurveyJson found = SurveyJson::array();
    if (pieces.empty() || pieces.back() != search.piece)
      return std::make_pair(SurveyJson{{"links", found}}, std::string());
    // Neighbours are not asked for loops.
    const std::size_t own = pieces.size() - 1;
    std::optional<Link> tie;
    if (own > 0 && pieces[own - 1] + 1 == search.piece)
      tie = tieBetween(detail::readRecord(recordOf(pieces[own - 1]), plan_.checksum),
                       detail::readRecord(recordOf(search.piece), plan_.checksum));
    PlaceFinder places;
    for (std::size_t i = 0; i < rows[own].first_keyframe; ++i) places.add(all.keyframes[i]);
    for (std::size_t i = rows[own].first_keyframe; i < rows[own].end_keyframe; ++i) {
      const Keyframe& key = all.keyframes[i];
      std::vector<std::int64_t> neighbours;
      if (tie && key.submap == tie->to_submap + rows[own].submap)
        neighbours.push_back(tie->from_submap + rows[own - 1].submap);
      for (Link& link : places.links(key, all.keyframes, neighbours)) {
        std::size_t to = own - 1;
        while (rows[to].submap > link.to_submap) --to;
        link.from_submap -= rows[own].submap;
        link.from_keyframe -= rows[own].keyframe;
        link.to_submap -= rows[to].submap;
        link.to_keyframe -= rows[to].keyframe;
        found.push_back(detail::toJson(link));
        found.back()["piece"] = pieces[to];
      }
    }
    return std::make_pair(SurveyJson{{"links", found}}, std::string());
  });
}

SurveyReport SurveyJobs::solve(bool allow_missing) const {
  SurveyJson read = SurveyJson::array();
  std::map<std::size_t, SurveyJson> pieces;
  std::vector<std::pair<std::size_t, SurveyJson>> links;  // by the piece they come from
  const auto take = [&](const std::string& path) {
    read.push_back(detail::fileRecord(path));
    return detail::readRecord(path, plan_.checksum);
  };
  for (std::size_t piece = 0; piece < plan_.pieces.size(); ++piece)
    if (hasPiece(piece, allow_missing)) pieces[piece] = take(recordOf(piece));
  for (const SurveySearch& search : plan_.searches) {
    const std::string path =
        pathOf("links_" + std::to_string(search.piece) + "_" + std::to_string(search.first) + "_" +
               std::to_string(search.last) + ".json");
    std::error_code ignored;
    if (!fs::exists(path, ignored)) {
      if (allow_missing) continue;
      throw InputError(path + ": is missing: planar_map atlas links; --allow-missing does without");
    }
    const SurveyJson found = take(path);
    for (const SurveyJson& link : found.at("links")) links.emplace_back(search.piece, link);
  }
  const SurveyRecord record(pathOf("survey.json"), plan_.checksum, read);
  return doJob("solve", record, [&]() {
    AtlasData all;
    std::map<std::size_t, PieceRows> rows;
    const auto load = [&](std::size_t piece, AtlasContent content) {
      return loadAtlas(pathOf("piece_" + std::to_string(piece) + ".atlas"), 1, content);
    };
    for (const auto& entry : pieces)
      rows[entry.first] = addPiece(all, load(entry.first, AtlasContent::Outline));
    const std::size_t within = all.links.size();
    for (const auto& [piece, said] : pieces) {
      const auto next = pieces.find(piece + 1);
      if (!plan_.pieces[piece].has_next || next == pieces.end()) continue;
      const std::optional<Link> tie = tieBetween(said, next->second);
      if (tie) addLink(all, *tie, rows.at(piece), rows.at(piece + 1));
    }
    for (const auto& [piece, link] : links) {
      const std::size_t to = link.at("piece");
      if (pieces.count(piece) > 0 && pieces.count(to) > 0)
        addLink(all, detail::linkOf(link), rows.at(piece), rows.at(to));
    }
    solvePoseGraph(all);
    // Under a name of its own until it is whole.
    const std::string part =
        pathOf(std::string(".") + kAtlasName + "." + std::to_string(::getpid()) + ".tmp");
    writingResult([&]() {
      try {
        {
          AtlasStore store = AtlasStore::create(part, io::Overwrite::Allow);
          for (const auto& entry : pieces) {
            const PieceRows& its = rows.at(entry.first);
            if (its.first_submap < its.end_submap)
              appendPiece(store, all, its, load(entry.first, AtlasContent::All));
          }
          AtlasData between;
          between.links.assign(all.links.begin() + static_cast<std::ptrdiff_t>(within),
                               all.links.end());
          store.append(between);
        }
        fs::rename(part, pathOf(kAtlasName));
        io::syncDirectory(folder_);
      } catch (...) {
        std::error_code ignored;
        fs::remove(part, ignored);
        throw;
      }
    });
    return std::make_pair(SurveyJson{{"submaps", all.submaps.size()},
                                     {"links", all.links.size()},
                                     {"components", componentsOf(all)}},
                          std::string(kAtlasName));
  });
}

/// The record of solve(). \throws InputError if it was not called
std::string SurveyJobs::requireSolved() const {
  std::error_code ignored;
  if (!fs::exists(pathOf("survey.json"), ignored))
    throw InputError(folder_ + ": has no survey.atlas: planar_map atlas solve comes first");
  return pathOf("survey.json");
}

std::int64_t SurveyJobs::firstComponent(const AtlasData& data) const {
  if (data.submaps.empty()) throw InputError(folder_ + ": no frame of the survey could be mapped");
  return componentsOf(data).front();
}

SurveyReport SurveyJobs::join(const std::string& map, std::optional<std::int64_t> component,
                              int threads) const {
  const fs::path absolute = fs::absolute(map).lexically_normal();
  const bool is_here =
      absolute.parent_path() == fs::absolute(pathOf("")).lexically_normal().parent_path();
  const std::string target = is_here ? absolute.filename().string() : absolute.string();
  const SurveyJson read = {{"files", 1},
                           {"survey", detail::fileRecord(requireSolved())},
                           {"map", target},
                           {"component", component ? SurveyJson(*component) : SurveyJson()}};
  const SurveyRecord record(pathOf("map.json"), plan_.checksum, read);
  return doJob("join", record, [&]() {
    const AtlasData data = loadAtlas(pathOf(kAtlasName), threads);
    const std::int64_t chosen = component.value_or(firstComponent(data));
    const PlanarMap joined = joinSubmaps(data, chosen);
    writingResult([&]() { io::saveMap(joined, absolute.string(), io::Overwrite::Allow); });
    return std::make_pair(SurveyJson{{"component", chosen}, {"components", componentsOf(data)}},
                          target);
  });
}

std::vector<SurveyReport> SurveyJobs::joinTiles(const std::string& folder, double side,
                                                std::optional<std::int64_t> component,
                                                int threads) const {
  const SurveyJson solved = detail::fileRecord(requireSolved());
  AtlasStore store = AtlasStore::open(pathOf(kAtlasName));
  const AtlasData data = store.load(1, AtlasContent::Outline);
  const std::int64_t chosen = component.value_or(firstComponent(data));
  double tile = 0.0;
  std::set<std::pair<int, int>> tiles;
  std::vector<std::pair<const Submap*, Eigen::AlignedBox3d>> reaches;
  for (const Submap& submap : data.submaps) {
    if (submap.component != chosen) continue;
    const std::shared_ptr<const PlanarMap> map = store.map(submap.id, threads);
    if (tile <= 0.0) tile = tileSide(map->params(), side);
    const Eigen::AlignedBox3d reach = reachOf(*map).transformed(submap.T_world_submap);
    if (reach.isEmpty()) continue;
    const auto at = [tile](double x) { return static_cast<int>(std::floor(x / tile)); };
    for (int x = at(reach.min().x()); x <= at(reach.max().x()); ++x)
      for (int y = at(reach.min().y()); y <= at(reach.max().y()); ++y) tiles.emplace(x, y);
    reaches.emplace_back(&submap, reach);
  }
  // With those of the next tiles: surfaces that go on there are the same in both.
  const auto isNear = [tile](const Eigen::AlignedBox3d& reach, int x, int y) {
    return reach.max().x() >= tile * (x - 1) && reach.min().x() <= tile * (x + 2) &&
           reach.max().y() >= tile * (y - 1) && reach.min().y() <= tile * (y + 2);
  };
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw OutputError(folder + ": cannot be created: " + error.message());
  const std::string said = SurveyJson{{"side_m", tile}, {"component", chosen}}.dump(1) + "\n";
  writingResult([&]() {
    io::writeFileAtomically((fs::path(folder) / "tiles.json").string(), said, io::Overwrite::Allow);
  });
  std::vector<SurveyReport> reports;
  for (const auto& [x, y] : tiles) {
    const std::string name = "map_" + std::to_string(x) + "_" + std::to_string(y);
    const SurveyRecord record(
        (fs::path(folder) / (name + ".json")).string(), plan_.checksum,
        {{"files", 1}, {"survey", solved}, {"side_m", tile}, {"component", chosen}});
    reports.push_back(doJob(name, record, [&, tile_x = x, tile_y = y]() {
      JoinedMap joined;
      for (const auto& [submap, reach] : reaches)
        if (isNear(reach, tile_x, tile_y))
          joined.set(static_cast<std::int32_t>(submap->id), store.map(submap->id, threads),
                     submap->T_world_submap);
      const PlanarMap part = tileOf(joined.map(), tile, tile_x, tile_y);
      const std::string file = (fs::path(folder) / (name + ".pmap")).string();
      writingResult([&]() { io::saveMap(part, file, io::Overwrite::Allow); });
      return std::make_pair(SurveyJson{{"submaps", joined.size()}, {"frames", part.frames()}},
                            name + ".pmap");
    }));
  }
  return reports;
}

}  // namespace planar_mapping
