// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/features/track_memory.h"

#include <algorithm>

namespace planar_mapping::detail {
namespace {

/// Appends those of a set that pass.
template <typename Keep>
void addIf(TrackSet& to, const TrackSet& from, const Keep& keep) {
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (keep(i)) to.add(from.tracks[i], from.descriptors, i);
  }
}

}  // namespace

std::vector<TrackMemory::Identity> TrackMemory::identify(const Descriptors& features, double ratio,
                                                         int threads) {
  std::vector<Identity> identities(features.size());
  std::vector<int> matches = matchDescriptors(features, last_.descriptors, ratio, threads);
  Descriptors rest;
  std::vector<std::size_t> rest_rows;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (matches[i] >= 0) {
      identities[i] = {last_.tracks[static_cast<std::size_t>(matches[i])], Origin::LastFrame};
    } else {
      rest.add(features, i);
      rest_rows.push_back(i);
    }
  }
  matches = matchDescriptors(rest, lost_.descriptors, ratio, threads);
  for (std::size_t k = 0; k < matches.size(); ++k) {
    if (matches[k] >= 0) {
      identities[rest_rows[k]] = {lost_.tracks[static_cast<std::size_t>(matches[k])], Origin::Lost};
    }
  }
  for (Identity& identity : identities) {
    if (identity.origin == Origin::New) {
      identity.track.number = next_number_++;
      identity.track.sightings = 1;
    } else {
      ++identity.track.sightings;
    }
  }
  return identities;
}

void TrackMemory::store(TrackSet features, int remember_frames, int max_remembered) {
  std::vector<std::int64_t> seen;
  seen.reserve(features.size());
  for (Track& track : features.tracks) {
    track.last_frame = frame_;
    seen.push_back(track.number);
  }
  std::sort(seen.begin(), seen.end());
  const auto isSeen = [&](const Track& track) {
    return std::binary_search(seen.begin(), seen.end(), track.number);
  };
  const auto kept = [&](const Track& track) {
    return !isSeen(track) && frame_ - track.last_frame <= remember_frames;
  };
  std::size_t count = 0;
  for (const TrackSet* set : {&lost_, &last_}) {
    count += static_cast<std::size_t>(std::count_if(set->tracks.begin(), set->tracks.end(), kept));
  }
  const auto limit = static_cast<std::size_t>(max_remembered);
  std::size_t too_many = count > limit ? count - limit : 0;  // of the oldest, which come first
  TrackSet lost;
  for (const TrackSet* set : {&lost_, &last_}) {
    addIf(lost, *set, [&](std::size_t i) {
      if (!kept(set->tracks[i])) return false;
      if (too_many == 0) return true;
      --too_many;
      return false;
    });
  }
  lost_ = std::move(lost);
  last_ = std::move(features);
  ++frame_;
}

void TrackMemory::clear() {
  last_ = TrackSet();
  lost_ = TrackSet();
}

}  // namespace planar_mapping::detail
