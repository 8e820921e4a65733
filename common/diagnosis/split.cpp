// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/split.h"

#include <utility>

#include "common/diagnosis/calibration.h"
#include "common/diagnosis/record_faults.h"

namespace zerodrift::diagnosis {
Split split_records(const twin::Model& model, const PlayedRecord& record,
                    const std::vector<PlayedRecord>& validation,
                    const std::vector<std::uint8_t>& sound, core::Axis axis) {
  constexpr double kLeastInReach = 0.2;
  Split split{.kind = HeldOut::kRecords, .fitted = sound};
  double left_out = 0.0;
  double all = 0.0;
  for (const PlayedRecord& other : validation) {
    const MeasuredSeries& series = *other.series;
    const auto residual =
        difference(measured_drift(series, axis), other.playback->drift(model, axis),
                   series.valid[core::index(axis)]);
    HeldOutPart part{&series, other.playback, find_record_faults(series, axis, residual).sound};
    if (lists_without_coefficients(model, axis)) {
      const auto size = static_cast<double>(series.size);
      const auto elsewhere = static_cast<double>(keep_in_reach(part, *record.series, sound));
      const bool too_few = size - elsewhere < kLeastInReach * size;
      left_out += too_few ? size : elsewhere;
      all += size;
      if (too_few) continue;
    }
    if (can_judge(part)) split.held_out.push_back(std::move(part));
  }
  if (split.held_out.empty()) split = split_in_blocks(*record.series, *record.playback, sound);
  if (all > 0.0) split.share_out_of_reach = left_out / all;
  return split;
}

}  // namespace zerodrift::diagnosis
