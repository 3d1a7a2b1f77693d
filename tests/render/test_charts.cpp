// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/drawing/charts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "planar_mapping/base/error.h"

namespace planar_mapping {
namespace {

constexpr Color kRed = {220, 0, 0};
constexpr Color kBlue = {0, 0, 220};

ChartSeries line(const std::string& name, Color color, std::vector<double> y) {
  ChartSeries series;
  series.name = name;
  series.color = color;
  for (std::size_t i = 0; i < y.size(); ++i) series.x.push_back(0.1 * static_cast<double>(i + 1));
  series.y = std::move(y);
  return series;
}

ChartPage pageOf(std::vector<ChartSeries> series) {
  Chart chart;
  chart.title = "corridor";
  chart.x_title = "cell size s [m]";
  chart.y_title = "error [%]";
  chart.series = std::move(series);
  ChartPage page;
  page.charts = {chart};
  return page;
}

/// Rows of pixels near a colour within the columns [from, to).
struct Found {
  int pixels = 0;
  int highest = std::numeric_limits<int>::max();  ///< row
  int lowest = -1;
};

Found find(const Image& image, Color color, int from, int to, int bottom) {
  Found found;
  for (int row = 0; row < bottom; ++row) {
    for (int column = from; column < to; ++column) {
      const Color c = colorAt(image, column, row);
      const int apart = std::abs(c.red - color.red) + std::abs(c.green - color.green) +
                        std::abs(c.blue - color.blue);
      if (apart > 60) continue;
      ++found.pixels;
      found.highest = std::min(found.highest, row);
      found.lowest = std::max(found.lowest, row);
    }
  }
  return found;
}

class Charts : public ::testing::Test {
 protected:
  /// Without a backend there is nothing to test but the message.
  void SetUp() override {
    try {
      renderCharts(pageOf({line("SG", kRed, {1.0, 2.0})}));
    } catch (const RenderError& error) {
      GTEST_SKIP() << error.what();
    }
  }
};

TEST_F(Charts, LinesLieWhereTheirValuesAre) {
  ChartPage page = pageOf({line("SG", kRed, {9.0, 9.0, 9.0}), line("PG", kBlue, {1.0, 1.0, 1.0})});
  const Image image = renderCharts(page);
  EXPECT_EQ(page.chart_width, image.width);
  EXPECT_GT(image.height, page.chart_height);
  const Found red = find(image, kRed, 0, image.width, page.chart_height);
  const Found blue = find(image, kBlue, 0, image.width, page.chart_height);
  ASSERT_GT(red.pixels, 100);
  ASSERT_GT(blue.pixels, 100);
  EXPECT_LT(red.lowest, blue.highest);
  // The axis begins at 0 and leaves some air above.
  const double units = 9.0 + 0.06 * 8.0;
  const double red_row = 0.5 * (red.highest + red.lowest);
  const double blue_row = 0.5 * (blue.highest + blue.lowest);
  const double axis = page.chart_height - 80.0 - 68.0;
  EXPECT_NEAR(8.0 / units * axis, blue_row - red_row, 3.0);
}

TEST_F(Charts, ALogarithmicAxisGivesEachPowerOfTenTheSameRoom) {
  const auto rowOf = [](double value) {
    ChartPage page = pageOf({line("SG", kRed, {value, value}), line("PG", kBlue, {1.0, 1000.0})});
    page.charts[0].logarithmic = true;
    const Found red = find(renderCharts(page), kRed, 0, page.chart_width, page.chart_height);
    return 0.5 * (red.highest + red.lowest);
  };
  EXPECT_NEAR(rowOf(10.0) - rowOf(100.0), rowOf(3.0) - rowOf(30.0), 3.0);
}

TEST_F(Charts, ValuesThatCannotBeDrawnAreLeftOut) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ChartPage page = pageOf({line("SG", kRed, {nan, 1.0, 2.0}), line("PG", kBlue, {nan, nan, nan})});
  page.charts[0].logarithmic = true;
  page.charts[0].series[0].low = {nan, 0.0, 1.5};
  page.charts[0].series[0].high = {nan, 2.0, INFINITY};
  const Image image = renderCharts(page);
  EXPECT_GT(find(image, kRed, 0, image.width, page.chart_height).pixels, 50);
  EXPECT_EQ(0, find(image, kBlue, 0, image.width, page.chart_height).pixels);
}

TEST_F(Charts, OnePointIsAChartToo) {
  const ChartPage page = pageOf({line("SG", kRed, {5.0})});
  EXPECT_GT(find(renderCharts(page), kRed, 0, page.chart_width, page.chart_height).pixels, 20);
}

TEST_F(Charts, ChartsStandBesideEachOtherAndTheLegendNamesEachSeriesOnce) {
  ChartPage page = pageOf({line("SG", kRed, {1.0, 2.0})});
  page.charts.push_back(page.charts[0]);
  page.charts[1].series[0] = line("PG", kBlue, {1.0, 2.0});
  const Image image = renderCharts(page);
  EXPECT_EQ(2 * page.chart_width, image.width);
  EXPECT_EQ(0, find(image, kBlue, 0, page.chart_width, page.chart_height).pixels);
  EXPECT_EQ(0, find(image, kRed, page.chart_width, image.width, page.chart_height).pixels);
  const int all = find(image, kRed, 0, image.width, image.height).pixels;
  EXPECT_GT(all, find(image, kRed, 0, image.width, page.chart_height).pixels) << "legend";
}

/// Whether a column has ink between two rows.
bool hasInk(const Image& image, int column, int from, int to) {
  for (int row = from; row < to; ++row) {
    const Color c = colorAt(image, column, row);
    if (c.red + c.green + c.blue < 600) return true;
  }
  return false;
}

TEST_F(Charts, NumbersOfAnAxisNeverMeet) {
  ChartPage page = pageOf({line("SG", kRed, {1.0, 2.0, 3.0, 2.0, 1.0, 2.0, 3.0, 4.0})});
  page.charts[0].series[0].x = {0.05, 0.06, 0.07, 0.08, 0.1, 0.11, 0.5, 1.0};
  const Image image = renderCharts(page);
  // "0.05" is some 30 pixels wide, and parts of a text are at most 5 apart.
  int first = -1, last = -1, texts = 0;
  for (int column = 0; column < image.width; ++column) {
    if (!hasInk(image, column, page.chart_height - 58, page.chart_height - 40)) continue;
    if (first < 0 || column - last > 5) {
      first = column;
      ++texts;
    }
    last = column;
    EXPECT_LT(last - first, 40) << "texts meet at column " << column;
  }
  EXPECT_GE(texts, 4);
  EXPECT_LT(texts, 8);
}

TEST_F(Charts, LegendHasAsManyRowsAsItNeeds) {
  ChartPage page = pageOf({});
  for (const char* name : {"SG (standard grid)", "OG (octree)", "RA (rectangular cuboids)",
                           "PG (paper)", "PG (compact)"}) {
    page.charts[0].series.push_back(line(name, kBlue, {1.0, 2.0}));
  }
  page.charts[0].series[4].color = kRed;
  page.charts[0].title = std::string(200, 'W');
  const Image image = renderCharts(page);
  for (const int column : {0, image.width - 1})
    EXPECT_FALSE(hasInk(image, column, 0, image.height)) << "cut off at column " << column;
  const int one_row = renderCharts(pageOf({line("SG", kRed, {1.0, 2.0})})).height;
  EXPECT_GT(image.height, one_row);
  const int all = find(image, kRed, 0, image.width, image.height).pixels;
  EXPECT_GT(all, find(image, kRed, 0, image.width, page.chart_height).pixels + 100);
}

TEST(ChartPages, RefuseWhatCannotBeAPage) {
  EXPECT_THROW(renderCharts(ChartPage()), InputError);
  EXPECT_THROW(renderCharts(pageOf({})), InputError);
  EXPECT_THROW(renderCharts(pageOf({line("SG", kRed, {NAN, NAN})})), InputError);
  ChartPage odd = pageOf({line("SG", kRed, {1.0, 2.0})});
  odd.charts[0].series[0].y.pop_back();
  EXPECT_THROW(renderCharts(odd), InputError);
  odd = pageOf({line("SG", kRed, {1.0, 2.0})});
  odd.charts[0].series[0].high = {1.0};
  EXPECT_THROW(renderCharts(odd), InputError);
  odd = pageOf({line("SG", kRed, {1.0, 2.0})});
  odd.chart_width = 10;
  EXPECT_THROW(renderCharts(odd), ParameterError);
}

}  // namespace
}  // namespace planar_mapping
