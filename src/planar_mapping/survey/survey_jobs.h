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
/// Their order: submap() of all pieces, places(), links() of all pieces but the first, solve(),
/// then join() or all tiles.
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
  /// For each piece the one before it, and the earlier ones that look most like it: places.json.
  /// One keyframe of a submap is what others are compared with, so that memory is 10 kB a submap.
  /// \param allow_missing  pieces that were not mapped are left out; so in the other jobs
  SurveyReport places(bool allow_missing = false) const;
  /// Looks for the places of a piece in those that places() says: links_N.json.
  SurveyReport links(std::size_t piece, bool allow_missing = false) const;
  /// All pieces and links to one atlas, with poses that agree: survey.atlas. One thread; memory is
  /// that of the poses, links and one piece.
  SurveyReport solve(bool allow_missing = false) const;

  /// Tiles of all components, once solve() is done; none where the plan asks for one map.
  std::size_t tileCount() const;
  /// A part of a map larger than memory: map_X_Y.pmap in tiles_C, C the number of the component.
  /// Only the submaps that reach into it or the next ones are loaded. io::loadMap() opens the
  /// folder as one map.
  SurveyReport tile(std::size_t number, int threads = 1) const;
  /// One map of a component, that of the first submap where none is said: joinSubmaps() of it, in
  /// the memory of the map.
  SurveyReport join(const std::string& map, std::optional<std::int64_t> component = {},
                    int threads = 1) const;

 private:
  std::string pathOf(const std::string& name) const;
  std::string pieceOf(std::size_t piece, const char* end) const;
  std::string requireDone(const std::string& name, const char* job) const;
  bool hasPiece(std::size_t piece, bool allow_missing) const;

  std::string folder_;
  SurveyPlan plan_;
};

}  // namespace planar_mapping
