// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// OctoMap: .bt (free or occupied) and .ot (log-odds).
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/export/exported_map.h"

#ifndef PLANAR_MAPPING_HAS_OCTOMAP

namespace planar_mapping::io {

Contents writeOctree(const ExportedMap&, const std::string& path) {
  throw ParameterError("'" + path +
                       "' needs OctoMap, which this program was built without (liboctomap-dev)");
}

}  // namespace planar_mapping::io

#else

#include <octomap/OcTree.h>

#include <algorithm>
#include <locale>
#include <sstream>

#include "planar_mapping/geometry/oriented_box.h"
#include "planar_mapping/io/text_lines.h"

namespace planar_mapping::io {
namespace {

constexpr std::size_t kMaxNodes = 10'000'000;  ///< about 0.5 GB while it is built
constexpr int kDepth = 16;                     ///< of OctoMap's trees
constexpr double kRoot = 32768.0;              ///< half side of the root, cells

struct TooManyNodes {};

/// A tree made from its root downwards: a cube that nothing meets is never opened, one that is all
/// free or all occupied neither.
class Builder : public octomap::OcTree {
 public:
  explicit Builder(const ExportedMap& map) : OcTree(map.cell()), map_(map) {
    const double half = kRoot * map.cell();
    for (const std::vector<Cuboid>* list : {&map.cuboids, &map.free}) {
      for (const Cuboid& cuboid : *list) requireWithin(cuboid, half);
    }
    for (const Cuboid& cuboid : map.cuboids) boxes_.emplace_back(cuboid);
    if (map.cuboids.empty() && map.free.empty()) return;
    for (std::size_t i = 0; i < map.cuboids.size(); ++i) cuboids_.push_back(index(i));
    for (std::size_t i = 0; i < map.free.size(); ++i) free_.push_back(index(i));
    root = new octomap::OcTreeNode();
    tree_size = 1;
    size_changed = true;
    fill(root, {Vector3::Zero(), half, 0}, {0, cuboids_.size()}, {0, free_.size()});
    if (isEmpty(root)) clear();  // read back, a root alone would be one huge occupied cell
  }

  /// What OctoMap's own writers make, but silently and with all digits of the resolution.
  std::string bytes(bool binary) {
    std::ostringstream out;
    out.imbue(std::locale::classic());
    if (binary) toMaxLikelihood();
    if (binary) prune();
    out << (binary ? binaryFileHeader : fileHeader) << "\n# (feel free to add / change comments, "
        << "but leave the first line as it is!)\n#\n"
        << originNote(map_, "# ", "\n") << "id OcTree\nsize " << size() << "\nres "
        << concatenated(map_.cell()) << "\ndata\n";
    if (root != nullptr) binary ? writeBinaryData(out) : writeData(out);
    if (!out) throw Error("OctoMap cannot write this tree");
    return out.str();
  }

 private:
  struct Cube {
    Vector3 center;
    double half;  ///< of its side
    int depth;
  };
  /// A part of cuboids_ or free_.
  struct Range {
    std::size_t begin, end;
    bool empty() const { return begin == end; }
  };

  static std::uint32_t index(std::size_t i) { return static_cast<std::uint32_t>(i); }

  static void requireWithin(const Cuboid& cuboid, double half) {
    for (const Vector3& corner : corners(cuboid)) {
      if (corner.cwiseAbs().maxCoeff() < half) continue;
      throw ParameterError("the map reaches " + std::to_string(corner.cwiseAbs().maxCoeff()) +
                           " m from its origin; with this cell an octree ends at " +
                           std::to_string(half) + " m: take a larger cell");
    }
  }

  /// Makes the children of a cube that is neither all alike nor unknown. What meets a child is put
  /// at the ends of the lists while it is worked on.
  void fill(octomap::OcTreeNode* node, const Cube& cube, const Range& cuboids, const Range& free) {
    const double half = 0.5 * cube.half;
    for (unsigned k = 0; k < 8; ++k) {
      const Vector3 side(k & 1u ? half : -half, k & 2u ? half : -half, k & 4u ? half : -half);
      fillChild(node, k, {cube.center + side, half, cube.depth + 1}, cuboids, free);
    }
    if (nodeHasChildren(node) && !pruneNode(node)) node->updateOccupancyChildren();
  }

  void fillChild(octomap::OcTreeNode* parent, unsigned k, const Cube& cube, const Range& cuboids,
                 const Range& free) {
    // Cuboids that only touch a cell do not fill it.
    const Vector3 sides = Vector3::Constant(cube.half * (1.0 - 1e-6));
    const bool is_cell = cube.depth == kDepth;
    Range met{cuboids_.size(), cuboids_.size()}, over{free_.size(), free_.size()};
    float belief = 0.0f, whole = -1.0f;  // of all that meet it, of those that contain it
    for (std::size_t at = cuboids.begin; at < cuboids.end; ++at) {
      const std::uint32_t i = cuboids_[at];
      if (!boxes_[i].meets(cube.center, sides)) continue;
      cuboids_.push_back(i);
      belief = std::max(belief, map_.cuboids[i].probability);
      if (!is_cell && boxes_[i].contains(cube.center, sides))
        whole = std::max(whole, map_.cuboids[i].probability);
    }
    met.end = cuboids_.size();
    if (!met.empty() && (is_cell || whole == belief)) {
      addChild(parent, k)->setLogOdds(logOddsOf(belief));
    } else {
      double volume = 0.0;  // of free space; its boxes do not overlap
      for (std::size_t at = free.begin; at < free.end; ++at) {
        const Cuboid& box = map_.free[free_[at]];
        const Vector3 low = (box.center - 0.5 * box.size).cwiseMax(cube.center - sides);
        const Vector3 high = (box.center + 0.5 * box.size).cwiseMin(cube.center + sides);
        if ((low.array() >= high.array()).any()) continue;
        free_.push_back(free_[at]);
        volume += (high - low).prod();
      }
      over.end = free_.size();
      if (met.empty() && volume > (1.0 - 1e-6) * 8.0 * sides.prod()) {
        addChild(parent, k)->setLogOdds(clamping_thres_min);
      } else if (!is_cell && !(met.empty() && over.empty())) {
        octomap::OcTreeNode* child = addChild(parent, k);
        fill(child, cube, met, over);
        if (isEmpty(child)) deleteNodeChild(parent, k);
      }
    }
    cuboids_.resize(met.begin);
    free_.resize(over.begin);
  }

  /// Did nothing in the cube of an opened node turn out to be known? A pruned one has its value.
  bool isEmpty(octomap::OcTreeNode* node) {
    if (nodeHasChildren(node) || node->getLogOdds() != 0.0f) return false;
    expandNode(node);  // OctoMap gives the list of children back when it prunes, and only then
    return pruneNode(node);
  }

  octomap::OcTreeNode* addChild(octomap::OcTreeNode* parent, unsigned k) {
    if (tree_size >= kMaxNodes) throw TooManyNodes();
    return createNodeChild(parent, k);
  }

  /// As far as OctoMap lets beliefs go; what is a cuboid stays occupied.
  float logOddsOf(float probability) const {
    constexpr double kMinOccupied = 0.5001, kMax = 0.999;
    const double p = std::clamp<double>(probability, kMinOccupied, kMax);
    return std::min(octomap::logodds(p), clamping_thres_max);
  }

  const ExportedMap& map_;
  std::vector<detail::OrientedBox> boxes_;  ///< of its cuboids
  std::vector<std::uint32_t> cuboids_, free_;
};

}  // namespace

Contents writeOctree(const ExportedMap& map, const std::string& path) {
  try {
    return {Builder(map).bytes(path.substr(path.size() - 3) == ".bt")};
  } catch (const TooManyNodes&) {
    throw ParameterError(concatenated("cells of ", map.cell(),
                                      " m make an octree of more than 10 million nodes; ",
                                      "take larger ones, such as --cell ", 2.0 * map.cell()));
  }
}

}  // namespace planar_mapping::io

#endif
