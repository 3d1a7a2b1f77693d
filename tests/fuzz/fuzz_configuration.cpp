// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A configuration file.
#include "fuzz.h"
#include "planar_mapping/pipeline/configuration.h"

using namespace planar_mapping;

namespace {

std::string effective(const std::string& text) {
  StageTable table;
  registerBuiltinStages(table);
  return effectiveYaml(parseConfiguration(text, "/fuzz/c.yaml", table, {}, Plugins::Ignore));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string text;
  if (!fuzz::succeeds([&] { text = effective(fuzz::Input(data, size).rest()); })) return 0;
  fuzz::require(effective(text) == text, "the effective text is read as the same");
  return 0;
}
