// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/run_atlas.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>

#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/output.h"
#ifdef PLANAR_MAPPING_HAS_ATLAS
#include "planar_mapping/atlas/atlas_store.h"
#endif

namespace planar_mapping::detail {

#ifdef PLANAR_MAPPING_HAS_ATLAS

namespace {

/// With what SQLite keeps beside it.
void removeAtlas(const std::string& path) {
  std::error_code ignored;
  for (const char* const suffix : {"", "-wal", "-shm"})
    std::filesystem::remove(path + suffix, ignored);
}

}  // namespace

struct RunAtlas::Store {
  std::string path;
  std::optional<AtlasStore> file;
};

RunAtlas::~RunAtlas() = default;

void RunAtlas::open(const RunOptions& options, const std::string& own,
                    const std::vector<std::string>& inputs) {
  const bool is_own = options.atlas.empty();
  if (is_own && own.empty()) return;
  if (!is_own && options.resume)
    throw InputError(options.atlas + ": a run with an atlas cannot be resumed; run it again");
  store_ = std::make_unique<Store>();
  store_->path = is_own ? own : options.atlas;
  AtlasData known;
  if (!is_own && std::filesystem::exists(store_->path)) {
    known = loadAtlas(store_->path, pipeline_.configuration().settings.threads);
    writingResult([&]() { store_->file = AtlasStore::open(store_->path, AtlasAccess::Write); });
  } else if (!is_own) {
    writingResult(
        [&]() { AtlasStore::create(store_->path); });  // what cannot be written is said at once
    removeAtlas(store_->path);
  }
  SubmapParams params;
  params.frames = options.submap_frames;
  AtlasSession session;
  for (const std::string& name : inputs)
    session.source += (session.source.empty() ? "" : ", ") + name;
  session.configuration = effectiveYaml(pipeline_.configuration());
  pipeline_.keepAtlas(params, std::move(session), std::move(known));
}

void RunAtlas::storeSubmaps() {
  if (pipeline_.atlas() == nullptr) return;
  pipeline_.atlas()->store([this](const AtlasData& added, const AtlasData& solved) {
    writingResult([&]() {
      if (!store_->file) {
        removeAtlas(store_->path);
        store_->file = AtlasStore::create(store_->path);
      }
      store_->file->append(added, solved);
    });
  });
}

std::string RunAtlas::finish() {
  if (pipeline_.atlas() == nullptr) return "";
  pipeline_.atlas()->finish();
  storeSubmaps();
  const AtlasData& data = pipeline_.atlas()->data();
  const auto loops = std::count_if(data.links.begin(), data.links.end(), [](const Link& link) {
    return link.kind == LinkKind::Loop && link.state == LinkState::Used;
  });
  return "atlas " + std::filesystem::path(store_->path).filename().string() + ": " +
         std::to_string(data.submaps.size()) + " submaps, " +
         std::to_string(data.keyframes.size()) + " keyframes, " + std::to_string(loops) +
         " loops used";
}

std::vector<MapPlace> RunAtlas::places() const {
  std::vector<MapPlace> places;
  if (pipeline_.atlas() == nullptr) return places;
  const AtlasData& data = pipeline_.atlas()->data();
  for (const Submap& submap : data.submaps)
    if (submap.session == data.sessions.back().id)
      places.push_back({submap.map.get(), submap.id, submap.component, submap.T_world_submap});
  return places;
}

std::vector<std::pair<std::int64_t, RunAtlas::Trajectory>> RunAtlas::trajectories() const {
  if (pipeline_.atlas() == nullptr) return {{0, pipeline_.map().trajectory()}};
  return pipeline_.atlas()->trajectories();
}

#else

struct RunAtlas::Store {};

RunAtlas::~RunAtlas() = default;

void RunAtlas::open(const RunOptions& options, const std::string&,
                    const std::vector<std::string>&) {
  if (!options.atlas.empty())
    throw InputError(options.atlas + ": this build has no atlas (libceres-dev, libsqlite3-dev)");
}

void RunAtlas::storeSubmaps() {}

std::string RunAtlas::finish() {
  return "";
}

std::vector<MapPlace> RunAtlas::places() const {
  return {};
}

std::vector<std::pair<std::int64_t, RunAtlas::Trajectory>> RunAtlas::trajectories() const {
  return {{0, pipeline_.map().trajectory()}};
}

#endif

RunAtlas::RunAtlas(Pipeline& pipeline) : pipeline_(pipeline) {}

}  // namespace planar_mapping::detail
