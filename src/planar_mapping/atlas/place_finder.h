// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "planar_mapping/atlas/atlas_data.h"
#include "planar_mapping/base/export.h"

namespace planar_mapping {
namespace detail {
class CloudPlaces;
}

/// Recognises places: of images by an index over descriptors and the check of two keyframes, of
/// clouds without images by their surfaces.
///
/// Results depend on what was added and in which order, on nothing else. Const functions may be
/// called from several threads at once.
class PLANAR_MAPPING_EXPORT PlaceFinder {
 public:
  PlaceFinder();
  ~PlaceFinder();
  PlaceFinder(PlaceFinder&&) noexcept;
  PlaceFinder& operator=(PlaceFinder&&) noexcept;

  /// Whether a keyframe has descriptors of the size that is looked for; features or not.
  static bool knows(const Keyframe& key);
  /// About 10 kB of memory for an image.
  /// \throws InputError for descriptors of another size than the sightings say or than those before
  void add(const Keyframe& key);
  std::size_t size() const;

  /// Keyframes that look alike, the most alike first: by votes of descriptors, rare ones count
  /// more; scans by their ranges, other clouds are like none. Without those of the same submap.
  /// \param n         at most
  /// \param excluded  ids of submaps that are left out too, such as its neighbours
  std::vector<std::int64_t> candidates(const Keyframe& key, std::size_t n,
                                       const std::vector<std::int64_t>& excluded = {}) const;

  /// The links from a new keyframe to those that look most like it and show the same place. A cloud
  /// without an image is also registered to the two submaps of its component that are nearest.
  /// \param data      with all keyframes that were added, and their submaps
  /// \param excluded  as candidates()
  /// \param most      keyframes that are checked
  std::vector<Link> links(const Keyframe& key, const AtlasData& data,
                          const std::vector<std::int64_t>& excluded = {},
                          std::size_t most = 4) const;

  /// The link from the submap of \p a to that of \p b, if both see the same place: features that
  /// agree with one motion, depths that agree both ways. Id 0, LinkKind::Loop.
  static std::optional<Link> verify(const Keyframe& a, const Keyframe& b);

 private:
  class Index;
  std::unique_ptr<Index> index_;
  std::unique_ptr<detail::CloudPlaces> clouds_;
};

}  // namespace planar_mapping
