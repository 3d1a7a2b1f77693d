// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// prior_maps_writer pmap|pbox MAP...: prints src/map/src/prior_maps.cpp, or of finished maps
// prior_finished_maps.cpp, with these maps as the prior ones (scripts/prior_maps.sh).
#include <algorithm>
#include <cstdio>
#include <exception>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "finished_coder.h"
#include "planar_mapping/core/error.h"
#include "record_coder.h"

namespace {

using namespace planar_mapping::detail;
using Bytes = std::vector<std::uint8_t>;

template <typename Record, typename Coder>
Record read(const char* path, Coder coder) {
  constexpr std::size_t kHeader = 9;
  std::ifstream stream(path, std::ios::binary);
  const Bytes file((std::istreambuf_iterator<char>(stream)), {});
  if (file.size() <= kHeader) throw planar_mapping::Error(std::string("cannot read ") + path);
  BitCoder in(file.data() + kHeader, file.size() - kHeader, path);
  Record record;
  in.finishReading(coder.code(in, record));
  return record;
}

/// The maps one after the other, by a coder that starts without experience.
template <typename Record, typename Coder>
Bytes coded(const std::vector<const char*>& paths) {
  BitCoder out;
  Coder learning;
  for (const char* path : paths) {
    Record record = read<Record>(path, Coder::experienced());
    learning.code(out, record);
  }
  return out.finish(0);
}

void print(const std::string& name, Bytes bytes, std::size_t count) {
  if (bytes.empty()) bytes.push_back(0);  // an array has a byte at least
  std::printf(
      "// SPDX-FileCopyrightText: planar_mapping contributors\n"
      "// SPDX-License-Identifier: BSD-3-Clause\n"
      "//\n"
      "// Written by scripts/prior_maps.sh.\n"
      "#include \"prior_maps.h\"\n\n"
      "namespace planar_mapping::detail {\n\n"
      "const std::size_t %sCount = %zu;\n"
      "const std::size_t %ssSize = %zu;\n"
      "// clang-format off\n"
      "const std::uint8_t %ss[] = {",
      name.c_str(), count, name.c_str(), bytes.size(), name.c_str());
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
    const std::string kind = argc > 1 ? argv[1] : "";
    const std::vector<const char*> paths(argv + std::min(argc, 2), argv + argc);
    if (kind == "pmap") {
      print("kPriorMap", coded<MapRecord, RecordCoder>(paths), paths.size());
    } else if (kind == "pbox") {
      print("kPriorFinishedMap", coded<FinishedRecord, FinishedCoder>(paths), paths.size());
    } else {
      throw planar_mapping::Error("say pmap or pbox");
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "prior_maps_writer: %s\n", error.what());
    return 1;
  }
}
