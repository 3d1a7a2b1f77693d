// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "../commands.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/viewer/drawing/charts.h"

namespace planar_mapping::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// How a method looks in every figure.
struct MethodStyle {
  const char* method;
  const char* name;
  Color color;
  ChartSeries::Marker marker;
  bool dashed;
};

// Colours that also differ for colour-blind readers (Okabe and Ito).
constexpr MethodStyle kStyles[] = {
    {"SG", "SG (standard grid)", {90, 90, 90}, ChartSeries::Marker::Square, false},
    {"OG", "OG (octree)", {0, 114, 178}, ChartSeries::Marker::Diamond, false},
    {"RA", "RA (rectangular cuboids)", {230, 159, 0}, ChartSeries::Marker::Cross, false},
    {"PG_paper", "PG (paper)", {0, 158, 115}, ChartSeries::Marker::Plus, true},
    {"PG", "PG (compact)", {213, 94, 0}, ChartSeries::Marker::Circle, false},
};

/// A figure of the tables as a chart.
struct ChartStyle {
  const char* column;
  const char* y_title;
  double factor;
  bool logarithmic;
  std::vector<std::string> methods;
};

struct DrawOptions {
  io::Overwrite overwrite = io::Overwrite::Refuse;
  bool quiet = false;
};

void save(const Image& image, const std::string& path, const DrawOptions& options) {
  writeResults([&]() { io::writeImage(path, image, options.overwrite); });
  if (!options.quiet) std::cout << path << '\n';
}

Json parsed(const std::string& path) {
  const Json json = Json::parse(io::readWholeText(path), nullptr, false);
  if (json.is_discarded()) throw InputError(path + ": this is no JSON");
  return json;
}

double number(const Json& value, double factor = 1.0) {
  return value.is_number() ? factor * value.get<double>()
                           : std::numeric_limits<double>::quiet_NaN();
}

bool hasFigure(const Json& results, const std::string& scene, const ChartStyle& style) {
  for (const Json& row : results) {
    if (row.at("scene") == scene && row.at(style.column).is_number()) return true;
  }
  return false;
}

ChartSeries seriesOf(const Json& results, const std::string& scene, const MethodStyle& method,
                     const ChartStyle& style) {
  ChartSeries series = {method.name, method.color, method.marker, method.dashed, {}, {}, {}, {}};
  for (const Json& row : results) {
    if (row.at("scene") != scene || row.at("method") != method.method) continue;
    series.x.push_back(number(row.at("cell_m")));
    series.y.push_back(number(row.at(style.column), style.factor));
    const Json& spread = row.at("spread").at(style.column);
    series.low.push_back(number(spread.at(0), style.factor));
    series.high.push_back(number(spread.at(1), style.factor));
  }
  return series;
}

Chart chartOf(const Json& results, const std::string& scene, const ChartStyle& style) {
  Chart chart = {scene, "cell size s [m]", style.y_title, style.logarithmic, {}};
  for (const MethodStyle& method : kStyles) {
    const auto& wanted = style.methods;
    if (std::find(wanted.begin(), wanted.end(), method.method) == wanted.end()) continue;
    ChartSeries series = seriesOf(results, scene, method, style);
    if (!series.x.empty()) chart.series.push_back(std::move(series));
  }
  return chart;
}

std::vector<std::string> scenesOf(const Json& results) {
  std::vector<std::string> scenes;
  for (const Json& row : results) {
    const auto scene = row.at("scene").get<std::string>();
    if (std::find(scenes.begin(), scenes.end(), scene) == scenes.end()) scenes.push_back(scene);
  }
  return scenes;
}

/// One row of charts a style, one column a scene; scenes without such figures are left out.
void drawFigure(const Json& results, const std::vector<ChartStyle>& styles, const std::string& path,
                const DrawOptions& options) {
  ChartPage page;
  int columns = 0;
  for (const ChartStyle& style : styles) {
    int in_row = 0;
    for (const std::string& scene : scenesOf(results)) {
      if (!hasFigure(results, scene, style)) continue;
      page.charts.push_back(chartOf(results, scene, style));
      ++in_row;
    }
    columns = std::max(columns, in_row);
  }
  if (page.charts.empty()) return;
  page.columns = columns;
  save(renderCharts(page), path, options);
}

void draw(const std::string& directory, const DrawOptions& options) {
  const fs::path folder(directory);
  const auto path = [&folder](const char* name) { return (folder / name).string(); };
  const std::string table = path("evaluation.json");
  try {
    const Json results = parsed(table).at("results");
    const std::vector<std::string> all = {"SG", "OG", "RA", "PG_paper", "PG"};
    drawFigure(results,
               {{"combination_efficiency",
                 "combination efficiency",
                 1.0,
                 false,
                 {"OG", "RA", "PG_paper", "PG"}}},
               path("fig12_combination_efficiency.png"), options);
    drawFigure(results, {{"error_percent", "mapping error [%]", 1.0, false, all}},
               path("fig13_mapping_error.png"), options);
    drawFigure(results,
               {{"memory_bytes", "memory [kB]", 1e-3, true, all},
                {"file_bytes", "file [kB]", 1e-3, true, all},
                {"time_ms_per_frame", "time a frame [ms]", 1.0, true, all}},
               path("fig14_memory_file_time.png"), options);
  } catch (const Json::exception& error) {
    throw InputError(table + ": not what planar_map evaluate writes: " + error.what());
  }
}

}  // namespace

int runCharts(int argc, char** argv) {
  CLI::App app("The figures of the tables that planar_map evaluate has written.",
               "planar_map_viewer charts");
  std::string directory;
  bool force = false;
  bool quiet = false;
  app.add_option("DIR", directory, "directory with evaluation.json")->required();
  app.add_flag("-f,--force", force, "overwrite existing pictures");
  app.add_flag("-q,--quiet", quiet, "do not name the pictures on stdout");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  draw(directory, {force ? io::Overwrite::Allow : io::Overwrite::Refuse, quiet});
  return kDone;
}

}  // namespace planar_mapping::tools
