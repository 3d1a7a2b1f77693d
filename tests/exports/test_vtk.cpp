// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// VTP, PLY, OBJ and STL, read by VTK as ParaView does.
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkOBJReader.h>
#include <vtkPLYReader.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSTLReader.h>
#include <vtkXMLPolyDataReader.h>

#include "export_scene.h"

namespace planar_mapping {
namespace {

Vector3 pointOf(vtkPolyData& data, vtkIdType i) {
  Vector3 p;
  data.GetPoint(i, p.data());
  return p;
}

TEST(Vtp, IsReadByVtkWithItsArrays) {
  const io::ExportedMap map = test::manyExported();
  const test::Exported file(io::writeVtp, map, "m.vtp");
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName(file.path().c_str());
  reader->Update();
  vtkPolyData& data = *reader->GetOutput();
  ASSERT_EQ(data.GetNumberOfPoints(), static_cast<vtkIdType>(8 * map.cuboids.size()));
  ASSERT_EQ(data.GetNumberOfCells(), static_cast<vtkIdType>(6 * map.cuboids.size()));
  vtkDataArray* origin = data.GetFieldData()->GetArray("origin_m");
  ASSERT_NE(origin, nullptr);
  EXPECT_EQ(Vector3(origin->GetTuple3(0)), map.origin);
  vtkCellData& cells = *data.GetCellData();
  ASSERT_EQ(cells.GetNumberOfArrays(), 5);
  for (const char* name : {"cuboid_id", "plane_id", "probability", "state", "size"})
    ASSERT_NE(cells.GetArray(name), nullptr) << name;
  for (std::size_t i = 0; i < map.cuboids.size(); ++i) {
    const Cuboid& c = map.cuboids[i];
    const std::array<Vector3, 8> expected = corners(c);
    for (std::size_t k = 0; k < 8; ++k)
      ASSERT_EQ(pointOf(data, static_cast<vtkIdType>(8 * i + k)), expected[k]);
    for (vtkIdType face = static_cast<vtkIdType>(6 * i); face < static_cast<vtkIdType>(6 * i + 6);
         ++face) {
      ASSERT_EQ(cells.GetArray("cuboid_id")->GetTuple1(face), static_cast<double>(i));
      ASSERT_EQ(cells.GetArray("plane_id")->GetTuple1(face), c.plane_id);
      ASSERT_EQ(static_cast<float>(cells.GetArray("probability")->GetTuple1(face)), c.probability);
      ASSERT_EQ(cells.GetArray("state")->GetTuple1(face), static_cast<double>(c.state));
      ASSERT_EQ(Vector3(cells.GetArray("size")->GetTuple3(face)), c.size);
      ASSERT_EQ(data.GetCell(face)->GetNumberOfPoints(), 4);
    }
  }
}

template <typename Reader>
void expectMesh(const test::Exported& file, const std::vector<Cuboid>& cuboids) {
  vtkNew<Reader> reader;
  reader->SetFileName(file.path().c_str());
  reader->Update();
  vtkPolyData& data = *reader->GetOutput();
  std::vector<test::Triangle> triangles;
  for (vtkIdType i = 0; i < data.GetNumberOfCells(); ++i) {
    vtkNew<vtkIdList> ids;
    data.GetCellPoints(i, ids);
    ASSERT_EQ(ids->GetNumberOfIds(), 3);
    triangles.push_back(
        {pointOf(data, ids->GetId(0)), pointOf(data, ids->GetId(1)), pointOf(data, ids->GetId(2))});
  }
  test::expectTrianglesOf(cuboids, triangles, 2e-5);
}

TEST(Meshes, AreReadByVtk) {
  const io::ExportedMap map = test::manyExported();
  expectMesh<vtkPLYReader>({io::writePly, map, "m.ply"}, map.cuboids);
  expectMesh<vtkSTLReader>({io::writeStl, map, "m.stl"}, map.cuboids);
  std::vector<Cuboid> by_group;
  for (const auto& [name, members] : test::groupsOf(map.cuboids))
    by_group.insert(by_group.end(), members.begin(), members.end());
  expectMesh<vtkOBJReader>({io::writeObj, map, "m.obj"}, by_group);
}

}  // namespace
}  // namespace planar_mapping
