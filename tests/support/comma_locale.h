// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <locale>
#include <string>

namespace planar_mapping::test {

/// As long as it lives, streams write 12.345,5 unless they are told a locale.
class CommaLocale {
 public:
  CommaLocale() = default;
  ~CommaLocale() { std::locale::global(before_); }
  CommaLocale(const CommaLocale&) = delete;
  CommaLocale& operator=(const CommaLocale&) = delete;

 private:
  class Numbers : public std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };

  std::locale before_ = std::locale::global(std::locale(std::locale::classic(), new Numbers));
};

}  // namespace planar_mapping::test
