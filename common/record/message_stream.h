// SPDX-License-Identifier: Apache-2.0
// Messages of one kind out of MCAP files, as samples, each with a look ahead.
#pragma once

#include <algorithm>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/integer_time.h"
#include "common/core/samples.h"
#include "common/mcap/mcap_reader.h"

namespace zerodrift::record {

// Files that follow each other, as a bag is split.
using McapFiles = std::vector<std::shared_ptr<mcap::Reader>>;

// Whether the messages of a channel belong to a stream.
using TakesChannel = std::function<bool(const mcap::Contents&, const mcap::Channel&)>;

// Where a message lies in the files: what was recorded first is first.
struct Place {
  std::size_t file = 0;
  std::uint64_t message = 0;  // of the file, of any channel

  auto operator<=>(const Place&) const = default;
};

// The samples that `decode` makes of the messages of some channels, in the files' order. What it
// makes nothing of is passed over.
template <typename Sample>
class MessageStream {
 public:
  using Decode = std::function<std::optional<Sample>(std::string_view)>;

  MessageStream(McapFiles files, TakesChannel takes, Decode decode)
      : files_(std::move(files)), takes_(std::move(takes)), decode_(std::move(decode)) {
    advance();
  }

  [[nodiscard]] const std::optional<Sample>& head() const { return head_; }
  // Of the head.
  [[nodiscard]] Place place() const { return place_; }
  // The one behind the head; null at the end.
  [[nodiscard]] const Sample* second() {
    look_ahead(1);
    return behind_.empty() ? nullptr : &behind_.front().sample;
  }
  std::optional<Sample> take() {
    std::optional<Sample> taken = std::move(head_);
    advance();
    return taken;
  }

  // Whether the head is stamped far ahead of one of the kLookedAhead samples behind it: its stamp
  // is wrong then, and it would hold up all of them.
  [[nodiscard]] bool is_head_ahead() {
    if (is_head_ahead_) return *is_head_ahead_;
    look_ahead(kLookedAhead);
    is_head_ahead_ = std::any_of(behind_.begin(), behind_.end(), [this](const Placed& behind) {
      return core::is_far_ahead(head_->time, behind.sample.time);
    });
    return *is_head_ahead_;
  }

 private:
  // A clock that was wrong at first is set before so many readings.
  static constexpr std::size_t kLookedAhead = 64;

  struct Placed {
    Sample sample;
    Place place;
  };

  void advance() {
    is_head_ahead_.reset();
    if (behind_.empty()) {
      head_ = read();
      place_ = {file_, message_};
    } else {
      head_ = std::move(behind_.front().sample);
      place_ = behind_.front().place;
      behind_.pop_front();
    }
  }

  void look_ahead(std::size_t samples) {
    while (behind_.size() < samples) {
      auto sample = read();
      if (!sample) return;
      behind_.push_back({std::move(*sample), {file_, message_}});
    }
  }

  std::optional<Sample> read() {
    for (; file_ < files_.size(); leave_file()) {
      if (!cursor_) enter_file();
      for (mcap::Message message; !channels_.empty() && cursor_->next(message);) {
        ++message_;
        if (std::find(channels_.begin(), channels_.end(), message.channel_id) == channels_.end())
          continue;
        if (auto sample = decode_(message.data)) return sample;
      }
    }
    return std::nullopt;
  }

  void enter_file() {
    mcap::Reader& reader = *files_[file_];
    cursor_.emplace(reader);
    message_ = 0;
    channels_.clear();
    for (const auto& channel : reader.contents().channels) {
      if (takes_(reader.contents(), channel)) channels_.push_back(channel.id);
    }
  }

  void leave_file() {
    cursor_.reset();
    files_[file_]->drop_records();
    ++file_;
  }

  McapFiles files_;
  TakesChannel takes_;
  Decode decode_;
  std::size_t file_ = 0;
  std::optional<mcap::Cursor> cursor_;
  std::uint64_t message_ = 0;            // of the file, read last
  std::vector<std::uint16_t> channels_;  // of the file
  std::optional<Sample> head_;
  Place place_;
  std::deque<Placed> behind_;  // the head, as far as it was looked ahead
  std::optional<bool> is_head_ahead_;
};

struct MessageStreams {
  MessageStream<core::AngularRateSample> rates;
  MessageStream<core::RateReferenceSample> references;
  std::vector<MessageStream<core::TemperatureSample>> probes;
  MessageStream<core::EnvironmentSample> environment;
};

}  // namespace zerodrift::record
