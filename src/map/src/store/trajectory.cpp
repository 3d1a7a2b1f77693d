// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "store/trajectory.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "store/heap_bytes.h"

namespace planar_mapping::detail {
namespace {

constexpr std::size_t kPosesPerChunk = 1024;
constexpr unsigned kMostRepeated = 255;

}  // namespace

bool isInMicroseconds(double timestamp, std::int64_t& microseconds) {
  if (!(std::abs(timestamp) < 4e9)) return false;
  microseconds = std::llround(timestamp * 1e6);
  return static_cast<double>(microseconds) / 1e6 == timestamp;
}

StoredPose StoredPose::from(double timestamp, const Quaternion& orientation,
                            const Vector3& position) {
  StoredPose stored;
  // To the microsecond; what is no time of ours stays as it is.
  stored.timestamp = std::abs(timestamp) < 4e9 ? std::round(timestamp * 1e6) / 1e6 : timestamp;
  for (std::size_t i = 0; i < 3; ++i) {
    stored.position[i] = std::llround(position[static_cast<int>(i)] * kPositionUnits);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    stored.orientation[i] = static_cast<std::int16_t>(
        std::lround(orientation.coeffs()[static_cast<int>(i)] * kOrientationUnits));
  }
  return stored;
}

void StoredPose::alignTo(const StoredPose& other) {
  std::int64_t dot = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    dot += std::int64_t{orientation[i]} * other.orientation[i];
  }
  if (dot >= 0) return;
  for (std::int16_t& part : orientation) part = static_cast<std::int16_t>(-part);
}

Vector3 StoredPose::sensor() const {
  return Vector3(static_cast<double>(position[0]), static_cast<double>(position[1]),
                 static_cast<double>(position[2])) /
         kPositionUnits;
}

Pose StoredPose::pose() const {
  Quaternion q;
  for (int i = 0; i < 4; ++i) q.coeffs()[i] = orientation[static_cast<std::size_t>(i)];
  Pose pose = Pose::Identity();
  pose.linear() = q.normalized().toRotationMatrix();
  pose.translation() = sensor();
  return pose;
}

Trajectory::Numbers Trajectory::numbersOf(const StoredPose& pose, bool in_microseconds) {
  Numbers numbers{};
  std::int64_t time = 0;
  if (!in_microseconds || !isInMicroseconds(pose.timestamp, time)) {
    std::memcpy(&time, &pose.timestamp, sizeof time);
  }
  numbers[0] = static_cast<std::uint64_t>(time);
  for (std::size_t i = 0; i < 3; ++i) numbers[1 + i] = static_cast<std::uint64_t>(pose.position[i]);
  for (std::size_t i = 0; i < 4; ++i) {
    numbers[4 + i] = static_cast<std::uint64_t>(std::int64_t{pose.orientation[i]});
  }
  return numbers;
}

StoredPose Trajectory::poseOf(const Numbers& numbers, bool in_microseconds) {
  StoredPose pose;
  if (in_microseconds) {
    pose.timestamp = static_cast<double>(static_cast<std::int64_t>(numbers[0])) / 1e6;
  } else {
    std::memcpy(&pose.timestamp, &numbers[0], sizeof pose.timestamp);
  }
  for (std::size_t i = 0; i < 3; ++i) pose.position[i] = static_cast<std::int64_t>(numbers[1 + i]);
  for (std::size_t i = 0; i < 4; ++i) {
    pose.orientation[i] = static_cast<std::int16_t>(static_cast<std::int64_t>(numbers[4 + i]));
  }
  return pose;
}

Trajectory::Numbers Trajectory::State::expected() const {
  Numbers numbers = last;
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] += step[i];
  return numbers;
}

void Trajectory::State::accept(const Numbers& numbers) {
  for (std::size_t i = 0; poses > 0 && i < numbers.size(); ++i) step[i] = numbers[i] - last[i];
  last = numbers;
  ++poses;
}

Trajectory::Reader::Reader(const Trajectory& trajectory, const Chunk& chunk)
    : in_(&trajectory.bytes_[chunk.first_byte]), in_microseconds_(chunk.in_microseconds) {}

StoredPose Trajectory::Reader::next() {
  Numbers numbers = state_.expected();
  if (repeated_ > 0) {
    --repeated_;
  } else {
    const unsigned differ = in_.byte();
    counting_ = differ == 0;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if ((differ >> i & 1u) != 0) numbers[i] += unfoldSign(in_.number());
    }
    if (differ == 0) repeated_ = in_.byte() - 1u;
  }
  state_.accept(numbers);
  return poseOf(numbers, in_microseconds_);
}

void Trajectory::put(std::uint8_t byte) {
  // By an eighth: maps are measured by their memory.
  if (bytes_.size() == bytes_.capacity()) bytes_.reserve(bytes_.size() + bytes_.size() / 8 + 4);
  bytes_.push_back(byte);
}

void Trajectory::startChunk(const StoredPose& pose) {
  std::int64_t unused = 0;
  const Chunk chunk{static_cast<std::uint32_t>(size_), static_cast<std::uint32_t>(bytes_.size()),
                    isInMicroseconds(pose.timestamp, unused)};
  tail_->state = State();
  tail_->counting = false;
  if (empty()) {
    first_in_microseconds_ = chunk.in_microseconds;
    return;
  }
  if (!later_) later_.reset(new std::vector<Chunk>);
  if (later_->size() == later_->capacity()) {
    later_->reserve(later_->size() + later_->size() / 8 + 1);
  }
  later_->push_back(chunk);
}

Trajectory::Tail Trajectory::readTail() const {
  Tail tail;
  if (empty()) return tail;
  const Chunk last = chunk(chunks() - 1);
  Reader reader(*this, last);
  for (std::size_t i = last.first_pose; i < size_; ++i) tail.back = reader.next();
  tail.state = reader.state();
  tail.counting = reader.isCounting();
  return tail;
}

Trajectory::Tail& Trajectory::tail() {
  if (tail_ == nullptr) tail_.reset(new Tail(readTail()));
  return *tail_;
}

StoredPose Trajectory::back() const {
  return tail_ != nullptr ? tail_->back : readTail().back;
}

void Trajectory::push(const StoredPose& pose) {
  std::int64_t unused = 0;
  Tail& tail = this->tail();
  const auto inMicroseconds = [&] { return chunk(later_ ? later_->size() : 0).in_microseconds; };
  if (empty() || tail.state.poses == kPosesPerChunk ||
      (inMicroseconds() && !isInMicroseconds(pose.timestamp, unused))) {
    startChunk(pose);
  }
  const Numbers numbers = numbersOf(pose, inMicroseconds());
  const Numbers expected = tail.state.expected();
  std::uint8_t differ = 0;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] != expected[i]) differ = static_cast<std::uint8_t>(differ | 1u << i);
  }
  if (differ == 0 && tail.counting && bytes_.back() < kMostRepeated) {
    ++bytes_.back();
  } else {
    put(differ);
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if ((differ >> i & 1u) == 0) continue;
      std::uint64_t rest = foldSign(numbers[i] - expected[i]);
      for (; rest >= 0x80; rest >>= 7u) put(static_cast<std::uint8_t>(0x80u | rest));
      put(static_cast<std::uint8_t>(rest));
    }
    tail.counting = differ == 0;
    if (tail.counting) put(1);
  }
  tail.state.accept(numbers);
  tail.back = pose;
  ++size_;
}

std::size_t Trajectory::chunkOf(std::size_t index) const {
  if (!later_) return 0;
  const auto after =
      std::upper_bound(later_->begin(), later_->end(), index,
                       [](std::size_t i, const Chunk& chunk) { return i < chunk.first_pose; });
  return static_cast<std::size_t>(after - later_->begin());
}

StoredPose Trajectory::at(std::size_t index) const {
  if (index + 1 == size_) return back();
  const Chunk from = chunk(chunkOf(index));
  Reader reader(*this, from);
  for (std::size_t i = from.first_pose; i < index; ++i) reader.next();
  return reader.next();
}

std::size_t Trajectory::memoryBytes() const {
  return heapBytes(bytes_) + (later_ ? heapBytes(sizeof *later_) + heapBytes(*later_) : 0) +
         (tail_ != nullptr ? heapBytes(sizeof(Tail)) : 0);
}

}  // namespace planar_mapping::detail
