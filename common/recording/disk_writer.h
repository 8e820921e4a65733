// SPDX-License-Identifier: Apache-2.0
// The half of a recorder that waits for the disk: messages go into files as they come, or once
// something happens, and a disk that refuses is tried again.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "common/mcap/mcap_writer.h"
#include "common/recording/pre_trigger.h"
#include "common/recording/record_file.h"
#include "common/recording/record_queue.h"
#include "common/service/latency_histogram.h"

namespace zerodrift::recording {

struct DiskWriterOptions {
  RecordFileOptions file{};
  // Above 0: nothing is written until a trigger comes, then what the last seconds brought.
  double pre_trigger_s = 0.0;
  double post_trigger_s = 10.0;
  std::size_t pre_trigger_bytes = std::size_t{512} << 20U;
};

// One thread, but for what is said to be any thread's.
class DiskWriter {
 public:
  // What belongs to a file's metadata beside the disk's own figures when it ends; `refused`: how
  // many messages the disk refused since the file before ended, or, where that was cut and tells of
  // itself that it lacks something, since this one began.
  using Describe = std::function<mcap::Pairs(std::uint64_t refused)>;

  // `report_refusal` is given a line where the disk refuses. Both are called by the writer's
  // thread. Throws as RecordFile.
  DiskWriter(const DiskWriterOptions& options,
             std::function<void(const std::string&)> report_refusal, Describe describe);

  // `now_ns` is of the monotonic clock. The batch may be emptied.
  void take(MessageBatch& batch, std::int64_t now_ns);
  // Durable step by step: what a second old is survives the process, what five are the machine.
  void look_after_disk(std::int64_t now_ns);
  void finish();

  // When no thread writes.
  [[nodiscard]] const RecordFile& file() const noexcept { return file_; }

  // Any thread.
  [[nodiscard]] bool has_failed() const noexcept { return failed_; }
  // Neither in a file nor waiting for it, and those that are in a file; after finish() none waits.
  [[nodiscard]] std::uint64_t unwritten() const noexcept { return unwritten_; }
  [[nodiscard]] std::uint64_t messages() const noexcept { return messages_; }
  [[nodiscard]] std::uint64_t bytes() const noexcept { return bytes_; }
  // From the arrival of a message to the writer.
  [[nodiscard]] const service::LatencyHistogram& queue_delay() const noexcept {
    return queue_delay_;
  }
  // To compress a chunk and hand it to the system.
  [[nodiscard]] const service::LatencyHistogram& chunk_delay() const noexcept {
    return chunk_delay_;
  }

 private:
  void write(const MessageBatch& batch);
  void write(const QueuedMessage& message);
  void watch_for_trigger(MessageBatch& batch, std::int64_t now_ns);
  void guarded(const std::function<void()>& action);
  void finish_file();
  void count() noexcept;

  DiskWriterOptions options_;
  std::function<void(const std::string&)> report_refusal_;
  Describe describe_;
  RecordFile file_;
  PreTrigger pre_trigger_;
  bool is_triggered_ = false;
  std::uint64_t triggers_ = 0;
  std::int64_t recorded_until_ns_ = 0;
  std::uint64_t taken_ = 0;           // messages
  std::uint64_t refused_before_ = 0;  // of unwritten(), those that the next file doesn't tell of
  bool is_refused_ = false;           // by the disk; tried again
  std::int64_t retry_ns_ = 0;
  std::int64_t flushed_ns_ = 0;
  std::int64_t synced_ns_ = 0;
  service::LatencyHistogram queue_delay_;
  service::LatencyHistogram chunk_delay_;

  std::atomic<bool> failed_{false};
  std::atomic<std::uint64_t> unwritten_{0};
  std::atomic<std::uint64_t> messages_{0};
  std::atomic<std::uint64_t> bytes_{0};
};

}  // namespace zerodrift::recording
