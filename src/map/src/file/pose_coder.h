// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "file/bit_coder.h"
#include "store/stored_pose.h"

namespace planar_mapping::detail {

/// Poses of the frames (docs/file_format.md, "Trajectory"). Each number of a pose is guessed from
/// those of the two poses before, in the way that did best of late.
class PoseCoder {
 public:
  /// \param poses as many as there are; they are filled when reading
  /// \throws Error
  void code(BitCoder& coder, std::vector<StoredPose>& poses);
  void forget();

 private:
  static constexpr std::size_t kGuesses = 3;
  static constexpr int kMostBits = 21;
  /// One of the seven numbers over the frames.
  struct Track {
    std::int64_t last = 0;
    std::int64_t step = 0;
    std::size_t frames = 0;
    int bits = 0;  ///< of what was coded lately
    std::array<std::int64_t, kGuesses> errors{};
  };
  void codeOne(BitCoder& coder, StoredPose& pose);
  /// Codes the next number of track \p k. \throws Error beyond +-limit
  std::int64_t next(BitCoder& coder, std::size_t k, std::int64_t value, std::int64_t limit);

  AdaptiveBit in_microseconds_, negative_;
  /// Of time, position, quaternion: of the first, the second, and by bits those after.
  std::array<std::array<NumberModel, 2 + kMostBits + 1>, 3> numbers_;
  NumberModel last_part_;
  std::array<Track, 7> tracks_;
};

}  // namespace planar_mapping::detail
