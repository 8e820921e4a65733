// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/column_memory.h"

#include <algorithm>

namespace zerodrift::diagnosis {

void ColumnMemory::begin(std::span<const std::uint8_t> valid, std::size_t single_coefficients) {
  now_.clear();  // of a search that did not come to its end
  const bool same = single_coefficients == single_coefficients_ &&
                    std::equal(valid.begin(), valid.end(), valid_.begin(), valid_.end());
  if (same) return;
  valid_.assign(valid.begin(), valid.end());
  single_coefficients_ = single_coefficients;
  before_.clear();
}

ColumnMemory::Columns ColumnMemory::find(const std::string& identity,
                                         const std::vector<double>& shape) {
  const auto kept = before_.find({identity, shape});
  if (identity.empty() || kept == before_.end()) return nullptr;
  now_.insert(*kept);
  return kept->second;
}

void ColumnMemory::keep(const std::string& identity, const std::vector<double>& shape,
                        Columns columns) {
  if (!identity.empty()) now_[{identity, shape}] = std::move(columns);
}

void ColumnMemory::end() {
  before_ = std::move(now_);
  now_.clear();
}

}  // namespace zerodrift::diagnosis
