// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
extern "C" int planar_mapping_plugin_interface() {
  return 0;
}
extern "C" void planar_mapping_plugin_stages(void*) {}
