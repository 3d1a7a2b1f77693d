// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause

// Part of programs that draw, in sanitized builds only. The graphics driver keeps memory until the
// process ends and is unloaded before leaks are looked for, so that no suppression can name it; its
// threads are not instrumented.
extern "C" {
__attribute__((used, visibility("default"))) const char* __asan_default_options() {
  return "detect_leaks=0";
}
__attribute__((used, visibility("default"))) const char* __tsan_default_options() {
  return "ignore_noninstrumented_modules=1";
}
}
