// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/plane_coder.h"

#include <cmath>

namespace planar_mapping::detail {

void RoundedCoder::code(BitCoder& coder, RoundedNumber& number, const RoundedNumber& guess) {
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

void PlaneFrameCoder::code(BitCoder& coder, StoredPlane& p) {
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
    // As the last plane that faces the same way: many rooms have right angles.
    std::int32_t& last = turns_[p.axis];
    p.turn = last + static_cast<std::int32_t>(turn_.codeWithin(
                        coder, p.turn - last, 1 - kHalfTurn - last, kHalfTurn - last));
    last = p.turn;
  }
  constexpr std::int64_t kLargest = StoredPlane::kLargest;
  for (std::size_t i = 0; i < 3; ++i) {
    p.origin[i] = origin_[i].codeWithin(coder, p.origin[i], -kLargest, kLargest);
  }
}

void PlaneFrameCoder::forget() {
  forgetAll(turn_, axis_, level_, reversed_);
  for (NumberModel& model : normal_) model.forget();
  for (NumberModel& model : origin_) model.forget();
}

/// What the cells of a plane say of where its points are: a good guess.
struct PlaneCoder::Spread {
  std::array<std::int64_t, 2> mean{};  ///< as StoredPlane::mean
  std::array<RoundedNumber, 2> variance;

  Spread(const std::vector<LatticeBundle>& tiles, double s) {
    std::array<std::int64_t, 2> sum{};
    std::array<std::uint64_t, 2> square{};
    std::int64_t n = 0;
    for (const LatticeBundle& b : tiles) n += __builtin_popcountll(b.ones);
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

void PlaneCoder::code(BitCoder& coder, std::vector<PlaneRecord>& planes, double resolution,
                      LatticeCount& count) {
  frame_.start();
  for (RoundedCoder* number : {&weight_, &variance_[0], &variance_[1], &residual_}) {
    number->start();
  }
  std::int32_t last_id = -1;
  for (PlaneRecord& plane : planes) {
    codeOne(coder, plane, last_id, resolution, count);
    last_id = plane.id;
  }
}

void PlaneCoder::codeOne(BitCoder& coder, PlaneRecord& plane, std::int32_t last_id,
                         double resolution, LatticeCount& count) {
  plane.id = last_id + 1 +
             static_cast<std::int32_t>(id_.codeWithin(coder, std::int64_t{plane.id} - last_id - 1,
                                                      0, std::int64_t{INT32_MAX} - last_id - 1));
  plane.frames = static_cast<std::uint32_t>(frames_.codeWithin(coder, plane.frames, 0, UINT32_MAX));
  for (std::int32_t& a : plane.anchor) {
    constexpr std::int32_t kLimit = 2 * kLatticeLimit / 8;
    a = static_cast<std::int32_t>(anchor_.codeWithin(coder, a, -kLimit, kLimit));
  }
  tiles_.code(coder, plane.tiles, count);
  if (plane.tiles.empty()) coder.fail("has a plane without a cell");
  beliefs_.code(coder, plane.tiles, plane.beliefs);
  codeStored(coder, plane.stored, Spread(plane.tiles, resolution));
}

void PlaneCoder::codeStored(BitCoder& coder, StoredPlane& p, const Spread& cells) {
  frame_.code(coder, p);
  constexpr std::int64_t kLargest = StoredPlane::kLargest;
  weight_.code(coder, p.weight);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t guess = i < 2 ? cells.mean[i] : 0;
    p.mean[i] = guess + mean_[i].codeWithin(coder, p.mean[i] - guess, -2 * kLargest, 2 * kLargest);
    if (p.mean[i] < -kLargest || p.mean[i] > kLargest) coder.fail("has a plane out of the world");
  }
  for (std::size_t i = 0; i < 2; ++i) variance_[i].code(coder, p.variance[i], cells.variance[i]);
  constexpr std::int32_t kOne = StoredPlane::kCorrelation;
  p.correlation =
      static_cast<std::int32_t>(correlation_.codeWithin(coder, p.correlation, -kOne, kOne));
  constexpr std::int64_t kSteepest = StoredPlane::kLargestSlope;
  // A plane that was not seen again has neither height nor slope over its own fit.
  if (flat_[p.mean[2] == 0 ? 0 : 1].code(coder, p.slope[0] == 0 && p.slope[1] == 0)) {
    p.slope = {0, 0};
  } else {
    for (std::int32_t& s : p.slope) {
      s = static_cast<std::int32_t>(slope_.codeWithin(coder, s, -kSteepest, kSteepest));
    }
  }
  residual_.code(coder, p.residual);
}

void PlaneCoder::forget() {
  forgetAll(id_, frames_, frame_, anchor_, correlation_, slope_, weight_, residual_, tiles_,
            beliefs_);
  for (NumberModel& model : mean_) model.forget();
  for (AdaptiveBit& bit : flat_) bit.forget();
  for (RoundedCoder& model : variance_) model.forget();
}

}  // namespace planar_mapping::detail
