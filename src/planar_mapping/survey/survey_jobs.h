// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/survey/survey_plan.h"

namespace planar_mapping {

/// What a job says of itself: a line for a person, its record (JSON) for machines.
struct SurveyReport {
  bool was_done = false;  ///< its result was there, and whole
  std::string line;
  std::string json;
};

/// The jobs of a plan. Each reads the results of others in one folder and leaves its own there,
/// whole or not at all; one whose result is there already does nothing. Jobs may run at the same
/// time, on several machines that see the same folder and inputs; the same job twice does no harm.
/// Bytes depend on the plan and the inputs alone.
///
/// All throw InputError, IoError for what they read, OutputError for what they write.
class PLANAR_MAPPING_EXPORT SurveyJobs {
 public:
  /// Puts the plan into the folder, which is made.
  /// \param plan  text of a plan's file; \param path its name, for messages
  /// \throws InputError if the folder is of another plan
  SurveyJobs(const std::string& plan, const std::string& path, std::string folder);
  /// In a folder that has a plan. \throws IoError if it has none
  explicit SurveyJobs(std::string folder);

  const SurveyPlan& plan() const { return plan_; }

  /// Maps a piece: piece_N.atlas. \param threads  0 = all cores; the bytes are the same
  SurveyReport submap(std::size_t piece, int threads = 1) const;
  /// Looks in the pieces [first, last) for the places of a later one: links_N_FIRST_LAST.json.
  /// Those that are missing are left out where the search is to go on without them.
  SurveyReport links(const SurveySearch& search, bool allow_missing = false) const;
  /// All pieces and links to one atlas, with poses that agree: survey.atlas. One thread; memory is
  /// that of the poses, links and one piece.
  SurveyReport solve(bool allow_missing = false) const;
  /// One map of a component, that of the first submap where none is said.
  SurveyReport join(const std::string& map, std::optional<std::int64_t> component = {},
                    int threads = 1) const;

  /// The same as tiles of a folder, map_X_Y.pmap, for maps larger than memory: only the submaps
  /// that reach into a tile or the next ones are loaded for it. io::loadMap() opens the folder as
  /// one map.
  /// \param side  of a tile, metres, see tileSide()
  std::vector<SurveyReport> joinTiles(const std::string& folder, double side,
                                      std::optional<std::int64_t> component = {},
                                      int threads = 1) const;

 private:
  std::string pathOf(const std::string& name) const;
  std::string recordOf(std::size_t piece) const;
  std::string requireSolved() const;
  std::int64_t firstComponent(const AtlasData& data) const;
  bool hasPiece(std::size_t piece, bool allow_missing) const;

  std::string folder_;
  SurveyPlan plan_;
};

}  // namespace planar_mapping
