// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include "planar_mapping/atlas/atlas_parts.h"
#include "planar_mapping/atlas/atlas_rows.h"
#include "planar_mapping/atlas/atlas_store.h"
#include "planar_mapping/atlas/pose_graph.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/map/map_tiles.h"
#include "planar_mapping/pipeline/output.h"
#include "planar_mapping/survey/survey_jobs.h"
#include "planar_mapping/survey/survey_records.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;
using detail::PieceRows;
using detail::SurveyJson;
using detail::SurveyRecord;
using detail::writingResult;

void addLink(AtlasData& all, Link link, const PieceRows& from, const PieceRows& to) {
  link.id = detail::nextId(all.links);
  link.from_submap += from.submap;
  link.to_submap += to.submap;
  if (link.from_keyframe >= 0) link.from_keyframe += from.keyframe;
  if (link.to_keyframe >= 0) link.to_keyframe += to.keyframe;
  all.links.push_back(std::move(link));
}

/// Which submaps reach into which tiles: rows of number, component, pose and the first and last
/// tile along x and y.
class Tiles {
 public:
  /// \param side  metres, see tileSide(); 0 = no tiles
  explicit Tiles(double side) : side_(side) {}

  /// \param piece  has its map, under a number that is lower by \p offset
  void add(const Submap& submap, AtlasStore& piece, std::int64_t offset) {
    if (side_ <= 0.0) return;
    const std::shared_ptr<const PlanarMap> map = piece.map(submap.id - offset);
    if (rows_.empty()) side_ = tileSide(map->params(), side_);
    const Eigen::AlignedBox3d reach = reachOf(*map).transformed(submap.T_world_submap);
    if (reach.isEmpty()) return;
    const auto at = [this](double x) { return static_cast<int>(std::floor(x / side_)); };
    const std::array<int, 4> range = {at(reach.min().x()), at(reach.min().y()), at(reach.max().x()),
                                      at(reach.max().y())};
    rows_.push_back(
        {submap.id, submap.component, detail::toJson(submap.T_world_submap), SurveyJson(range)});
    for (int x = range[0]; x <= range[2]; ++x)
      for (int y = range[1]; y <= range[3]; ++y) tiles_.insert({submap.component, x, y});
  }
  void tell(SurveyJson& said) const {
    if (side_ > 0.0) said.update({{"tile_m", side_}, {"tiles", tiles_}, {"rows", rows_}});
  }

 private:
  double side_;
  std::set<std::array<std::int64_t, 3>> tiles_;  ///< component, x, y
  SurveyJson rows_ = SurveyJson::array();
};

/// Appends a piece whose rows are numbered and solved in \p all, with the maps and images of its
/// file.
void appendPiece(AtlasStore& store, const AtlasData& all, const PieceRows& rows,
                 const std::string& file, Tiles& tiles) {
  AtlasStore its = AtlasStore::open(file);
  AtlasData piece = its.load(1, AtlasContent::WithoutMaps);
  AtlasData part;
  part.sessions.push_back(detail::rowOf(all.sessions, all.submaps[rows.first_submap].session));
  for (std::size_t i = rows.first_submap; i < rows.end_submap; ++i) {
    part.submaps.push_back(all.submaps[i]);
    tiles.add(all.submaps[i], its, rows.submap);
  }
  for (std::size_t i = rows.first_keyframe; i < rows.end_keyframe; ++i) {
    part.keyframes.push_back(std::move(piece.keyframes[i - rows.first_keyframe]));
    part.keyframes.back().id = all.keyframes[i].id;
    part.keyframes.back().submap = all.keyframes[i].submap;
  }
  part.links.assign(all.links.begin() + static_cast<std::ptrdiff_t>(rows.first_link),
                    all.links.begin() + static_cast<std::ptrdiff_t>(rows.end_link));
  store.appendWithMapsOf(its, rows.submap, part);
}

/// Between keyframes of two pieces.
struct FoundLink {
  std::size_t from = 0, to = 0;
  Link link;
};

}  // namespace

SurveyReport SurveyJobs::solve(bool allow_missing) const {
  SurveyJson read = SurveyJson::array();
  std::map<std::size_t, SurveyJson> pieces;
  std::vector<FoundLink> links;
  const auto take = [&](const std::string& path) {
    read.push_back(detail::fileRecord(path));
    return detail::readRecord(path, plan_.checksum);
  };
  for (std::size_t piece = 0; piece < plan_.pieces.size(); ++piece)
    if (hasPiece(piece, allow_missing)) pieces[piece] = take(pieceOf(piece, "json"));
  for (std::size_t piece = 1; piece < plan_.pieces.size(); ++piece) {
    const std::string path = pathOf("links_" + std::to_string(piece) + ".json");
    std::error_code ignored;
    if (!fs::exists(path, ignored)) {
      if (allow_missing) continue;
      throw InputError(path + ": is missing: planar_map atlas links; --allow-missing does without");
    }
    const SurveyJson found = take(path);
    for (const SurveyJson& link : found.at("links"))
      links.push_back({piece, link.at("piece"), detail::linkOf(link)});
  }
  const SurveyRecord record(pathOf("survey.json"), plan_.checksum, read);
  return detail::doJob("solve", record, [&]() {
    AtlasData all;
    std::map<std::size_t, PieceRows> rows;
    for (const auto& [piece, said] : pieces)
      rows[piece] =
          detail::addPiece(all, loadAtlas(pieceOf(piece, "atlas"), 1, AtlasContent::Outline));
    const std::size_t within = all.links.size();
    for (const auto& [piece, said] : pieces) {
      const auto next = pieces.find(piece + 1);
      if (!plan_.pieces[piece].has_next || next == pieces.end()) continue;
      const std::optional<Link> tie = detail::tieBetween(said, next->second);
      if (tie) addLink(all, *tie, rows.at(piece), rows.at(piece + 1));
    }
    for (const FoundLink& found : links)
      if (pieces.count(found.from) > 0 && pieces.count(found.to) > 0)
        addLink(all, found.link, rows.at(found.from), rows.at(found.to));
    solvePoseGraph(all);
    Tiles tiles(plan_.params.tile);
    // Under a name of its own until it is whole.
    const std::string part = pathOf(".survey.atlas." + std::to_string(::getpid()) + ".tmp");
    writingResult([&]() {
      try {
        {
          AtlasStore store = AtlasStore::create(part, io::Overwrite::Allow);
          for (const auto& [piece, its] : rows)
            if (its.first_submap < its.end_submap)
              appendPiece(store, all, its, pieceOf(piece, "atlas"), tiles);
          AtlasData between;
          between.links.assign(all.links.begin() + static_cast<std::ptrdiff_t>(within),
                               all.links.end());
          store.append(between);
        }
        fs::rename(part, pathOf("survey.atlas"));
        io::syncDirectory(folder_);
      } catch (...) {
        std::error_code ignored;
        fs::remove(part, ignored);
        throw;
      }
    });
    SurveyJson said = {{"submaps", all.submaps.size()},
                       {"links", all.links.size()},
                       {"components", componentsOf(all)}};
    tiles.tell(said);
    return std::make_pair(said, std::string("survey.atlas"));
  });
}

}  // namespace planar_mapping
