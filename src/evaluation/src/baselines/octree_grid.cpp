// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/evaluation/octree_grid.h"

#include "planar_mapping/core/base/error.h"

#ifdef PLANAR_MAPPING_HAS_OCTOMAP
#include <malloc.h>
#include <octomap/OcTree.h>
#include <zstd.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <sstream>
#include <unordered_map>
#endif

namespace planar_mapping {
namespace evaluation {

void OctreeGridParams::validate() const {
  requirePositive("resolution", resolution, "m");
  requireInRange("max_range", max_range, -1e9, 1e9, "m");
  requireInRange("min_points", min_points, 1, 1e9);
  requireInRange("hit", hit, 0.5, 1.0);
  requireInRange("miss", miss, 0.0, 0.5);
  requireInRange("clamping_min", clamping_min, 0.0, 0.5);
  requireInRange("clamping_max", clamping_max, 0.5, 1.0);
  requireInRange("occupied_at_least", occupied_at_least, 0.0, 1.0);
}

#ifdef PLANAR_MAPPING_HAS_OCTOMAP

namespace {

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
  header << title << "\n"
         << "# (feel free to add / change comments, but leave the first line as it is!)\n#\n"
         << "id " << tree.getTreeType() << "\nsize " << tree.size() << "\nres "
         << tree.getResolution() << "\ndata\n";
  return header.str().size();
}

/// Cells in which rays end, with the number of obstacle points in them.
using RayEnds = std::unordered_map<octomap::OcTreeKey, int, octomap::OcTreeKey::KeyHash>;

}  // namespace

struct OctreeGrid::Impl {
  explicit Impl(const OctreeGridParams& p) : params(p), tree(p.resolution) {
    tree.setProbHit(p.hit);
    tree.setProbMiss(p.miss);
    tree.setClampingThresMin(p.clamping_min);
    tree.setClampingThresMax(p.clamping_max);
    tree.setOccupancyThres(p.occupied_at_least);
  }

  void add(const std::vector<Vector3>& points, bool obstacles, const Vector3& origin,
           RayEnds& ends) {
    for (const Vector3& point : points) {
      const double range = (point - origin).norm();
      const bool is_far = params.max_range >= 0.0 && range > params.max_range;
      const Vector3 end = is_far ? origin + (point - origin) * (params.max_range / range) : point;
      octomap::OcTreeKey key;
      if (!end.allFinite() || !tree.coordToKeyChecked(toOctomap(end), key)) {
        ++dropped;
        continue;
      }
      int& count = ends[key];
      if (obstacles && !is_far) ++count;
    }
  }

  OctreeGridParams params;
  octomap::OcTree tree;
  std::size_t dropped = 0;
};

bool OctreeGrid::isAvailable() {
  return true;
}

OctreeGrid::OctreeGrid(const OctreeGridParams& params) {
  params.validate();
  impl_ = std::make_unique<Impl>(params);
}

OctreeGrid::~OctreeGrid() = default;
OctreeGrid::OctreeGrid(OctreeGrid&& other) noexcept = default;
OctreeGrid& OctreeGrid::operator=(OctreeGrid&& other) noexcept = default;

void OctreeGrid::insert(const std::vector<Vector3>& obstacles, const std::vector<Vector3>& ground,
                        const Vector3& origin) {
  octomap::OcTree& tree = impl_->tree;
  octomap::OcTreeKey key;
  if (!origin.allFinite() || !tree.coordToKeyChecked(toOctomap(origin), key))
    throw InputError("the sensor is outside the octree");
  RayEnds ends;
  impl_->add(obstacles, true, origin, ends);
  impl_->add(ground, false, origin, ends);
  const octomap::point3d start = toOctomap(origin);
  octomap::KeySet hit;
  octomap::KeySet crossed;
  octomap::KeyRay ray;
  for (const auto& [end, points] : ends) {
    if (points >= impl_->params.min_points) hit.insert(end);
    if (tree.computeRayKeys(start, tree.keyToCoord(end), ray))
      crossed.insert(ray.begin(), ray.end());
  }
  for (const octomap::OcTreeKey& cell : crossed)
    if (hit.find(cell) == hit.end()) tree.updateNode(cell, false);
  for (const octomap::OcTreeKey& cell : hit) tree.updateNode(cell, true);
}

void OctreeGrid::finish() {
  impl_->tree.toMaxLikelihood();
  impl_->tree.prune();
}

OctreeGrid::Counts OctreeGrid::counts() const {
  const octomap::OcTree& tree = impl_->tree;
  Counts counts;
  for (auto it = tree.begin_leafs(); it != tree.end_leafs(); ++it) {
    const bool occupied = tree.isNodeOccupied(*it);
    ++(occupied ? counts.occupied_leaves : counts.free_leaves);
    (occupied ? counts.occupied_cells : counts.free_cells) +=
        std::size_t{1} << (3 * (tree.getTreeDepth() - it.getDepth()));
  }
  counts.nodes = tree.size();
  counts.dropped_points = impl_->dropped;
  return counts;
}

std::vector<Cuboid> OctreeGrid::cuboids() const {
  const octomap::OcTree& tree = impl_->tree;
  std::vector<Cuboid> cuboids;
  const double s = impl_->params.resolution;
  for (auto it = tree.begin_leafs(); it != tree.end_leafs(); ++it) {
    if (!tree.isNodeOccupied(*it)) continue;
    const unsigned level = tree.getTreeDepth() - it.getDepth();
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

std::size_t OctreeGrid::reportedBytes() const {
  return impl_->tree.memoryUsage();
}

std::size_t OctreeGrid::heapBytes() const {
  const octomap::OcTree& tree = impl_->tree;
  return sizeof(octomap::OcTree) + tree.size() * blockBytes(sizeof(octomap::OcTreeNode)) +
         innerNodes(tree) * blockBytes(8 * sizeof(octomap::OcTreeNode*));
}

std::size_t OctreeGrid::fileBytes() const {
  octomap::OcTree tree(impl_->tree);
  tree.toMaxLikelihood();
  tree.prune();
  return headerBytes(tree, "# Octomap OcTree binary file") + 2 * innerNodes(tree);
}

std::size_t OctreeGrid::compressedFileBytes() const {
  constexpr int kLevel = 19;
  octomap::OcTree tree(impl_->tree);
  tree.toMaxLikelihood();
  tree.prune();
  std::ostringstream stream;
  tree.writeBinaryData(stream);
  const std::string data = stream.str();
  std::string packed(ZSTD_compressBound(data.size()), 0);
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), data.data(), data.size(), kLevel);
  if (ZSTD_isError(size) != 0) throw Error("the octree cannot be compressed");
  return headerBytes(tree, "# Octomap OcTree binary file") + size;
}

bool OctreeGrid::isFree(const Vector3& point) const {
  octomap::OcTreeKey key;
  if (!point.allFinite() || !impl_->tree.coordToKeyChecked(toOctomap(point), key)) return false;
  const octomap::OcTreeNode* node = impl_->tree.search(key);
  return node != nullptr && !impl_->tree.isNodeOccupied(*node);
}

std::size_t OctreeGrid::otBytes() const {
  constexpr std::size_t kNode = sizeof(float) + 1;  // the log-odds and which children there are
  return headerBytes(impl_->tree, "# Octomap OcTree file") + kNode * impl_->tree.size();
}

#else

struct OctreeGrid::Impl {};

bool OctreeGrid::isAvailable() {
  return false;
}
OctreeGrid::OctreeGrid(const OctreeGridParams&) {
  throw Error("built without OctoMap (install liboctomap-dev and build again)");
}
OctreeGrid::~OctreeGrid() = default;
OctreeGrid::OctreeGrid(OctreeGrid&& other) noexcept = default;
OctreeGrid& OctreeGrid::operator=(OctreeGrid&& other) noexcept = default;
void OctreeGrid::insert(const std::vector<Vector3>&, const std::vector<Vector3>&, const Vector3&) {}
void OctreeGrid::finish() {}
OctreeGrid::Counts OctreeGrid::counts() const {
  return {};
}
std::vector<Cuboid> OctreeGrid::cuboids() const {
  return {};
}
std::size_t OctreeGrid::reportedBytes() const {
  return 0;
}
std::size_t OctreeGrid::heapBytes() const {
  return 0;
}
std::size_t OctreeGrid::fileBytes() const {
  return 0;
}
std::size_t OctreeGrid::compressedFileBytes() const {
  return 0;
}
bool OctreeGrid::isFree(const Vector3&) const {
  return false;
}
std::size_t OctreeGrid::otBytes() const {
  return 0;
}

#endif

}  // namespace evaluation
}  // namespace planar_mapping
