// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "store/packed_records.h"

#include <iterator>
#include <utility>

#include "store/packed_numbers.h"

namespace planar_mapping::detail {

std::vector<PackedRecords::Record> PackedRecords::list() const {
  std::vector<Record> records;
  for (std::size_t p = 0; p < pages(); ++p) {
    PackReader in(page(p).data());
    const std::uint8_t* end = page(p).data() + page(p).size();
    while (in.at() != end) {
      const auto size = in.as<std::size_t>();
      records.push_back({in.at(), size, static_cast<std::uint32_t>(p)});
      in.skip(size);
    }
  }
  return records;
}

std::size_t PackedRecords::Change::wholePageAt(std::size_t item) const {
  const std::size_t first = items_[item].kept;
  if (first == kNew) return 0;
  const std::uint32_t page = before_[first].page;
  if (first > 0 && before_[first - 1].page == page) return 0;
  std::size_t n = 0;
  std::size_t bytes = 0;
  for (; first + n < before_.size() && before_[first + n].page == page; ++n) {
    if (item + n >= items_.size() || items_[item + n].kept != first + n) return 0;
    bytes += before_[first + n].size;
  }
  return 2 * bytes >= kPage ? n : 0;  // small ones are joined with what comes next
}

void PackedRecords::apply(const Change& change) {
  std::vector<PackedBytes> pages;
  PackWriter page;
  const auto endPage = [&] {
    if (!page.bytes.empty()) pages.emplace_back(page.bytes);
    page.bytes.clear();
  };
  for (std::size_t i = 0; i < change.items_.size();) {
    const std::size_t whole =
        2 * page.bytes.size() >= kPage || page.bytes.empty() ? change.wholePageAt(i) : 0;
    const Record record = change.recordOf(change.items_[i]);
    if (whole > 0) {
      endPage();
      pages.push_back(std::move(this->page(record.page)));
      i += whole;
      continue;
    }
    if (page.bytes.size() + record.size > kPage) endPage();
    page.number(record.size);
    page.append(record.data, record.size);
    ++i;
  }
  endPage();
  setPages(std::move(pages));
}

void PackedRecords::setPages(std::vector<PackedBytes> pages) {
  first_ = pages.empty() ? PackedBytes() : std::move(pages.front());
  others_.reset();
  if (pages.size() < 2) return;
  others_.reset(new std::vector<PackedBytes>(std::make_move_iterator(pages.begin() + 1),
                                             std::make_move_iterator(pages.end())));
}

std::size_t PackedRecords::memoryBytes() const {
  std::size_t bytes = others_ ? heapBytes(sizeof *others_) + heapBytes(*others_) : 0;
  for (std::size_t p = 0; p < pages(); ++p) bytes += page(p).memoryBytes();
  return bytes;
}

}  // namespace planar_mapping::detail
