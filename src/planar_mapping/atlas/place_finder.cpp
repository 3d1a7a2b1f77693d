// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/place_finder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "planar_mapping/atlas/atlas_rows.h"
#include "planar_mapping/atlas/cloud_places.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping {
namespace {

constexpr std::size_t kValues = 128;  // of a descriptor, 4 bits each
constexpr std::size_t kTables = 8;    // of the signs of 16 values each
constexpr int kMaxDistance = 32;      // signs of 128 that differ in what may be the same feature
// A bucket with more descriptors than this says nothing of the place.
constexpr std::size_t kMaxBucket = 256;
constexpr std::size_t kPerSubmap = 3;  // candidates: they show the same

using Signs = std::array<std::uint64_t, 2>;

/// Whether each value is above the descriptor's median. The values of a word are spread over the
/// descriptor, so that each table sees all of it.
Signs signsOf(const std::uint8_t* bytes) {
  std::array<int, 16> count{};
  const auto value = [&](std::size_t i) { return (bytes[i / 2] >> (4 * (i % 2))) & 15; };
  for (std::size_t i = 0; i < kValues; ++i) ++count[static_cast<std::size_t>(value(i))];
  int median = 0;
  for (int below = 0; median < 15; ++median) {
    below += count[static_cast<std::size_t>(median)];
    if (2 * below >= static_cast<int>(kValues)) break;
  }
  Signs signs{};
  for (std::size_t i = 0; i < kValues; ++i) {
    if (value(i) <= median) continue;
    const std::size_t bit = (i % kTables) * (kValues / kTables) + i / kTables;
    signs[bit / 64] |= std::uint64_t{1} << (bit % 64);
  }
  return signs;
}

std::uint32_t wordOf(const Signs& signs, std::size_t table) {
  return static_cast<std::uint32_t>(signs[table / 4] >> (16 * (table % 4))) & 0xFFFFU;
}

int bitsOf(std::uint64_t word) {
  word -= (word >> 1) & 0x5555555555555555ULL;
  word = (word & 0x3333333333333333ULL) + ((word >> 2) & 0x3333333333333333ULL);
  word = (word + (word >> 4)) & 0x0F0F0F0F0F0F0F0FULL;
  return static_cast<int>((word * 0x0101010101010101ULL) >> 56);
}

int distanceOf(const Signs& a, const Signs& b) {
  return bitsOf(a[0] ^ b[0]) + bitsOf(a[1] ^ b[1]);
}

void requireSound(const Keyframe& key) {
  if (!PlaceFinder::knows(key))
    throw InputError("keyframe " + std::to_string(key.id) + " has descriptors of another size");
}

}  // namespace

class PlaceFinder::Index {
 public:
  void add(const Keyframe& key) {
    requireSound(key);
    const auto number = static_cast<std::uint32_t>(keys_.size());
    keys_.push_back({key.id, key.submap});
    for (std::size_t i = 0; i < key.sightings.size(); ++i) {
      const Signs signs = signsOf(key.descriptors.data() + i * key.descriptor_bytes);
      const auto entry = static_cast<std::uint32_t>(entries_.size());
      entries_.push_back({signs, number});
      for (std::size_t table = 0; table < kTables; ++table)
        buckets_[table][wordOf(signs, table)].push_back(entry);
    }
  }

  std::size_t size() const { return keys_.size(); }

  std::vector<std::int64_t> candidates(const Keyframe& key, std::size_t n,
                                       const std::vector<std::int64_t>& excluded) const {
    requireSound(key);
    std::vector<double> votes(keys_.size(), 0.0);
    std::vector<int> nearest(keys_.size(), kMaxDistance + 1);
    std::vector<std::uint32_t> touched;
    for (std::size_t i = 0; i < key.sightings.size(); ++i) {
      const Signs signs = signsOf(key.descriptors.data() + i * key.descriptor_bytes);
      for (std::size_t table = 0; table < kTables; ++table) {
        const auto bucket = buckets_[table].find(wordOf(signs, table));
        if (bucket == buckets_[table].end() || bucket->second.size() > kMaxBucket) continue;
        for (const std::uint32_t entry : bucket->second) {
          const Entry& other = entries_[entry];
          const int distance = distanceOf(signs, other.signs);
          int& least = nearest[other.key];
          if (distance >= least) continue;
          if (least > kMaxDistance) touched.push_back(other.key);
          least = distance;
        }
      }
      // A feature that many keyframes have tells little.
      const double rarity =
          std::log(static_cast<double>(keys_.size() + 2) / static_cast<double>(touched.size() + 1));
      for (const std::uint32_t number : touched) {
        votes[number] += rarity * (1.0 - static_cast<double>(nearest[number]) / (2 * kMaxDistance));
        nearest[number] = kMaxDistance + 1;
      }
      touched.clear();
    }
    return best(votes, key.submap, n, excluded);
  }

 private:
  struct Entry {
    Signs signs;
    std::uint32_t key;
  };
  struct Key {
    std::int64_t id;
    std::int64_t submap;
  };

  std::vector<std::int64_t> best(const std::vector<double>& votes, std::int64_t own, std::size_t n,
                                 const std::vector<std::int64_t>& excluded) const {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      const bool far = keys_[i].submap != own && std::find(excluded.begin(), excluded.end(),
                                                           keys_[i].submap) == excluded.end();
      if (far && votes[i] > 0.0) order.push_back(i);
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t i, std::size_t j) { return votes[i] > votes[j]; });
    std::map<std::int64_t, std::size_t> taken;
    std::vector<std::int64_t> ids;
    for (const std::size_t i : order) {
      if (ids.size() >= n) break;
      if (taken[keys_[i].submap]++ < kPerSubmap) ids.push_back(keys_[i].id);
    }
    return ids;
  }

  std::vector<Key> keys_;
  std::vector<Entry> entries_;
  std::array<std::unordered_map<std::uint32_t, std::vector<std::uint32_t>>, kTables> buckets_;
};

bool PlaceFinder::knows(const Keyframe& key) {
  if (key.sightings.empty() && key.descriptors.empty()) return true;
  return key.descriptor_bytes == kValues / 2 &&
         key.descriptors.size() == key.sightings.size() * key.descriptor_bytes;
}

PlaceFinder::PlaceFinder()
    : index_(std::make_unique<Index>()), clouds_(std::make_unique<detail::CloudPlaces>()) {}
PlaceFinder::~PlaceFinder() = default;
PlaceFinder::PlaceFinder(PlaceFinder&&) noexcept = default;
PlaceFinder& PlaceFinder::operator=(PlaceFinder&&) noexcept = default;

void PlaceFinder::add(const Keyframe& key) {
  key.points.empty() ? index_->add(key) : clouds_->add(key);
}

std::size_t PlaceFinder::size() const {
  return index_->size() + clouds_->size();
}

std::vector<std::int64_t> PlaceFinder::candidates(const Keyframe& key, std::size_t n,
                                                  const std::vector<std::int64_t>& excluded) const {
  return key.points.empty() ? index_->candidates(key, n, excluded)
                            : clouds_->candidates(key, n, excluded);
}

std::vector<Link> PlaceFinder::links(const Keyframe& key, const AtlasData& data,
                                     const std::vector<std::int64_t>& excluded,
                                     std::size_t most) const {
  if (!key.points.empty()) return clouds_->links(key, data, excluded, most);
  std::vector<Link> found;
  for (const std::int64_t candidate : candidates(key, most, excluded)) {
    std::optional<Link> link = verify(key, detail::rowOf(data.keyframes, candidate));
    if (link) found.push_back(std::move(*link));
  }
  return found;
}

}  // namespace planar_mapping
