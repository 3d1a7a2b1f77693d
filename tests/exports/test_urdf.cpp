// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// URDF, read by urdfdom.
#include <urdf_model/link.h>
#include <urdf_parser/urdf_parser.h>

#include "export_scene.h"

namespace planar_mapping {
namespace {

template <typename Element>
void expectBox(const Element& element, const Cuboid& cuboid) {
  ASSERT_EQ(element.geometry->type, urdf::Geometry::BOX);
  const auto& box = static_cast<const urdf::Box&>(*element.geometry);
  ASSERT_EQ(Vector3(box.dim.x, box.dim.y, box.dim.z), cuboid.size);
  const urdf::Pose& pose = element.origin;
  ASSERT_EQ(Vector3(pose.position.x, pose.position.y, pose.position.z), cuboid.center);
  const urdf::Rotation& r = pose.rotation;
  ASSERT_LT(Quaternion(r.w, r.x, r.y, r.z).angularDistance(cuboid.orientation), 1e-7);
}

TEST(Urdf, IsReadByUrdfdom) {
  const io::ExportedMap map = test::manyExported();
  const test::Exported file(io::writeUrdf, map, "office.urdf");
  const urdf::ModelInterfaceSharedPtr robot = urdf::parseURDFFile(file.path());
  ASSERT_NE(robot, nullptr);
  EXPECT_EQ(robot->getName(), "office");
  ASSERT_EQ(robot->links_.size(), 1u);
  const urdf::Link& link = *robot->getRoot();
  EXPECT_EQ(link.name, "map");
  ASSERT_EQ(link.collision_array.size(), map.cuboids.size());
  ASSERT_EQ(link.visual_array.size(), map.cuboids.size());
  for (std::size_t i = 0; i < map.cuboids.size(); ++i) {
    expectBox(*link.collision_array[i], map.cuboids[i]);
    expectBox(*link.visual_array[i], map.cuboids[i]);
    const urdf::Material& material = *link.visual_array[i]->material;
    ASSERT_EQ(material.color.a < 1.0f, map.cuboids[i].state == CellState::Unknown);
  }
}

}  // namespace
}  // namespace planar_mapping
