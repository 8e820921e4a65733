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

template <typename... Texts>
void clean(Texts&... texts) {
  (clean_text(texts), ...);
}

// A message without a text stays as it is.
template <typename Message>
void clean_texts(Message&) {}

inline void clean_texts(msg::Temperature& message) {
  clean(message.probe());
}

inline void clean_texts(msg::ServiceStatus& message) {
  clean(message.service(), message.host(), message.summary());
  for (msg::Metric& metric : message.metrics()) clean(metric.name(), metric.unit());
}

inline void clean_texts(msg::Event& message) {
  clean(message.service(), message.code(), message.text());
}

inline void clean_texts(msg::Command& message) {
  clean(message.service(), message.name(), message.argument(), message.issuer());
}

inline void clean_texts(msg::CommandReply& message) {
  clean(message.service(), message.text());
}

inline void clean_texts(msg::ReplayProgress& message) {
  clean(message.consumer(), message.probes());
}

inline void clean_texts(msg::TwinReport& message) {
  clean(message.verdict(), message.model(), message.record(), message.text(),
        message.next_experiment(), message.input());
  for (msg::NamedEffect& effect : message.effects()) {
    clean(effect.name());
    for (msg::Alternative& other : effect.alternatives()) clean(other.name());
  }
}

}  // namespace zerodrift::dds
