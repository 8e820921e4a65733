// SPDX-License-Identifier: Apache-2.0
// One hop of the middleware with a chosen quality of service, to be measured between two processes:
// our AngularRate there, and back where an answer is wanted, on two topics of its own.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/dds/participant.h"

namespace zerodrift::dds {

enum class HopTransport : std::uint8_t {
  kUdp,           // as every service of the project
  kSharedMemory,  // Fast DDS' shared-memory transport alone
  kDataSharing    // UDP, samples by data sharing; a type with a key would switch it off silently
};

// A choice of quality of service for the hot topics.
struct HopAlternative {
  std::string_view name;  // one word, for the command line
  std::string_view text;
  HopTransport transport = HopTransport::kUdp;
  // Changes that of kAngularRate, which is in place before; null: as it is.
  void (*change)(eprosima::fastdds::dds::DataWriterQos& writer,
                 eprosima::fastdds::dds::DataReaderQos& reader) = nullptr;
};

// The first is plain best effort, the second what topics.h says.
const std::vector<HopAlternative>& hop_alternatives();
// Throws DdsError for a name that is not among them.
const HopAlternative& hop_alternative(std::string_view name);

enum class HopEnd : std::uint8_t { kNear, kFar };

class MeasuredHop {
 public:
  // On the middleware's receiving thread.
  using OnSample = std::function<void(msg::AngularRate&)>;

  // `name` keeps apart hops in one domain. Throws DdsError.
  MeasuredHop(const NetworkOptions& network, const HopAlternative& alternative,
              const std::string& name, HopEnd end, OnSample on_sample);
  ~MeasuredHop();
  MeasuredHop(const MeasuredHop&) = delete;
  MeasuredHop& operator=(const MeasuredHop&) = delete;

  // Both directions are matched.
  [[nodiscard]] bool connected() const;
  // One thread at a time. False: the middleware refused it.
  bool send(msg::AngularRate& sample) noexcept;

 private:
  class Writing;
  class Reading;

  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  std::unique_ptr<Writing> writing_;
  std::unique_ptr<Reading> reading_;
  eprosima::fastdds::dds::DataWriter* writer_ = nullptr;
};

}  // namespace zerodrift::dds
