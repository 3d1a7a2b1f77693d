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

#include "planar_mapping/base/error.h"

/// Objects that remember earlier frames as bytes, so that an interrupted run continues bit for bit.
/// A class lists its members once, for both directions:
///
///     template <typename Archive>
///     void visitState(Archive& archive) { archive(frame_, tracks_); }
///
/// The bytes are for the same build on the same kind of machine.
namespace planar_mapping::detail {

/// Writes values, or reads them back in the same order.
/// \throws Error where the bytes to be read end too early
template <bool reads>
class StateArchive {
 public:
  static constexpr bool kReads = reads;

  StateArchive() = default;
  explicit StateArchive(std::string_view bytes) : rest_(bytes) {}

  template <typename... Values>
  void operator()(Values&&... values) {
    // What is written is not changed.
    (visit(const_cast<std::remove_const_t<std::remove_reference_t<Values>>&>(values)), ...);
  }
  /// The bytes written.
  std::string take() { return std::move(written_); }
  /// \throws Error if there are more bytes than were read
  void finish() const {
    if (!rest_.empty()) throw Error("the saved state has another size than expected");
  }

 private:
  void raw(void* data, std::size_t size) {
    if (size == 0) return;
    if constexpr (kReads) {
      if (size > rest_.size()) throw Error("the saved state is cut short");
      std::memcpy(data, rest_.data(), size);
      rest_.remove_prefix(size);
    } else {
      written_.append(static_cast<const char*>(data), size);
    }
  }
  /// Number of values that follow, each of at least so many bytes.
  std::size_t count(std::uint64_t size, std::size_t least = 1) {
    visit(size);
    if (kReads && size > rest_.size() / least) throw Error("the saved state is cut short");
    return static_cast<std::size_t>(size);
  }
  template <typename T>
  void visit(T& value) {
    static_assert(!std::is_pointer_v<T>, "a pointer means nothing to another process");
    if constexpr (std::is_trivially_copyable_v<T>) {
      raw(&value, sizeof value);
    } else {
      value.visitState(*this);
    }
  }
  template <typename S, int R, int C, int O, int MR, int MC>
  void visit(Eigen::Matrix<S, R, C, O, MR, MC>& value) {
    static_assert(R > 0 && C > 0, "of a fixed size");
    raw(value.data(), sizeof(S) * R * C);
  }
  template <typename S, int D, int M, int O>
  void visit(Eigen::Transform<S, D, M, O>& value) {
    visit(value.matrix());
  }
  template <typename A, typename B>
  void visit(std::pair<A, B>& value) {
    (*this)(value.first, value.second);
  }
  template <typename T>
  void visit(std::optional<T>& value) {
    bool has_value = value.has_value();
    visit(has_value);
    if constexpr (kReads) {
      value.reset();
      if (has_value) value.emplace();
    }
    if (value) visit(*value);
  }
  void visit(std::string& text) {
    text.resize(count(text.size()));
    raw(text.data(), text.size());
  }
  template <typename T>
  void visit(std::vector<T>& list) {
    if constexpr (std::is_trivially_copyable_v<T>) {
      list.resize(count(list.size(), sizeof(T)));
      raw(list.data(), list.size() * sizeof(T));
    } else {
      visitList(list);
    }
  }
  template <typename T>
  void visit(std::deque<T>& list) {
    visitList(list);
  }
  template <typename K, typename V>
  void visit(std::map<K, V>& table) {
    visitTable(table);
  }
  template <typename K, typename V>
  void visit(std::unordered_map<K, V>& table) {
    visitTable(table);
  }
  template <typename List>
  void visitList(List& list) {
    std::size_t left = count(list.size());
    if constexpr (kReads) {
      list.clear();
      for (; left > 0; --left) visit(list.emplace_back());
    } else {
      for (auto& value : list) visit(value);
    }
  }
  template <typename Table>
  void visitTable(Table& table) {
    std::size_t left = count(table.size());
    if constexpr (kReads) {
      table.clear();
      for (; left > 0; --left) {
        typename Table::key_type key{};
        visit(key);
        visit(table[key]);
      }
    } else {
      for (auto& [key, value] : table) (*this)(key, value);
    }
  }

  std::string written_;
  std::string_view rest_;  ///< to be read
};
using StateWriter = StateArchive<false>;
using StateReader = StateArchive<true>;

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
