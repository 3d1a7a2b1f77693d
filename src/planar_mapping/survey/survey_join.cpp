// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>
#include <vector>

#include "planar_mapping/atlas/atlas_parts.h"
#include "planar_mapping/atlas/atlas_store.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/map/joined_map.h"
#include "planar_mapping/map/map_tiles.h"
#include "planar_mapping/pipeline/output.h"
#include "planar_mapping/survey/survey_jobs.h"
#include "planar_mapping/survey/survey_records.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;
using detail::SurveyJson;
using detail::SurveyRecord;
using detail::writingResult;

/// joinSubmaps(), bit for bit, with few submaps in memory at a time.
PlanarMap joinedInOrder(AtlasStore& store, const std::vector<const Submap*>& submaps, int threads) {
  constexpr std::size_t kAtOnce = 16;
  PlanarMap all;
  for (std::size_t first = 0; first < submaps.size(); first += kAtOnce) {
    JoinedMap joined;
    if (first > 0)
      joined.set(0, std::make_shared<const PlanarMap>(std::move(all)), Pose::Identity());
    for (std::size_t i = first; i < std::min(submaps.size(), first + kAtOnce); ++i)
      joined.set(static_cast<std::int32_t>(i + 1), store.map(submaps[i]->id, threads),
                 submaps[i]->T_world_submap);
    all = joined.map();
  }
  return all;
}

}  // namespace

SurveyReport SurveyJobs::join(const std::string& map, std::optional<std::int64_t> component,
                              int threads) const {
  const fs::path absolute = fs::absolute(map).lexically_normal();
  const bool is_here =
      absolute.parent_path() == fs::absolute(pathOf("")).lexically_normal().parent_path();
  const std::string target = is_here ? absolute.filename().string() : absolute.string();
  const SurveyJson read = {{"files", 1},
                           {"survey", detail::fileRecord(requireDone("survey.json", "solve"))},
                           {"map", target},
                           {"component", component ? SurveyJson(*component) : SurveyJson()}};
  const SurveyRecord record(pathOf("map.json"), plan_.checksum, read);
  return detail::doJob("join", record, [&]() {
    AtlasStore store = AtlasStore::open(pathOf("survey.atlas"));
    const AtlasData data = store.load(1, AtlasContent::Outline);
    if (data.submaps.empty())
      throw InputError(folder_ + ": no frame of the survey could be mapped");
    const std::int64_t chosen = component.value_or(data.submaps.front().component);
    std::vector<const Submap*> submaps;
    for (const Submap& submap : data.submaps)
      if (submap.component == chosen) submaps.push_back(&submap);
    if (submaps.empty()) throw InputError("there is no component " + std::to_string(chosen));
    const PlanarMap joined = joinedInOrder(store, submaps, threads);
    writingResult([&]() { io::saveMap(joined, absolute.string(), io::Overwrite::Allow); });
    return std::make_pair(SurveyJson{{"component", chosen}, {"components", componentsOf(data)}},
                          target);
  });
}

std::size_t SurveyJobs::tileCount() const {
  const SurveyJson solved = detail::readRecord(requireDone("survey.json", "solve"), plan_.checksum);
  return solved.contains("tiles") ? solved.at("tiles").size() : 0;
}

SurveyReport SurveyJobs::tile(std::size_t number, int threads) const {
  const SurveyJson solved = detail::readRecord(requireDone("survey.json", "solve"), plan_.checksum);
  const std::size_t count = solved.contains("tiles") ? solved.at("tiles").size() : 0;
  if (number >= count)
    throw InputError("there is no tile " + std::to_string(number) + ": the survey has " +
                     detail::counted(count, "tile"));
  const std::array<std::int64_t, 3> place = solved.at("tiles").at(number);
  const auto [component, x, y] = place;
  const double side = solved.at("tile_m");
  const std::string folder = pathOf("tiles_" + std::to_string(component));
  const std::string name = "map_" + std::to_string(x) + "_" + std::to_string(y);
  const SurveyRecord record((fs::path(folder) / (name + ".json")).string(), plan_.checksum,
                            {{"files", 1}, {"survey", solved.at("wrote")}});
  return detail::doJob("tile " + name, record, [&, x = x, y = y, component = component]() {
    AtlasStore store = AtlasStore::open(pathOf("survey.atlas"));
    JoinedMap joined;
    for (const SurveyJson& row : solved.at("rows")) {
      // With those of the next tiles: surfaces that go on there are the same in both.
      const std::array<std::int64_t, 4> range = row.at(3);
      if (row.at(1) != component || range[0] > x + 1 || range[1] > y + 1 || range[2] < x - 1 ||
          range[3] < y - 1)
        continue;
      const std::int32_t id = row.at(0);
      joined.set(id, store.map(id, threads), detail::poseOf(row.at(2)));
    }
    const PlanarMap part = tileOf(joined.map(), side, static_cast<int>(x), static_cast<int>(y));
    writingResult([&]() {
      std::error_code error;
      fs::create_directories(folder, error);
      if (error) throw IoError(folder, "cannot be created: " + error.message());
      io::writeFileAtomically((fs::path(folder) / "tiles.json").string(),
                              SurveyJson{{"side_m", side}}.dump(1) + "\n", io::Overwrite::Allow);
      io::saveMap(part, (fs::path(folder) / (name + ".pmap")).string(), io::Overwrite::Allow);
    });
    return std::make_pair(SurveyJson{{"submaps", joined.size()}, {"frames", part.frames()}},
                          name + ".pmap");
  });
}

}  // namespace planar_mapping
