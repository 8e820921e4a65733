// SPDX-License-Identifier: Apache-2.0
// Which messages of MCAP files a record is made of: those of one gyro in a recording of this
// project's topics, or those of the chosen topics of a ROS 2 bag.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/record/message_stream.h"
#include "common/record/record_reader.h"

namespace zerodrift::record {

class RecordedMessages {
 public:
  virtual ~RecordedMessages() = default;

  // From the first message on. Those that it gave out before are not to be used any more.
  [[nodiscard]] virtual MessageStreams open() = 0;
  // Sets the gyro and the probes, in the order of MessageStreams::probes, and adds what was chosen
  // without being asked for to the warnings.
  virtual void describe(RecordInfo& info) const = 0;
  // "angular_rate of gyro 3", "/imu/data_raw": for lines about a rate.
  [[nodiscard]] virtual std::string rates_name() const = 0;
  // Where the interval of the first rate is not in the messages but follows from those behind it.
  [[nodiscard]] virtual bool first_interval_is_missing() const = 0;
  // Why that is no record where none of the messages holds a rate; empty: it is one.
  [[nodiscard]] virtual std::string problem_without_rates() const = 0;
  // What was left out of the streams of the last open() so far, and why, one line each.
  [[nodiscard]] virtual std::vector<std::string> left_out() const = 0;
};

// Throws files::FileError where the files hold no such messages, or a choice is needed.
[[nodiscard]] std::unique_ptr<RecordedMessages> find_messages(const McapFiles& files,
                                                              const std::string& name,
                                                              const RecordOptions& options);

// The two that there are. find_messages() chooses.
[[nodiscard]] bool has_own_rates(const McapFiles& files);
[[nodiscard]] std::unique_ptr<RecordedMessages> find_own_messages(const McapFiles& files,
                                                                  const std::string& name,
                                                                  const RecordOptions& options);
[[nodiscard]] bool is_of_ros2(const McapFiles& files);
[[nodiscard]] std::unique_ptr<RecordedMessages> find_ros2_messages(const McapFiles& files,
                                                                   const std::string& name,
                                                                   const RecordOptions& options);

// Foreign names for a line, at most 16 of them; "none at all" of none.
[[nodiscard]] std::string listed(const std::vector<std::string>& names);

}  // namespace zerodrift::record
