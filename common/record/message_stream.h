// SPDX-License-Identifier: Apache-2.0
// Messages of one kind out of MCAP files, as samples, each with a look ahead.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/samples.h"
#include "common/mcap/mcap_reader.h"

namespace zerodrift::record {

// Files that follow each other, as a bag is split.
using McapFiles = std::vector<std::shared_ptr<mcap::Reader>>;

// Whether the messages of a channel belong to a stream.
using TakesChannel = std::function<bool(const mcap::Contents&, const mcap::Channel&)>;

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
  std::optional<Sample> take() {
    std::optional<Sample> taken = std::move(head_);
    advance();
    return taken;
  }

 private:
  void advance() {
    head_.reset();
    for (; file_ < files_.size(); leave_file()) {
      if (!cursor_) enter_file();
      for (mcap::Message message; !channels_.empty() && cursor_->next(message);) {
        if (std::find(channels_.begin(), channels_.end(), message.channel_id) == channels_.end())
          continue;
        head_ = decode_(message.data);
        if (head_) return;
      }
    }
  }

  void enter_file() {
    mcap::Reader& reader = *files_[file_];
    cursor_.emplace(reader);
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
  std::vector<std::uint16_t> channels_;  // of the file
  std::optional<Sample> head_;
};

struct MessageStreams {
  MessageStream<core::AngularRateSample> rates;
  MessageStream<core::RateReferenceSample> references;
  std::vector<MessageStream<core::TemperatureSample>> probes;
  MessageStream<core::EnvironmentSample> environment;
};

}  // namespace zerodrift::record
