// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/base/export.h"

namespace planar_mapping::evaluation {

/// Figures of merit of one method at one place, absent where they have no meaning (METHOD: IV-B).
struct Figures {
  std::optional<double> cells;                   ///< N_f
  std::optional<double> standard_cells;          ///< A_S, cells of SG
  std::optional<double> combination_efficiency;  ///< 1 - N_f / A_S
  std::optional<double> error_percent;           ///< e, needs truth
  std::optional<double> wrong_fraction;          ///< N_e over what is marked, needs truth
  std::optional<double> completeness;            ///< within s, in [0, 1], needs truth
  std::optional<double> completeness_half;       ///< within s / 2
  std::optional<double> completeness_quarter;    ///< within s / 4
  std::optional<double> coverage;                ///< of the true places of points, in [0, 1]
  std::optional<double> coverage_quarter;        ///< within s / 4 instead of s / 2
  std::optional<double> coverage_inside;         ///< within 0
  std::optional<double> measured_coverage;       ///< of the points with their noise, in [0, 1]
  std::optional<double> held_back_median_m;      ///< from checked points to what is occupied
  std::optional<double> surface_median_m;        ///< from what rays meet to the true surface
  std::optional<double> surface_p95_m;
  std::optional<double> free_space_violation;  ///< fraction of what rays crossed, in [0, 1]
  std::optional<double> free_not_known;        ///< fraction of it that is not known to be free
  std::optional<double> memory_bytes;          ///< of the live structure; OG: of its heap
  std::optional<double> file_bytes;
  std::optional<double> compressed_bytes;  ///< OG: of the file under zstd, as ours is
  std::optional<double> finished_bytes;    ///< ours: file of the finished map
  std::optional<double> ot_bytes;          ///< OG: file with beliefs
  std::optional<double> time_ms_per_frame;
  std::optional<double> frames;          ///< that were placed
  std::optional<double> position_rms_m;  ///< of poses found, from given ones, aligned at the first
};

/// A figure as a column of the tables.
struct FigureColumn {
  const char* name;
  std::optional<double> Figures::*value;
};
/// All of them, in the order of the tables.
PLANAR_MAPPING_EXPORT const std::vector<FigureColumn>& figureColumns();

/// What one method made of one place.
struct PlaceResult {
  std::string scene;  ///< or input
  bool simulated = false;
  std::size_t place = 0;
  double cell = 0.0;   ///< s, metres
  std::string method;  ///< SG, OG, RA, PG_paper, PG, or the name of a variant
  Figures figures;
};

/// Median and quartiles over the places of one input.
struct Summary {
  std::string scene;
  bool simulated = false;
  double cell = 0.0;
  std::string method;
  std::size_t places = 0;
  Figures median;
  Figures lower;  ///< quartile
  Figures upper;  ///< quartile
};

/// Median over the values that are there, and quartiles, both by linear interpolation between
/// ranks; empty for none. \p fraction 0.5 is the median.
PLANAR_MAPPING_EXPORT std::optional<double> quantile(std::vector<double> values, double fraction);

/// One row for each input, cell size and method, in the order in which they first appear.
PLANAR_MAPPING_EXPORT std::vector<Summary> summarize(const std::vector<PlaceResult>& results);

/// What an evaluation was made with.
struct ReportHeader {
  std::vector<std::pair<std::string, std::string>> facts;  ///< name and value
  bool interrupted = false;
};

/// {"interrupted": ..., facts, "results": [...]}; each result has the medians as members, the
/// quartiles under "spread", the places one by one under "per_place".
PLANAR_MAPPING_EXPORT std::string toJson(const ReportHeader& header,
                                         const std::vector<PlaceResult>& results);
/// The same rows as a table: medians, then quartiles as NAME_q1, NAME_q3. Facts come first, as
/// lines that start with #.
PLANAR_MAPPING_EXPORT std::string toCsv(const ReportHeader& header,
                                        const std::vector<PlaceResult>& results);
/// Tables for people, one for each input.
PLANAR_MAPPING_EXPORT std::string toMarkdown(const ReportHeader& header,
                                             const std::vector<PlaceResult>& results);

}  // namespace planar_mapping::evaluation
