// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "planar_mapping/atlas/atlas_store.h"
#include "planar_mapping/atlas/place_finder.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/survey/survey_jobs.h"
#include "planar_mapping/survey/survey_records.h"

namespace planar_mapping {
namespace {

using detail::PieceRows;
using detail::SurveyJson;
using detail::SurveyRecord;

constexpr const char* kPlacesName = "places.json";

/// The earlier pieces that most keyframes of one look most like.
/// \param places    with the pieces before
/// \param piece_of  a keyframe of places
/// \param tied      a piece that is left out; -1 = none
std::set<std::size_t> alike(const AtlasData& piece, std::size_t count, const PlaceFinder& places,
                            const std::vector<std::size_t>& piece_of, std::int64_t tied) {
  std::vector<std::int64_t> left_out;
  for (std::size_t i = 0; i < piece_of.size(); ++i)
    if (static_cast<std::int64_t>(piece_of[i]) == tied)
      left_out.push_back(static_cast<std::int64_t>(i));
  std::map<std::size_t, double> votes;
  for (Keyframe key : piece.keyframes) {
    key.submap = -1;  // none of those in places
    double vote = 1.0;
    for (const std::int64_t other : places.candidates(key, count, left_out)) {
      votes[piece_of[static_cast<std::size_t>(other)]] += vote;
      vote -= 1.0 / static_cast<double>(count);
    }
  }
  std::vector<std::pair<double, std::size_t>> order;
  order.reserve(votes.size());
  for (const auto& [other, vote] : votes) order.emplace_back(-vote, other);
  std::sort(order.begin(), order.end());
  std::set<std::size_t> found;
  for (std::size_t i = 0; i < std::min(count, order.size()); ++i) found.insert(order[i].second);
  return found;
}

/// One keyframe of each submap, that with the most features.
std::vector<Keyframe> typicalOf(AtlasData piece) {
  std::vector<Keyframe> typical;
  for (Keyframe& key : piece.keyframes) {  // in the order of their submaps
    if (typical.empty() || typical.back().submap != key.submap) {
      typical.push_back(std::move(key));
    } else if (key.sightings.size() > typical.back().sightings.size()) {
      typical.back() = std::move(key);
    }
  }
  return typical;
}

}  // namespace

SurveyReport SurveyJobs::places(bool allow_missing) const {
  SurveyJson read = SurveyJson::array();
  std::set<std::size_t> pieces;
  for (std::size_t piece = 0; piece < plan_.pieces.size(); ++piece) {
    if (!hasPiece(piece, allow_missing)) continue;
    pieces.insert(piece);
    read.push_back(detail::fileRecord(pieceOf(piece, "json")));
  }
  const SurveyRecord record(pathOf(kPlacesName), plan_.checksum, read);
  return detail::doJob("places", record, [&]() {
    PlaceFinder places;
    std::vector<std::size_t> piece_of;
    SurveyJson found = SurveyJson::array();
    for (std::size_t piece = 0; piece < plan_.pieces.size(); ++piece) {
      found.push_back(SurveyJson::array());
      if (pieces.count(piece) == 0) continue;
      AtlasData data = loadAtlas(pieceOf(piece, "atlas"), 1, AtlasContent::WithoutMaps);
      const auto count = static_cast<std::size_t>(plan_.params.link_pieces);
      const bool is_tied =
          piece > 0 && pieces.count(piece - 1) > 0 && plan_.pieces[piece - 1].has_next;
      const std::int64_t tied = is_tied ? static_cast<std::int64_t>(piece) - 1 : -1;
      std::set<std::size_t> looked_at = alike(data, count, places, piece_of, tied);
      if (is_tied) looked_at.insert(piece - 1);  // it would take a place of the others
      found.back() = looked_at;
      for (Keyframe& key : typicalOf(std::move(data))) {
        key.id = key.submap = static_cast<std::int64_t>(piece_of.size());
        piece_of.push_back(piece);
        places.add(key);
      }
    }
    return std::make_pair(SurveyJson{{"alike", found}}, std::string());
  });
}

SurveyReport SurveyJobs::links(std::size_t piece, bool allow_missing) const {
  if (piece == 0 || piece >= plan_.pieces.size())
    throw InputError("links are looked for between a piece and earlier ones: there is no piece " +
                     std::to_string(piece) + " with earlier ones among " +
                     detail::counted(plan_.pieces.size(), "piece"));
  const SurveyJson said = detail::readRecord(requireDone(kPlacesName, "places"), plan_.checksum);
  std::vector<std::size_t> pieces = said.at("alike").at(piece);
  if (hasPiece(piece, allow_missing)) pieces.push_back(piece);
  SurveyJson read = SurveyJson::array();
  for (const std::size_t one : pieces) read.push_back(detail::fileRecord(pieceOf(one, "json")));
  const std::string name = "links_" + std::to_string(piece);
  const SurveyRecord record(pathOf(name + ".json"), plan_.checksum, read);
  return detail::doJob(name, record, [&]() {
    SurveyJson found = SurveyJson::array();
    if (pieces.size() < 2 || pieces.back() != piece)
      return std::make_pair(SurveyJson{{"links", found}}, std::string());
    AtlasData all;
    std::vector<PieceRows> rows;
    rows.reserve(pieces.size());
    for (const std::size_t one : pieces)
      rows.push_back(
          detail::addPiece(all, loadAtlas(pieceOf(one, "atlas"), 1, AtlasContent::WithoutMaps)));
    // Neighbours are not asked for loops.
    const std::size_t own = pieces.size() - 1;
    std::optional<Link> tie;
    if (pieces[own - 1] + 1 == piece)
      tie = detail::tieBetween(detail::readRecord(pieceOf(piece - 1, "json"), plan_.checksum),
                               detail::readRecord(pieceOf(piece, "json"), plan_.checksum));
    PlaceFinder places;
    for (std::size_t i = 0; i < rows[own].first_keyframe; ++i) places.add(all.keyframes[i]);
    for (std::size_t i = rows[own].first_keyframe; i < rows[own].end_keyframe; ++i) {
      const Keyframe& key = all.keyframes[i];
      std::vector<std::int64_t> neighbours;
      if (tie && key.submap == tie->to_submap + rows[own].submap)
        neighbours.push_back(tie->from_submap + rows[own - 1].submap);
      for (Link& link : places.links(key, all, neighbours)) {
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

}  // namespace planar_mapping
