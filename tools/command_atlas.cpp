// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "commands.h"
#include "planar_mapping/atlas/atlas_parts.h"
#include "planar_mapping/atlas/atlas_store.h"
#include "planar_mapping/atlas/pose_graph.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/number_text.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/io/pose_file.h"

namespace planar_mapping::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct AtlasArguments {
  std::string file;
  std::vector<std::string> files;  ///< of merge
  std::string output;
  std::vector<std::int64_t> without_loops, with_loops;
  std::optional<std::int64_t> component;
  std::string by = "session";
  bool json = false;
  bool force = false;
  bool allow_missing = false;

  io::Overwrite overwrite() const { return force ? io::Overwrite::Allow : io::Overwrite::Refuse; }
};

AtlasData read(const std::string& path) {
  return loadAtlas(path, 0);
}

/// How many of the rows \p holds for.
template <typename Row, typename Holds>
std::size_t countIf(const std::vector<Row>& rows, const Holds& holds) {
  return static_cast<std::size_t>(std::count_if(rows.begin(), rows.end(), holds));
}

/// Submaps and keyframes of the part of an atlas.
Json countsOf(const AtlasData& part) {
  return {{"submaps", part.submaps.size()}, {"keyframes", part.keyframes.size()}};
}

Json boundsOf(const AtlasData& part) {
  Eigen::AlignedBox3d all;
  for (const Submap& submap : part.submaps) {
    Vector3 low, high;
    if (!submap.map->bounds(low, high)) continue;
    const Eigen::AlignedBox3d box(low, high);
    for (int corner = 0; corner < 8; ++corner)
      all.extend(submap.T_world_submap *
                 box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  }
  if (all.isEmpty()) return nullptr;
  return {{"low", toJson(all.min())}, {"high", toJson(all.max())}};
}

Json infoOf(const std::string& path) {
  const AtlasData data = read(path);
  Json info = {{"type", "atlas"}};
  info.update(countsOf(data));
  Json links;
  for (const LinkKind kind : {LinkKind::Neighbour, LinkKind::Loop, LinkKind::Surface})
    links[wordOf(kind)] =
        countIf(data.links, [kind](const Link& link) { return link.kind == kind; });
  for (const LinkState state : {LinkState::Used, LinkState::Rejected, LinkState::Refused})
    links[wordOf(state)] =
        countIf(data.links, [state](const Link& link) { return link.state == state; });
  info["links"] = links;
  info["sessions"] = Json::array();
  for (const AtlasSession& session : data.sessions) {
    Json row = {{"session", session.id}, {"source", session.source}};
    row.update(
        countsOf(partOf(data, [&](const Submap& submap) { return submap.session == session.id; })));
    info["sessions"].push_back(row);
  }
  info["components"] = Json::array();
  for (const std::int64_t component : componentsOf(data)) {
    const AtlasData part =
        partOf(data, [&](const Submap& submap) { return submap.component == component; });
    Json row = {{"component", component}};
    row.update(countsOf(part));
    row["bounds_m"] = boundsOf(part);
    info["components"].push_back(row);
  }
  info["file_bytes"] = fs::file_size(path);
  return info;
}

void printInfo(const Json& info) {
  for (const auto& item : info.items()) {
    if (!item.value().is_array()) {
      std::cout << item.key() << ": "
                << (item.value().is_string() ? item.value().get<std::string>()
                                             : item.value().dump())
                << '\n';
      continue;
    }
    for (const Json& row : item.value()) {
      std::string line;
      for (const auto& cell : row.items()) {
        const std::string value =
            cell.value().is_string() ? cell.value().get<std::string>() : cell.value().dump();
        line += (line.empty() ? "" : ", ") + cell.key() + " " + value;
      }
      std::cout << line << '\n';
    }
  }
}

Json loopsOf(const AtlasData& data) {
  std::unordered_map<std::int64_t, std::size_t> frame_of;
  for (const Keyframe& keyframe : data.keyframes) frame_of[keyframe.id] = keyframe.frame;
  const auto frame = [&](std::int64_t keyframe) {
    return keyframe < 0 ? Json() : Json(frame_of.at(keyframe));
  };
  Json loops = Json::array();
  for (const Link& link : data.links) {
    if (link.kind == LinkKind::Neighbour) continue;
    loops.push_back({{"loop", link.id},
                     {"kind", wordOf(link.kind)},
                     {"from_submap", link.from_submap},
                     {"to_submap", link.to_submap},
                     {"from_frame", frame(link.from_keyframe)},
                     {"to_frame", frame(link.to_keyframe)},
                     {"inliers", link.evidence.inliers},
                     {"matches", link.evidence.matches},
                     {"agreement", link.evidence.agreement},
                     {"seen_through", link.evidence.seen_through},
                     {"residual", link.residual},
                     {"state", wordOf(link.state)}});
  }
  return loops;
}

void printLoops(const Json& loops) {
  if (loops.empty()) std::cout << "no loops\n";
  for (const Json& loop : loops) {
    const auto end = [&](const std::string& which) {
      const Json& frame = loop[which + "_frame"];
      return "submap " + loop[which + "_submap"].dump() +
             (frame.is_null() ? "" : " (frame " + frame.dump() + ")");
    };
    std::cout << "loop " << loop["loop"] << ": " << end("from") << " to " << end("to") << ", "
              << loop["kind"].get<std::string>() << ", " << loop["inliers"] << " of "
              << loop["matches"]
              << (loop["kind"] == wordOf(LinkKind::Surface) ? " planes" : " features")
              << ", agreement " << loop["agreement"] << ", seen through " << loop["seen_through"]
              << ", residual " << loop["residual"] << ", " << loop["state"].get<std::string>()
              << '\n';
  }
}

/// Refuses and takes back loops, solves, and writes all of that at once.
void solve(const AtlasArguments& arguments) {
  std::error_code ignored;
  if (fs::is_directory(arguments.file, ignored))
    return solveSurvey(arguments.file, arguments.allow_missing, arguments.json);
  AtlasStore::open(arguments.file);  // what cannot be read is no fault of writing
  std::optional<AtlasStore> store;
  writeResults([&]() { store = AtlasStore::open(arguments.file, AtlasAccess::Write); });
  AtlasData data = store->load(0);
  try {
    setLoopStates(data, arguments.without_loops, LinkState::Refused);
    setLoopStates(data, arguments.with_loops, LinkState::Used);
  } catch (const InputError& error) {
    throw UsageError(arguments.file + ": " + error.what() + "; planar_map atlas loops lists them");
  }
  const PoseGraphResult result = solvePoseGraph(data);
  writeResults([&]() { store->update(data); });
  const Json answer = {{"moved", result.moved},
                       {"components", componentsOf(data)},
                       {"loops", loopsOf(data)},
                       {"solve_ms", result.ms}};
  if (arguments.json) {
    std::cout << answer.dump(2) << '\n';
  } else {
    std::cout << "moved " << detail::counted(result.moved.size(), "submap") << " in "
              << detail::numberText(result.ms) << " ms\n";
    printLoops(answer["loops"]);
  }
}

/// The component that was asked for; else that of the first submap, with a note if there are more.
std::int64_t chosenComponent(const AtlasData& data, const AtlasArguments& arguments) {
  const std::vector<std::int64_t> components = componentsOf(data);
  if (components.empty()) throw InputError(arguments.file + ": has no submaps");
  if (arguments.component) {
    if (std::find(components.begin(), components.end(), *arguments.component) == components.end())
      throw UsageError(arguments.file + ": has no component " +
                       std::to_string(*arguments.component) + "; planar_map atlas info lists them");
    return *arguments.component;
  }
  if (components.size() > 1)
    std::cerr << "planar_map: note: " << arguments.file << " has " << components.size()
              << " components; this is the first, --component writes others\n";
  return components.front();
}

void exportThumbnails(const AtlasData& data, const AtlasArguments& arguments) {
  std::unordered_map<std::int64_t, std::int64_t> component_of;
  for (const Submap& submap : data.submaps) component_of[submap.id] = submap.component;
  std::vector<std::pair<std::string, const Keyframe*>> files;
  for (const Keyframe& keyframe : data.keyframes) {
    if (keyframe.thumbnail.empty()) continue;
    if (arguments.component && component_of.at(keyframe.submap) != *arguments.component) continue;
    files.emplace_back(
        (fs::path(arguments.output) / (std::to_string(keyframe.id) + ".png")).string(), &keyframe);
    requireNew(files.back().first, arguments.force);
  }
  writeResults([&]() {
    std::error_code error;
    fs::create_directories(arguments.output, error);
    if (error) throw IoError(arguments.output, "cannot be created: " + error.message());
    for (const auto& [file, keyframe] : files)
      io::writeFileAtomically(file, keyframe->thumbnail.data(), keyframe->thumbnail.size(),
                              arguments.overwrite());
  });
}

void exportAtlas(const AtlasArguments& arguments) {
  const std::string& output = arguments.output;
  const std::string ending = fs::path(output).extension().string();
  std::error_code ignored;
  const bool is_folder = output.back() == '/' || fs::is_directory(output, ignored);
  if (!is_folder && ending != ".pmap" && ending != ".txt")
    throw UsageError(output +
                     ": is no *.pmap (the map), *.txt (poses of keyframes) or folder/ (their "
                     "thumbnails); planar_map convert makes other formats of a map");
  if (!is_folder) requireNew(output, arguments.force);
  const AtlasData data = read(arguments.file);
  if (is_folder) {
    if (arguments.component) chosenComponent(data, arguments);
    return exportThumbnails(data, arguments);
  }
  const std::int64_t component = chosenComponent(data, arguments);
  if (ending == ".txt") {
    const std::vector<io::StampedPose> poses = keyframePoses(data, component);
    return writeResults([&]() { io::writeTumPoses(output, poses, arguments.overwrite()); });
  }
  const PlanarMap map = [&]() {
    try {
      return joinSubmaps(data, component);
    } catch (const InputError& error) {
      throw InputError(arguments.file + ": " + error.what());
    }
  }();
  writeResults([&]() { io::saveMap(map, output, arguments.overwrite()); });
}

void mergeFiles(const AtlasArguments& arguments) {
  requireNew(arguments.output, arguments.force);
  AtlasData merged;
  std::size_t loops = 0;
  for (const std::string& file : arguments.files) {
    AtlasData added = read(file);
    if (!merged.submaps.empty()) {
      try {
        requireFits(added, merged.submaps.front().map->params());
      } catch (const InputError& error) {
        throw InputError(file + ": " + error.what() + " as " + arguments.files.front() + " has");
      }
    }
    const std::size_t first = merged.keyframes.size();
    addAtlas(merged, std::move(added));
    loops += addLoops(merged, first, 0);
  }
  if (loops > 0) solvePoseGraph(merged);
  writeResults([&]() { saveAtlas(merged, arguments.output, arguments.overwrite()); });
  if (arguments.files.size() > 1)
    std::cout << detail::counted(loops, "loop") << " between them, "
              << detail::counted(componentsOf(merged).size(), "component") << '\n';
}

void split(const AtlasArguments& arguments) {
  const AtlasData data = read(arguments.file);
  std::vector<std::pair<std::string, AtlasData>> parts;
  const auto add = [&](std::int64_t number, const std::function<bool(const Submap&)>& kept) {
    const std::string name = arguments.by + "_" + std::to_string(number) + ".atlas";
    parts.emplace_back((fs::path(arguments.output) / name).string(), partOf(data, kept));
    requireNew(parts.back().first, arguments.force);
  };
  if (arguments.by == "session") {
    for (const AtlasSession& session : data.sessions)
      add(session.id, [&](const Submap& submap) { return submap.session == session.id; });
  } else {
    for (const std::int64_t component : componentsOf(data))
      add(component, [&](const Submap& submap) { return submap.component == component; });
  }
  writeResults([&]() {
    std::error_code error;
    fs::create_directories(arguments.output, error);
    if (error) throw IoError(arguments.output, "cannot be created: " + error.message());
    for (const auto& [file, part] : parts) saveAtlas(part, file, arguments.overwrite());
  });
  for (const auto& [file, part] : parts) std::cout << file << '\n';
}

/// What info and loops answer.
template <typename Answer, typename Print>
void tell(bool as_json, const Answer& answer, const Print& print) {
  if (as_json) {
    std::cout << answer.dump(2) << '\n';
  } else {
    print(answer);
  }
}

}  // namespace

void addAtlasCommand(CLI::App& app, int&) {
  auto* atlas = app.add_subcommand("atlas", "The store of submaps, keyframes and loops");
  atlas->require_subcommand(0, 1);  // a word that is none is named
  atlas->callback([atlas]() {
    if (atlas->get_subcommands().empty())
      throw UsageError("atlas: what to do is missing; see planar_map atlas --help");
  });
  const auto arguments = std::make_shared<AtlasArguments>();
  const auto add = [&](const char* name, const char* text, void (*act)(const AtlasArguments&)) {
    CLI::App* command = atlas->add_subcommand(name, text);
    command->callback([arguments, act]() {
      std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error like a full disk
      act(*arguments);
    });
    return command;
  };
  const auto addFile = [&](CLI::App* command) {
    command->add_option("file", arguments->file, "Atlas (*.atlas)")->required();
  };
  const auto addJson = [&](CLI::App* command) {
    command->add_flag("--json", arguments->json, "For machines");
  };
  const auto addOutput = [&](CLI::App* command, const char* names, const char* text) {
    command->add_option(names, arguments->output, text)->required();
    command->add_flag("--force", arguments->force, "Overwrite files that exist");
  };

  auto* info =
      add("info", "Its sessions, submaps, keyframes, links and components",
          [](const AtlasArguments& given) { tell(given.json, infoOf(given.file), printInfo); });
  addFile(info);
  addJson(info);

  auto* loops = add(
      "loops", "Its loops: submaps, frames, evidence, residual, state",
      [](const AtlasArguments& given) { tell(given.json, loopsOf(read(given.file)), printLoops); });
  addFile(loops);
  addJson(loops);

  auto* solving = add("solve", "Moves the submaps so that the links agree", solve);
  solving
      ->add_option("file", arguments->file,
                   "Atlas (*.atlas), or the folder of a survey: makes survey.atlas in it")
      ->required();
  solving->add_flag("--allow-missing", arguments->allow_missing,
                    "Of a survey: leave pieces out that were not mapped");
  addJson(solving);
  solving
      ->add_option("--without-loop", arguments->without_loops,
                   "Number of a loop to refuse for good, repeatable")
      ->expected(1)
      ->take_all();
  solving
      ->add_option("--with-loop", arguments->with_loops,
                   "Number of a loop that was refused, to take it back, repeatable")
      ->expected(1)
      ->take_all();

  auto* exporting = add("export", "A map, poses or thumbnails of it", exportAtlas);
  addFile(exporting);
  addOutput(
      exporting, "output",
      "*.pmap: the map; *.txt: poses of the keyframes (TUM); folder/: their thumbnails (PNG)");
  exporting->add_option("--component", arguments->component,
                        "Number of a component (info); default: that of the first submap");

  auto* merging = add("merge", "Several atlases to one", mergeFiles);
  merging->add_option("files", arguments->files, "Atlases (*.atlas)")->required();
  addOutput(merging, "-o,--output", "Atlas to write");

  auto* splitting = add("split", "An atlas for each session or component", split);
  addFile(splitting);
  addOutput(splitting, "-o,--output", "Folder for session_N.atlas or component_N.atlas");
  splitting->add_option("--by", arguments->by, "session or component")
      ->capture_default_str()
      ->check(CLI::IsMember({"session", "component"}));

  addSurveyCommands(*atlas);
}

}  // namespace planar_mapping::tools
