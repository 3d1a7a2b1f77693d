// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/lattice_coder.h"

#include <algorithm>
#include <array>

namespace planar_mapping::detail {
namespace {

constexpr std::size_t kModels = 11;
constexpr std::size_t kContexts = std::size_t{1} << 12u;
constexpr std::size_t kNearest = 64;  ///< values of context 0
constexpr std::uint8_t kMixed = 3;    ///< label of a bundle whose cells differ
constexpr std::uint8_t kNotYet = 3;   ///< value of a cell that is not known yet
constexpr std::int32_t kRim = 2;      ///< how far neighbours are looked at
constexpr std::int32_t kRegionSide = 8;
constexpr std::uint64_t kAll = ~std::uint64_t{0};

/// Values of a box of bundles or cells and of their neighbours.
struct Window {
  std::int32_t row;    ///< step to the next y
  std::int32_t slice;  ///< step to the next z
  std::array<std::uint8_t, 12 * 12 * 12> values{};

  Window(std::int32_t side, int dimensions)
      : row(side + 2 * kRim), slice(row * row), flat_(dimensions == 2) {}
  std::size_t index(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return static_cast<std::size_t>((x + kRim) + row * (y + kRim) + slice * (flat_ ? 0 : z + kRim));
  }
  /// The contexts of the value at \p i: groups of up to six neighbours, two bits each.
  /// \param place of the value in its bundle or region, below 64
  void contexts(std::size_t i, std::uint32_t place, std::uint32_t* context) const {
    const std::uint8_t* at = &values[i];
    // In a plane there is nothing above and below.
    const auto get = [&](std::int32_t dx, std::int32_t dy, std::int32_t dz) -> std::uint32_t {
      if (flat_ && dz != 0) return 0;
      return at[dx + dy * row + dz * slice];
    };
    const auto group = [](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d,
                          std::uint32_t e, std::uint32_t f) {
      return a | b << 2u | c << 4u | d << 6u | e << 8u | f << 10u;
    };
    const std::uint32_t left = get(-1, 0, 0), back = get(0, -1, 0), below = get(0, 0, -1);
    const std::uint32_t right = get(1, 0, 0), front = get(0, 1, 0), above = get(0, 0, 1);
    const std::uint32_t left2 = get(-2, 0, 0), back2 = get(0, -2, 0), below2 = get(0, 0, -2);
    const std::uint32_t back_left = get(-1, -1, 0), back_right = get(1, -1, 0);
    context[0] = group(left, back, below, 0, 0, 0);
    context[1] = group(left, back, below, back_left, get(-1, 0, -1), get(0, -1, -1));
    context[2] = group(left, back, below, back_right, get(1, 0, -1), get(0, 1, -1));
    context[3] = group(left, back, below, left2, back2, below2);
    context[4] = group(left, back, below, right, front, above);
    context[5] =
        group(back_left, back_right, get(-2, -1, 0), get(2, -1, 0), get(-1, -2, 0), get(1, -2, 0));
    context[6] =
        flat_ ? group(left, back, back_right, get(2, -1, 0), left2, back_left)
              : group(get(-1, 0, -1), get(1, 0, -1), get(0, -1, -1), get(0, 1, -1), below, below2);
    context[7] = context[0] | place << 6u;
    context[8] = flat_ ? group(left, back, right, front, back_left, back_right)
                       : group(left, back, right, front, above, below2);
    context[9] = context[10] = 0;
    if (flat_) {
      context[9] = group(left, back, left2, back2, back_left, back_right);
      return;
    }
    // One bit each, the upper or the lower one: the nine below and three of the same slice.
    for (std::int32_t k = 0; k < 12; ++k) {
      const std::uint32_t value = k < 9     ? get(k % 3 - 1, k / 3 - 1, -1)
                                  : k == 9  ? left
                                  : k == 10 ? back
                                            : back_right;
      context[9] |= (value & 1u) << k;
      context[10] |= (value >> 1u) << k;
    }
  }

 private:
  bool flat_;
};

std::int32_t floorDivide(std::int32_t value, std::int32_t divisor) {
  return value >= 0 ? value / divisor : -((divisor - 1 - value) / divisor);
}

/// The region of a bundle.
Int3 regionOf(int dimensions, const Int3& at) {
  return {floorDivide(at.x, kRegionSide), floorDivide(at.y, kRegionSide),
          dimensions == 2 ? 0 : floorDivide(at.z, kRegionSide)};
}

bool codeDecision(BitCoder& coder, MixedBit& model, bool bit, const std::uint32_t* context,
                  std::size_t decision) {
  std::uint32_t own[kModels];
  for (std::size_t m = 0; m < kModels; ++m) {
    own[m] = context[m] + static_cast<std::uint32_t>(decision * kContexts);
  }
  return model.code(coder, bit, own, {decision, decision * kNearest + context[0]});
}

}  // namespace

struct LatticeCoder::Region {
  Int3 at;
  std::array<std::uint8_t, 512> labels{};
  std::array<LatticeBundle*, 512> mixed{};
};

class LatticeCoder::Grid {
 public:
  Grid(int dimensions, std::vector<Region>& regions) : flat_(dimensions == 2), regions_(regions) {
    for (std::size_t r = 0; r < regions.size(); ++r) {
      places_[packKey(regions[r].at)] = static_cast<std::uint32_t>(r);
    }
  }
  Region* region(const Int3& at) {
    const std::uint32_t* r = places_.find(packKey(at));
    return r != nullptr ? &regions_[*r] : nullptr;
  }
  std::size_t indexOf(const Int3& within) const {
    return static_cast<std::size_t>(within.x + 8 * within.y + 64 * within.z);
  }
  std::int32_t depth() const { return flat_ ? 1 : kRegionSide; }

  /// Labels of the region's bundles and of those around it that are known.
  void fill(const Region& region, Window& window) {
    for (std::int32_t rz = flat_ ? 0 : -1; rz <= (flat_ ? 0 : 1); ++rz) {
      for (std::int32_t ry = -1; ry <= 1; ++ry) {
        for (std::int32_t rx = -1; rx <= 1; ++rx) {
          const Region* other =
              this->region({region.at.x + rx, region.at.y + ry, region.at.z + rz});
          if (other == nullptr || !isBefore(other->at, region.at)) continue;
          const auto first = [](std::int32_t r) { return r < 0 ? -kRim : r * kRegionSide; };
          const auto last = [](std::int32_t r) {
            return r < 0 ? 0 : r * (kRegionSide + kRim) + (r == 0 ? kRegionSide : 0);
          };
          for (std::int32_t z = flat_ ? 0 : first(rz); z < (flat_ ? 1 : last(rz)); ++z) {
            for (std::int32_t y = first(ry); y < last(ry); ++y) {
              for (std::int32_t x = first(rx); x < last(rx); ++x) {
                window.values[window.index(x, y, z)] =
                    other->labels[indexOf({x & 7, y & 7, flat_ ? 0 : z & 7})];
              }
            }
          }
        }
      }
    }
  }

 private:
  const bool flat_;
  std::vector<Region>& regions_;
  KeyMap<std::uint32_t> places_;
};

LatticeCoder::LatticeCoder(int dimensions, bool with_twos)
    : dimensions_(dimensions),
      with_twos_(with_twos),
      labels_(kModels, 3 * kContexts, {3, 3 * kNearest}),
      cells_(kModels, 2 * kContexts, {2, 2 * kNearest}) {}

void LatticeCoder::forget() {
  forgetAll(labels_, cells_, uniform_, uniform_label_, count_, corner_, step_, next_, same_row_,
            same_slab_);
}

void LatticeCoder::codeRegions(BitCoder& coder, std::vector<Int3>& regions) {
  const std::size_t n = static_cast<std::size_t>(count_.code(coder, regions.size()));
  if (coder.isReading()) {
    if (n > 64 + coder.size()) coder.fail("asks for too many regions");
    regions.assign(n, Int3());
  }
  // Coordinates of regions, so that those of cells stay within the lattice.
  const std::int32_t limit = kLatticeLimit / (dimensions_ == 2 ? 64 : 32);
  const auto within = [&](NumberModel& model, std::int32_t value, std::int32_t from) {
    return from + static_cast<std::int32_t>(
                      model.codeWithin(coder, value - from, -limit - from, limit - 1 - from));
  };
  Int3 row, slab;
  for (std::size_t i = 0; i < n; ++i) {
    Int3& r = regions[i];
    if (i == 0) {
      r = {within(corner_, r.x, 0), within(corner_, r.y, 0),
           dimensions_ == 2 ? 0 : within(corner_, r.z, 0)};
      row = slab = r;
      continue;
    }
    const Int3 last = regions[i - 1];
    const Int3 wanted = r;
    r = last;
    if (next_.code(coder, wanted == Int3{last.x + 1, last.y, last.z})) {
      ++r.x;
    } else if (same_row_.code(coder, wanted.y == last.y && wanted.z == last.z)) {
      r.x += 2 + static_cast<std::int32_t>(
                     step_.codeWithin(coder, wanted.x - last.x - 2, 0, 2 * limit));
    } else if (dimensions_ == 2 || same_slab_.code(coder, wanted.z == last.z)) {
      r.y += 1 + static_cast<std::int32_t>(
                     step_.codeWithin(coder, wanted.y - last.y - 1, 0, 2 * limit));
      r.x = within(corner_, wanted.x, row.x);
      row = r;
    } else {
      r.z += 1 + static_cast<std::int32_t>(
                     step_.codeWithin(coder, wanted.z - last.z - 1, 0, 2 * limit));
      r.y = within(corner_, wanted.y, slab.y);
      r.x = within(corner_, wanted.x, slab.x);
      row = slab = r;
    }
    if (r.x >= limit || r.y >= limit || r.z >= limit) coder.fail("has cells outside the world");
  }
}

void LatticeCoder::codeLabels(BitCoder& coder, Grid& grid, Region& region) {
  const std::size_t bundles = dimensions_ == 2 ? 64 : 512;
  std::uint8_t* labels = region.labels.data();
  const bool same = std::all_of(labels, labels + bundles,
                                [&](std::uint8_t l) { return l == labels[0] && l != kMixed; });
  if (uniform_.code(coder, same)) {
    const auto label = static_cast<std::uint8_t>(uniform_label_.code(coder, labels[0]));
    if (label == 0 || label == kMixed || (label == 2 && !with_twos_)) {
      coder.fail("has a region of a label that cannot be");
    }
    std::fill(labels, labels + bundles, label);
    return;
  }
  Window window(kRegionSide, dimensions_);
  grid.fill(region, window);
  std::uint32_t context[kModels];
  // First, last or between: labels of later regions are not known.
  const auto edge = [](std::int32_t i) { return i == 0 ? 0u : i == kRegionSide - 1 ? 2u : 1u; };
  for (std::int32_t z = 0; z < grid.depth(); ++z) {
    for (std::int32_t y = 0; y < kRegionSide; ++y) {
      for (std::int32_t x = 0; x < kRegionSide; ++x) {
        std::uint8_t& label = labels[grid.indexOf({x, y, z})];
        const std::size_t at = window.index(x, y, z);
        window.contexts(at, edge(x) + 3 * edge(y) + 9 * edge(z), context);
        const auto decide = [&](bool bit, std::size_t decision) {
          return codeDecision(coder, labels_, bit, context, decision);
        };
        if (decide(label == kMixed, 0)) {
          label = kMixed;
        } else if (with_twos_ && decide(label == 2, 1)) {
          label = 2;
        } else {
          label = decide(label == 1, 2) ? 1 : 0;
        }
        window.values[at] = label;
      }
    }
  }
}

void LatticeCoder::codeCells(BitCoder& coder, Grid& grid, Region& region, std::size_t bundle) {
  const bool flat = dimensions_ == 2;
  const std::int32_t side = flat ? 8 : 4;
  const std::int32_t shift = flat ? 3 : 2;
  const Int3 at{static_cast<std::int32_t>(bundle & 7), static_cast<std::int32_t>(bundle >> 3 & 7),
                static_cast<std::int32_t>(bundle >> 6)};
  LatticeBundle& own = *region.mixed[bundle];
  Window window(side, dimensions_);
  for (std::int32_t bz = flat ? 0 : -1; bz <= (flat ? 0 : 1); ++bz) {
    for (std::int32_t by = -1; by <= 1; ++by) {
      for (std::int32_t bx = -1; bx <= 1; ++bx) {
        const Int3 other{at.x + bx, at.y + by, at.z + bz};
        const Int3 step{other.x >> 3, other.y >> 3, other.z >> 3};
        const Region* r =
            step == Int3()
                ? &region
                : grid.region({region.at.x + step.x, region.at.y + step.y, region.at.z + step.z});
        std::uint8_t label = 0;
        const LatticeBundle* cells = nullptr;
        if (r != nullptr) {
          const std::size_t i = grid.indexOf({other.x & 7, other.y & 7, other.z & 7});
          label = r->labels[i];
          const bool before = r == &region ? i < bundle : isBefore(r->at, region.at);
          if (label == kMixed && before) cells = r->mixed[i];
        }
        const auto first = [&](std::int32_t b) { return b < 0 ? -kRim : b * side; };
        const auto last = [&](std::int32_t b) { return b < 0 ? 0 : b == 0 ? side : side + kRim; };
        for (std::int32_t z = flat ? 0 : first(bz); z < (flat ? 1 : last(bz)); ++z) {
          for (std::int32_t y = first(by); y < last(by); ++y) {
            for (std::int32_t x = first(bx); x < last(bx); ++x) {
              std::uint8_t value = label;
              if (cells != nullptr) {
                const int bit =
                    (((z & (side - 1)) << shift | (y & (side - 1))) << shift) | (x & (side - 1));
                value = static_cast<std::uint8_t>((cells->ones >> bit & 1u) |
                                                  (cells->twos >> bit & 1u) << 1u);
              } else if (label == kMixed) {
                value = kNotYet;
              }
              window.values[window.index(x, y, z)] = value;
            }
          }
        }
      }
    }
  }
  const std::uint64_t ones = own.ones;
  const std::uint64_t twos = own.twos;
  own.ones = own.twos = 0;
  std::uint32_t context[kModels];
  for (int bit = 0; bit < 64; ++bit) {
    const std::size_t i =
        window.index(bit & (side - 1), bit >> shift & (side - 1), flat ? 0 : bit >> 4);
    window.contexts(i, static_cast<std::uint32_t>(bit), context);
    const auto decide = [&](std::uint64_t of, std::size_t decision) {
      return codeDecision(coder, cells_, (of >> bit & 1u) != 0, context, decision);
    };
    const bool two = with_twos_ && decide(twos, 0);
    const bool one = !two && decide(ones, 1);
    own.ones |= std::uint64_t{one} << bit;
    own.twos |= std::uint64_t{two} << bit;
    window.values[i] = two ? 2 : one ? 1 : 0;
  }
  if ((own.ones | own.twos) == 0 || own.ones == kAll || own.twos == kAll) {
    coder.fail("has mixed cells that are all alike");
  }
}

void LatticeCoder::sort(int dimensions, std::vector<LatticeBundle>& bundles) {
  std::sort(bundles.begin(), bundles.end(), [&](const LatticeBundle& a, const LatticeBundle& b) {
    const Int3 ra = regionOf(dimensions, a.at);
    const Int3 rb = regionOf(dimensions, b.at);
    return ra == rb ? isBefore(a.at, b.at) : isBefore(ra, rb);
  });
}

void LatticeCoder::code(BitCoder& coder, std::vector<LatticeBundle>& bundles, LatticeCount& count) {
  const std::int32_t depth = dimensions_ == 2 ? 1 : kRegionSide;
  std::vector<Int3> places;
  for (const LatticeBundle& b : bundles) {
    const Int3 r = regionOf(dimensions_, b.at);
    if (places.empty() || !(places.back() == r)) places.push_back(r);
  }
  codeRegions(coder, places);
  std::vector<Region> regions(places.size());
  for (std::size_t r = 0; r < places.size(); ++r) regions[r].at = places[r];
  Grid grid(dimensions_, regions);
  if (!coder.isReading()) {
    std::size_t r = 0;
    for (LatticeBundle& b : bundles) {
      while (!(places[r] == regionOf(dimensions_, b.at))) ++r;
      const std::size_t i = grid.indexOf({b.at.x & 7, b.at.y & 7, depth == 1 ? 0 : b.at.z & 7});
      regions[r].labels[i] = b.ones == kAll ? 1 : b.twos == kAll ? 2 : kMixed;
    }
  }
  std::size_t total = 0;
  for (Region& region : regions) {
    codeLabels(coder, grid, region);
    std::size_t some = 0;
    for (const std::uint8_t label : region.labels) {
      some += label != 0 ? 1 : 0;
      count.bundles += (with_twos_ ? label == kMixed : label != 0) ? 1 : 0;
    }
    if (some == 0) coder.fail("has a region without a cell");
    total += some;
    ++count.regions;
    if (coder.isReading() && count.bundles > 64 + kBundlesPerByte * coder.size()) {
      coder.fail("stands for more cells than its size allows");
    }
  }
  bundles.resize(total);
  std::size_t next = 0;
  for (Region& region : regions) {
    for (std::size_t i = 0; i < region.labels.size(); ++i) {
      if (region.labels[i] == 0) continue;
      LatticeBundle& b = bundles[next++];
      region.mixed[i] = &b;
      if (!coder.isReading()) continue;
      b.at = {kRegionSide * region.at.x + static_cast<std::int32_t>(i & 7),
              kRegionSide * region.at.y + static_cast<std::int32_t>(i >> 3 & 7),
              depth * region.at.z + static_cast<std::int32_t>(i >> 6)};
      if (region.labels[i] == 1) b.ones = kAll;
      if (region.labels[i] == 2) b.twos = kAll;
    }
  }
  for (Region& region : regions) {
    for (std::size_t i = 0; i < region.labels.size(); ++i) {
      if (region.labels[i] == kMixed) codeCells(coder, grid, region, i);
    }
  }
}

}  // namespace planar_mapping::detail
