// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// What benchmarks/python_calls.py compares Python with: state_of_points MAP.pmap POINTS, whose file
// holds xyz triples of double. Prints milliseconds for all of them, least of five.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <limits>
#include <vector>

#include "planar_mapping/io/map_file.h"

int main(int argc, char** argv) {
  using namespace planar_mapping;
  if (argc != 3) return 2;
  const PlanarMap map = io::loadMap(argv[1]);
  std::ifstream in(argv[2], std::ios::binary | std::ios::ate);
  std::vector<Vector3> points(static_cast<std::size_t>(in.tellg()) / sizeof(Vector3));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(points.data()),
          static_cast<std::streamsize>(points.size() * sizeof(Vector3)));
  std::vector<std::uint8_t> states(points.size());
  double least = std::numeric_limits<double>::infinity();
  for (int run = 0; run < 5; ++run) {
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < points.size(); ++i) {
      states[i] = static_cast<std::uint8_t>(map.stateAt(points[i]));
    }
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
    least = std::min(least, time.count());
  }
  std::printf("%.3f\n", least);
}
