// SPDX-License-Identifier: Apache-2.0
// Columns that several searches in one record have in common: making one, an effect played over the
// record and transformed, costs more than judging it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/diagnosis/evidence.h"
#include "common/diagnosis/search_problem.h"

namespace zerodrift::diagnosis {

// What a shape's columns are, whatever stands beside them.
struct ShapeColumns {
  Testability testability = Testability::kTestable;
  std::vector<SpectralColumn> columns;  // those that vary
  std::vector<std::size_t> which;       // their places among the group's own columns
  Eigen::MatrixXd own;                  // bins x q²
  Eigen::MatrixXd plain_gram;           // q x q, of unit columns, not whitened
};

// Of one record and one axis. It keeps what the last search asked for, so that it is never larger
// than that search: 4 bytes a point and column.
class ColumnMemory {
 public:
  using Columns = std::shared_ptr<const ShapeColumns>;

  // Begins a search. Other valid samples, or another number of single coefficients, make other
  // columns: then all is forgotten.
  void begin(std::span<const std::uint8_t> valid, std::size_t single_coefficients);
  // Of a group without an identity, and of what is not known: nothing.
  [[nodiscard]] Columns find(const std::string& identity, const std::vector<double>& shape);
  void keep(const std::string& identity, const std::vector<double>& shape, Columns columns);
  // Ends it: what it didn't ask for is forgotten.
  void end();

 private:
  using Key = std::pair<std::string, std::vector<double>>;

  std::vector<std::uint8_t> valid_;
  std::size_t single_coefficients_ = 0;
  std::map<Key, Columns> before_;
  std::map<Key, Columns> now_;
};

}  // namespace zerodrift::diagnosis
