// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// C interface of plane_bench, the program that times plane extractors of several libraries on the
// same clouds. It loads extractors of others as shared objects that export these three functions;
// layout and names are its, so they differ from the style of this project.
extern "C" {

struct pb_input {
  const float* xyz;       ///< 3 * n floats, metres; NaN where nothing was measured
  int n;                  ///< number of points
  int width, height;      ///< height > 1: organized, row major
  float dist;             ///< inlier distance, metres
  int min_inliers;        ///< smallest plane that counts
  double fx, fy, cx, cy;  ///< intrinsics in pixels, 0 when unknown
};

struct pb_output {
  int* labels;     ///< n entries to fill: plane number, -1 = none
  double* planes;  ///< a, b, c, d of up to max_planes planes
  int max_planes;
  int n_planes;   ///< how many were written
  double ms_pre;  ///< preparation, milliseconds
  double ms_seg;  ///< segmentation, milliseconds
};

__attribute__((visibility("default"))) int pb_count(void);
__attribute__((visibility("default"))) const char* pb_name(int i);
__attribute__((visibility("default"))) int pb_run(int i, const pb_input* in, pb_output* out);
}
