// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "store/heap_value.h"
#include "store/packed_numbers.h"
#include "planar_mapping/core/base/types.h"
#include "store/resting.h"

namespace planar_mapping::detail {

/// Pose of a frame as the file keeps it: what is saved is what the live map answers.
struct StoredPose {
  double timestamp = 0.0;
  static constexpr int kPositionUnits = 4096;     ///< a metre
  static constexpr int kOrientationUnits = 8191;  ///< length of the quaternion

  std::array<std::int64_t, 3> position{};
  std::array<std::int16_t, 4> orientation{};  ///< quaternion x y z w

  static StoredPose from(double timestamp, const Quaternion& orientation, const Vector3& position);
  /// Takes the one of the two quaternions of the same rotation that is nearer to that of another
  /// pose, so that sequences have no jumps.
  void alignTo(const StoredPose& other);
  Vector3 sensor() const;
  Pose pose() const;
};
/// Largest coordinate of a pose, metres: what StoredPose can hold.
constexpr double kFarthestPose = 1e14;

/// Time stamps are mostly whole microseconds. \return whether this one is, and them
bool isInMicroseconds(double timestamp, std::int64_t& microseconds);

/// Poses of the frames in order, packed: a map must not grow while the robot stands still. A pose
/// is what differs from where it is expected, if all goes on as it did: a byte that says which of
/// the eight numbers differ, and these; for poses as expected a count of them. Every 1,024 poses or
/// so it starts anew, so that any one can be read.
class Trajectory {
 public:
  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  StoredPose back() const;
  StoredPose at(std::size_t index) const;
  void push(const StoredPose& pose);
  /// Forgets what the next push() can find out again.
  void rest() { tail_.reset(); }
  /// \param take  called with each pose from the given one on
  template <class Take>
  void forEach(std::size_t from, const Take& take) const;
  std::size_t memoryBytes() const;  ///< on the heap

 private:
  using Numbers = std::array<std::uint64_t, 8>;  ///< time, position, orientation; two's complement
  struct Chunk {
    std::uint32_t first_pose = 0;
    std::uint32_t first_byte = 0;
    bool in_microseconds = false;
  };
  /// What is known after some poses of a chunk.
  struct State {
    Numbers last{};
    Numbers step{};
    std::size_t poses = 0;

    Numbers expected() const;
    void accept(const Numbers& numbers);
  };
  /// Reads a chunk from its start.
  class Reader {
   public:
    Reader(const Trajectory& trajectory, const Chunk& chunk);
    StoredPose next();
    const State& state() const { return state_; }
    bool isCounting() const { return counting_; }  ///< was the last pose as expected?

   private:
    PackReader in_;
    bool in_microseconds_;
    bool counting_ = false;
    State state_;
    unsigned repeated_ = 0;  ///< poses as expected that are still to come
  };
  /// Where the next pose is added.
  struct Tail {
    State state;            ///< of the last chunk
    bool counting = false;  ///< the last byte counts poses as expected
    StoredPose back;
  };
  Tail readTail() const;
  Tail& tail();
  static Numbers numbersOf(const StoredPose& pose, bool in_microseconds);
  static StoredPose poseOf(const Numbers& numbers, bool in_microseconds);
  void startChunk(const StoredPose& pose);
  void put(std::uint8_t byte);
  std::size_t chunks() const { return empty() ? 0 : 1 + (later_ ? later_->size() : 0); }
  Chunk chunk(std::size_t i) const {
    return i == 0 ? Chunk{0, 0, first_in_microseconds_} : (*later_)[i - 1];
  }
  std::size_t chunkOf(std::size_t index) const;

  std::vector<std::uint8_t> bytes_;
  HeapValue<std::vector<Chunk>> later_;  ///< most trajectories have but one chunk
  std::uint32_t size_ = 0;
  bool first_in_microseconds_ = false;
  Resting<Tail> tail_;
};

template <class Take>
void Trajectory::forEach(std::size_t from, const Take& take) const {
  if (from >= size_) return;
  for (std::size_t c = chunkOf(from); c < chunks(); ++c) {
    const std::size_t end = c + 1 < chunks() ? chunk(c + 1).first_pose : size_;
    Reader reader(*this, chunk(c));
    for (std::size_t i = chunk(c).first_pose; i < end; ++i) {
      const StoredPose pose = reader.next();
      if (i >= from) take(pose);
    }
  }
}

}  // namespace planar_mapping::detail
