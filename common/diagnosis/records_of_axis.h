// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <list>
#include <optional>
#include <utility>

#include "common/core/axis.h"
#include "common/diagnosis/measured_series.h"
#include "common/diagnosis/motion.h"
#include "common/diagnosis/playback.h"
#include "common/diagnosis/verdict.h"

namespace zerodrift::diagnosis {

// A record and the twin's effects over it.
struct PlayedRecord {
  const MeasuredSeries* series;
  const Playback* playback;
};

// Records as one axis can be judged on them: of those in which it turns without a reference the
// longest stretch at rest.
class RecordsOfAxis {
 public:
  explicit RecordsOfAxis(core::Axis axis) : axis_(axis) {}

  // Nothing where the gyro never rests for as long as a record has to be.
  [[nodiscard]] std::optional<PlayedRecord> judged(const PlayedRecord& record,
                                                   std::optional<UnreferencedMotion>& motion) {
    motion = motion_without_reference(*record.series, axis_);
    if (!motion) return record;
    MeasuredSeries part = part_at_rest(*record.series, *motion);
    if (why_too_short(part)) return std::nullopt;
    Own& own = own_.emplace_back(std::move(part));
    return PlayedRecord{&own.series, &own.playback};
  }

 private:
  struct Own {
    explicit Own(MeasuredSeries part) : series(std::move(part)), playback(series) {}

    MeasuredSeries series;
    Playback playback;
  };

  core::Axis axis_;
  std::list<Own> own_;  // what is added moves nothing
};

}  // namespace zerodrift::diagnosis
