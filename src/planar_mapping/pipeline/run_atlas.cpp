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

/// Their number changes nothing.
std::string withoutThreads(std::string yaml) {
  const std::size_t line = yaml.find("threads:");
  if (line != std::string::npos) yaml.erase(line, yaml.find('\n', line) + 1 - line);
  return yaml;
}

}  // namespace

struct RunAtlas::Store {
  /// Goes on where the last session of the file is that of this run, which was interrupted.
  /// \return what there was before it; nothing if it is another one
  std::optional<AtlasData> resume(const AtlasSession& session, int threads);

  std::string path;
  std::optional<AtlasStore> file;
  Append how = Append::ToAll;
  std::size_t frames = 0;  ///< of the session in the file that is to be replaced
};

std::optional<AtlasData> RunAtlas::Store::resume(const AtlasSession& session, int threads) {
  if (!file->knowsBeforeLastSession()) return std::nullopt;
  const AtlasData all = file->load(threads, AtlasContent::Outline);
  const AtlasSession& last = all.sessions.back();
  if (last.source != session.source || last.configuration != session.configuration)
    return std::nullopt;
  for (const Submap& submap : all.submaps)
    if (submap.session == last.id) frames += file->map(submap.id, threads)->frames();
  how = Append::InPlaceOfLastSession;
  return file->loadWithoutLastSession(threads);
}

RunAtlas::~RunAtlas() = default;

void RunAtlas::open(const RunOptions& options, const std::string& own,
                    const std::vector<std::string>& inputs) {
  const bool is_own = options.atlas.empty();
  if (is_own && own.empty()) return;
  store_ = std::make_unique<Store>();
  store_->path = is_own ? own : options.atlas;
  AtlasSession session;
  for (const std::string& name : inputs)
    session.source += (session.source.empty() ? "" : ", ") + name;
  session.configuration = withoutThreads(effectiveYaml(pipeline_.configuration()));
  const int threads = pipeline_.configuration().settings.threads;
  std::optional<AtlasData> known;
  if (std::filesystem::exists(store_->path) && (!is_own || options.resume)) {
    if (!is_own) known = loadAtlas(store_->path, threads);
    try {
      writingResult([&]() { store_->file = AtlasStore::open(store_->path, AtlasAccess::Write); });
      std::optional<AtlasData> before;
      if (options.resume) before = store_->resume(session, threads);
      if (before) known = std::move(before);
    } catch (const Error&) {
      if (!is_own) throw;  // else it is made anew
    }
    if (!known) store_->file.reset();
  } else if (!is_own) {
    writingResult(
        [&]() { AtlasStore::create(store_->path); });  // what cannot be written is said at once
    removeAtlas(store_->path);
  }
  SubmapParams params;
  params.frames = options.submap_frames;
  pipeline_.keepAtlas(params, std::move(session), std::move(known).value_or(AtlasData()),
                      store_->path);
}

void RunAtlas::storeSubmaps() {
  if (pipeline_.atlas() == nullptr) return;
  const auto write = [this](const AtlasData& added, const AtlasData& solved) {
    writingResult([&]() {
      if (!store_->file) {
        removeAtlas(store_->path);
        store_->file = AtlasStore::create(store_->path);
      }
      store_->file->append(added, solved, store_->how);
    });
    store_->how = Append::ToAll;
    store_->frames = 0;
  };
  pipeline_.atlas()->store(write, store_->frames);
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
