// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/drawing/charts.h"

#include <vtkAxis.h>
#include <vtkBrush.h>
#include <vtkChartXY.h>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkPen.h>
#include <vtkPlotLine.h>
#include <vtkStringArray.h>
#include <vtkTable.h>

#include <algorithm>
#include <cmath>

#include "planar_mapping/viewer/drawing/canvas.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/viewer/scene/ground.h"
#include "planar_mapping/viewer/window/render_backend.h"

namespace planar_mapping {
namespace {

using visualization::Canvas;
using visualization::Captions;

// Pixels. VTK's axes place text between pixels, which cuts it: charts are drawn without text, into
// rectangles that are known, and the canvas writes it.
constexpr int kLeft = 84;
constexpr int kRight = 28;
constexpr int kTop = 80;
constexpr int kBottom = 68;
constexpr double kTitleSize = 19.0;
constexpr double kTextSize = 16.0;
constexpr double kTickSize = 14.0;
constexpr Color kInk = {26, 26, 26};
constexpr float kLineWidth = 2.5f;
constexpr float kMarkerSize = 10.0f;
constexpr float kSpreadWidth = 1.5f;
constexpr unsigned char kSpreadOpacity = 130;
// Of the legend.
constexpr double kLegendLine = 44.0;
constexpr double kLegendSpace = 10.0;  // between line and name
constexpr double kLegendGap = 38.0;    // between entries
constexpr int kLegendRow = 28;
constexpr int kLegendMargin = 14;  // above and below

int markerOf(const ChartSeries& series) {
  constexpr int kMarkers[] = {vtkPlotPoints::CIRCLE, vtkPlotPoints::SQUARE, vtkPlotPoints::DIAMOND,
                              vtkPlotPoints::CROSS, vtkPlotPoints::PLUS};
  return kMarkers[static_cast<std::size_t>(series.marker)];
}

double widthOf(const ChartSeries& series) {
  return kLegendLine + kLegendSpace + Captions::widthOf(series.name, kTextSize);
}

/// Lines, markers and names, centred below the charts of a page, in as many rows as they need.
class ChartLegend {
 public:
  /// \param width  of the page, pixels
  ChartLegend(const std::vector<ChartSeries>& series, double width) : width_(width) {
    double x = 0.0;
    for (const ChartSeries& one : series) {
      if (rows_.empty() || x + kLegendGap + widthOf(one) > width) {
        rows_.emplace_back();
        x = -kLegendGap;
      }
      rows_.back().push_back(one);
      x += kLegendGap + widthOf(one);
    }
  }
  int height() const { return 2 * kLegendMargin + kLegendRow * static_cast<int>(rows_.size()); }
  void draw(double top, Canvas& canvas) const {
    double y = top + kLegendMargin + 0.5 * kLegendRow;
    for (const std::vector<ChartSeries>& row : rows_) {
      double all = -kLegendGap;
      for (const ChartSeries& one : row) all += widthOf(one) + kLegendGap;
      double x = 0.5 * (width_ - all);
      for (const ChartSeries& one : row) {
        const Vector2 left(x, y);
        const Vector2 right(x + kLegendLine, y);
        canvas.line({left, right}, kLineWidth, one.color, one.dashed);
        canvas.marker(markerOf(one), 0.5 * (left + right), kMarkerSize, one.color);
        canvas.text(one.name, {x + kLegendLine + kLegendSpace, y}, kTextSize, -1, kInk);
        x += widthOf(one) + kLegendGap;
      }
      y += kLegendRow;
    }
  }

 private:
  double width_;
  std::vector<std::vector<ChartSeries>> rows_;
};

/// How the y values of a chart become positions on its axis.
double positionOf(double value, bool logarithmic) {
  return logarithmic ? std::log10(value) : value;
}

bool isDrawn(double value, bool logarithmic) {
  return std::isfinite(value) && (!logarithmic || value > 0.0);
}

bool hasValues(const Chart& chart) {
  for (const ChartSeries& series : chart.series) {
    for (const double y : series.y) {
      if (isDrawn(y, chart.logarithmic)) return true;
    }
  }
  return false;
}

struct AxisRange {
  double low = 0.0;
  double high = 1.0;
};

/// Of what is drawn, in positions, with some air.
AxisRange rangeOf(const Chart& chart) {
  double low = INFINITY;
  double high = -INFINITY;
  const auto take = [&](double value) {
    if (!isDrawn(value, chart.logarithmic)) return;
    low = std::min(low, positionOf(value, chart.logarithmic));
    high = std::max(high, positionOf(value, chart.logarithmic));
  };
  for (const ChartSeries& series : chart.series) {
    for (const std::vector<double>* values : {&series.y, &series.low, &series.high}) {
      for (const double value : *values) take(value);
    }
  }
  if (!(high >= low)) return {};
  if (chart.logarithmic) return {std::floor(low - 0.02), std::ceil(high + 0.02)};
  const double air = std::max(0.06 * (high - low), 1e-9 + 0.01 * std::abs(high));
  return {low >= 0.0 && low - air < 0.35 * high ? std::min(0.0, low) : low - air, high + air};
}

/// 1, 10, 100, ..., then 1e5 and so on.
std::string powerText(int exponent) {
  if (exponent >= -3 && exponent <= 4) return visualization::shortNumber(std::pow(10.0, exponent));
  return "1e" + std::to_string(exponent);
}

/// Where an axis has ticks, and what stands there.
struct Ticks {
  AxisRange range;
  std::vector<double> positions;
  std::vector<std::string> labels;
};

Ticks valueTicks(const Chart& chart) {
  Ticks ticks;
  ticks.range = rangeOf(chart);
  const AxisRange& range = ticks.range;
  if (chart.logarithmic) {
    for (int e = static_cast<int>(std::ceil(range.low)); e <= range.high; ++e) {
      ticks.positions.push_back(e);
      ticks.labels.push_back(powerText(e));
    }
    return ticks;
  }
  const double step = visualization::roundStep(range.high - range.low, 6);
  ticks.positions = visualization::multiples(range.low, range.high, step);
  for (const double at : ticks.positions) ticks.labels.push_back(visualization::shortNumber(at));
  return ticks;
}

/// A tick at each x of any series.
Ticks argumentTicks(const Chart& chart) {
  std::vector<double> xs;
  for (const ChartSeries& series : chart.series)
    xs.insert(xs.end(), series.x.begin(), series.x.end());
  std::sort(xs.begin(), xs.end());
  xs.erase(std::unique(xs.begin(), xs.end()), xs.end());
  if (xs.empty()) xs = {0.0, 1.0};
  const double span = xs.back() - xs.front();
  const double length = span > 0.0 ? span : 10.0 * std::max(std::abs(xs.front()), 1e-3);
  Ticks ticks;
  ticks.range = {xs.front() - 0.05 * length, xs.back() + 0.05 * length};
  ticks.positions = xs;
  for (const double x : xs) ticks.labels.push_back(visualization::shortNumber(x));
  return ticks;
}

void styleAxis(vtkAxis* axis, const Ticks& ticks) {
  axis->SetTitle("");
  axis->SetLabelsVisible(false);
  axis->GetPen()->SetColor(60, 60, 60);
  axis->GetGridPen()->SetColor(222, 224, 228);
  axis->SetBehavior(vtkAxis::FIXED);
  axis->SetMinimum(ticks.range.low);
  axis->SetMaximum(ticks.range.high);
  vtkNew<vtkDoubleArray> positions;
  vtkNew<vtkStringArray> texts;
  for (std::size_t i = 0; i < ticks.positions.size(); ++i) {
    positions->InsertNextValue(ticks.positions[i]);
    texts->InsertNextValue(ticks.labels[i]);
  }
  axis->SetCustomTickPositions(positions, texts);
}

vtkPlot* addLine(vtkChartXY& chart, const std::vector<double>& xs, const std::vector<double>& ys) {
  vtkNew<vtkTable> table;
  vtkNew<vtkDoubleArray> x;
  x->SetName("x");
  vtkNew<vtkDoubleArray> y;
  y->SetName("y");
  for (std::size_t i = 0; i < xs.size(); ++i) {
    x->InsertNextValue(xs[i]);
    y->InsertNextValue(ys[i]);
  }
  table->AddColumn(x);
  table->AddColumn(y);
  vtkPlot* line = chart.AddPlot(vtkChart::LINE);
  line->SetInputData(table, 0, 1);
  return line;
}

void addSpread(vtkChartXY& chart, const ChartSeries& series, bool logarithmic) {
  for (std::size_t i = 0; i < series.low.size(); ++i) {
    if (!isDrawn(series.low[i], logarithmic) || !isDrawn(series.high[i], logarithmic)) continue;
    vtkPlot* bar =
        addLine(chart, {series.x[i], series.x[i]},
                {positionOf(series.low[i], logarithmic), positionOf(series.high[i], logarithmic)});
    bar->SetColor(series.color.red, series.color.green, series.color.blue, kSpreadOpacity);
    bar->SetWidth(kSpreadWidth);
  }
}

void addSeries(vtkChartXY& chart, const ChartSeries& series, bool logarithmic) {
  std::vector<double> xs;
  std::vector<double> ys;
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (!isDrawn(series.y[i], logarithmic)) continue;
    xs.push_back(series.x[i]);
    ys.push_back(positionOf(series.y[i], logarithmic));
  }
  if (xs.empty()) return;
  if (xs.size() == 1) {  // VTK draws no line of one point
    xs.push_back(xs.front());
    ys.push_back(ys.front());
  }
  auto* line = vtkPlotLine::SafeDownCast(addLine(chart, xs, ys));
  line->SetColor(series.color.red, series.color.green, series.color.blue, 255);
  line->SetWidth(kLineWidth);
  line->GetPen()->SetLineType(series.dashed ? vtkPen::DASH_LINE : vtkPen::SOLID_LINE);
  line->SetMarkerStyle(markerOf(series));
  line->SetMarkerSize(kMarkerSize);
}

/// The rectangle between the axes of a chart, pixels from the top left corner of the page.
struct ChartFrame {
  int left = 0;
  int top = 0;
  int width = 0;
  int height = 0;
};

ChartFrame frameOf(const ChartPage& page, int index, int columns) {
  return {(index % columns) * page.chart_width + kLeft,
          (index / columns) * page.chart_height + kTop, page.chart_width - kLeft - kRight,
          page.chart_height - kTop - kBottom};
}

vtkSmartPointer<vtkChartXY> makeChart(const Chart& chart, const ChartFrame& frame,
                                      int page_height) {
  auto item = vtkSmartPointer<vtkChartXY>::New();
  item->SetAutoSize(false);
  item->SetLayoutStrategy(vtkChart::AXES_TO_RECT);
  item->SetSize(vtkRectf(static_cast<float>(frame.left),
                         static_cast<float>(page_height - frame.top - frame.height),
                         static_cast<float>(frame.width), static_cast<float>(frame.height)));
  item->SetShowLegend(false);
  item->GetBackgroundBrush()->SetColor(255, 255, 255, 0);  // it would hide its neighbours
  styleAxis(item->GetAxis(vtkAxis::BOTTOM), argumentTicks(chart));
  styleAxis(item->GetAxis(vtkAxis::LEFT), valueTicks(chart));
  for (const ChartSeries& series : chart.series) addSpread(*item, series, chart.logarithmic);
  for (const ChartSeries& series : chart.series) addSeries(*item, series, chart.logarithmic);
  return item;
}

/// What of a text fits into a width.
std::string fitted(std::string text, double pixels, double width, Canvas& canvas) {
  if (canvas.textSize(text, pixels).x() <= width) return text;
  while (!text.empty() && canvas.textSize(text + "...", pixels).x() > width) text.pop_back();
  return text + "...";
}

void writeTexts(const Chart& chart, const ChartFrame& frame, Canvas& canvas) {
  const double right = frame.left + frame.width;
  const double bottom = frame.top + frame.height;
  const double middle = 0.5 * (frame.left + right);
  const double title_width = frame.width + 2.0 * kRight;
  canvas.text(fitted(chart.title, kTitleSize, title_width, canvas), {middle, frame.top - 54.0},
              kTitleSize, 0, kInk);
  canvas.text(chart.y_title, {frame.left - 50.0, frame.top - 22.0}, kTextSize, -1, kInk);
  canvas.text(chart.x_title, {middle, bottom + 46.0}, kTextSize, 0, kInk);
  const auto fraction = [](double value, const AxisRange& range) {
    return (value - range.low) / (range.high - range.low);
  };
  Captions captions;
  const auto label = [&](const std::string& text, const Vector2& at, int align) {
    const Vector2 size = canvas.textSize(text, kTickSize);
    const double left = at.x() - 0.5 * (align + 1) * size.x();
    if (captions.take(left, canvas.flipped(at.y() + 0.5 * size.y()), size.x() + 0.4 * kTickSize,
                      size.y()))
      canvas.text(text, at, kTickSize, align, kInk);
  };
  const Ticks x = argumentTicks(chart);
  for (std::size_t i = 0; i < x.positions.size(); ++i) {
    const double at = frame.left + fraction(x.positions[i], x.range) * frame.width;
    label(x.labels[i], {at, bottom + 19.0}, 0);
  }
  const Ticks y = valueTicks(chart);
  for (std::size_t i = 0; i < y.positions.size(); ++i) {
    const double at = bottom - fraction(y.positions[i], y.range) * frame.height;
    label(y.labels[i], {frame.left - 10.0, at}, 1);
  }
}

/// Series by name, the first of each.
std::vector<ChartSeries> legendOf(const ChartPage& page) {
  std::vector<ChartSeries> names;
  for (const Chart& chart : page.charts) {
    for (const ChartSeries& series : chart.series) {
      const auto same = [&series](const ChartSeries& other) { return other.name == series.name; };
      if (std::none_of(names.begin(), names.end(), same)) names.push_back(series);
    }
  }
  return names;
}

}  // namespace

void ChartPage::validate() const {
  if (charts.empty()) throw InputError("there is no chart to draw");
  requireInRange("columns of the page", columns, 1, 16);
  requireInRange("width of a chart", chart_width, 320, 4096, "px");
  requireInRange("height of a chart", chart_height, 240, 4096, "px");
  for (const Chart& chart : charts) {
    if (!hasValues(chart)) throw InputError("chart '" + chart.title + "' has no value to draw");
    for (const ChartSeries& series : chart.series) {
      const std::size_t size = series.x.size();
      const bool spread_fits = series.low.empty()
                                   ? series.high.empty()
                                   : series.low.size() == size && series.high.size() == size;
      if (series.y.size() != size || !spread_fits)
        throw InputError("chart '" + chart.title + "': the values of series '" + series.name +
                         "' differ in number");
    }
  }
}

Image renderCharts(const ChartPage& page) {
  page.validate();
  const int count = static_cast<int>(page.charts.size());
  const int columns = std::min(page.columns, count);
  const int rows = (count + columns - 1) / columns;
  const int width = columns * page.chart_width;
  const ChartLegend legend(legendOf(page), width);
  const int height = rows * page.chart_height + legend.height();
  requireInRange("height of the page", height, 1, 16384, "px");
  std::vector<vtkSmartPointer<vtkAbstractContextItem>> items;
  for (int i = 0; i < count; ++i)
    items.push_back(
        makeChart(page.charts[static_cast<std::size_t>(i)], frameOf(page, i, columns), height));
  const auto write = [&](Canvas& canvas) {
    for (int i = 0; i < count; ++i)
      writeTexts(page.charts[static_cast<std::size_t>(i)], frameOf(page, i, columns), canvas);
    legend.draw(rows * page.chart_height, canvas);
  };
  Image image = visualization::drawPage(width, height, {255, 255, 255}, write, items);
  visualization::requireDrawn(image);
  return image;
}

}  // namespace planar_mapping
