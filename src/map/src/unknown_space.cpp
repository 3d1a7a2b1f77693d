// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "unknown_space.h"

#include <algorithm>
#include <cmath>

namespace planar_mapping::detail {
namespace {

constexpr CubeBits kNone{};
constexpr CubeBits kFull{~std::uint64_t{0}, ~std::uint64_t{0}, ~std::uint64_t{0},
                         ~std::uint64_t{0}, ~std::uint64_t{0}, ~std::uint64_t{0},
                         ~std::uint64_t{0}, ~std::uint64_t{0}};
constexpr int kCubeLevel = 3;
constexpr int kRootLevel = 5;  ///< the walk starts at cubes of 32 cells

}  // namespace

/// Goes down from large cubes to cells and stops where the image says the same of all cells.
/// Stopping early never changes the result: a cube's footprint in the image contains those of its
/// cells at every level of the pyramid.
class UnknownSpace::Walk {
 public:
  Walk(UnknownSpace& space, const DepthImage& image, double cell, double max_range)
      : space_(space), image_(image), cell_(cell), max_range_(max_range) {
    const Matrix3& r = image.inverseRotation();
    for (int level = 0; level <= kRootLevel; ++level) {
      // All cells, each as a box along the camera's axes, about the middle of the cube.
      const double half = 0.5 * cell * static_cast<double>(1 << level);
      half_[level] = image.extentInCamera(Vector3::Constant(half - 0.5 * cell)) +
                     Vector3::Constant(0.5 * cell);
      for (int child = 0; child < 8; ++child) {
        const Vector3 to((child & 1) != 0 ? 0.5 : -0.5, (child & 2) != 0 ? 0.5 : -0.5,
                         (child & 4) != 0 ? 0.5 : -0.5);
        child_[level][child] = r * (half * to);
      }
    }
  }

  void root(const Int3& low) {
    const Vector3 middle =
        cell_ * (Vector3(low.x, low.y, low.z) + Vector3::Constant(0.5 * (1 << kRootLevel)));
    node(kRootLevel, low, image_.toCamera(middle));
  }

 private:
  void node(int level, const Int3& low, const Vector3& centre) {
    // What was seen free stays free: nothing to be learnt there.
    if (level < kCubeLevel ? isKnownFree(level, low)
                           : level == kCubeLevel && space_.isAllFree(keyOf(low))) {
      return;
    }
    // Where the image ends nothing is certain; to follow its rim cell by cell is not worth it.
    const bool whole = level <= 1;
    const DepthImage::Look look = image_.look(centre, half_[level], whole);
    if (whole && !look.inside) return;
    if (!look.visible || look.near > max_range_ || look.farthest <= 0.0f) return;
    if (look.inside && look.far <= max_range_) {
      if (look.farthest < look.near) return mark(level, low, false);
      if (look.nearest > look.far) return mark(level, low, true);
    }
    if (level == 0) {
      if (look.farthest > look.far && look.far <= max_range_ && look.near > 0.0) {
        mark(level, low, true);
      }
      return;
    }
    const std::int32_t half = std::int32_t{1} << (level - 1);
    const bool is_cube = level == kCubeLevel;
    if (is_cube) open(low);
    for (int child = 0; child < 8; ++child) {
      node(level - 1,
           {low.x + ((child & 1) != 0 ? half : 0), low.y + ((child & 2) != 0 ? half : 0),
            low.z + ((child & 4) != 0 ? half : 0)},
           centre + child_[level][child]);
    }
    if (is_cube) close(low);
  }

  static std::uint64_t keyOf(const Int3& low) {
    return packKey(Int3{low.x >> 3, low.y >> 3, low.z >> 3});
  }
  /// Bits of a cube of 2^level cells in one slice of the cube of 8.
  static std::uint64_t sliceOf(int level, const Int3& low) {
    constexpr std::uint64_t kSquare[3] = {0x1u, 0x303u, 0x0f0f0f0fu};
    return kSquare[level] << (8 * (low.y & 7) + (low.x & 7));
  }
  bool isKnownFree(int level, const Int3& low) const {
    const std::uint64_t slice = sliceOf(level, low);
    const auto first = static_cast<std::size_t>(low.z & 7);
    for (std::size_t z = first; z < first + (std::size_t{1} << level); ++z) {
      if ((slice & ~known_[z]) != 0) return false;
    }
    return true;
  }

  void open(const Int3& low) {
    unknown_ = kNone;
    free_ = kNone;
    known_ = space_.freeBits(keyOf(low));
  }
  void close(const Int3& low) {
    const std::uint64_t key = keyOf(low);
    if (free_ != kNone) space_.set(key, free_, true);
    if (unknown_ != kNone) space_.set(key, unknown_, false);
  }

  void mark(int level, const Int3& low, bool free) {
    const std::int32_t side = std::int32_t{1} << level;
    if (level >= kCubeLevel) {
      for (std::int32_t z = low.z; z < low.z + side; z += 8) {
        for (std::int32_t y = low.y; y < low.y + side; y += 8) {
          for (std::int32_t x = low.x; x < low.x + side; x += 8) {
            space_.setAll(packKey(Int3{x >> 3, y >> 3, z >> 3}), free);
          }
        }
      }
      return;
    }
    CubeBits& bits = free ? free_ : unknown_;
    const std::uint64_t slice = sliceOf(level, low);
    for (std::int32_t z = low.z & 7; z < (low.z & 7) + side; ++z) {
      bits[static_cast<std::size_t>(z)] |= slice;
    }
  }

  UnknownSpace& space_;
  const DepthImage& image_;
  const double cell_;
  const double max_range_;
  Vector3 half_[kRootLevel + 1];
  Vector3 child_[kRootLevel + 1][8];
  CubeBits unknown_{};
  CubeBits free_{};
  CubeBits known_{};  ///< free bits of the open cube before this frame
};

void UnknownSpace::integrate(const DepthImage& image, double cell, double max_range) {
  Vector3 low, high;
  image.bounds(max_range, low, high);
  constexpr std::int32_t kSide = 1 << kRootLevel;
  constexpr double kLimit = kLatticeLimit / kSide - 1;
  low = (low / (cell * kSide)).array().floor().max(-kLimit).min(kLimit);
  high = (high / (cell * kSide)).array().floor().max(-kLimit).min(kLimit);
  Walk walk(*this, image, cell, max_range);
  for (auto z = static_cast<std::int32_t>(low.z()); z <= high.z(); ++z) {
    for (auto y = static_cast<std::int32_t>(low.y()); y <= high.y(); ++y) {
      for (auto x = static_cast<std::int32_t>(low.x()); x <= high.x(); ++x) {
        walk.root({x * kSide, y * kSide, z * kSide});
      }
    }
  }
}

void UnknownSpace::setAll(std::uint64_t key, bool free) {
  std::uint32_t& state = states_[key];
  if (free) {
    release(state);
    state = kAllFree;
  } else if (state == kNothing) {
    state = kAllUnknown;
  } else if (state >= kFirstCube) {
    set(key, kFull, false);
  }
}

void UnknownSpace::set(std::uint64_t key, const CubeBits& bits, bool free) {
  std::uint32_t& state = states_[key];
  if (state == kAllFree || (state == kAllUnknown && !free)) return;
  if (state < kFirstCube) {
    Cube fresh;
    if (state == kAllUnknown) fresh.unknown = kFull;
    if (spare_.empty()) {
      state = static_cast<std::uint32_t>(cubes_.size()) + kFirstCube;
      cubes_.push_back(fresh);
    } else {
      state = spare_.back() + kFirstCube;
      spare_.pop_back();
      cubes_[state - kFirstCube] = fresh;
    }
  }
  Cube& cube = cubes_[state - kFirstCube];
  bool all_free = true;
  bool all_unknown = true;
  for (std::size_t z = 0; z < 8; ++z) {
    if (free) {
      cube.free[z] |= bits[z];
      cube.unknown[z] &= ~bits[z];
    } else {
      cube.unknown[z] |= bits[z] & ~cube.free[z];
    }
    all_free &= cube.free[z] == ~std::uint64_t{0};
    all_unknown &= cube.unknown[z] == ~std::uint64_t{0};
  }
  if (all_free || all_unknown) {
    release(state);
    state = all_free ? kAllFree : kAllUnknown;
  }
}

CubeBits UnknownSpace::freeBits(std::uint64_t key) const {
  const std::uint32_t* state = states_.find(key);
  return state != nullptr && *state >= kFirstCube ? cubes_[*state - kFirstCube].free : kNone;
}

bool UnknownSpace::isUnknown(const Int3& cell) const {
  const std::uint32_t* state = states_.find(packKey(Int3{cell.x >> 3, cell.y >> 3, cell.z >> 3}));
  if (state == nullptr || *state < kAllUnknown) return false;
  if (*state == kAllUnknown) return true;
  return ((cubes_[*state - kFirstCube].unknown[static_cast<std::size_t>(cell.z & 7)] >>
           (8 * (cell.y & 7) + (cell.x & 7))) &
          1u) != 0;
}

UnknownSpace::Cube UnknownSpace::cube(std::size_t i) const {
  const std::uint32_t state = states_.value(i);
  if (state >= kFirstCube) return cubes_[state - kFirstCube];
  Cube cube;
  if (state == kAllFree) cube.free = kFull;
  if (state == kAllUnknown) cube.unknown = kFull;
  return cube;
}

}  // namespace planar_mapping::detail
