// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/geometry/plane.h"
#include "planar_mapping/planes/surface_leaves.h"

namespace planar_mapping::detail {

/// A plane cuts a leaf through its middle if it passes its centre within this fraction of the side.
constexpr double kMiddle = 0.35;
/// Fraction of the leaves around one that have to go on its surface for it to vote.
constexpr double kMinCompany = 0.25;

/// Calls visit(leaf) for the leaves around \p leaf the plane runs through the middle of.
/// \return false where it runs through the middle of no cell around, but along the sides of two
template <typename Visit>
bool forEachNeighbour(const SurfaceLeaves& surface, const SurfaceLeaf& leaf, const Plane& plane,
                      Visit visit) {
  const double leaf_side = surface.sideOf(leaf);
  const Vector3 step = leaf_side * plane.normal;
  const double here = plane.signedDistance(surface.centreOf(leaf));
  bool any = false;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (dx == 0 && dy == 0 && dz == 0) continue;
        const double distance = here + dx * step[0] + dy * step[1] + dz * step[2];
        if (std::abs(distance) > kMiddle * leaf_side) continue;
        any = true;
        const std::int32_t other =
            surface.find(leaf.level, {leaf.key.x + dx, leaf.key.y + dy, leaf.key.z + dz});
        if (other >= 0) visit(surface.nearerTwin(other, plane));
      }
    }
  }
  return any;
}

/// Whether the surface goes on around the leaf: clutter that looks flat by chance stands alone.
inline bool hasCompany(const SurfaceLeaves& surface, const SurfaceLeaf& leaf, double cosine) {
  const Plane plane{leaf.normal, -leaf.normal.dot(leaf.mean)};
  int agree = 0, oppose = 0;
  forEachNeighbour(surface, leaf, plane, [&](std::int32_t other) {
    const SurfaceLeaf& neighbour = surface.leaves[static_cast<std::size_t>(other)];
    const bool agrees = neighbour.planar &&
                        std::abs(neighbour.normal.dot(plane.normal)) >= cosine &&
                        std::abs(plane.signedDistance(neighbour.mean)) <= neighbour.band;
    ++(agrees ? agree : oppose);
  });
  return agree >= kMinCompany * (agree + oppose);
}

/// Leaves as columns: mean, unit normal, half width of the band and weight.
struct LeafColumns {
  const float *x, *y, *z, *nx, *ny, *nz, *band;
  const std::int32_t* weight;
  std::size_t n;
};

/// The leaves that no plane has yet, as columns about a common origin.
class Voters {
 public:
  Voters(const SurfaceLeaves& surface, const Vector3& origin, double cosine) : origin_(origin) {
    for (std::size_t i = 0; i < surface.leaves.size(); ++i) {
      const SurfaceLeaf& leaf = surface.leaves[i];
      if (!leaf.planar || !hasCompany(surface, leaf, cosine)) continue;
      name_.push_back(static_cast<std::int32_t>(i));
      const Vector3 p = leaf.mean - origin;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        columns_[axis].push_back(static_cast<float>(p[static_cast<Eigen::Index>(axis)]));
        columns_[3 + axis].push_back(
            static_cast<float>(leaf.normal[static_cast<Eigen::Index>(axis)]));
      }
      columns_[6].push_back(static_cast<float>(leaf.band));
      weight_.push_back(static_cast<std::int32_t>(std::min(leaf.sums.n, 32768.0)));
    }
  }
  std::size_t size() const { return name_.size(); }
  std::int32_t name(std::size_t i) const { return name_[i]; }

  LeafColumns columns() const {
    const auto& c = columns_;
    return {c[0].data(), c[1].data(), c[2].data(),    c[3].data(), c[4].data(),
            c[5].data(), c[6].data(), weight_.data(), size()};
  }
  /// Votes for \p plane, numbers of voters, among those at most \p reach from \p middle.
  void agreeing(const Plane& plane, const Vector3& middle, double reach, double cosine,
                std::vector<std::int32_t>& voters) const {
    voters.clear();
    const Vector3 m = middle - origin_;
    const double d = plane.signedDistance(origin_);
    const Vector3& n = plane.normal;
    const LeafColumns l = columns();
    for (std::size_t i = 0; i < size(); ++i) {
      const double x = l.x[i], y = l.y[i], z = l.z[i];
      if (std::abs(n[0] * x + n[1] * y + n[2] * z + d) > l.band[i]) continue;
      if (std::abs(n[0] * l.nx[i] + n[1] * l.ny[i] + n[2] * l.nz[i]) < cosine) continue;
      const double dx = x - m[0], dy = y - m[1], dz = z - m[2];
      if (dx * dx + dy * dy + dz * dz > reach * reach) continue;
      voters.push_back(static_cast<std::int32_t>(i));
    }
  }
  std::int64_t weightOf(const std::vector<std::int32_t>& voters) const {
    std::int64_t weight = 0;
    for (const std::int32_t i : voters) weight += weight_[static_cast<std::size_t>(i)];
    return weight;
  }
  /// Keeps the voters with keep[i] != 0.
  void select(const std::vector<char>& keep) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size(); ++i) {
      if (keep[i] == 0) continue;
      for (std::vector<float>& column : columns_) column[kept] = column[i];
      weight_[kept] = weight_[i];
      name_[kept++] = name_[i];
    }
    for (std::vector<float>& column : columns_) column.resize(kept);
    weight_.resize(kept);
    name_.resize(kept);
  }
  /// A random part of them whose weights stand for all.
  Voters sample(std::size_t wanted, Random& random) const {
    Voters part = *this;
    std::vector<char> keep(size(), 0);
    std::size_t missing = wanted;
    for (std::size_t i = 0; i < size(); ++i) {
      if (random.below(static_cast<std::uint32_t>(size() - i)) >= missing) continue;
      keep[i] = 1;
      --missing;
    }
    part.select(keep);
    const double scale = static_cast<double>(size()) / static_cast<double>(wanted);
    for (std::int32_t& weight : part.weight_) {
      weight = static_cast<std::int32_t>(std::min(weight * scale, 32768.0));
    }
    return part;
  }

 private:
  Vector3 origin_;
  std::vector<std::int32_t> name_;
  std::array<std::vector<float>, 7> columns_;  ///< x, y, z, nx, ny, nz, band
  std::vector<std::int32_t> weight_;
};

}  // namespace planar_mapping::detail
