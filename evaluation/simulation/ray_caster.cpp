// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/simulation/ray_caster.h"

#include <algorithm>
#include <limits>

#include "evaluation/simulation/object_view.h"
#include "evaluation/simulation/surface_shading.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/parallel.h"

namespace planar_mapping::evaluation {
namespace {

/// Depth, object and face of the pixels of rows [begin, end).
void findSurfaces(const std::vector<ObjectView>& views, int begin, int end, Rendering& image) {
  const PinholeCamera& camera = image.camera;
  for (const ObjectView& view : views) {
    const PixelWindow& window = view.window;
    for (int row = std::max(begin, window.row_begin); row < std::min(end, window.row_end); ++row) {
      const std::size_t first =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width);
      for (int column = window.column_begin; column < window.column_end; ++column) {
        const std::size_t i = first + static_cast<std::size_t>(column);
        const bool taken = image.object[i] >= 0;
        if (taken && view.nearest > image.depth[i]) continue;
        double t = 0.0;
        int face = 0;
        if (!view.hit(camera.rayOf(column, row), t, face)) continue;
        const auto depth = static_cast<float>(t);
        if (taken &&
            (depth > image.depth[i] || (depth == image.depth[i] && view.index > image.object[i])))
          continue;
        image.depth[i] = depth;
        image.object[i] = view.index;
        image.face[i] = static_cast<std::uint8_t>(face);
      }
    }
  }
}

void shadeRows(const std::vector<const ObjectView*>& views, const RenderParams& params, int begin,
               int end, Rendering& image) {
  const PinholeCamera& camera = image.camera;
  auto i = static_cast<std::size_t>(begin) * static_cast<std::size_t>(camera.width);
  for (int row = begin; row < end; ++row) {
    for (int column = 0; column < camera.width; ++column, ++i) {
      if (image.object[i] < 0) continue;
      const SurfaceShader shader(*views[static_cast<std::size_t>(image.object[i])], image.face[i],
                                 camera, params.plain_fraction, params.colors);
      const Vector3 ray = camera.rayOf(column, row);
      const SurfacePatch patch = shader.patchAt(static_cast<double>(image.depth[i]), ray);
      image.incidence[i] = static_cast<float>(patch.incidence);
      image.texture[i] = static_cast<float>(patch.texture);
      if (params.colors) image.colors[i] = shader.colorOf(patch);
    }
  }
}

}  // namespace

void RenderParams::validate() const {
  requireInRange("frame", frame, 0, std::numeric_limits<int>::max());
  requireInRange("plain_fraction", plain_fraction, 0.0, 1.0);
  requireInRange("threads", threads, 0, 1024);
}

Rendering render(const Scene& scene, const PinholeCamera& camera, const Pose& T_world_camera,
                 const RenderParams& params) {
  requireInRange("width", camera.width, 1, 65535, "px");
  requireInRange("height", camera.height, 1, 65535, "px");
  requirePositive("fx", camera.fx, "px");
  requirePositive("fy", camera.fy, "px");
  params.validate();
  if (!T_world_camera.matrix().allFinite()) throw InputError("the camera's pose is not finite");
  for (const SceneObject& object : scene.objects) requireSound(object);
  Rendering image;
  image.camera = camera;
  const std::size_t pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  image.depth.assign(pixels, 0.0f);
  image.object.assign(pixels, -1);
  image.face.assign(pixels, 0);
  image.incidence.assign(pixels, 0.0f);
  image.texture.assign(pixels, 0.0f);
  if (params.colors) image.colors.assign(pixels, kSkyColor);
  const std::vector<ObjectView> views = viewsOf(scene, camera, T_world_camera, params.frame);
  const std::vector<const ObjectView*> by_index = byIndex(views, scene);
  const std::size_t bands = static_cast<std::size_t>((camera.height + kBandRows - 1) / kBandRows);
  parallelFor(bands, params.threads, [&](std::size_t band) {
    const int begin = static_cast<int>(band) * kBandRows;
    const int end = std::min(begin + kBandRows, camera.height);
    findSurfaces(views, begin, end, image);
    shadeRows(by_index, params, begin, end, image);
  });
  return image;
}

}  // namespace planar_mapping::evaluation
