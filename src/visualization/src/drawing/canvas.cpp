// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "drawing/canvas.h"

#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkStdString.h>
#include <vtkTextProperty.h>
#include <vtkTextRenderer.h>

#include <array>

namespace planar_mapping::visualization {

namespace {

constexpr int kDpi = 72;

bool renderText(const std::string& words, double pixels, vtkImageData* image,
                std::array<int, 2>& size) {
  vtkTextRenderer* renderer = vtkTextRenderer::GetInstance();
  vtkNew<vtkTextProperty> style;
  style->SetFontFamilyToArial();
  style->SetFontSize(std::max(6, static_cast<int>(std::lround(pixels))));
  style->SetColor(1.0, 1.0, 1.0);
  return renderer != nullptr &&
         renderer->RenderString(style, words, image, size.data(), kDpi, vtkTextRenderer::FreeType);
}

}  // namespace

std::vector<Vector2> convexHull(std::vector<Vector2> points) {
  std::sort(points.begin(), points.end(), [](const Vector2& a, const Vector2& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  const auto left_turn = [](const Vector2& a, const Vector2& b, const Vector2& c) {
    return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x()) > 0.0;
  };
  std::vector<Vector2> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t start = hull.size();
    for (const Vector2& p : points) {
      while (hull.size() >= start + 2 && !left_turn(hull[hull.size() - 2], hull.back(), p)) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

Canvas::Canvas(int width, int height, Color background)
    : width_(width),
      height_(height),
      // Smoothing is given up where it would take hundreds of megabytes.
      scale_(static_cast<long long>(width) * height <= 4'000'000 ? 3 : 1),
      large_(std::min(width * scale_, 16384), std::min(height * scale_, 16384), background) {
  if (large_.width != width * scale_ || large_.height != height * scale_) {
    scale_ = 1;
    large_ = Image(width, height, background);
  }
}

void Canvas::draw(const Image& picture) {
  for (int row = 0; row < std::min(large_.height, scale_ * picture.height); ++row) {
    for (int column = 0; column < std::min(large_.width, scale_ * picture.width); ++column) {
      large_.set(column, row, picture.at(column / scale_, row / scale_));
    }
  }
}

void Canvas::fill(const std::vector<Vector2>& convex, Color color) {
  std::vector<Vector2> scaled = convex;
  for (Vector2& p : scaled) p *= scale_;
  visitConvex(scaled, large_.width, large_.height,
              [&](int column, int row) { large_.set(column, row, color); });
}

void Canvas::line(const Vector2& a, const Vector2& b, double width, Color color) {
  const Vector2 along = b - a;
  if (!(along.norm() > 1e-9)) return;
  const Vector2 across = 0.5 * width * Vector2(-along.y(), along.x()).normalized();
  fill({a + across, b + across, b - across, a - across}, color);
}

void Canvas::dashed(const std::vector<Vector2>& path, double width, double dash, double gap,
                    Color color) {
  double position = 0.0;  // along the pattern
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double length = (path[i] - path[i - 1]).norm();
    double done = 0.0;
    while (done < length) {
      const bool drawn = position < dash;
      const double rest = (drawn ? dash : dash + gap) - position;
      const double step = std::min(rest, length - done);
      if (drawn) {
        const Vector2 along = (path[i] - path[i - 1]) / length;
        line(path[i - 1] + done * along, path[i - 1] + (done + step) * along, width, color);
      }
      done += step;
      position += step;
      if (position >= dash + gap - 1e-9) position = 0.0;
    }
  }
}

void Canvas::text(const std::string& words, const Vector2& at, double pixels, int align,
                  Color color) {
  vtkNew<vtkImageData> image;
  std::array<int, 2> size = {0, 0};
  if (!renderText(words, pixels * scale_, image, size)) return;
  const int left = static_cast<int>(std::lround(at.x() * scale_ - 0.5 * (align + 1) * size[0]));
  const int middle = static_cast<int>(std::lround(at.y() * scale_));
  const std::array<int, 2> limit = {std::min(size[0], image->GetDimensions()[0]),
                                    std::min(size[1], image->GetDimensions()[1])};
  for (int y = 0; y < limit[1]; ++y) {
    for (int x = 0; x < limit[0]; ++x) {
      const int column = left + x;
      const int row = middle + limit[1] / 2 - y;
      if (column < 0 || row < 0 || column >= large_.width || row >= large_.height) continue;
      const auto* rgba = static_cast<const unsigned char*>(image->GetScalarPointer(x, y, 0));
      const double alpha = rgba[3] / 255.0;
      const Color under = large_.at(column, row);
      const auto mix = [alpha](int a, int b) {
        return static_cast<std::uint8_t>(std::lround(a + alpha * (b - a)));
      };
      large_.set(
          column, row,
          {mix(under.red, color.red), mix(under.green, color.green), mix(under.blue, color.blue)});
    }
  }
}

double Canvas::textWidth(const std::string& words, double pixels) const {
  vtkNew<vtkImageData> image;
  std::array<int, 2> size = {0, 0};
  return renderText(words, pixels * scale_, image, size) ? static_cast<double>(size[0]) / scale_
                                                         : 0.0;
}

Image Canvas::finish() const {
  if (scale_ == 1) return large_;
  Image image(width_, height_, Color{});
  const int share = scale_ * scale_;
  for (int row = 0; row < height_; ++row) {
    for (int column = 0; column < width_; ++column) {
      std::array<int, 3> sum = {0, 0, 0};
      for (int k = 0; k < share; ++k) {
        const Color c = large_.at(column * scale_ + k % scale_, row * scale_ + k / scale_);
        sum[0] += c.red;
        sum[1] += c.green;
        sum[2] += c.blue;
      }
      const auto mean = [&](int channel) {
        return static_cast<std::uint8_t>((sum[static_cast<std::size_t>(channel)] + share / 2) /
                                         share);
      };
      image.set(column, row, {mean(0), mean(1), mean(2)});
    }
  }
  return image;
}

}  // namespace planar_mapping::visualization
