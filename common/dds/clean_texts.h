// SPDX-License-Identifier: Apache-2.0
// Texts of other participants on their way in: one line of valid UTF-8 each (core/one_line.h), so
// that nothing behind a reader has to ask what a log, a terminal or a page would make of them.
#pragma once

#include <cstddef>
#include <string_view>

#include "common/core/one_line.h"
#include "common/dds/topics.h"

namespace zerodrift::dds {

// Takes no memory where the text is clean already, as those of services are.
template <std::size_t kLongest>
void clean_text(eprosima::fastrtps::fixed_string<kLongest>& text) {
  const std::string_view raw(text.c_str(), text.size());
  if (!core::is_one_line(raw)) text = core::one_line(raw).c_str();
}

// A message without a text stays as it is.
template <typename Message>
void clean_texts(Message&) {}

inline void clean_texts(msg::Temperature& message) {
  clean_text(message.probe());
}

inline void clean_texts(msg::ServiceStatus& message) {
  clean_text(message.service());
  clean_text(message.host());
  clean_text(message.summary());
  for (msg::Metric& metric : message.metrics()) {
    clean_text(metric.name());
    clean_text(metric.unit());
  }
}

inline void clean_texts(msg::Event& message) {
  clean_text(message.service());
  clean_text(message.code());
  clean_text(message.text());
}

inline void clean_texts(msg::Command& message) {
  clean_text(message.service());
  clean_text(message.name());
  clean_text(message.argument());
  clean_text(message.issuer());
}

inline void clean_texts(msg::CommandReply& message) {
  clean_text(message.service());
  clean_text(message.text());
}

inline void clean_texts(msg::ReplayProgress& message) {
  clean_text(message.consumer());
  clean_text(message.probes());
}

inline void clean_texts(msg::TwinReport& message) {
  clean_text(message.verdict());
  clean_text(message.model());
  clean_text(message.record());
  clean_text(message.text());
  clean_text(message.next_experiment());
  for (msg::NamedEffect& effect : message.effects()) {
    clean_text(effect.name());
    clean_text(effect.alternatives());
  }
}

}  // namespace zerodrift::dds
