// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/pose_coder.h"

#include <algorithm>
#include <cmath>

#include "file/parameter_coder.h"

namespace planar_mapping::detail {
namespace {

constexpr std::int64_t kFar = std::int64_t{1} << 60;
constexpr std::int64_t kOne = StoredPose::kOrientationUnits;

std::int64_t sizeOf(std::int64_t number) {
  return number < 0 ? -number : number;
}

}  // namespace

void PoseCoder::code(BitCoder& coder, std::vector<StoredPose>& poses) {
  tracks_ = {};
  for (StoredPose& pose : poses) codeOne(coder, pose);
}

void PoseCoder::codeOne(BitCoder& coder, StoredPose& pose) {
  std::int64_t time = 0;
  const bool exact = !coder.isReading() && isInMicroseconds(pose.timestamp, time);
  if (in_microseconds_.code(coder, exact)) {
    pose.timestamp = static_cast<double>(next(coder, 0, time, kFar)) / 1e6;
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
  last += last_part_.codeWithin(coder, pose.orientation[3] - last, -kOne, kOne);
  if (last < -kOne || last > kOne) coder.fail("holds a pose outside the world");
  pose.orientation[3] = static_cast<std::int16_t>(last);
  norm += static_cast<double>(last * last);
  if (!(std::abs(std::sqrt(norm) / static_cast<double>(kOne) - 1.0) < 1e-3)) {
    coder.fail("holds a quaternion of another length than 1");
  }
}

std::int64_t PoseCoder::next(BitCoder& coder, std::size_t k, std::int64_t value,
                             std::int64_t limit) {
  Track& t = tracks_[k];
  // Sensors go on as they did, or a little less, or stand still.
  std::array<std::int64_t, kGuesses> guesses{t.last + t.step - (t.step >> 2), t.last + t.step,
                                             t.last};
  if (k == 0) std::swap(guesses[0], guesses[1]);
  const auto best = static_cast<std::size_t>(std::min_element(t.errors.begin(), t.errors.end()) -
                                             t.errors.begin());
  const std::int64_t guess = t.frames < 2 ? t.last : guesses[best];
  NumberModel& model =
      numbers_[k == 0  ? 0
               : k < 4 ? 1
                       : 2][t.frames < 2 ? t.frames : 2 + static_cast<std::size_t>(t.bits)];
  const std::int64_t apart = model.codeWithin(coder, value - guess, -kFar, kFar);
  value = guess + apart;
  if (value < -limit || value > limit) coder.fail("holds a pose outside the world");

  int bits = 0;
  while (bits < kMostBits && sizeOf(apart) >> bits != 0) ++bits;
  t.bits = t.frames == 0 ? 0 : t.frames == 1 ? bits : (bits + t.bits + 1) / 2;
  for (std::size_t i = 0; i < kGuesses && t.frames >= 2; ++i) {
    constexpr std::int64_t kLargestError = 1 << 30;
    t.errors[i] = t.errors[i] / 2 + std::min(sizeOf(value - guesses[i]), kLargestError);
  }
  t.step = value - t.last;
  t.last = value;
  ++t.frames;
  return value;
}

void PoseCoder::forget() {
  forgetAll(in_microseconds_, negative_, last_part_);
  for (auto& kind : numbers_) {
    for (NumberModel& model : kind) model.forget();
  }
}

}  // namespace planar_mapping::detail
