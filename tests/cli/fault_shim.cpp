// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Preloaded into a program (LD_PRELOAD), this makes one of its operations on files below
// FAULT_DIRECTORY fail: FAULT_KIND is kill (SIGKILL before the operation), eio (that operation) or
// full (that operation and later ones that need room, ENOSPC), FAULT_AT its number from 1. The file
// FAULT_MARK says that it came so far.
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <string>

namespace {

template <typename Function>
Function* original(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

bool isBelow(const char* path) {
  const char* directory = std::getenv("FAULT_DIRECTORY");
  return directory != nullptr && std::strncmp(path, directory, std::strlen(directory)) == 0;
}

bool isBelow(int descriptor) {
  char path[4096];
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
  const ssize_t size = ::readlink(link.c_str(), path, sizeof path - 1);
  if (size <= 0) return false;
  path[size] = '\0';
  return isBelow(path);
}

/// \return whether the operation, which is on a file of the directory, is to fail
bool fails(bool needs_room) {
  static std::atomic<int> count{0};
  static const int at = std::atoi(std::getenv("FAULT_AT") ? std::getenv("FAULT_AT") : "0");
  static const std::string kind = std::getenv("FAULT_KIND") ? std::getenv("FAULT_KIND") : "";
  const int number = ++count;
  const bool is_full = kind == "full";
  if (at == 0 || number < at || (number > at && !is_full)) return false;
  if (number == at) {
    static auto* open_file = original<int(const char*, int, ...)>("open");
    const int mark = open_file(std::getenv("FAULT_MARK"), O_CREAT | O_WRONLY, 0666);
    if (mark >= 0) ::close(mark);
    if (kind == "kill") ::kill(::getpid(), SIGKILL);
  }
  if (is_full && !needs_room) return false;
  errno = is_full ? ENOSPC : EIO;
  return true;
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  static auto* next = original<int(const char*, int, ...)>("open");
  va_list list;
  va_start(list, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(list, mode_t) : 0;
  va_end(list);
  if ((flags & O_CREAT) != 0 && isBelow(path) && fails(true)) return -1;
  return next(path, flags, mode);
}
ssize_t write(int descriptor, const void* data, size_t size) {
  static auto* next = original<ssize_t(int, const void*, size_t)>("write");
  return isBelow(descriptor) && fails(true) ? -1 : next(descriptor, data, size);
}
int fsync(int descriptor) {
  static auto* next = original<int(int)>("fsync");
  return isBelow(descriptor) && fails(true) ? -1 : next(descriptor);
}
int mkdir(const char* path, mode_t mode) {
  static auto* next = original<int(const char*, mode_t)>("mkdir");
  return isBelow(path) && fails(true) ? -1 : next(path, mode);
}
int rename(const char* from, const char* to) {
  static auto* next = original<int(const char*, const char*)>("rename");
  return isBelow(to) && fails(false) ? -1 : next(from, to);
}
int renameat2(int from_directory, const char* from, int to_directory, const char* to,
              unsigned flags) {
  static auto* next = original<int(int, const char*, int, const char*, unsigned)>("renameat2");
  return isBelow(to) && fails(false) ? -1 : next(from_directory, from, to_directory, to, flags);
}
int unlink(const char* path) {
  static auto* next = original<int(const char*)>("unlink");
  return isBelow(path) && fails(false) ? -1 : next(path);
}
int remove(const char* path) {
  static auto* next = original<int(const char*)>("remove");
  return isBelow(path) && fails(false) ? -1 : next(path);
}

}  // extern "C"
