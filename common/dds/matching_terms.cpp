// SPDX-License-Identifier: Apache-2.0
#include "common/dds/matching_terms.h"

#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>

#include "common/dds/participant.h"

namespace zerodrift::dds::detail {

namespace fdds = eprosima::fastdds::dds;

namespace {

constexpr std::int64_t kNanosecondsPerMs = 1'000'000;

}  // namespace

std::string milliseconds(std::int64_t ns) {
  if (ns >= eprosima::fastrtps::c_TimeInfinite.to_ns()) return "none";
  return std::to_string(ns / kNanosecondsPerMs) + " ms";
}

std::string liveliness(int kind) {
  switch (kind) {
    case fdds::AUTOMATIC_LIVELINESS_QOS: return "automatic";
    case fdds::MANUAL_BY_PARTICIPANT_LIVELINESS_QOS: return "manual by participant";
    default: return "manual by topic";
  }
}

std::string durability(int kind) {
  switch (kind) {
    case fdds::VOLATILE_DURABILITY_QOS: return "volatile";
    case fdds::TRANSIENT_LOCAL_DURABILITY_QOS: return "transient_local";
    default: return "transient";
  }
}

std::string described(Policy policy, const Terms& terms) {
  switch (policy) {
    case Policy::kReliability:
      return terms.reliability == fdds::RELIABLE_RELIABILITY_QOS ? "reliable" : "best_effort";
    case Policy::kDurability: return durability(terms.durability);
    case Policy::kDeadline: return milliseconds(terms.deadline_ns);
    case Policy::kLiveliness:
      return liveliness(terms.liveliness) + " with lease " + milliseconds(terms.lease_ns);
    case Policy::kOwnership:
      return terms.ownership == fdds::EXCLUSIVE_OWNERSHIP_QOS ? "exclusive" : "shared";
  }
  return "";
}

const char* name(Policy policy) {
  switch (policy) {
    case Policy::kReliability: return "reliability";
    case Policy::kDurability: return "durability";
    case Policy::kDeadline: return "deadline";
    case Policy::kLiveliness: return "liveliness";
    case Policy::kOwnership: return "ownership";
  }
  return "";
}

std::vector<Policy> unmet(const Terms& offered, const Terms& requested) {
  std::vector<Policy> policies;
  if (offered.reliability < requested.reliability) policies.push_back(Policy::kReliability);
  if (offered.durability < requested.durability) policies.push_back(Policy::kDurability);
  if (offered.deadline_ns > requested.deadline_ns) policies.push_back(Policy::kDeadline);
  if (offered.liveliness < requested.liveliness || offered.lease_ns > requested.lease_ns)
    policies.push_back(Policy::kLiveliness);
  if (offered.ownership != requested.ownership) policies.push_back(Policy::kOwnership);
  return policies;
}

Terms terms_of(const TopicSpec& spec) {
  const fdds::DataWriterQos qos = writer_qos(spec);
  return {.reliability = static_cast<int>(qos.reliability().kind),
          .durability = static_cast<int>(qos.durability().kind),
          .liveliness = static_cast<int>(qos.liveliness().kind),
          .ownership = static_cast<int>(qos.ownership().kind),
          .deadline_ns = qos.deadline().period.to_ns(),
          .lease_ns = qos.liveliness().lease_duration.to_ns()};
}

}  // namespace zerodrift::dds::detail
