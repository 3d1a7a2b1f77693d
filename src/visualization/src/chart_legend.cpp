// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "chart_legend.h"

#include <vtkBrush.h>
#include <vtkContext2D.h>
#include <vtkObjectFactory.h>
#include <vtkPen.h>
#include <vtkPlotPoints.h>
#include <vtkTextProperty.h>

#include <array>
#include <utility>

namespace planar_mapping::visualization {
namespace {

constexpr int kFontSize = 18;
constexpr float kLineLength = 44.0f;  // pixels
constexpr float kSpace = 10.0f;       // between line and name
constexpr float kGap = 40.0f;         // between entries

class LegendItem : public vtkContextItem {
 public:
  static LegendItem* New();
  vtkTypeMacro(LegendItem, vtkContextItem)

  void set(std::vector<ChartSeries> series, int width, int height) {
    series_ = std::move(series);
    width_ = static_cast<float>(width);
    height_ = static_cast<float>(height);
  }

  bool Paint(vtkContext2D* painter) override {
    vtkTextProperty* text = painter->GetTextProp();
    text->SetFontSize(kFontSize);
    text->SetBold(false);
    text->SetColor(0.1, 0.1, 0.1);
    text->SetOpacity(1.0);
    text->SetOrientation(0.0);
    text->SetJustificationToLeft();
    text->SetVerticalJustificationToCentered();
    std::vector<float> widths;
    float all = -kGap;
    for (const ChartSeries& one : series_) {
      std::array<float, 4> bounds{};
      painter->ComputeStringBounds(one.name, bounds.data());
      widths.push_back(bounds[2]);
      all += kLineLength + kSpace + bounds[2] + kGap;
    }
    float x = 0.5f * (width_ - all);
    for (std::size_t i = 0; i < series_.size(); ++i) {
      paintEntry(*painter, series_[i], x);
      x += kLineLength + kSpace + widths[i] + kGap;
    }
    return true;
  }

 private:
  void paintEntry(vtkContext2D& painter, const ChartSeries& series, float x) const {
    const float y = 0.5f * height_;
    vtkPen* pen = painter.GetPen();
    pen->SetColor(series.color.red, series.color.green, series.color.blue, 255);
    pen->SetWidth(2.5f);
    pen->SetLineType(series.dashed ? vtkPen::DASH_LINE : vtkPen::SOLID_LINE);
    painter.DrawLine(x, y, x + kLineLength, y);
    pen->SetLineType(vtkPen::SOLID_LINE);
    painter.GetBrush()->SetColor(series.color.red, series.color.green, series.color.blue, 255);
    std::array<float, 2> middle = {x + 0.5f * kLineLength, y};
    pen->SetWidth(10.0f);
    painter.DrawMarkers(markerStyle(series.marker), false, middle.data(), 1);
    painter.DrawString(x + kLineLength + kSpace, y, series.name);
  }

  std::vector<ChartSeries> series_;
  float width_ = 0.0f;
  float height_ = 0.0f;
};
vtkStandardNewMacro(LegendItem)

}  // namespace

int markerStyle(ChartSeries::Marker marker) {
  switch (marker) {
    case ChartSeries::Marker::Square:
      return vtkPlotPoints::SQUARE;
    case ChartSeries::Marker::Diamond:
      return vtkPlotPoints::DIAMOND;
    case ChartSeries::Marker::Cross:
      return vtkPlotPoints::CROSS;
    case ChartSeries::Marker::Plus:
      return vtkPlotPoints::PLUS;
    case ChartSeries::Marker::Circle:
      break;
  }
  return vtkPlotPoints::CIRCLE;
}

vtkSmartPointer<vtkContextItem> makeChartLegend(std::vector<ChartSeries> series, int width,
                                                int height) {
  auto item = vtkSmartPointer<LegendItem>::New();
  item->set(std::move(series), width, height);
  return item;
}

}  // namespace planar_mapping::visualization
