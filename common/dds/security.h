// SPDX-License-Identifier: Apache-2.0
// DDS Security of a participant: who it is, what it lets in, and what it refused.
//
// Fast DDS authenticates (PKI-DH), checks permissions and encrypts (AES-GCM). What it leaves open
// packet_guard.h closes, and what it refuses without a word, or in its log alone, is reported here.
#pragma once

#include <chrono>
#include <cstdint>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/dds/security_notices.h"

namespace zerodrift::dds {

// Whose certificate a participant uses: a service's its name without "/<instance>"; all else, which
// the command line starts, that of "zerodrift".
std::string security_identity(std::string_view participant_name);

// The files in a folder made by deploy/security/make_certificates.sh.
struct SecurityFiles {
  std::filesystem::path identity_ca;
  std::filesystem::path permissions_ca;
  std::filesystem::path governance;
  std::filesystem::path certificate;
  std::filesystem::path key;
  std::filesystem::path permissions;
};

// Throws DdsError, one line, where one is missing or can't be read, the key may be read by others
// or does not fit, the certificate is another's, not of this authority, or not valid at `now`, or
// the documents are for other domains.
SecurityFiles find_security_files(const std::filesystem::path& folder, const std::string& identity,
                                  std::uint32_t domain, std::chrono::system_clock::time_point now);

// Lives as long as its participant and its transport. Any thread.
class SecurityWatch {
 public:
  virtual ~SecurityWatch() = default;
  // To be the participant's listener, for discovery and authentication.
  virtual eprosima::fastdds::dds::DomainParticipantListener* listener() noexcept = 0;
  // From now on datagrams leave. To be called once the participant is made: the middleware
  // announces it shortly before it listens, each peer answers an announcement once, and an answer
  // that comes in between is lost; then a peer is not found before it announces itself again, up to
  // 2 s later.
  virtual void let_out() noexcept = 0;
  // When the oldest datagram came that a receiving thread is still busy with.
  [[nodiscard]] virtual std::optional<std::int64_t> busy_since_ns() const noexcept = 0;
  // Others are there who take part with certificates only, and this participant has none.
  [[nodiscard]] virtual bool lacks_certificate() const = 0;
  // With security: others are here who are proving who they are.
  [[nodiscard]] virtual bool awaits_proof() const { return false; }
  // Each notice once. A participant that does not prove who it is within 5 s of its announcement
  // counts as refused.
  virtual std::vector<SecurityNotice> take(std::chrono::steady_clock::time_point now) = 0;
};

// Puts a guarded transport into `qos`, whose transports must be complete. `next` is notified of
// discovery as without.
std::shared_ptr<SecurityWatch> guard_transports(
    eprosima::fastdds::dds::DomainParticipantListener& next,
    eprosima::fastdds::dds::DomainParticipantQos& qos);

// The same, and the properties of security. Throws as find_security_files().
std::shared_ptr<SecurityWatch> secure(const std::string& participant_name,
                                      const std::filesystem::path& folder, std::uint32_t domain,
                                      eprosima::fastdds::dds::DomainParticipantListener& next,
                                      eprosima::fastdds::dds::DomainParticipantQos& qos);

// For each reliable writer of a participant with security. What is repaired, or sent to who comes
// late, fills datagrams, and where one is full Fast DDS 2.9.1 has no room for what encryption adds:
// it ends the process by an assertion, or sends nothing.
void fill_no_datagram(eprosima::fastdds::dds::DataWriterQos& qos);

// While such a writer is made: the thread that will send its samples, which Fast DDS starts then,
// preempts nobody as it wakes (SCHED_BATCH, which needs no permission). It tries for the writer's
// lock without a pause; on the core of whoever holds it and has just woken it, both would wait
// until its time slice ends. A real-time thread's stays a real-time thread, which preempts no
// equal.
class NoPreemption {
 public:
  NoPreemption() noexcept;
  ~NoPreemption();
  NoPreemption(const NoPreemption&) = delete;
  NoPreemption& operator=(const NoPreemption&) = delete;

 private:
  bool is_in_force_ = false;
};

// What the library said last about why it refused something; empty: nothing.
std::string last_security_error();

}  // namespace zerodrift::dds
