// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "store/heap_value.h"
#include "store/packed_bytes.h"

namespace planar_mapping::detail {

/// A row of records of some bytes each, in pages of about kPage bytes: most records of a map are so
/// short that blocks and pointers of their own would take as much again.
class PackedRecords {
 public:
  static constexpr std::size_t kPage = 2048;

  struct Record {
    const std::uint8_t* data = nullptr;
    std::size_t size = 0;
    std::uint32_t page = 0;
  };
  /// Where the records are, in their order; until the next change.
  std::vector<Record> list() const;
  /// To change bytes of a record of list() in place.
  std::uint8_t* bytesOf(const Record& record) {
    PackedBytes& page = this->page(record.page);
    return page.data() + (record.data - page.data());
  }
  std::size_t memoryBytes() const;  ///< on the heap

  /// What the row is to be. A page of which every record is kept, and nothing else comes between,
  /// is kept as it is: what did not change costs no more than a look.
  class Change {
   public:
    /// \param before  list()
    explicit Change(const std::vector<Record>& before) : before_(before) {}
    /// The next record is this one of those before; in ascending order.
    void keep(std::size_t record) { items_.push_back({record, 0, 0}); }
    /// The next record is a new one.
    void put(const std::vector<std::uint8_t>& bytes) {
      items_.push_back({kNew, bytes_.size(), bytes.size()});
      bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    }

   private:
    friend class PackedRecords;
    static constexpr std::size_t kNew = static_cast<std::size_t>(-1);
    struct Item {
      std::size_t kept;  ///< of those before, or kNew
      std::size_t begin;
      std::size_t size;
    };
    Record recordOf(const Item& item) const {
      if (item.kept != kNew) return before_[item.kept];
      return {bytes_.data() + item.begin, item.size, 0};
    }
    /// Is the page that starts with this item kept whole? \return how many records it has, 0 = no
    std::size_t wholePageAt(std::size_t item) const;

    const std::vector<Record>& before_;
    std::vector<Item> items_;
    std::vector<std::uint8_t> bytes_;  ///< of the new ones
  };
  void apply(const Change& change);

 private:
  std::size_t pages() const { return first_.empty() ? 0 : 1 + (others_ ? others_->size() : 0); }
  const PackedBytes& page(std::size_t i) const { return i == 0 ? first_ : (*others_)[i - 1]; }
  PackedBytes& page(std::size_t i) { return i == 0 ? first_ : (*others_)[i - 1]; }
  void setPages(std::vector<PackedBytes> pages);

  // Records one after the other, each behind its size. Most maps have one page.
  PackedBytes first_;
  HeapValue<std::vector<PackedBytes>> others_;
};

}  // namespace planar_mapping::detail
