// SPDX-License-Identifier: Apache-2.0
// How far a replay may go ahead of its consumers: an account of who takes part and what each took,
// without threads, clocks or the middleware. One thread at a time. What says when is the
// ReplayPacer's.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/core/time.h"
#include "common/dds/participant.h"

namespace zerodrift::service {

class ReplayCredit {
 public:
  using Guid = eprosima::fastrtps::rtps::GUID_t;

  // Sequence numbers ahead of the slowest consumer: far below the history kept, so that nothing can
  // be overwritten.
  static constexpr std::uint64_t kWindow = 256;

  // What a consumer says of this gyro.
  struct Progress {
    std::uint64_t taken;  // newest sequence
    core::SensorTime needed;
  };

  // Consumers named in `wait_for` are waited for from the first sample on.
  explicit ReplayCredit(std::vector<std::string> wait_for);

  // A consumer's word; without progress it says only that it is there.
  void note(const std::string& name, const Guid& writer, const std::optional<Progress>& progress);
  // It left.
  void forget(const Guid& writer);
  // A reader of the rates was met: its process misses nothing from now on.
  void note_reader(const Guid& reader);
  void note_sent(std::uint64_t sequence);

  // The next sample may be sent, the replay's first being `first_sequence`. A jump in the sequence
  // numbers waits for nobody.
  [[nodiscard]] bool has_room(std::uint64_t first_sequence) const;
  // All consumers have taken `sequence`.
  [[nodiscard]] bool is_taken_by_all(std::uint64_t sequence, std::uint64_t first_sequence) const;
  // Somebody needs temperatures up to `time`.
  [[nodiscard]] bool is_needed(core::SensorTime time) const;
  [[nodiscard]] bool anybody_to_wait_for() const noexcept { return !wait_for_.empty(); }
  // Names of the consumers that have not announced themselves, comma-separated.
  [[nodiscard]] std::string missing_consumers() const;

  // Consumers that have taken nothing although another took all that was sent: what was sent before
  // they were connected (behind the compensation, say) never comes to them. From now on they stand
  // where the replay is. Their names, comma-separated; "" where nobody took all, or all took
  // something.
  [[nodiscard]] std::string let_unconnected_join(std::uint64_t first_sequence);
  // Consumers that others can do without, not named or not the furthest of their name, and that
  // have not taken all that was sent: they are no longer waited for until they get on. Their names,
  // comma-separated.
  [[nodiscard]] std::string leave_behind(std::uint64_t first_sequence);

 private:
  // A process that announced itself, and what it took of this gyro.
  struct Consumer {
    std::string name;
    Guid writer;
    // Newest sample sent before it was known or connected; none: it is there from the first. What
    // it says that it has taken counts more.
    std::optional<std::uint64_t> joined_after{};
    // Newest sample sent before another one joined, of whose answers this one may live. It counts
    // more than what was taken before.
    std::optional<std::uint64_t> missed{};
    std::optional<Progress> progress{};
    bool is_left_behind = false;
  };
  // It stands where the replay is. Where it is named, so do those of other names.
  void join(Consumer& consumer);
  [[nodiscard]] bool has_announced(const std::string& name) const;
  [[nodiscard]] bool is_named(const Consumer& consumer) const;
  // Of this replay.
  [[nodiscard]] static bool has_taken(const Consumer& consumer, std::uint64_t first_sequence);
  // ... and of what it did not miss.
  [[nodiscard]] static bool has_taken_some(const Consumer& consumer, std::uint64_t first_sequence);
  // It is not left behind, and is named or has said of this replay how far it is.
  [[nodiscard]] bool keeps_up(const Consumer& consumer, std::uint64_t first_sequence) const;
  // Sequence numbers up to `newest` that the furthest consumer of this name has not taken; none:
  // nobody has the name.
  [[nodiscard]] std::optional<std::uint64_t> least_backlog(const std::string& name,
                                                           std::uint64_t newest,
                                                           std::uint64_t first_sequence) const;
  // Sequence numbers up to `newest` that the slowest consumer has not taken.
  [[nodiscard]] std::uint64_t backlog(std::uint64_t newest, std::uint64_t first_sequence) const;
  [[nodiscard]] static std::uint64_t backlog(const Consumer& consumer, std::uint64_t newest,
                                             std::uint64_t first_sequence);

  std::vector<std::string> wait_for_;
  std::vector<Consumer> consumers_;
  std::optional<std::uint64_t> newest_sent_;
};

}  // namespace zerodrift::service
