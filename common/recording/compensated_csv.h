// SPDX-License-Identifier: Apache-2.0
// Compensated samples as a record: what `compensate` writes offline and `record` writes from the
// live topic, so that the two can be compared byte for byte.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "common/core/compensated_sample.h"
#include "common/record/record_writer.h"

namespace zerodrift::recording {

class CompensatedCsv {
 public:
  explicit CompensatedCsv(const std::filesystem::path& path);
  void write(const core::CompensatedSample& sample);
  [[nodiscard]] std::uint64_t bytes() const noexcept { return writer_.bytes(); }
  [[nodiscard]] std::string fault_of_times() const { return writer_.fault_of_times(); }
  void commit() { writer_.commit(); }
  std::filesystem::path keep() { return writer_.keep(); }

 private:
  record::RecordWriter writer_;
};

}  // namespace zerodrift::recording
