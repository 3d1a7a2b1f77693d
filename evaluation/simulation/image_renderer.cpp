// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/simulation/image_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "evaluation/simulation/object_view.h"
#include "evaluation/simulation/surface_shading.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/parallel.h"

namespace planar_mapping::evaluation {
namespace {

constexpr int kSubRays = 16;  ///< of a pixel at an edge: each in a column and a row of its own

/// The objects around a pixel, each once.
struct Neighbours {
  std::array<const ObjectView*, 9> views{};
  int count = 0;
  bool border = false;  ///< not all of them show one surface

  void add(const ObjectView* view) {
    if (view != nullptr &&
        std::find(views.begin(), views.begin() + count, view) == views.begin() + count)
      views[static_cast<std::size_t>(count++)] = view;
  }
};

class ImageRenderer {
 public:
  ImageRenderer(const Scene& scene, const Rendering& view, const Pose& T_world_camera,
                const RenderParams& params, const ImageSensorParams& sensor)
      : view_(view),
        params_(params),
        sensor_(sensor),
        views_(viewsOf(scene, view.camera, T_world_camera, params.frame)),
        by_index_(byIndex(views_, scene)) {}

  void drawRows(int begin, int end, io::Image& image) const {
    std::size_t i = static_cast<std::size_t>(begin) * static_cast<std::size_t>(image.width);
    for (int row = begin; row < end; ++row)
      for (int column = 0; column < image.width; ++column, ++i) {
        const Neighbours neighbours = around(column, row);
        const std::uint32_t color =
            neighbours.border ? averageColor(neighbours, column, row) : view_.colors[i];
        writePixel(color, i, image);
      }
  }

 private:
  Neighbours around(int column, int row) const {
    Neighbours result;
    const auto width = static_cast<std::size_t>(view_.camera.width);
    const std::size_t center =
        static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column);
    for (int r = std::max(0, row - 1); r <= std::min(view_.camera.height - 1, row + 1); ++r)
      for (int c = std::max(0, column - 1); c <= std::min(view_.camera.width - 1, column + 1);
           ++c) {
        const std::size_t i = static_cast<std::size_t>(r) * width + static_cast<std::size_t>(c);
        if (view_.object[i] == view_.object[center] && view_.face[i] == view_.face[center])
          continue;
        result.border = true;
        if (view_.object[i] >= 0) result.add(by_index_[static_cast<std::size_t>(view_.object[i])]);
      }
    if (result.border && view_.object[center] >= 0)
      result.add(by_index_[static_cast<std::size_t>(view_.object[center])]);
    return result;
  }

  /// A surface in a pixel: how many of its rays meet it, and where on average.
  struct Part {
    const ObjectView* view = nullptr;
    int face = 0;
    int rays = 0;
    Vector3 ray = Vector3::Zero();  ///< sum over them; likewise depth
    double depth = 0.0;
  };

  std::uint32_t averageColor(const Neighbours& neighbours, int column, int row) const {
    const PinholeCamera& camera = view_.camera;
    std::array<Part, kSubRays> parts;
    std::size_t count = 0;
    for (int k = 0; k < kSubRays; ++k) {
      const int reversed = (k & 1) << 3 | (k & 2) << 1 | (k & 4) >> 1 | (k & 8) >> 3;
      const double dx = (k + 0.5) / kSubRays - 0.5;
      const double dy = (reversed + 0.5) / kSubRays - 0.5;
      const Vector3 ray = camera.rayOf(column + dx, row + dy);
      const Part met = nearestTo(neighbours, ray);
      auto known = std::find_if(parts.begin(), parts.begin() + count, [&met](const Part& part) {
        return part.view == met.view && part.face == met.face;
      });
      if (known == parts.begin() + count) parts[count++] = {met.view, met.face};
      known->rays += 1;
      known->ray += ray;
      known->depth += met.depth;
    }
    std::array<double, 3> sum{};
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t color = colorOf(parts[i]);
      for (std::size_t channel = 0; channel < 3; ++channel)
        sum[channel] += parts[i].rays * static_cast<double>(color >> (16u - 8u * channel) & 0xFFu);
    }
    std::uint32_t result = 0;
    for (std::size_t channel = 0; channel < 3; ++channel)
      result |= static_cast<std::uint32_t>(sum[channel] / kSubRays + 0.5) << (16u - 8u * channel);
    return result;
  }

  Part nearestTo(const Neighbours& neighbours, const Vector3& ray) const {
    Part nearest;
    for (int i = 0; i < neighbours.count; ++i) {
      const ObjectView* candidate = neighbours.views[static_cast<std::size_t>(i)];
      double depth = 0.0;
      int face = 0;
      if (!candidate->hit(ray, depth, face) || (nearest.view != nullptr && depth >= nearest.depth))
        continue;
      nearest = {candidate, face, 0, Vector3::Zero(), depth};
    }
    return nearest;
  }

  std::uint32_t colorOf(const Part& part) const {
    if (part.view == nullptr) return kSkyColor;
    const SurfaceShader shader(*part.view, part.face, view_.camera, params_.plain_fraction, true);
    return shader.colorOf(shader.patchAt(part.depth / part.rays, part.ray / part.rays));
  }

  void writePixel(std::uint32_t color, std::size_t i, io::Image& image) const {
    const double red = color >> 16u & 0xFFu;
    const double green = color >> 8u & 0xFFu;
    const double blue = color & 0xFFu;
    if (image.channels == 1) {
      image.pixels[i] = withNoise(0.299 * red + 0.587 * green + 0.114 * blue, i);
      return;
    }
    image.pixels[3 * i] = withNoise(red, 3 * i);
    image.pixels[3 * i + 1] = withNoise(green, 3 * i + 1);
    image.pixels[3 * i + 2] = withNoise(blue, 3 * i + 2);
  }

  /// Noise that depends on the place alone, and so not on the thread: a sum of four uniform
  /// numbers, which is close to normal.
  std::uint8_t withNoise(double value, std::size_t place) const {
    std::uint64_t h = sensor_.seed + 0x9E3779B97F4A7C15ULL * (place + 1);
    h = (h ^ h >> 30u) * 0xBF58476D1CE4E5B9ULL;
    h = (h ^ h >> 27u) * 0x94D049BB133111EBULL;
    h ^= h >> 31u;
    const double sum = static_cast<double>((h & 0xFFFFu) + (h >> 16u & 0xFFFFu) +
                                           (h >> 32u & 0xFFFFu) + (h >> 48u));
    constexpr double kMean = 2.0 * 65535.0;
    const double normal = (sum - kMean) / (65536.0 * std::sqrt(4.0 / 12.0));
    return static_cast<std::uint8_t>(
        std::clamp(sensor_.exposure * value + sensor_.noise * normal, 0.0, 255.0) + 0.5);
  }

  const Rendering& view_;
  const RenderParams& params_;
  const ImageSensorParams& sensor_;
  std::vector<ObjectView> views_;
  std::vector<const ObjectView*> by_index_;
};

}  // namespace

void ImageSensorParams::validate() const {
  requireInRange("noise", noise, 0.0, 100.0, "gray levels");
  requirePositive("exposure", exposure);
}

io::Image renderImage(const Scene& scene, const Rendering& view, const Pose& T_world_camera,
                      const RenderParams& params, const ImageSensorParams& sensor) {
  params.validate();
  sensor.validate();
  if (view.colors.size() != view.size() || view.size() == 0)
    throw InputError("an image is made from a view with colours");
  io::Image image{view.camera.width, view.camera.height, sensor.color ? 3 : 1, {}};
  image.pixels.resize(view.size() * static_cast<std::size_t>(image.channels));
  const ImageRenderer renderer(scene, view, T_world_camera, params, sensor);
  const auto bands = static_cast<std::size_t>((image.height + kBandRows - 1) / kBandRows);
  parallelFor(bands, params.threads, [&](std::size_t band) {
    const int begin = static_cast<int>(band) * kBandRows;
    renderer.drawRows(begin, std::min(begin + kBandRows, image.height), image);
  });
  return image;
}

}  // namespace planar_mapping::evaluation
