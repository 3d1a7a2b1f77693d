// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "planar_mapping/core/base/error.h"

/// Objects that remember earlier frames as bytes, so that an interrupted run continues bit for bit.
/// A class lists its members once, for both directions:
///
///     template <typename Archive>
///     void visitState(Archive& archive) { archive(frame_, tracks_); }
///
/// The bytes are for the same build on the same kind of machine.
namespace planar_mapping::detail {

class StateWriter {
 public:
  static constexpr bool kReads = false;

  template <typename... Values>
  void operator()(const Values&... values) {
    (put(values), ...);
  }
  std::string take() { return std::move(bytes_); }

 private:
  void raw(const void* data, std::size_t size) {
    if (size > 0) bytes_.append(static_cast<const char*>(data), size);
  }
  template <typename T>
  void put(const T& value) {
    static_assert(!std::is_pointer_v<T>, "a pointer means nothing to another process");
    if constexpr (std::is_trivially_copyable_v<T>) {
      raw(&value, sizeof value);
    } else {
      const_cast<T&>(value).visitState(*this);  // which only reads it
    }
  }
  template <typename S, int R, int C, int O, int MR, int MC>
  void put(const Eigen::Matrix<S, R, C, O, MR, MC>& value) {
    static_assert(R > 0 && C > 0, "of a fixed size");
    raw(value.data(), sizeof(S) * R * C);
  }
  template <typename S, int D, int M, int O>
  void put(const Eigen::Transform<S, D, M, O>& value) {
    put(value.matrix());
  }
  template <typename A, typename B>
  void put(const std::pair<A, B>& value) {
    (*this)(value.first, value.second);
  }
  template <typename T>
  void put(const std::optional<T>& value) {
    put(value.has_value());
    if (value) put(*value);
  }
  template <typename List>
  void putList(const List& list) {
    put(std::uint64_t{list.size()});
    for (const auto& value : list) put(value);
  }
  void put(const std::string& text) {
    put(std::uint64_t{text.size()});
    raw(text.data(), text.size());
  }
  template <typename T>
  void put(const std::vector<T>& list) {
    if constexpr (std::is_trivially_copyable_v<T>) {
      put(std::uint64_t{list.size()});
      raw(list.data(), list.size() * sizeof(T));
    } else {
      putList(list);
    }
  }
  template <typename T>
  void put(const std::deque<T>& list) {
    putList(list);
  }
  template <typename K, typename V>
  void put(const std::map<K, V>& table) {
    putList(table);
  }
  template <typename K, typename V>
  void put(const std::unordered_map<K, V>& table) {
    putList(table);
  }

  std::string bytes_;
};

/// \throws Error where the bytes end too early
class StateReader {
 public:
  static constexpr bool kReads = true;

  explicit StateReader(std::string_view bytes) : bytes_(bytes) {}

  template <typename... Values>
  void operator()(Values&... values) {
    (get(values), ...);
  }
  /// \throws Error if there are more bytes than were read
  void finish() const {
    if (!bytes_.empty()) throw Error("the saved state has another size than expected");
  }

 private:
  void raw(void* data, std::size_t size) {
    if (size > bytes_.size()) throw Error("the saved state is cut short");
    if (size > 0) std::memcpy(data, bytes_.data(), size);
    bytes_.remove_prefix(size);
  }
  /// Number of values that follow, each of at least so many bytes.
  std::size_t count(std::size_t least = 1) {
    std::uint64_t size = 0;
    get(size);
    if (size > bytes_.size() / least) throw Error("the saved state is cut short");
    return static_cast<std::size_t>(size);
  }
  template <typename T>
  void get(T& value) {
    if constexpr (std::is_trivially_copyable_v<T>) {
      raw(&value, sizeof value);
    } else {
      value.visitState(*this);
    }
  }
  template <typename S, int R, int C, int O, int MR, int MC>
  void get(Eigen::Matrix<S, R, C, O, MR, MC>& value) {
    raw(value.data(), sizeof(S) * R * C);
  }
  template <typename S, int D, int M, int O>
  void get(Eigen::Transform<S, D, M, O>& value) {
    get(value.matrix());
  }
  template <typename A, typename B>
  void get(std::pair<A, B>& value) {
    (*this)(value.first, value.second);
  }
  template <typename T>
  void get(std::optional<T>& value) {
    bool has_value = false;
    get(has_value);
    value.reset();
    if (has_value) get(value.emplace());
  }
  void get(std::string& text) {
    text.resize(count());
    raw(text.data(), text.size());
  }
  template <typename T>
  void get(std::vector<T>& list) {
    if constexpr (std::is_trivially_copyable_v<T>) {
      list.resize(count(sizeof(T)));
      raw(list.data(), list.size() * sizeof(T));
    } else {
      getList(list);
    }
  }
  template <typename T>
  void get(std::deque<T>& list) {
    getList(list);
  }
  template <typename List>
  void getList(List& list) {
    list.clear();
    for (std::size_t left = count(); left > 0; --left) get(list.emplace_back());
  }
  template <typename K, typename V>
  void get(std::map<K, V>& table) {
    getTable(table);
  }
  template <typename K, typename V>
  void get(std::unordered_map<K, V>& table) {
    getTable(table);
  }
  template <typename Table>
  void getTable(Table& table) {
    table.clear();
    for (std::size_t left = count(); left > 0; --left) {
      typename Table::key_type key{};
      get(key);
      get(table[key]);
    }
  }

  std::string_view bytes_;
};

template <typename T>
std::string stateOf(const T& object) {
  StateWriter writer;
  writer(object);
  return writer.take();
}

/// \throws Error if the bytes are not what stateOf() made of such an object
template <typename T>
void restoreState(T& object, std::string_view bytes) {
  StateReader reader(bytes);
  reader(object);
  reader.finish();
}

}  // namespace planar_mapping::detail
