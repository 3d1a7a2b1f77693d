// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/baselines/octree_grid.h"

#include "planar_mapping/base/error.h"

#ifdef PLANAR_MAPPING_HAS_OCTOMAP
#include <malloc.h>
#include <octomap/OcTree.h>
#include <zstd.h>

#include <algorithm>
#include <locale>
#include <new>
#include <sstream>
#include <unordered_map>
#endif

namespace planar_mapping::evaluation {

namespace {

#ifdef PLANAR_MAPPING_HAS_OCTOMAP

/// Size of the heap block that an allocation of so many bytes gets, its header included.
std::size_t blockBytes(std::size_t bytes) {
  void* block = ::operator new(bytes);
  const std::size_t size = malloc_usable_size(block) + sizeof(std::size_t);
  ::operator delete(block);
  return size;
}

std::size_t innerNodes(const octomap::OcTree& tree) {
  return tree.size() - tree.getNumLeafNodes();
}

octomap::point3d toOctomap(const Vector3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

/// Bytes before the data of a file. Not written for real: the library prints when it has done so.
std::size_t headerBytes(const octomap::OcTree& tree, const char* title) {
  std::ostringstream header;
  header.imbue(std::locale::classic());
  header << title << "\n"
         << "# (feel free to add / change comments, but leave the first line as it is!)\n#\n"
         << "id " << tree.getTreeType() << "\nsize " << tree.size() << "\nres "
         << tree.getResolution() << "\ndata\n";
  return header.str().size();
}

/// Cells in which rays end, with the number of obstacle points in them.
using RayEnds = std::unordered_map<octomap::OcTreeKey, int, octomap::OcTreeKey::KeyHash>;

/// The tree has OctoMap's own parameters.
class OctomapGrid : public OctreeGrid {
 public:
  OctomapGrid(double s, int min_points) : tree_(s), min_points_(min_points) {}

  void insert(const std::vector<Vector3>& obstacles, const std::vector<Vector3>& ground,
              const Vector3& origin) override {
    octomap::OcTreeKey key;
    if (!origin.allFinite() || !tree_.coordToKeyChecked(toOctomap(origin), key))
      throw InputError("the sensor is outside the octree");
    RayEnds ends;
    add(obstacles, true, ends);
    add(ground, false, ends);
    const octomap::point3d start = toOctomap(origin);
    octomap::KeySet hit;
    octomap::KeySet crossed;
    octomap::KeyRay ray;
    for (const auto& [end, points] : ends) {
      if (points >= min_points_) hit.insert(end);
      if (tree_.computeRayKeys(start, tree_.keyToCoord(end), ray))
        crossed.insert(ray.begin(), ray.end());
    }
    for (const octomap::OcTreeKey& cell : crossed)
      if (hit.find(cell) == hit.end()) tree_.updateNode(cell, false);
    for (const octomap::OcTreeKey& cell : hit) tree_.updateNode(cell, true);
  }

  void finish() override {
    tree_.toMaxLikelihood();
    tree_.prune();
  }

  Counts counts() const override {
    Counts counts;
    for (auto it = tree_.begin_leafs(); it != tree_.end_leafs(); ++it) {
      const bool occupied = tree_.isNodeOccupied(*it);
      ++(occupied ? counts.occupied_leaves : counts.free_leaves);
      (occupied ? counts.occupied_cells : counts.free_cells) +=
          std::size_t{1} << (3 * (tree_.getTreeDepth() - it.getDepth()));
    }
    counts.nodes = tree_.size();
    counts.dropped_points = dropped_;
    return counts;
  }

  std::vector<Cuboid> cuboids() const override {
    std::vector<Cuboid> cuboids;
    const double s = tree_.getResolution();
    for (auto it = tree_.begin_leafs(); it != tree_.end_leafs(); ++it) {
      if (!tree_.isNodeOccupied(*it)) continue;
      const unsigned level = tree_.getTreeDepth() - it.getDepth();
      const octomap::OcTreeKey key = it.getKey();
      const double cells = static_cast<double>(std::size_t{1} << level);
      Cuboid cuboid;  // from the key, for getX() is a float
      for (int axis = 0; axis < 3; ++axis) {
        const int low = (static_cast<int>(key[static_cast<unsigned>(axis)]) >> level) << level;
        cuboid.center[axis] = s * (low - 32768 + 0.5 * cells);
      }
      cuboid.size = Vector3::Constant(s * cells);
      cuboid.probability = static_cast<float>(it->getOccupancy());
      cuboids.push_back(cuboid);
    }
    std::sort(cuboids.begin(), cuboids.end(), [](const Cuboid& a, const Cuboid& b) {
      for (const int axis : {2, 1, 0})
        if (a.center[axis] != b.center[axis]) return a.center[axis] < b.center[axis];
      return false;
    });
    return cuboids;
  }

  std::size_t heapBytes() const override {
    return sizeof(octomap::OcTree) + tree_.size() * blockBytes(sizeof(octomap::OcTreeNode)) +
           innerNodes(tree_) * blockBytes(8 * sizeof(octomap::OcTreeNode*));
  }

  std::size_t fileBytes() const override {
    const octomap::OcTree tree = finished();
    return headerBytes(tree, "# Octomap OcTree binary file") + 2 * innerNodes(tree);
  }

  std::size_t compressedFileBytes() const override {
    constexpr int kLevel = 19;
    const octomap::OcTree tree = finished();
    std::ostringstream stream;
    tree.writeBinaryData(stream);
    const std::string data = stream.str();
    std::string packed(ZSTD_compressBound(data.size()), 0);
    const std::size_t size =
        ZSTD_compress(packed.data(), packed.size(), data.data(), data.size(), kLevel);
    if (ZSTD_isError(size) != 0) throw Error("the octree cannot be compressed");
    return headerBytes(tree, "# Octomap OcTree binary file") + size;
  }

  bool isFree(const Vector3& point) const override {
    octomap::OcTreeKey key;
    if (!point.allFinite() || !tree_.coordToKeyChecked(toOctomap(point), key)) return false;
    const octomap::OcTreeNode* node = tree_.search(key);
    return node != nullptr && !tree_.isNodeOccupied(*node);
  }

  std::size_t otBytes() const override {
    constexpr std::size_t kNode = sizeof(float) + 1;  // the log-odds and which children there are
    return headerBytes(tree_, "# Octomap OcTree file") + kNode * tree_.size();
  }

 private:
  octomap::OcTree finished() const {
    octomap::OcTree tree(tree_);
    tree.toMaxLikelihood();
    tree.prune();
    return tree;
  }
  /// Takes note of the cells the points are in.
  void add(const std::vector<Vector3>& points, bool obstacles, RayEnds& ends) {
    for (const Vector3& point : points) {
      octomap::OcTreeKey key;
      if (!point.allFinite() || !tree_.coordToKeyChecked(toOctomap(point), key)) {
        ++dropped_;
        continue;
      }
      int& count = ends[key];
      if (obstacles) ++count;
    }
  }

  octomap::OcTree tree_;
  int min_points_;
  std::size_t dropped_ = 0;
};

#endif

}  // namespace

std::unique_ptr<OctreeGrid> makeOctreeGrid(double s, int min_points) {
  requirePositive("s", s, "m");
  requireInRange("min_points", min_points, 1, 1e9);
#ifdef PLANAR_MAPPING_HAS_OCTOMAP
  return std::make_unique<OctomapGrid>(s, min_points);
#else
  return nullptr;
#endif
}

}  // namespace planar_mapping::evaluation
