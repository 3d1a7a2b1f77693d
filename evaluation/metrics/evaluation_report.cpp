// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/metrics/evaluation_report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "planar_mapping/base/spelling.h"

namespace planar_mapping::evaluation {

using planar_mapping::detail::quotedForCsv;

namespace {

using Json = nlohmann::ordered_json;

bool isBaseline(const std::string& method) {
  return method == "SG" || method == "OG" || method == "RA";
}

bool belongs(const PlaceResult& result, const Summary& row) {
  return result.scene == row.scene && result.cell == row.cell && result.method == row.method;
}

/// Integers without a fraction, so that the tables read as they should.
Json number(const std::optional<double>& value) {
  if (!value || !std::isfinite(*value)) return nullptr;
  if (*value == std::floor(*value) && std::abs(*value) < 1e15)
    return static_cast<std::int64_t>(*value);
  return *value;
}

std::string text(const std::optional<double>& value) {
  const Json json = number(value);
  return json.is_null() ? std::string() : json.dump();
}

std::string fixed(const std::optional<double>& value, int decimals, double factor = 1.0) {
  if (!value) return "-";
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.setf(std::ios::fixed);
  out.precision(decimals);
  out << factor * *value;
  return out.str();
}

std::string withSpread(const Summary& row, std::optional<double> Figures::*value, int decimals,
                       double factor = 1.0) {
  const std::string median = fixed(row.median.*value, decimals, factor);
  if (!(row.median.*value) || row.places < 2) return median;
  return median + " (" + fixed(row.lower.*value, decimals, factor) + "-" +
         fixed(row.upper.*value, decimals, factor) + ")";
}

Json resultJson(const Summary& row, const std::vector<PlaceResult>& results) {
  Json json;
  json["scene"] = row.scene;
  json["simulated"] = row.simulated;
  json["cell_m"] = row.cell;
  json["method"] = row.method;
  json["places"] = row.places;
  Json spread;
  Json per_place;
  for (const FigureColumn& column : figureColumns()) {
    json[column.name] = number(row.median.*column.value);
    spread[column.name] = {number(row.lower.*column.value), number(row.upper.*column.value)};
    for (const PlaceResult& result : results) {
      if (!belongs(result, row)) continue;
      per_place[column.name].push_back(number(result.figures.*column.value));
    }
  }
  json["spread"] = std::move(spread);
  json["per_place"] = std::move(per_place);
  return json;
}

}  // namespace

const std::vector<FigureColumn>& figureColumns() {
  static const std::vector<FigureColumn> kColumns = {
      {"cells", &Figures::cells},
      {"standard_cells", &Figures::standard_cells},
      {"combination_efficiency", &Figures::combination_efficiency},
      {"error_percent", &Figures::error_percent},
      {"wrong_fraction", &Figures::wrong_fraction},
      {"completeness", &Figures::completeness},
      {"completeness_half", &Figures::completeness_half},
      {"completeness_quarter", &Figures::completeness_quarter},
      {"coverage", &Figures::coverage},
      {"coverage_quarter", &Figures::coverage_quarter},
      {"coverage_inside", &Figures::coverage_inside},
      {"measured_coverage", &Figures::measured_coverage},
      {"held_back_median_m", &Figures::held_back_median_m},
      {"surface_median_m", &Figures::surface_median_m},
      {"surface_p95_m", &Figures::surface_p95_m},
      {"free_space_violation", &Figures::free_space_violation},
      {"free_not_known", &Figures::free_not_known},
      {"memory_bytes", &Figures::memory_bytes},
      {"file_bytes", &Figures::file_bytes},
      {"compressed_bytes", &Figures::compressed_bytes},
      {"finished_bytes", &Figures::finished_bytes},
      {"ot_bytes", &Figures::ot_bytes},
      {"time_ms_per_frame", &Figures::time_ms_per_frame},
      {"frames", &Figures::frames},
      {"position_rms_m", &Figures::position_rms_m},
  };
  return kColumns;
}

std::optional<double> quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return std::nullopt;
  std::sort(values.begin(), values.end());
  const double rank = fraction * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(rank);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (rank - static_cast<double>(below)) * (values[above] - values[below]);
}

std::vector<Summary> summarize(const std::vector<PlaceResult>& results) {
  std::vector<Summary> rows;
  for (const PlaceResult& result : results) {
    const auto same = [&result](const Summary& row) { return belongs(result, row); };
    if (std::any_of(rows.begin(), rows.end(), same)) continue;
    Summary row;
    row.scene = result.scene;
    row.simulated = result.simulated;
    row.cell = result.cell;
    row.method = result.method;
    for (const PlaceResult& other : results) row.places += belongs(other, row) ? 1 : 0;
    for (const FigureColumn& column : figureColumns()) {
      std::vector<double> values;
      for (const PlaceResult& other : results) {
        if (belongs(other, row) && other.figures.*column.value)
          values.push_back(*(other.figures.*column.value));
      }
      row.lower.*column.value = quantile(values, 0.25);
      row.median.*column.value = quantile(values, 0.5);
      row.upper.*column.value = quantile(values, 0.75);
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string toJson(const ReportHeader& header, const std::vector<PlaceResult>& results) {
  Json json;
  for (const auto& [name, value] : header.facts) json[name] = value;
  json["interrupted"] = header.interrupted;
  json["results"] = Json::array();
  for (const Summary& row : summarize(results)) json["results"].push_back(resultJson(row, results));
  return json.dump(1) + "\n";
}

std::string toCsv(const ReportHeader& header, const std::vector<PlaceResult>& results) {
  std::string csv;
  for (const auto& [name, value] : header.facts) csv += "# " + name + ": " + value + "\n";
  if (header.interrupted) csv += "# interrupted: true\n";
  csv += "scene,cell_m,method,places";
  for (const FigureColumn& column : figureColumns()) csv += std::string(",") + column.name;
  for (const FigureColumn& column : figureColumns())
    csv += std::string(",") + column.name + "_q1," + column.name + "_q3";
  csv += "\n";
  for (const Summary& row : summarize(results)) {
    csv += quotedForCsv(row.scene) + "," + text(row.cell) + "," + quotedForCsv(row.method) + "," +
           std::to_string(row.places);
    for (const FigureColumn& column : figureColumns()) csv += "," + text(row.median.*column.value);
    for (const FigureColumn& column : figureColumns())
      csv += "," + text(row.lower.*column.value) + "," + text(row.upper.*column.value);
    csv += "\n";
  }
  return csv;
}

std::string toMarkdown(const ReportHeader& header, const std::vector<PlaceResult>& results) {
  std::string markdown;
  for (const auto& [name, value] : header.facts) markdown += "- " + name + ": " + value + "\n";
  if (header.interrupted) markdown += "- interrupted: this is what was done so far\n";
  std::string scene;
  bool first = true;
  for (const Summary& row : summarize(results)) {
    if (first || row.scene != scene) {
      scene = row.scene;
      markdown +=
          "\n### " + scene + ", " + std::to_string(row.places) +
          (row.places == 1 ? " place" : " places: median (quartiles)") +
          "\n\n"
          "| s m | method | cells | eta | error % | complete % | covered % | held back mm "
          "| free space violated % | memory kB | file kB | finished / .ot kB | ms a frame |\n"
          "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    }
    first = false;
    const bool ours = !isBaseline(row.method);
    markdown +=
        "| " + text(row.cell) + " | " + row.method + " | " + withSpread(row, &Figures::cells, 0) +
        " | " + fixed(row.median.combination_efficiency, 3) + " | " +
        withSpread(row, &Figures::error_percent, 2) + " | " +
        fixed(row.median.completeness, 1, 100.0) + " | " + fixed(row.median.coverage, 1, 100.0) +
        " | " + fixed(row.median.held_back_median_m, 1, 1e3) + " | " +
        fixed(row.median.free_space_violation, 2, 100.0) + " | " +
        fixed(row.median.memory_bytes, 1, 1e-3) + " | " + fixed(row.median.file_bytes, 2, 1e-3) +
        " | " + fixed(ours ? row.median.finished_bytes : row.median.ot_bytes, 2, 1e-3) + " | " +
        fixed(row.median.time_ms_per_frame, 1) + " |\n";
  }
  return markdown;
}

}  // namespace planar_mapping::evaluation
