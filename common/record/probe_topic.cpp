// SPDX-License-Identifier: Apache-2.0
#include "common/record/probe_topic.h"

#include <algorithm>
#include <cctype>

namespace zerodrift::record {
namespace {

constexpr std::size_t kLongestProbe = 32;  // of the temperature topic

bool is_probe_name(std::string_view text) {
  return !text.empty() && text.size() <= kLongestProbe &&
         std::all_of(text.begin(), text.end(),
                     [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
}

}  // namespace

std::optional<ProbeTopic> parse_probe_topic(std::string_view text) {
  const std::size_t equals = text.find('=');
  const bool is_named = equals != std::string_view::npos;
  const std::string_view probe = is_named ? text.substr(0, equals) : kUsualProbe;
  const std::string_view topic = is_named ? text.substr(equals + 1) : text;
  if (!is_probe_name(probe) || topic.empty()) return std::nullopt;
  return ProbeTopic{std::string(probe), std::string(topic)};
}

}  // namespace zerodrift::record
