// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// prior_maps_writer MAP.pmap...: prints src/map/src/prior_maps.cpp with these maps as the prior
// ones (scripts/prior_maps.sh).
#include <cstdio>
#include <exception>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "planar_mapping/core/error.h"
#include "record_coder.h"

namespace {

using namespace planar_mapping::detail;
using Bytes = std::vector<std::uint8_t>;

MapRecord read(const char* path) {
  constexpr std::size_t kHeader = 9;
  std::ifstream stream(path, std::ios::binary);
  const Bytes file((std::istreambuf_iterator<char>(stream)), {});
  if (file.size() <= kHeader) throw planar_mapping::Error(std::string("cannot read ") + path);
  BitCoder in(file.data() + kHeader, file.size() - kHeader, path);
  MapRecord record;
  in.finishReading(RecordCoder::experienced().code(in, record));
  return record;
}

void print(const Bytes& bytes, int count) {
  std::printf(
      "// SPDX-FileCopyrightText: planar_mapping contributors\n"
      "// SPDX-License-Identifier: BSD-3-Clause\n"
      "//\n"
      "// Written by scripts/prior_maps.sh.\n"
      "#include \"prior_maps.h\"\n\n"
      "namespace planar_mapping::detail {\n\n"
      "const std::size_t kPriorMapCount = %d;\n"
      "const std::size_t kPriorMapsSize = %zu;\n"
      "// clang-format off\n"
      "const std::uint8_t kPriorMaps[] = {",
      count, bytes.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::printf("%s%d%s", i % 25 == 0 ? "\n" : "", bytes[i], i + 1 < bytes.size() ? "," : "");
  }
  std::printf(
      "};\n"
      "// clang-format on\n\n"
      "}  // namespace planar_mapping::detail\n");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    BitCoder out;
    RecordCoder learning;
    for (int i = 1; i < argc; ++i) {
      MapRecord record = read(argv[i]);
      learning.code(out, record);
    }
    Bytes bytes = out.finish(0);
    if (bytes.empty()) bytes.push_back(0);  // an array has a byte at least
    print(bytes, argc - 1);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "prior_maps_writer: %s\n", error.what());
    return 1;
  }
}
