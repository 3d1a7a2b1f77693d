// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cctype>
#include <chrono>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "../commands.h"
#include "../robot_options.h"
#include "../unknown_words.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/viewer/drawing/projection_2d.h"
#include "planar_mapping/viewer/scene/scene_content.h"
#include "planar_mapping/viewer/window/snapshot.h"
#include "planar_mapping/viewer/window/window.h"
namespace planar_mapping::tools {
namespace {

struct Arguments {
  std::vector<std::string> files;
  std::string snapshot;
  std::string size = "1280x720", camera = "iso", color = "plane", cutaway;
  std::string show, background, up = "auto";
  std::string camera_position, focal_point, view_up;
  double zoom = 1.0, point_size = 2.0;
  std::optional<double> clip_above;
  bool projection_2d = false;
  RobotModel robot;
  std::size_t storey = 0;
  std::string reference;
  double threshold = 0.01;
  bool force = false;
  bool follow = false;

  io::Overwrite overwrite() const { return force ? io::Overwrite::Allow : io::Overwrite::Refuse; }
};

/// \throws ParameterError for a name that promises another kind of picture
void requirePngName(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const char* other :
       {".jpg", ".jpeg", ".bmp", ".gif", ".tif", ".tiff", ".webp", ".svg", ".pdf", ".eps"}) {
    if (extension == other)
      throw ParameterError("'" + path + "': pictures are PNG files; call it *.png");
  }
}

Vector3 vectorFromString(const std::string& name, const std::string& text) {
  const std::array<double, 3> v = numbersOf<3>(name, text);
  return {v[0], v[1], v[2]};
}

void declare(CLI::App& app, Arguments& a) {
  app.option_defaults()->always_capture_default();
  app.add_option("FILE", a.files,
                 "map (.pmap) or the result folder of a run, then point clouds (.pcd, .ply) to "
                 "draw over it")
      ->required();
  app.add_option("-o,--output,--snapshot", a.snapshot,
                 "write a PNG and open no window; no display is needed");
  app.add_option("--size", a.size, "picture or window, pixels (16x16 to 16384x16384)");
  app.add_option("--camera", a.camera, "iso, top, front, back, left, right or first-person");
  app.add_option("--camera-position", a.camera_position, "where the camera is: x,y,z in metres");
  app.add_option("--focal-point", a.focal_point, "what it looks at: x,y,z in metres");
  app.add_option("--view-up", a.view_up, "what is up in the picture: x,y,z");
  app.add_option("--zoom", a.zoom, "2 shows half as much (0 to 1000)");
  app.add_option("--color", a.color, "plane, height, probability, state or tilt");
  app.add_option("--show", a.show,
                 "layers, comma-separated: occupied, unknown, trajectory, cloud, edges, axes, "
                 "ground-grid, legend; or all, none [all but unknown; --projection-2d: all]");
  app.add_option("--background", a.background,
                 "#rrggbb, white, black, gray, light or dark [a light gradient]");
  app.add_option("--cutaway", a.cutaway,
                 "what hides a room is left out: none; ceiling; seen = surfaces show only from "
                 "the side they were seen from [seen, where the map knows what was seen]");
  app.add_option("--clip-above", a.clip_above, "leave out what lies above this height, metres");
  app.add_option("--up", a.up, "the map's axis against gravity: x,y,z, or auto");
  app.add_option("--point-size", a.point_size, "of clouds, pixels (1 to 50)");
  app.add_flag("--projection-2d", a.projection_2d,
               "draw a plan: occupied dark, free white, unknown gray, the path dashed");
  app.add_option("--storey", a.storey, "of the plan; the lowest is 0");
  addRobotOptions(app, a.robot);
  app.add_option("--reference", a.reference, "compare with this PNG; exit code 6 if it differs");
  app.add_option("--threshold", a.threshold, "fraction of pixels that may differ (0 to 1)");
  app.add_flag("-f,--force", a.force, "overwrite an existing PNG");
  app.add_flag("--follow", a.follow,
               "wait for the map, and show it anew when its file changes, as run --watch does");
  app.set_version_flag("--version", PLANAR_MAPPING_VERSION);
  app.footer(
      "Examples:\n  planar_map view out/map.pmap cloud.pcd\n  planar_map view --follow "
      "out/map.pmap\n  planar_map snapshot out/map.pmap -o map.png --camera top\n  planar_map "
      "snapshot out/map.pmap -o plan.png --projection-2d");
}

ViewOptions viewOptions(const Arguments& a) {
  ViewOptions options;
  options.setSize(a.size);
  options.camera = cameraPresetFromString(a.camera);
  options.color = colorByFromString(a.color);
  if (!a.cutaway.empty()) options.cutaway = cutawayFromString(a.cutaway);
  options.show.unknown = a.projection_2d;
  if (!a.show.empty()) options.show = Layers::fromString(a.show);
  if (!a.background.empty()) options.background = colorFromString(a.background);
  if (!a.camera_position.empty())
    options.camera_position = vectorFromString("--camera-position", a.camera_position);
  if (!a.focal_point.empty())
    options.focal_point = vectorFromString("--focal-point", a.focal_point);
  if (!a.view_up.empty()) options.view_up = vectorFromString("--view-up", a.view_up);
  options.clip_above = a.clip_above;
  options.zoom = a.zoom;
  options.point_size = a.point_size;
  options.validate();
  a.robot.validate();
  requireInRange("--threshold", a.threshold, 0.0, 1.0);
  return options;
}

/// \param origin  of the map's frame in the world
SceneCloud sceneCloud(const std::string& path, const Vector3& origin) {
  io::CloudChannels channels = io::CloudChannels::none();
  channels.colors = true;
  const io::CloudData data = io::readCloudFile(path, channels);
  SceneCloud cloud;
  cloud.xyz.reserve(data.xyz.size());
  for (std::size_t i = 0; i < data.size(); ++i) {
    const Vector3 p = data.T_world_sensor * data.view().point(i) - origin;
    for (int k = 0; k < 3; ++k) cloud.xyz.push_back(static_cast<float>(p[k]));
  }
  for (const std::uint32_t c : data.colors) {
    for (const unsigned shift : {16u, 8u, 0u})
      cloud.rgb.push_back(static_cast<std::uint8_t>(c >> shift));
  }
  return cloud;
}

SceneContent readContent(const Arguments& a) {
  SceneContent content;
  std::size_t first_cloud = 0;
  Vector3 origin = Vector3::Zero();
  // Clouds alone can be looked at, too.
  if (io::recognizeCloudFile(a.files[0]) == io::CloudFormat::None) {
    const PlanarMap map = io::loadMap(a.files[0]);
    content = sceneContent(map);
    origin = map.params().origin;
    first_cloud = 1;
  }
  for (std::size_t i = first_cloud; i < a.files.size(); ++i)
    content.clouds.push_back(sceneCloud(a.files[i], origin));
  if (a.up != "auto") {
    content.up = vectorFromString("--up", a.up);
    if (content.up.isZero()) throw ParameterError("--up is '" + a.up + "', which is no direction");
  }
  if (content.empty()) throw InputError(a.files[0] + ": the map is empty; nothing to draw");
  return content;
}

int compareWithReference(const Image& image, const Arguments& a) {
  const Image reference = readPng(a.reference);
  if (reference.width != image.width || reference.height != image.height) {
    std::cerr << "planar_map_viewer: " << a.reference << " is " << reference.width << "x"
              << reference.height << ", the picture is " << image.width << "x" << image.height
              << "; set --size\n";
    return kOverThreshold;
  }
  const double changed = compareImages(image, reference).changed;
  std::cout << "changed pixels: " << changed << " (threshold " << a.threshold << ")\n";
  if (changed <= a.threshold) return kDone;
  std::cerr << "planar_map_viewer: the picture differs from " << a.reference << " in "
            << 100.0 * changed << " % of its pixels; allowed are " << 100.0 * a.threshold << " %\n";
  return kOverThreshold;
}

/// From where a merged cloud was seen nobody knows: a side of its planes would be any side.
ViewOptions optionsFor(const SceneContent& content, const Arguments& a, ViewOptions options) {
  const bool knows_space = content.unseen == Unseen::Free || !content.free.empty();
  if (a.cutaway.empty() && !knows_space) options.cutaway = Cutaway::None;
  return options;
}

/// What changes when the file does: when it was written, and its size.
using FileState = std::pair<std::filesystem::file_time_type, std::uintmax_t>;

FileState stateOf(const std::string& path) {
  std::error_code gone;
  const FileState state{std::filesystem::last_write_time(path, gone),
                        std::filesystem::file_size(path, gone)};
  return gone ? FileState() : state;
}

/// Shows the map of a file that another program writes.
void followFile(const Arguments& a, const ViewOptions& options) {
  constexpr auto kPeriod = std::chrono::milliseconds(200);
  const std::string& path = a.files[0];
  if (!std::filesystem::exists(path))
    std::cerr << "planar_map_viewer: waiting for " << path << "\n";
  FileState shown;
  const auto read = [&]() -> std::optional<SceneContent> {
    const FileState now = stateOf(io::mapFileOf(path));
    if (now == shown) return std::nullopt;
    shown = now;
    if (now.second == 0) return std::nullopt;
    try {
      return readContent(a);
    } catch (const InputError&) {  // a map without anything in it yet
      return std::nullopt;
    }
  };
  std::optional<SceneContent> content;
  while (!(content = read())) std::this_thread::sleep_for(kPeriod);
  const ViewOptions chosen = optionsFor(*content, a, options);
  const std::unique_ptr<Window> window =
      openWindow(std::move(*content), chosen, Window::Screen::Display, path + " - planar_mapping");
  window->follow(read, kPeriod.count() * 1e-3);
  window->run();
}

int draw(const Arguments& a, const ViewOptions& wanted) {
  const bool in_window = a.snapshot.empty() && a.reference.empty() && !a.projection_2d;
  if (a.follow && !in_window) throw ParameterError("--follow is for windows, not for pictures");
  if (a.follow) {
    followFile(a, wanted);
    return kDone;
  }
  const SceneContent content = readContent(a);
  const ViewOptions options = optionsFor(content, a, wanted);
  if (in_window) {
    openWindow(content, options, Window::Screen::Display, a.files[0] + " - planar_mapping")->run();
    return kDone;
  }
  const Image image = a.projection_2d ? drawProjection2d(content, options, a.robot, a.storey)
                                      : renderSnapshot(content, options);
  if (!a.snapshot.empty()) {
    writeResults([&]() { io::writeImage(a.snapshot, image, a.overwrite()); });
  }
  return a.reference.empty() ? kDone : compareWithReference(image, a);
}

int run(int argc, char** argv) {
  CLI::App app("Looks at a map of planar cuboids: in a window, or as a PNG without a display.",
               "planar_map_viewer");
  Arguments arguments;
  declare(app, arguments);
  try {
    app.parse(argc, argv);
    if (arguments.projection_2d && arguments.snapshot.empty() && arguments.reference.empty())
      throw ParameterError("--projection-2d needs the picture's name: -o FILE.png");
    const ViewOptions options = viewOptions(arguments);
    requirePngName(arguments.snapshot);
    // What cannot be written is refused before anything is drawn.
    if (!arguments.snapshot.empty()) {
      writeResults([&]() { io::AtomicFile(arguments.snapshot, arguments.overwrite()); });
    }
    return draw(arguments, options);
  } catch (const CLI::ExtrasError& error) {
    std::cerr << "planar_map_viewer: " << error.what() << suggestionFor(app) << "\n";
    return kUsage;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
}

int report(const std::exception& error, int code) {
  std::cerr << "planar_map_viewer: " << error.what() << "\n";
  return code;
}

}  // namespace
}  // namespace planar_mapping::tools

int main(int argc, char** argv) {
  using namespace planar_mapping;
  try {
    return tools::run(argc, argv);
  } catch (const tools::UsageError& error) {
    return tools::report(error, tools::kUsage);
  } catch (const ParameterError& error) {
    return tools::report(error, tools::kUsage);
  } catch (const RenderError& error) {
    return tools::report(error, tools::kNoRenderer);
  } catch (const Error& error) {
    return tools::report(error, tools::kInputUnreadable);
  } catch (const std::exception& error) {
    return tools::report(error, tools::kInternalFailure);
  }
}
