// SPDX-License-Identifier: Apache-2.0
// A strict reader of markup: what a browser would forgive is an error here.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace zerodrift::report {

struct Element {
  std::string name;
  std::map<std::string, std::string> attributes;
  std::string text;  // directly within, entities not replaced
};

struct Markup {
  std::vector<Element> elements;  // in the order of their begin tags
  std::string error;              // empty: balanced tags, quoted attributes, known entities

  [[nodiscard]] std::vector<Element> named(std::string_view name) const;
};

// An HTML page of this project or an <svg> element.
[[nodiscard]] Markup read_markup(std::string_view text);

}  // namespace zerodrift::report
