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

// The same with what it points to.
struct OwnRecord {
  explicit OwnRecord(MeasuredSeries own) : series(std::move(own)), playback(series) {}
  OwnRecord(const OwnRecord&) = delete;
  OwnRecord& operator=(const OwnRecord&) = delete;

  [[nodiscard]] PlayedRecord played() const { return {&series, &playback}; }

  MeasuredSeries series;
  Playback playback;
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
    return own_.emplace_back(std::move(part)).played();
  }

 private:
  core::Axis axis_;
  std::list<OwnRecord> own_;  // what is added moves nothing
};

}  // namespace zerodrift::diagnosis
