// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "belief_coder.h"
#include "map_record.h"
#include "octant_coder.h"
#include "parameter_coder.h"
#include "planar_mapping/core/error.h"

namespace planar_mapping::detail {
namespace {

constexpr std::size_t kFramesPerByte = 64;
constexpr std::size_t kFree = 64;  ///< regions, planes, ... that a file may always have

// Trajectory ---------------------------------------------------------------------------------

class PoseCoder {
 public:
  void code(BitCoder& coder, StoredPose& pose) {
    std::int64_t time = 0;
    const bool exact = !coder.isReading() && isInMicroseconds(pose.timestamp, time);
    if (in_microseconds_.code(coder, exact)) {
      time = predicted(0) + numbers_[0].codeWithin(coder, time - predicted(0), -kFar, kFar);
      if (time < -kFar || time > kFar) coder.fail("holds a time that is too far away");
      pose.timestamp = static_cast<double>(time) / 1e6;
      remember(0, time);
    } else {
      pose.timestamp = codeDouble(coder, pose.timestamp);
      if (!std::isfinite(pose.timestamp)) coder.fail("holds a number that is not finite");
    }
    for (std::size_t k = 0; k < 3; ++k) {
      pose.position[k] = next(coder, 1 + k, pose.position[k], kFar);
    }
    double norm = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int64_t part = next(coder, 4 + k, pose.orientation[k], kOne);
      pose.orientation[k] = static_cast<std::int16_t>(part);
      norm += static_cast<double>(part * part);
    }
    // The length is 1: the last part follows, but for its sign and for rounding.
    const bool negative = negative_.code(coder, pose.orientation[3] < 0);
    auto last = static_cast<std::int64_t>(
        std::floor(std::sqrt(std::max(0.0, static_cast<double>(kOne * kOne) - norm))));
    if (negative) last = -last;
    last += numbers_[3].codeWithin(coder, pose.orientation[3] - last, -kOne, kOne);
    if (last < -kOne || last > kOne) coder.fail("holds a pose outside the world");
    pose.orientation[3] = static_cast<std::int16_t>(last);
    norm += static_cast<double>(last * last);
    if (!(std::abs(std::sqrt(norm) / static_cast<double>(kOne) - 1.0) < 1e-3)) {
      coder.fail("holds a quaternion of another length than 1");
    }
  }

 private:
  static constexpr std::int64_t kFar = std::int64_t{1} << 61;
  static constexpr std::int64_t kOne = StoredPose::kOrientationUnits;

  /// Time goes on, the sensor mostly too, a little less than between the two frames before.
  std::int64_t predicted(std::size_t k) const {
    if (frames_[k] < 2) return last_[k];
    return last_[k] + step_[k] - (k == 0 ? 0 : step_[k] >> 2);
  }
  std::int64_t next(BitCoder& coder, std::size_t k, std::int64_t value, std::int64_t limit) {
    const std::int64_t guess = predicted(k);
    value = guess + numbers_[k < 4 ? 1 : 2].codeWithin(coder, value - guess, -kFar, kFar);
    if (value < -limit || value > limit) coder.fail("holds a pose outside the world");
    remember(k, value);
    return value;
  }
  void remember(std::size_t k, std::int64_t value) {
    step_[k] = value - last_[k];
    last_[k] = value;
    ++frames_[k];
  }

  AdaptiveBit in_microseconds_, negative_;
  std::array<NumberModel, 4> numbers_;  ///< of time, position, x y z of the quaternion, w
  std::array<std::int64_t, 8> last_{};
  std::array<std::int64_t, 8> step_{};
  std::array<std::size_t, 8> frames_{};
};

// Cells --------------------------------------------------------------------------------------

std::size_t countCells(const std::vector<LatticeBundle>& bundles) {
  std::size_t count = 0;
  for (const LatticeBundle& b : bundles) {
    count += static_cast<std::size_t>(__builtin_popcountll(b.ones));
  }
  return count;
}

// Planes -------------------------------------------------------------------------------------

class RoundedCoder {
 public:
  explicit RoundedCoder(int bits) : bits_(bits) {}
  /// \param guess taken for the last number if that is not 0
  void code(BitCoder& coder, RoundedNumber& number, const RoundedNumber& guess = {}) {
    if (zero_.code(coder, number.mantissa == 0)) {
      number = RoundedNumber();
      return;
    }
    // Exponent and mantissa together count the numbers there are, in their order.
    const std::int64_t highest = std::int64_t{1} << (bits_ - 1);
    const auto place = [&](const RoundedNumber& n) {
      return n.exponent * highest + n.mantissa - highest;
    };
    const std::int64_t limit = RoundedNumber::kLargestExponent * highest;
    if (guess.mantissa != 0) last_ = place(guess);
    last_ += step_.codeWithin(coder, place(number) - last_, -2 * limit, 2 * limit);
    if (last_ < -limit || last_ >= limit) coder.fail("holds a number outside its range");
    number.exponent = static_cast<std::int16_t>(last_ >> (bits_ - 1));
    number.mantissa = static_cast<std::uint16_t>(highest + (last_ & (highest - 1)));
  }

 private:
  int bits_;
  AdaptiveBit zero_;
  NumberModel step_;
  std::int64_t last_ = 0;
};

/// What the cells of a plane say of where its points are: a good guess.
struct Spread {
  std::array<std::int64_t, 2> mean{};  ///< as StoredPlane::mean
  std::array<RoundedNumber, 2> variance;

  Spread(const std::vector<LatticeBundle>& tiles, double s) {
    std::array<std::int64_t, 2> sum{};
    std::array<std::uint64_t, 2> square{};
    const auto n = static_cast<std::int64_t>(countCells(tiles));
    // Twice the middles of the cells, which are whole numbers.
    const auto forEach = [&](auto&& visit) {
      for (const LatticeBundle& b : tiles) {
        for (std::uint64_t bits = b.ones; bits != 0; bits &= bits - 1) {
          const int bit = __builtin_ctzll(bits);
          visit(0, 2 * (8 * b.at.x + (bit & 7)) + 1);
          visit(1, 2 * (8 * b.at.y + (bit >> 3)) + 1);
        }
      }
    };
    forEach([&](std::size_t i, std::int64_t x) { sum[i] += x; });
    for (std::int64_t& m : sum) m /= n;
    forEach([&](std::size_t i, std::int64_t x) {
      square[i] += static_cast<std::uint64_t>((x - sum[i]) * (x - sum[i]));
    });
    const double half = 0.5 * s;
    for (std::size_t i = 0; i < 2; ++i) {
      const double steps = half * static_cast<double>(sum[i]) / StoredPlane::kPlace;
      if (std::abs(steps) < 1e15) mean[i] = std::llround(steps);
      variance[i] = RoundedNumber::from(
          half * half * (static_cast<double>(square[i]) / static_cast<double>(n)),
          StoredPlane::kVarianceBits);
    }
  }
};

class PlaneCoder {
 public:
  explicit PlaneCoder(double resolution) : resolution_(resolution) {}

  void code(BitCoder& coder, PlaneRecord& plane, std::int32_t last_id, LatticeCount& count) {
    plane.id = last_id + 1 +
               static_cast<std::int32_t>(id_.codeWithin(coder, std::int64_t{plane.id} - last_id - 1,
                                                        0, std::int64_t{INT32_MAX} - last_id - 1));
    plane.frames =
        static_cast<std::uint32_t>(frames_.codeWithin(coder, plane.frames, 0, UINT32_MAX));
    for (std::int32_t& a : plane.anchor) {
      constexpr std::int32_t kLimit = 2 * kLatticeLimit / 8;
      a = static_cast<std::int32_t>(anchor_.codeWithin(coder, a, -kLimit, kLimit));
    }
    tiles_.code(coder, plane.tiles, count);
    if (plane.tiles.empty()) coder.fail("has a plane without a cell");
    beliefs_.code(coder, plane.tiles, plane.beliefs);
    codeStored(coder, plane.stored, Spread(plane.tiles, resolution_));
  }

 private:
  void codeStored(BitCoder& coder, StoredPlane& p, const Spread& cells) {
    p.axis = static_cast<std::uint8_t>(axis_.code(coder, p.axis));
    if (p.axis > 5) coder.fail("has a plane without a normal");
    double length = 0.0;
    for (std::size_t i = 0; i < 2; ++i) {
      p.normal[i] =
          static_cast<std::int32_t>(normal_[i].codeWithin(coder, p.normal[i], -32768, 32768));
      length += p.normal[i] * StoredPlane::kDirection * p.normal[i] * StoredPlane::kDirection;
    }
    if (length > 0.7) coder.fail("has a plane whose normal is not of length 1");
    constexpr std::int32_t kHalfTurn = StoredPlane::kHalfTurn;
    const bool level = p.turn == 0 || p.turn == kHalfTurn;
    if (level_.code(coder, level)) {
      p.turn = reversed_.code(coder, p.turn != 0) ? kHalfTurn : 0;
    } else {
      p.turn = static_cast<std::int32_t>(turn_.codeWithin(coder, p.turn, 1 - kHalfTurn, kHalfTurn));
    }
    constexpr std::int64_t kLargest = StoredPlane::kLargest;
    for (std::size_t i = 0; i < 3; ++i) {
      p.origin[i] = origin_[i].codeWithin(coder, p.origin[i], -kLargest, kLargest);
    }
    weight_.code(coder, p.weight);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int64_t guess = i < 2 ? cells.mean[i] : 0;
      p.mean[i] =
          guess + mean_[i].codeWithin(coder, p.mean[i] - guess, -2 * kLargest, 2 * kLargest);
      if (p.mean[i] < -kLargest || p.mean[i] > kLargest) coder.fail("has a plane out of the world");
    }
    for (std::size_t i = 0; i < 2; ++i) variance_[i].code(coder, p.variance[i], cells.variance[i]);
    constexpr std::int32_t kOne = StoredPlane::kCorrelation;
    p.correlation =
        static_cast<std::int32_t>(correlation_.codeWithin(coder, p.correlation, -kOne, kOne));
    constexpr std::int64_t kSteepest = StoredPlane::kLargestSlope;
    for (std::int32_t& s : p.slope) {
      s = static_cast<std::int32_t>(slope_.codeWithin(coder, s, -kSteepest, kSteepest));
    }
    residual_.code(coder, p.residual);
  }

  double resolution_;
  NumberModel id_, frames_, turn_, anchor_, correlation_, slope_;
  std::array<NumberModel, 2> normal_;
  std::array<NumberModel, 3> origin_, mean_;
  SymbolModel<3> axis_;
  AdaptiveBit level_, reversed_;
  RoundedCoder weight_{StoredPlane::kWeightBits};
  std::array<RoundedCoder, 2> variance_{RoundedCoder(StoredPlane::kVarianceBits),
                                        RoundedCoder(StoredPlane::kVarianceBits)};
  RoundedCoder residual_{StoredPlane::kVarianceBits};
  LatticeCoder tiles_{2, false};
  BeliefCoder beliefs_{2};
};

// Non-planar cells ---------------------------------------------------------------------------

void codeCells(BitCoder& coder, MapRecord& record, LatticeCount& count) {
  NumberModel anchor;
  constexpr std::int32_t kLimit = kLatticeLimit / 2;
  for (std::int32_t* a : {&record.anchor.x, &record.anchor.y, &record.anchor.z}) {
    *a = static_cast<std::int32_t>(anchor.codeWithin(coder, *a, -kLimit, kLimit));
  }
  LatticeCoder(3, false).code(coder, record.blocks, count);
  const std::size_t cells = countCells(record.blocks);
  BeliefCoder(3).code(coder, record.blocks, record.beliefs);
  if (record.params.approximation.profile == Profile::Compact) {
    record.octants.resize(cells);
    codeOctants(coder, record.blocks, record.octants);
  } else {
    record.means.resize(cells);
    for (CellBlock::Mean& mean : record.means) {
      for (std::uint8_t& m : mean) m = static_cast<std::uint8_t>(coder.plain(m, 8));
    }
  }
  NumberModel regions, frames;
  const std::uint64_t n = regions.code(coder, record.region_frames.size());
  if (n > record.blocks.size()) coder.fail("names too many regions");
  record.region_frames.resize(static_cast<std::size_t>(n));
  std::int64_t last = static_cast<std::int64_t>(record.trajectory.size()) - 1;
  for (std::uint32_t& frame : record.region_frames) {
    last += frames.codeWithin(coder, frame - last, -std::int64_t{UINT32_MAX}, UINT32_MAX);
    if (last < 0 || last > UINT32_MAX) coder.fail("names a frame that is not in the trajectory");
    frame = static_cast<std::uint32_t>(last);
  }
}

}  // namespace

std::size_t codeRecord(BitCoder& coder, MapRecord& record) {
  codeParams(coder, record.params);
  NumberModel counts;
  LatticeCount count;
  const std::uint64_t frames = counts.code(coder, record.trajectory.size());
  const std::size_t most = kFree + coder.size();  // when reading
  if (coder.isReading() && frames > kFramesPerByte * most) coder.fail("holds too many frames");
  record.trajectory.resize(static_cast<std::size_t>(frames));
  PoseCoder poses;
  for (StoredPose& pose : record.trajectory) poses.code(coder, pose);

  record.next_plane_id =
      static_cast<std::int32_t>(counts.codeWithin(coder, record.next_plane_id, 0, INT32_MAX));
  const std::uint64_t planes = counts.code(coder, record.planes.size());
  if (coder.isReading() && planes > most) coder.fail("holds too many planes");
  record.planes.resize(static_cast<std::size_t>(planes));
  PlaneCoder plane_coder(record.params.approximation.resolution);
  std::int32_t last_id = -1;
  for (PlaneRecord& plane : record.planes) {
    plane_coder.code(coder, plane, last_id, count);
    last_id = plane.id;
  }
  if (last_id >= record.next_plane_id) coder.fail("has plane numbers that are yet to be given");

  codeCells(coder, record, count);
  LatticeCoder(3, true).code(coder, record.space, count);

  // The chances that bits are coded with would let a few bytes stand for almost anything.
  const auto least = [](std::size_t n, std::size_t per_byte) {
    const std::size_t bytes = (n + per_byte - 1) / per_byte;
    return bytes > kFree ? bytes - kFree : 0;
  };
  return std::max({least(count.regions, 1), least(count.bundles, kBundlesPerByte),
                   least(record.planes.size(), 1),
                   least(record.trajectory.size(), kFramesPerByte)});
}

}  // namespace planar_mapping::detail
