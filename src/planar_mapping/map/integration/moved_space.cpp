// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/integration/moved_space.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/base/error.h"

namespace planar_mapping::detail {
namespace {

Int3 shifted(const Int3& at, int bits) {
  return {at.x >> bits, at.y >> bits, at.z >> bits};
}

class Mover {
  static constexpr int kBlockLevel = UnknownSpace::kBlockLevel;
  static constexpr int kRegionLevel = UnknownSpace::kRegionLevel;
  static constexpr std::int32_t kRegionSide = 1 << kRegionLevel;  // cells
  /// Regions that are resampled block by block: some seconds.
  static constexpr std::size_t kMaxMixed = std::size_t{1} << 16;
  static constexpr double kRounding = 1e-6;  // cells
  static constexpr std::uint64_t kAll = ~std::uint64_t{0};

 public:
  Mover(const UnknownSpace& space, double cell, const Pose& T)
      : space_(space),
        to_(inCells(T, cell)),
        back_(to_.inverse()),
        widths_(back_.linear().cwiseAbs()) {}

  UnknownSpace moved() {
    KeyMap<std::uint8_t> reached;
    const Vector3 half =
        0.5 * kRegionSide * to_.linear().cwiseAbs().rowwise().sum() - Vector3::Constant(kRounding);
    space_.forEachRegion([&](const Int3& at, const SpaceRegion&) {
      const Vector3 middle =
          to_ * Vector3(kRegionSide * (Vector3(at.x, at.y, at.z) + Vector3::Constant(0.5)));
      forEachPlace(toInt3(((middle - half) / kRegionSide).array().floor()),
                   toInt3(((middle + half) / kRegionSide).array().floor()),
                   [&](const Int3& region) { reached.insert(packKey(region)); });
    });
    UnknownSpace moved(space_.isUnseenUnknown() ? Unseen::Unknown : Unseen::Free);
    for (const std::uint64_t key : reached.sortedKeys()) {
      const SpaceRegion region = regionAt(unpackKey(key));
      if (region.label() != SpaceRegion::kNever) moved.setRegion(unpackKey(key), region);
    }
    return moved;
  }

 private:
  /// A region of the space that is moved.
  struct Source {
    Int3 at;
    SpaceRegion::Label label = SpaceRegion::kNever;
    std::unique_ptr<SpaceRegion::Blocks> blocks;  ///< if it is mixed

    SpaceRegion::Label labelOf(const Int3& block) const {
      return label == SpaceRegion::kMixed
                 ? static_cast<SpaceRegion::Label>(blocks->labels[placeOf(block)])
                 : label;
    }
  };

  static Pose inCells(Pose pose, double cell) {
    pose.translation() /= cell;
    return pose;
  }
  /// Without a call: the processor's own rounding is newer than what this is built for.
  static std::int32_t floorOf(double value) {
    const auto whole = static_cast<std::int32_t>(value);
    return whole - (value < whole ? 1 : 0);
  }
  static std::size_t placeOf(const Int3& block) {
    return static_cast<std::size_t>((block.x & 7) + 8 * (block.y & 7) + 64 * (block.z & 7));
  }

  SpaceRegion regionAt(const Int3& at) {
    sources_.clear();
    const Int3 low{kRegionSide * at.x, kRegionSide * at.y, kRegionSide * at.z};
    const SpaceRegion::Label label = labelOf(kRegionLevel, low);
    if (label != SpaceRegion::kMixed) return SpaceRegion::allOf(label);
    if (++mixed_ > kMaxMixed)
      throw InputError("its pose turns the map, or moves it by other than whole cubes of " +
                       std::to_string(kRegionSide) + " cells, and space in more than " +
                       std::to_string(kMaxMixed) + " of these would have to be resampled");
    node(kRegionLevel, low);
    SpaceRegion region;
    region.pack(result_);
    return region;
  }

  void node(int level, const Int3& low) {
    const SpaceRegion::Label label = labelOf(level, low);
    if (label == SpaceRegion::kMixed && level > kBlockLevel) {
      const std::int32_t half = 1 << (level - 1);
      for (int k = 0; k < 8; ++k)
        node(level - 1,
             {low.x + half * (k & 1), low.y + half * (k >> 1 & 1), low.z + half * (k >> 2)});
      return;
    }
    const std::int32_t last = (1 << (level - kBlockLevel)) - 1;
    const Int3 first = shifted(low, kBlockLevel);
    forEachPlace(first, {first.x + last, first.y + last, first.z + last},
                 [&](const Int3& block) { result_.labels[placeOf(block)] = label; });
    if (label == SpaceRegion::kMixed) cells(first, low);
  }

  /// What the cells of a cube were, by their blocks; mixed where that needs a closer look.
  SpaceRegion::Label labelOf(int level, const Int3& low) {
    const double half = 0.5 * (1 << level);
    const Vector3 middle = back_ * Vector3(Vector3(low.x, low.y, low.z) + Vector3::Constant(half));
    const Vector3 reach = widths_ * Vector3::Constant(half - 0.5 + kRounding);
    const Int3 first = toInt3((middle - reach).array().floor());
    const Int3 last = toInt3((middle + reach).array().floor());
    std::optional<SpaceRegion::Label> all;
    const auto agrees = [&all](SpaceRegion::Label label) {
      if (!all) all = label;
      return label != SpaceRegion::kMixed && label == *all;
    };
    const Int3 low_block = shifted(first, kBlockLevel), high_block = shifted(last, kBlockLevel);
    const bool are_alike = allPlaces(
        shifted(first, kRegionLevel), shifted(last, kRegionLevel), [&](const Int3& region) {
          const Source& source = sourceAt(region);
          if (source.label != SpaceRegion::kMixed) return agrees(source.label);
          if (level == kRegionLevel) return false;
          Int3 from, to;
          for (std::size_t k = 0; k < 3; ++k) {
            from[k] = std::max(low_block[k], 8 * region[k]);
            to[k] = std::min(high_block[k], 8 * region[k] + 7);
          }
          return allPlaces(from, to,
                           [&](const Int3& block) { return agrees(source.labelOf(block)); });
        });
    return are_alike ? *all : SpaceRegion::kMixed;
  }

  void cells(const Int3& block, const Int3& low) {
    SpaceBlock& cells = result_.cells[placeOf(block)];
    cells = {};
    const Vector3 corner = back_ * Vector3(Vector3(low.x, low.y, low.z) + Vector3::Constant(0.5));
    Int3 known{1 << 30, 0, 0};  // the block whose cells were found: none yet
    SpaceBlock found;
    for (int bit = 0; bit < 64; ++bit) {
      const Vector3 place_in_source = corner + (bit & 3) * back_.linear().col(0) +
                                      (bit >> 2 & 3) * back_.linear().col(1) +
                                      (bit >> 4) * back_.linear().col(2);
      const Int3 from{floorOf(place_in_source.x()), floorOf(place_in_source.y()),
                      floorOf(place_in_source.z())};
      const Int3 holder = shifted(from, kBlockLevel);
      if (!(holder == known)) {
        known = holder;
        const Source& source = sourceAt(shifted(from, kRegionLevel));
        const SpaceRegion::Label label = source.labelOf(known);
        found = {label == SpaceRegion::kFree ? kAll : 0, label == SpaceRegion::kUnknown ? kAll : 0};
        if (label == SpaceRegion::kMixed) found = source.blocks->cells[placeOf(known)];
      }
      const int place = UnknownSpace::bitOf(from);
      cells.free |= (found.free >> place & 1u) << bit;
      cells.unknown |= (found.unknown >> place & 1u) << bit;
    }
    if (cells.free == kAll) result_.labels[placeOf(block)] = SpaceRegion::kFree;
    if (cells.unknown == kAll) result_.labels[placeOf(block)] = SpaceRegion::kUnknown;
    if ((cells.free | cells.unknown) == 0) result_.labels[placeOf(block)] = SpaceRegion::kNever;
  }

  /// Valid until the next call.
  const Source& sourceAt(const Int3& region) {
    if (last_ < sources_.size() && sources_[last_].at == region) return sources_[last_];
    for (last_ = 0; last_ < sources_.size(); ++last_) {
      if (sources_[last_].at == region) return sources_[last_];
    }
    Source source{region, SpaceRegion::kNever, nullptr};
    if (const SpaceRegion* known = space_.region(region)) {
      source.label = known->label();
      if (source.label == SpaceRegion::kMixed) {
        source.blocks = std::make_unique<SpaceRegion::Blocks>();
        known->unpack(*source.blocks);
      }
    }
    sources_.push_back(std::move(source));
    return sources_.back();
  }

  const UnknownSpace& space_;
  const Pose to_, back_;  ///< in cells
  const Matrix3 widths_;
  std::vector<Source> sources_;  ///< around one region of the result
  std::size_t last_ = 0;         ///< of them that was asked for
  SpaceRegion::Blocks result_;
  std::size_t mixed_ = 0;
};

}  // namespace

UnknownSpace movedSpace(const UnknownSpace& space, double cell, const Pose& T) {
  return Mover(space, cell, T).moved();
}

}  // namespace planar_mapping::detail
