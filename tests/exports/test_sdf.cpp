// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// SDFormat and model folders, read by Gazebo's own library.
#include <sdf/sdf.hh>

#include "export_scene.h"

namespace planar_mapping {
namespace {

template <typename Element>
void expectBox(const Element& element, const Cuboid& cuboid) {
  ASSERT_EQ(element.Geom()->Type(), sdf::GeometryType::BOX);
  const auto size = element.Geom()->BoxShape()->Size();
  ASSERT_EQ(Vector3(size.X(), size.Y(), size.Z()), cuboid.size);
  const auto& pose = element.RawPose();
  ASSERT_EQ(Vector3(pose.Pos().X(), pose.Pos().Y(), pose.Pos().Z()), cuboid.center);
  const auto& r = pose.Rot();
  ASSERT_LT(Quaternion(r.W(), r.X(), r.Y(), r.Z()).angularDistance(cuboid.orientation), 1e-7);
}

void expectModel(const sdf::Model& model, const io::ExportedMap& map) {
  EXPECT_TRUE(model.Static());
  ASSERT_EQ(model.LinkCount(), 1u);
  const sdf::Link& link = *model.LinkByIndex(0);
  ASSERT_EQ(link.CollisionCount(), map.cuboids.size());
  ASSERT_EQ(link.VisualCount(), map.cuboids.size());
  for (std::size_t i = 0; i < map.cuboids.size(); ++i) {
    expectBox(*link.CollisionByIndex(i), map.cuboids[i]);
    expectBox(*link.VisualByIndex(i), map.cuboids[i]);
  }
}

std::string messageOf(const sdf::Errors& errors) {
  return errors.empty() ? "" : errors.front().Message();
}

TEST(Sdf, IsReadByLibsdformat) {
  const io::ExportedMap map = test::manyExported();
  const test::Exported file(io::writeSdf, map, "office.sdf");
  sdf::Root root;
  const sdf::Errors errors = root.Load(file.path());
  ASSERT_TRUE(errors.empty()) << messageOf(errors);
  ASSERT_NE(root.Model(), nullptr);
  EXPECT_EQ(root.Model()->Name(), "office");
  expectModel(*root.Model(), map);
  EXPECT_EQ(root.Model()->RawPose(), ignition::math::Pose3d::Zero);
}

TEST(Sdf, MapOfACameraStandsUpright) {
  io::ExportedMap map = test::manyExported(20);
  map.up = -Vector3::UnitY();
  const test::Exported file(io::writeSdf, map, "m.sdf");
  sdf::Root root;
  ASSERT_TRUE(root.Load(file.path()).empty());
  const auto up = root.Model()->RawPose().Rot() * ignition::math::Vector3d(0, -1, 0);
  EXPECT_NEAR(up.Z(), 1.0, 1e-12);
}

TEST(Sdf, ModelFolderIsFoundByItsName) {
  const io::ExportedMap map = test::manyExported(50);
  const test::Exported folder(io::writeModelFolder, map, "my office/");
  const std::string config =
      std::filesystem::path(sdf::getModelFilePath(folder.path())).lexically_normal();
  EXPECT_EQ(config, folder.path() + "model.sdf");
  sdf::Root root;
  const sdf::Errors errors = root.Load(config);
  ASSERT_TRUE(errors.empty()) << messageOf(errors);
  EXPECT_EQ(root.Model()->Name(), "my office");
  std::ifstream about(folder.path() + "model.config");
  const std::string text{std::istreambuf_iterator<char>(about), {}};
  EXPECT_NE(text.find("origin_m 501000 4500000 0.5."), std::string::npos) << text;
  expectModel(*root.Model(), map);
}

}  // namespace
}  // namespace planar_mapping
