// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/stereo/features/feature_detection.h"

namespace planar_mapping::detail {

/// What is known of a track: where and when it was last seen.
struct Track {
  std::int64_t number = -1;
  std::int32_t sightings = 1;
  std::int64_t last_frame = 0;
  float column = 0.0f;
  float row = 0.0f;
};

/// Tracks with the descriptor of their last sighting, row by row.
struct TrackSet {
  std::vector<Track> tracks;
  Descriptors descriptors;

  std::size_t size() const { return tracks.size(); }
  void add(const Track& track, const Descriptors& from, std::size_t row) {
    tracks.push_back(track);
    descriptors.add(from, row);
  }
};

/// The tracks of the last frame and those lost before it, so that a feature keeps its number when
/// it is seen again after an occlusion, a dark frame or a jump.
class TrackMemory {
 public:
  enum class Origin : std::uint8_t { New, LastFrame, Lost };
  struct Identity {
    Track track;  ///< as it was last seen; of a new one only number and sightings count
    Origin origin = Origin::New;
  };

  /// Gives each feature its track; nothing is stored yet.
  std::vector<Identity> identify(const Descriptors& features, double ratio, int threads);

  /// Makes the features the last frame. Tracks of the frame before that are not among them are lost
  /// from now on; those lost for `remember_frames`, and the oldest beyond `max_remembered`, are
  /// forgotten.
  void store(TrackSet features, int remember_frames, int max_remembered);

  void clear();

 private:
  TrackSet last_;
  TrackSet lost_;  ///< in the order they were lost in
  std::int64_t frame_ = 0;
  std::int64_t next_number_ = 0;
};

}  // namespace planar_mapping::detail
