// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause

// Part of programs that use the network, in sanitized builds only. The packaged libzmq, libsodium,
// OpenCV and TBB are not instrumented: the thread sanitizer sees their threads take and free
// messages and key points, but not how they are handed over.
extern "C" {
__attribute__((used, visibility("default"))) const char* __tsan_default_suppressions() {
  return "called_from_lib:libzmq.so\ncalled_from_lib:libsodium.so\n"
         "race:libopencv_\nrace:libtbb.so\n";
}
}
