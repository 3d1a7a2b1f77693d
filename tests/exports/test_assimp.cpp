// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// glTF, OBJ, PLY and STL, read by assimp.
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <functional>

#include "evaluation/metrics/cuboid_geometry.h"
#include "export_scene.h"

namespace planar_mapping {
namespace {

using Meshes = std::map<std::string, std::vector<test::Triangle>>;

/// Triangles by the name of their mesh, or of their node where meshes have none.
Meshes meshesOf(const aiScene& scene) {
  Meshes meshes;
  const std::function<void(const aiNode&, const aiMatrix4x4&)> visit =
      [&](const aiNode& node, const aiMatrix4x4& above) {
        const aiMatrix4x4 turn = above * node.mTransformation;
        for (unsigned m = 0; m < node.mNumMeshes; ++m) {
          const aiMesh& mesh = *scene.mMeshes[node.mMeshes[m]];
          std::vector<test::Triangle>& triangles = meshes[mesh.mName.C_Str()];
          for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
            EXPECT_EQ(mesh.mFaces[f].mNumIndices, 3u);
            test::Triangle triangle;
            for (unsigned k = 0; k < 3; ++k) {
              const aiVector3D p = turn * mesh.mVertices[mesh.mFaces[f].mIndices[k]];
              triangle[k] = Vector3(p.x, p.y, p.z);
            }
            triangles.push_back(triangle);
          }
        }
        for (unsigned c = 0; c < node.mNumChildren; ++c) visit(*node.mChildren[c], turn);
      };
  visit(*scene.mRootNode, aiMatrix4x4());
  return meshes;
}

const aiScene& read(Assimp::Importer& importer, const std::string& path) {
  const aiScene* scene = importer.ReadFile(path, 0);
  if (scene == nullptr) throw std::runtime_error(importer.GetErrorString());
  return *scene;
}

void expectGroups(const Meshes& meshes, const std::vector<Cuboid>& cuboids) {
  const auto groups = test::groupsOf(cuboids);
  ASSERT_EQ(meshes.size(), groups.size());
  for (const auto& [name, members] : groups) {
    ASSERT_EQ(meshes.count(name), 1u) << name;
    test::expectTrianglesOf(members, meshes.at(name), 2e-5);
  }
}

/// The colours of materials by their names.
std::map<std::string, aiColor4D> colours(const aiScene& scene) {
  std::map<std::string, aiColor4D> colours;
  for (unsigned i = 0; i < scene.mNumMaterials; ++i) {
    aiString name;
    aiColor4D colour;
    scene.mMaterials[i]->Get(AI_MATKEY_NAME, name);
    scene.mMaterials[i]->Get(AI_MATKEY_COLOR_DIFFUSE, colour);
    colours[name.C_Str()] = colour;
  }
  return colours;
}

TEST(Glb, IsReadByAssimpWithYUp) {
  const io::ExportedMap map = test::manyExported();
  const test::Exported file(io::writeGlb, map, "m.glb");
  Assimp::Importer importer;
  const aiScene& scene = read(importer, file.path());
  std::vector<Cuboid> turned;  // x stays, z becomes y, y becomes -z
  Pose turn = Pose::Identity();
  turn.linear() << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  for (const Cuboid& cuboid : map.cuboids) turned.push_back(test::transformed(cuboid, turn));
  expectGroups(meshesOf(scene), turned);
  const auto colour = colours(scene);
  EXPECT_NE(colour.at("plane_1"), colour.at("plane_2"));
  EXPECT_LT(colour.at("unknown").a, 0.5f);
  EXPECT_EQ(colour.at("plane_1").a, 1.0f);
}

TEST(Glb, RootNodeSaysTheOrigin) {
  const io::ExportedMap map = test::manyExported(10);
  const test::Exported file(io::writeGlb, map, "m.glb");
  Assimp::Importer importer;
  const aiMetadata* extras = nullptr;
  for (const aiNode* node = read(importer, file.path()).mRootNode; node != nullptr;
       node = node->mNumChildren > 0 ? node->mChildren[0] : nullptr) {
    if (node->mMetaData != nullptr && node->mMetaData->HasKey("origin_m")) extras = node->mMetaData;
  }
  ASSERT_NE(extras, nullptr);
}

TEST(Glb, MapOfACameraStandsUpright) {
  io::ExportedMap map;
  Cuboid high;
  high.center = {1.0, -2.0, 3.0};  // right, up, forward
  high.size = {0.1, 0.2, 0.3};
  map.cuboids = {high};
  map.up = -Vector3::UnitY();
  const test::Exported file(io::writeGlb, map, "m.glb");
  Assimp::Importer importer;
  Vector3 middle = Vector3::Zero();
  for (const test::Triangle& t : meshesOf(read(importer, file.path())).at("no_plane"))
    middle += (t[0] + t[1] + t[2]) / 36.0;
  EXPECT_LT((middle - Vector3(1.0, 2.0, -3.0)).norm(), 0.3) << middle.transpose();
}

TEST(Glb, KeepsMillimetresFarFromTheOrigin) {
  io::ExportedMap map;
  map.cuboids = test::manyCuboids(100);
  for (Cuboid& cuboid : map.cuboids) cuboid.center += Vector3(4e5, 5e6, 100.0);
  const test::Exported file(io::writeGlb, map, "m.glb");
  Assimp::Importer importer;
  const aiScene& scene = read(importer, file.path());
  // The mesh is near its own origin; its node carries the place.
  for (unsigned m = 0; m < scene.mNumMeshes; ++m)
    EXPECT_LT(scene.mMeshes[m]->mVertices[0].Length(), 50.0f);
  EXPECT_NEAR(scene.mRootNode->mChildren[0]->mTransformation.a4, 4e5, 5.0);
}

TEST(Obj, IsReadByAssimpWithItsMaterials) {
  const io::ExportedMap map = test::manyExported();
  const test::Exported file(io::writeObj, map, "m.obj");
  Assimp::Importer importer;
  const aiScene& scene = read(importer, file.path());
  expectGroups(meshesOf(scene), map.cuboids);
  const auto colour = colours(scene);
  EXPECT_EQ(colour.count("plane_1") + colour.count("no_plane") + colour.count("unknown"), 3u);
  EXPECT_NE(colour.at("plane_1"), colour.at("plane_2"));
}

TEST(PlyAndStl, AreReadByAssimp) {
  const io::ExportedMap map = test::manyExported();
  const test::Exported ply(io::writePly, map, "m.ply"), stl(io::writeStl, map, "m.stl");
  for (const test::Exported* file : {&ply, &stl}) {
    Assimp::Importer importer;
    const aiScene& scene = read(importer, file->path());
    ASSERT_EQ(scene.mNumMeshes, 1u);
    EXPECT_TRUE(file == &stl || scene.mMeshes[0]->HasVertexColors(0));
    test::expectTrianglesOf(map.cuboids, meshesOf(scene).begin()->second, 2e-5);
  }
}

}  // namespace
}  // namespace planar_mapping
