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

/// Recognises places: an index over keyframes by their descriptors, and the check of two of them.
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
  /// About 10 kB of memory.
  /// \throws InputError for descriptors of another size than the sightings say or than those before
  void add(const Keyframe& key);
  std::size_t size() const;

  /// Keyframes that look alike, the most alike first: by votes of descriptors, rare ones count
  /// more. Those of the same submap and of \p excluded ones are left out.
  /// \param n         at most
  /// \param excluded  ids of submaps, such as its neighbours
  std::vector<std::int64_t> candidates(const Keyframe& key, std::size_t n,
                                       const std::vector<std::int64_t>& excluded = {}) const;

  /// The links from a new keyframe to the four that look most like it and show the same place.
  /// \param known     by id, with all that were added
  /// \param excluded  as candidates()
  std::vector<Link> links(const Keyframe& key, const std::vector<Keyframe>& known,
                          const std::vector<std::int64_t>& excluded = {}) const;

  /// The link from the submap of \p a to that of \p b, if both see the same place: features that
  /// agree with one motion, depths that agree both ways. Id 0, LinkKind::Loop.
  static std::optional<Link> verify(const Keyframe& a, const Keyframe& b);

 private:
  class Index;
  std::unique_ptr<Index> index_;
};

}  // namespace planar_mapping
