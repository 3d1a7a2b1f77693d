// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/scene/cuboid_layer.h"

#include <vtkCubeSource.h>
#include <vtkFloatArray.h>
#include <vtkGlyph3DMapper.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkProperty.h>
#include <vtkShaderProperty.h>
#include <vtkUniforms.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <array>
#include <locale>
#include <sstream>
#include <string>

namespace planar_mapping::visualization {

namespace {

constexpr double kThinnest = 1e-4;  // metres; a flat box has no normals

// GCMCMatrix, the cuboid's own matrix, is the name the glyph mapper gives it.
constexpr const char* kVertexDeclarations = R"(
//VTK::Normal::Dec
//VTK::CustomUniforms::Dec
out vec3 cubeVSOutput;
out float heightVSOutput;
)";
constexpr const char* kVertexBody = R"(
//VTK::PositionVC::Impl
  cubeVSOutput = vertexMC.xyz;
  heightVSOutput = dot(up_axis, vertex.xyz);
  vec3 cuboid_center = GCMCMatrix[3].xyz;
  vec3 cuboid_normal = normalize(GCMCMatrix[2].xyz);
  vec3 to_viewer = eye.w > 0.5 ? eye.xyz - cuboid_center : eye.xyz;
  float half_height = 0.5 * (abs(dot(GCMCMatrix[0].xyz, up_axis)) +
                             abs(dot(GCMCMatrix[1].xyz, up_axis)) +
                             abs(dot(GCMCMatrix[2].xyz, up_axis)));
  bool left_out = dot(cuboid_center, up_axis) - half_height > clip_above ||
                  (cutaway == 1 && dot(cuboid_normal, up_axis) < -0.7) ||
                  (cutaway == 2 && dot(cuboid_normal, to_viewer) < -0.05 * length(to_viewer));
  if (left_out) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
)";
constexpr const char* kFragmentDeclarations = R"(
//VTK::Normal::Dec
in vec3 cubeVSOutput;
in float heightVSOutput;
)";
constexpr const char* kFragmentColor = R"(
//VTK::Color::Impl
  if (height_range.y > height_range.x) {
    float t = clamp((heightVSOutput - height_range.x) / (height_range.y - height_range.x), 0.0, 1.0);
    vec3 height_color = heightColor(8.0 * t);
    ambientColor = ambientIntensity * height_color;
    diffuseColor = diffuseIntensity * height_color;
  }
)";
// Distances in pixels to the six faces; on a face the smallest is 0, so that the second smallest
// is the distance to its nearest edge.
constexpr const char* kFragmentEdges = R"(
//VTK::Light::Impl
  if (edge_strength > 0.0) {
    vec3 per_pixel = max(fwidth(cubeVSOutput), vec3(1e-6));
    vec3 d = (0.5 - abs(cubeVSOutput)) / per_pixel;
    float nearest_edge = max(min(d.x, d.y), min(max(d.x, d.y), d.z));
    float smallest_face = 1.0 / max(per_pixel.x, max(per_pixel.y, per_pixel.z));
    float line = 1.0 - smoothstep(0.4, 1.3, nearest_edge);
    line *= smoothstep(3.0, 14.0, smallest_face) * edge_strength;
    gl_FragData[0].rgb = mix(gl_FragData[0].rgb, edge_color, line);
  }
)";

// One of the four samples of a pixel: a quarter of the colour, and the nearest veil hides the
// others, where blending would add them up to a wall.
constexpr const char* kVeilExtension = R"(
//VTK::System::Dec
#extension GL_ARB_sample_shading : enable
)";
constexpr const char* kVeil = R"(
//VTK::DepthPeeling::Impl
  gl_SampleMask[0] = 2;
)";

std::string heightColorFunction() {
  std::ostringstream code;
  code.imbue(std::locale::classic());
  code << "//VTK::Color::Dec\nvec3 heightColor(float position) {\n  vec3 c[9];\n";
  for (int i = 0; i < 9; ++i) {
    const Color c = scaleColor(ColorBy::Height, i / 8.0);
    code << "  c[" << i << "] = vec3(" << c.red / 255.0 << "," << c.green / 255.0 << ","
         << c.blue / 255.0 << ");\n";
  }
  code << "  int i = min(int(position), 7);\n  return mix(c[i], c[i + 1], position - "
          "float(i));\n}\n";
  return code.str();
}

vtkSmartPointer<vtkPolyData> makeInstances(const std::vector<Cuboid>& cuboids,
                                           const Vector3& origin) {
  const auto count = static_cast<vtkIdType>(cuboids.size());
  vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  points->SetNumberOfPoints(count);
  vtkNew<vtkFloatArray> turn;
  turn->SetName("quaternion_wxyz");
  turn->SetNumberOfComponents(4);
  turn->SetNumberOfTuples(count);
  vtkNew<vtkFloatArray> size;
  size->SetName("size");
  size->SetNumberOfComponents(3);
  size->SetNumberOfTuples(count);
  for (vtkIdType i = 0; i < count; ++i) {
    const Cuboid& c = cuboids[static_cast<std::size_t>(i)];
    const Vector3 p = c.center - origin;
    const Quaternion q = c.orientation.normalized();
    const Vector3 s = c.size.cwiseMax(kThinnest);
    points->SetPoint(i, p.x(), p.y(), p.z());
    turn->SetTuple4(i, q.w(), q.x(), q.y(), q.z());
    size->SetTuple3(i, s.x(), s.y(), s.z());
  }
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->GetPointData()->AddArray(turn);
  data->GetPointData()->AddArray(size);
  return data;
}

}  // namespace

CuboidLayer::CuboidLayer(std::vector<Cuboid> cuboids, const Vector3& origin, const Vector3& up)
    : cuboids_(std::move(cuboids)),
      origin_(origin),
      up_(up.normalized()),
      instances_(makeInstances(cuboids_, origin)),
      actor_(vtkSmartPointer<vtkActor>::New()) {
  setColors([](const Cuboid&) { return Color{200, 200, 200}; });
  vtkNew<vtkCubeSource> cube;
  vtkNew<vtkGlyph3DMapper> mapper;
  mapper->SetInputData(instances_);
  mapper->SetSourceConnection(cube->GetOutputPort());
  mapper->SetOrientationArray("quaternion_wxyz");
  mapper->SetOrientationModeToQuaternion();
  mapper->SetScaleArray("size");
  mapper->SetScaleModeToScaleByVectorComponents();
  mapper->SetScaling(true);
  mapper->SetOrient(true);
  mapper->SetScalarModeToUsePointFieldData();
  mapper->SelectColorArray("color");
  mapper->SetColorModeToDirectScalars();
  mapper->ScalarVisibilityOn();
  actor_->SetMapper(mapper);
  actor_->GetProperty()->SetInterpolationToPhong();
  actor_->GetProperty()->SetAmbient(0.52);
  actor_->GetProperty()->SetDiffuse(0.62);
  actor_->GetProperty()->SetSpecular(0.0);

  vtkShaderProperty* shader = actor_->GetShaderProperty();
  shader->AddVertexShaderReplacement("//VTK::Normal::Dec", true, kVertexDeclarations, false);
  shader->AddVertexShaderReplacement("//VTK::PositionVC::Impl", true, kVertexBody, false);
  shader->AddFragmentShaderReplacement("//VTK::Normal::Dec", true, kFragmentDeclarations, false);
  shader->AddFragmentShaderReplacement("//VTK::Color::Dec", true, heightColorFunction(), false);
  shader->AddFragmentShaderReplacement("//VTK::Color::Impl", true, kFragmentColor, false);
  shader->AddFragmentShaderReplacement("//VTK::Light::Impl", true, kFragmentEdges, false);
  const std::array<float, 3> axis = {static_cast<float>(up_.x()), static_cast<float>(up_.y()),
                                     static_cast<float>(up_.z())};
  const std::array<float, 3> edge_color = {0.10f, 0.11f, 0.13f};
  const std::array<float, 4> eye = {0.0f, 0.0f, 0.0f, 1.0f};
  shader->GetVertexCustomUniforms()->SetUniform3f("up_axis", axis.data());
  shader->GetVertexCustomUniforms()->SetUniform4f("eye", eye.data());
  shader->GetVertexCustomUniforms()->SetUniformi("cutaway", 0);
  shader->GetVertexCustomUniforms()->SetUniformf("clip_above", 1e30f);
  shader->GetFragmentCustomUniforms()->SetUniform3f("edge_color", edge_color.data());
  setHeightRange(nullptr);
  setEdges(true);
}

void CuboidLayer::setColors(const std::function<Color(const Cuboid&)>& color) {
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetName("color");
  colors->SetNumberOfComponents(4);
  colors->SetNumberOfTuples(static_cast<vtkIdType>(cuboids_.size()));
  for (std::size_t i = 0; i < cuboids_.size(); ++i) {
    const Color c = color(cuboids_[i]);
    unsigned char* rgba = colors->GetPointer(static_cast<vtkIdType>(4 * i));
    rgba[0] = c.red;
    rgba[1] = c.green;
    rgba[2] = c.blue;
    rgba[3] = 255;
  }
  instances_->GetPointData()->AddArray(colors);
  instances_->GetPointData()->Modified();
  instances_->Modified();
}

void CuboidLayer::setHeightRange(const ScalarRange* range) {
  std::array<float, 2> shifted = {0.0f, 0.0f};
  if (range != nullptr) {
    const double base = origin_.dot(up_);
    shifted = {static_cast<float>(range->low - base),
               static_cast<float>(std::max(range->high, range->low + 1e-3) - base)};
  }
  actor_->GetShaderProperty()->GetFragmentCustomUniforms()->SetUniform2f("height_range",
                                                                         shifted.data());
}

void CuboidLayer::setEdges(bool visible) {
  actor_->GetShaderProperty()->GetFragmentCustomUniforms()->SetUniformf("edge_strength",
                                                                        visible ? 0.62f : 0.0f);
}

void CuboidLayer::setVeil() {
  vtkShaderProperty* shader = actor_->GetShaderProperty();
  shader->AddFragmentShaderReplacement("//VTK::System::Dec", true, kVeilExtension, false);
  shader->AddFragmentShaderReplacement("//VTK::DepthPeeling::Impl", true, kVeil, false);
}

void CuboidLayer::setView(const CameraView& view, const ViewOptions& options) {
  const Vector3 eye = view.parallel ? Vector3(-view.direction()) : Vector3(view.position - origin_);
  const std::array<float, 4> values = {static_cast<float>(eye.x()), static_cast<float>(eye.y()),
                                       static_cast<float>(eye.z()), view.parallel ? 0.0f : 1.0f};
  vtkUniforms* uniforms = actor_->GetShaderProperty()->GetVertexCustomUniforms();
  uniforms->SetUniform4f("eye", values.data());
  uniforms->SetUniformi("cutaway", static_cast<int>(options.cutaway));
  const double clip = options.clip_above ? *options.clip_above - origin_.dot(up_) : 1e30;
  uniforms->SetUniformf("clip_above", static_cast<float>(clip));
}

}  // namespace planar_mapping::visualization
