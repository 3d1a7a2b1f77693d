// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "planar_mapping/atlas/atlas_builder.h"
#include "planar_mapping/base/export.h"
#include "planar_mapping/pipeline/configuration.h"

namespace planar_mapping {

/// How a survey is cut into jobs.
struct SurveyParams {
  int piece_frames = 100;  ///< frames of a sequence that one job maps, >= 1
  /// Earlier pieces that look alike and are searched for places of a piece, beside the one before
  /// it; >= 1.
  int link_pieces = 8;
  double tile = 0.0;  ///< side of the tiles that the map comes in, metres; 0 = one map
  SubmapParams submaps;

  /// \throws ParameterError
  void validate() const;
};

/// Frames that one job maps. The last one is the first of the next piece of its sequence, which
/// ties the two together.
struct SurveyPiece {
  std::size_t sequence = 0;  ///< number in the plan
  FrameSelection frames;
  bool has_next = false;    ///< the piece after it is of the same sequence
  std::size_t files = 0;    ///< that it reads
  std::uint32_t stamp = 0;  ///< CRC-32 of their names, sizes and times
};

/// One survey as jobs: which frames are mapped together. It follows from the inputs and the
/// configuration, not from who does the jobs.
struct PLANAR_MAPPING_EXPORT SurveyPlan {
  std::string program;        ///< version of the one that made it
  std::string configuration;  ///< YAML with the seed, without inputs; what was `auto` is resolved
  SurveyParams params;
  std::vector<std::string> sequences;  ///< inputs, absolute
  std::vector<SurveyPiece> pieces;
  std::uint32_t checksum = 0;  ///< CRC-32 of its file

  /// "piece 3 (/data/walk frames 300:401:1)"
  std::string nameOf(std::size_t piece) const;
  /// Of the frames of a piece. \throws InputError if there is no such piece
  Configuration configurationOf(std::size_t piece) const;
  /// \throws InputError if a file of the piece has changed since the plan was made
  void requireUnchanged(std::size_t piece) const;
};

/// Cuts sequences, each with what `configuration` says of frames; `auto` is resolved by the first
/// frames of the first sequence, for all of them.
/// \param sequences  folders, each one sequence
/// \throws InputError, IoError: a sequence that cannot be read, or one of another kind or
///         calibration than the first, or coordinates too far apart for one map
PLANAR_MAPPING_EXPORT SurveyPlan planSurvey(const std::vector<std::string>& sequences,
                                            Configuration configuration,
                                            const SurveyParams& params);

/// The text of a plan's file (JSON), and back.
/// \throws InputError with \p path for a text that is no plan, or one of another version of this
///         program
PLANAR_MAPPING_EXPORT std::string toJson(const SurveyPlan& plan);
PLANAR_MAPPING_EXPORT SurveyPlan parseSurveyPlan(const std::string& text, const std::string& path);

}  // namespace planar_mapping
