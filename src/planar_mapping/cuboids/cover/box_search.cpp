// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/cuboids/cover/box_search.h"

#include <algorithm>

#include "planar_mapping/base/lists.h"

namespace planar_mapping::detail {
namespace {

/// The time of a search grows with the number of boxes times that of those in a cover.
constexpr std::size_t kMaxPairs = std::size_t{1} << 20;
constexpr std::uint32_t kNone = 0xFFFFFFFFu;

/// A box that stands for all of \p need and cannot grow; from \p need itself where none has room.
LatticeBox largestAround(const LatticeBox& need, const BoxSpace& space) {
  LatticeBox box = need;
  forEachFit(space.allowed, space.rules, need, [&](const LatticeBox& least) {
    box = least;
    return false;
  });
  for (std::size_t k = 0; k < 3; ++k) {
    space.allowed.extendUp(box, k);
    space.allowed.extendDown(box, k);
  }
  return box;
}

/// Divides cells between sets: those that only one holds to that one, each other to the one
/// whose hull grows least for it.
/// \param place  cell of each number
std::vector<CellSet> partitioned(const std::vector<const CellSet*>& sets,
                                 const std::vector<LatticeBox>& place) {
  std::vector<CellSet> holders(place.size());
  for (std::uint32_t s = 0; s < sets.size(); ++s) {
    for (const std::uint32_t number : *sets[s]) holders[number].push_back(s);
  }
  std::vector<CellSet> parts(sets.size());
  std::vector<LatticeBox> hulls(sets.size());
  const auto give = [&](std::uint32_t number, std::uint32_t to) {
    if (parts[to].empty()) hulls[to] = place[number];
    include(hulls[to], place[number]);
    parts[to].push_back(number);
  };
  for (std::uint32_t number = 0; number < place.size(); ++number) {
    if (holders[number].size() == 1) give(number, holders[number].front());
  }
  for (std::uint32_t number = 0; number < place.size(); ++number) {
    if (holders[number].size() < 2) continue;
    const auto growth = [&](std::uint32_t s) {
      if (parts[s].empty()) return volume(place[number]);
      LatticeBox hull = hulls[s];
      include(hull, place[number]);
      return volume(hull) - volume(hulls[s]);
    };
    give(number, *std::min_element(
                     holders[number].begin(), holders[number].end(),
                     [&](std::uint32_t l, std::uint32_t r) { return growth(l) < growth(r); }));
  }
  return parts;
}

}  // namespace

std::optional<std::vector<CellSet>> fewerBoxes(const BoxSpace& space, const CellSet& covered,
                                               const BoxList& needs) {
  if (space.largest.size() * needs.size() > kMaxPairs) return std::nullopt;
  std::vector<std::uint32_t> number_of(space.cells.size(), kNone);
  std::vector<LatticeBox> place;
  for (const std::uint32_t cell : covered) {
    number_of[cell] = static_cast<std::uint32_t>(place.size());
    place.push_back(boxOf(space.cells[cell]));
  }
  std::vector<CellSet> sets;
  const auto addBox = [&](const LatticeBox& box) {
    sets.emplace_back();
    space.numbers.forEach(grown(box, space.rules.tolerance), [&](std::size_t cell) {
      if (number_of[cell] != kNone) sets.back().push_back(number_of[cell]);
    });
  };
  for (const LatticeBox& box : space.largest) addBox(box);
  std::vector<std::size_t> start;
  for (const LatticeBox& need : needs) {
    start.push_back(sets.size());
    addBox(largestAround(need, space));
  }
  const std::vector<std::size_t> found = fewerSets(covered.size(), sets, start);
  if (found.size() >= needs.size()) return std::nullopt;
  std::vector<const CellSet*> chosen;
  for (const std::size_t s : found) chosen.push_back(&sets[s]);
  std::vector<CellSet> parts = partitioned(chosen, place);
  eraseIf(parts, [](const CellSet& part) { return part.empty(); });
  for (CellSet& part : parts) {
    for (std::uint32_t& number : part) number = covered[number];
    std::sort(part.begin(), part.end());
  }
  return parts;
}

}  // namespace planar_mapping::detail
