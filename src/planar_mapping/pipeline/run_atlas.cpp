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

/// The outline of a file whose last session is this one, and was interrupted; nothing of another.
std::optional<AtlasData> interrupted(AtlasStore& file, const AtlasSession& session) {
  if (!file.isLastSessionOpen()) return std::nullopt;
  AtlasData outline = file.load(1, AtlasContent::Outline);
  const AtlasSession& last = outline.sessions.back();
  if (last.source != session.source || last.configuration != session.configuration)
    return std::nullopt;
  return outline;
}

AtlasSession sessionOf(const Configuration& configuration, const std::vector<std::string>& inputs) {
  AtlasSession session;
  for (const std::string& name : inputs)
    session.source += (session.source.empty() ? "" : ", ") + name;
  session.configuration = withoutThreads(effectiveYaml(configuration));
  return session;
}

}  // namespace

struct RunAtlas::Store {
  /// Goes on where the run was interrupted.
  /// \return what there was before its session; nothing if it has none
  std::optional<AtlasData> resume(const AtlasSession& session, int threads);

  std::string path;
  std::optional<AtlasStore> file;
  Append how = Append::ToAll;
  std::size_t frames = 0;  ///< of the session in the file that is to be replaced
};

std::optional<AtlasData> RunAtlas::Store::resume(const AtlasSession& session, int threads) {
  const std::optional<AtlasData> all = interrupted(*file, session);
  if (!all) return std::nullopt;
  for (const Submap& submap : all->submaps)
    if (submap.session == all->sessions.back().id)
      frames += file->map(submap.id, threads)->frames();
  how = Append::InPlaceOfLastSession;
  return file->loadWithoutLastSession(threads);
}

RunAtlas::~RunAtlas() = default;

bool RunAtlas::wasInterrupted(const std::string& path,
                              const std::vector<std::string>& inputs) const {
  try {
    AtlasStore file = AtlasStore::open(path);
    return interrupted(file, sessionOf(pipeline_.configuration(), inputs)).has_value();
  } catch (const Error&) {  // there is none
    return false;
  }
}

void RunAtlas::open(const std::string& path, bool is_own, const RunOptions& options,
                    const std::vector<std::string>& inputs) {
  store_ = std::make_unique<Store>();
  store_->path = path;
  AtlasSession session = sessionOf(pipeline_.configuration(), inputs);
  const int threads = pipeline_.configuration().settings.threads;
  std::optional<AtlasData> known;
  if (std::filesystem::exists(path) && (!is_own || options.resume)) {
    try {
      AtlasStore::open(path);  // what cannot be read is no matter of writing
      writingResult([&]() { store_->file = AtlasStore::open(path, AtlasAccess::Write); });
      if (options.resume) known = store_->resume(session, threads);
      if (!known && !is_own) known = store_->file->load(threads);
    } catch (const Error&) {
      if (!is_own) throw;  // else it is made anew
    }
    if (!known) store_->file.reset();
  } else if (!is_own) {
    writingResult([&]() { AtlasStore::create(path); });  // what cannot be written is said at once
    removeAtlas(path);
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
    return link.kind != LinkKind::Neighbour && link.state == LinkState::Used;
  });
  return "atlas " + std::filesystem::path(store_->path).filename().string() + ": " +
         std::to_string(data.submaps.size()) + " submaps, " +
         std::to_string(data.keyframes.size()) + " keyframes, " + std::to_string(loops) +
         " loops used";
}

void RunAtlas::close() {
  if (store_ != nullptr && store_->file) writingResult([&]() { store_->file->closeSession(); });
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

bool RunAtlas::wasInterrupted(const std::string&, const std::vector<std::string>&) const {
  return false;
}

void RunAtlas::open(const std::string& path, bool is_own, const RunOptions&,
                    const std::vector<std::string>&) {
  if (!is_own) throw InputError(path + ": this build has no atlas (libceres-dev, libsqlite3-dev)");
}

void RunAtlas::close() {}

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
