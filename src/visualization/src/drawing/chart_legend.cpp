// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "drawing/chart_legend.h"

#include <cmath>

#include "scene/captions.h"

namespace planar_mapping::visualization {
namespace {

constexpr double kFontSize = 16.0;  // pixels, like all lengths here
constexpr double kLineLength = 44.0;
constexpr double kLineWidth = 2.5;
constexpr double kSpace = 10.0;  // between line and name
constexpr double kGap = 38.0;    // between entries
constexpr double kMarker = 5.0;  // half its size
constexpr int kRowHeight = 28;
constexpr int kMargin = 14;  // above and below
constexpr Color kInk = {26, 26, 26};

/// A regular polygon, its first corner at the given angle.
std::vector<Vector2> polygon(const Vector2& center, double radius, int corners, double angle) {
  std::vector<Vector2> points;
  for (int i = 0; i < corners; ++i) {
    const double turn = angle + 6.283185307179586 * i / corners;
    points.push_back(center + radius * Vector2(std::cos(turn), std::sin(turn)));
  }
  return points;
}

void drawMarker(ChartSeries::Marker marker, const Vector2& at, Color color, Canvas& canvas) {
  constexpr double kEighth = 0.7853981633974483;
  switch (marker) {
    case ChartSeries::Marker::Circle:
      canvas.fill(polygon(at, kMarker, 24, 0.0), color);
      return;
    case ChartSeries::Marker::Square:
      canvas.fill(polygon(at, kMarker * std::sqrt(2.0), 4, kEighth), color);
      return;
    case ChartSeries::Marker::Diamond:
      canvas.fill(polygon(at, kMarker, 4, 0.0), color);
      return;
    case ChartSeries::Marker::Cross:
    case ChartSeries::Marker::Plus:
      break;
  }
  const double diagonal = marker == ChartSeries::Marker::Cross ? kMarker : 0.0;
  const Vector2 along(kMarker, diagonal);
  const Vector2 across = diagonal > 0.0 ? Vector2(kMarker, -diagonal) : Vector2(0.0, kMarker);
  canvas.line({at - along, at + along}, 1.5, color);
  canvas.line({at - across, at + across}, 1.5, color);
}

double widthOf(const ChartSeries& series) {
  return kLineLength + kSpace + Captions::widthOf(series.name, kFontSize);
}

}  // namespace

ChartLegend::ChartLegend(const std::vector<ChartSeries>& series, double width) : width_(width) {
  double x = 0.0;
  for (const ChartSeries& one : series) {
    if (rows_.empty() || x + kGap + widthOf(one) > width) {
      rows_.emplace_back();
      x = -kGap;
    }
    rows_.back().push_back(one);
    x += kGap + widthOf(one);
  }
}

int ChartLegend::height() const {
  return 2 * kMargin + kRowHeight * static_cast<int>(rows_.size());
}

void ChartLegend::draw(double top, Canvas& canvas) const {
  double y = top + kMargin + 0.5 * kRowHeight;
  for (const std::vector<ChartSeries>& row : rows_) {
    double all = -kGap;
    for (const ChartSeries& one : row) all += widthOf(one) + kGap;
    double x = 0.5 * (width_ - all);
    for (const ChartSeries& one : row) {
      const Vector2 left(x, y);
      const Vector2 right(x + kLineLength, y);
      canvas.line({left, right}, kLineWidth, one.color, one.dashed);
      drawMarker(one.marker, 0.5 * (left + right), one.color, canvas);
      canvas.text(one.name, {x + kLineLength + kSpace, y}, kFontSize, -1, kInk);
      x += widthOf(one) + kGap;
    }
    y += kRowHeight;
  }
}

}  // namespace planar_mapping::visualization
