// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/report/markup.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <iterator>
#include <utility>

namespace zerodrift::report {
namespace {

constexpr std::array<std::string_view, 5> kEntities{"amp;", "lt;", "gt;", "quot;", "#39;"};

bool is_blank(char c) {
  return std::isspace(static_cast<unsigned char>(c)) != 0;
}

bool is_name(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' || c == ':';
}

class Reader {
 public:
  explicit Reader(std::string_view text) : rest_(text) {}

  Markup read() {
    while (!rest_.empty() && markup_.error.empty()) step();
    if (markup_.error.empty() && !open_.empty()) fail("not closed: " + top().name);
    return std::move(markup_);
  }

 private:
  void fail(const std::string& what) {
    if (markup_.error.empty())
      markup_.error = what + " at '" + std::string{rest_.substr(0, 60)} + "'";
  }

  Element& top() { return markup_.elements[open_.back()]; }

  void step() {
    if (rest_.front() != '<') return text();
    if (rest_.starts_with("<!DOCTYPE html>")) return rest_.remove_prefix(15);
    if (rest_.starts_with("</")) return end_tag();
    begin_tag();
  }

  void check_entities(std::string_view text) {
    for (std::size_t at = text.find('&'); at != std::string_view::npos;
         at = text.find('&', at + 1)) {
      const std::string_view entity = text.substr(at + 1);
      const bool known = std::any_of(kEntities.begin(), kEntities.end(),
                                     [&](std::string_view e) { return entity.starts_with(e); });
      if (!known) fail("unknown entity");
    }
  }

  void text() {
    const std::string_view found = rest_.substr(0, rest_.find('<'));
    check_entities(found);
    if (!open_.empty()) {
      top().text += found;
    } else if (!std::all_of(found.begin(), found.end(), is_blank)) {
      fail("text outside of all elements");
    }
    rest_.remove_prefix(found.size());
  }

  std::string name() {
    std::size_t length = 0;
    while (length < rest_.size() && is_name(rest_[length])) ++length;
    if (length == 0) fail("a name is missing");
    std::string found{rest_.substr(0, length)};
    rest_.remove_prefix(length);
    return found;
  }

  void blanks() {
    while (!rest_.empty() && is_blank(rest_.front())) rest_.remove_prefix(1);
  }

  void expect(char c) {
    if (rest_.empty() || rest_.front() != c) return fail(std::string{c} + " is missing");
    rest_.remove_prefix(1);
  }

  void end_tag() {
    rest_.remove_prefix(2);
    const std::string found = name();
    expect('>');
    if (open_.empty() || top().name != found) return fail("unexpected </" + found + ">");
    open_.pop_back();
  }

  void attribute(Element& element) {
    const std::string key = name();
    blanks();
    expect('=');
    blanks();
    if (rest_.empty() || (rest_.front() != '"' && rest_.front() != '\'')) return fail("no quote");
    const char quote = rest_.front();
    rest_.remove_prefix(1);
    const std::size_t end = rest_.find(quote);
    if (end == std::string_view::npos) return fail("an open quote");
    const std::string value{rest_.substr(0, end)};
    if (value.find('<') != std::string::npos) fail("< in an attribute");
    check_entities(value);
    if (!element.attributes.emplace(key, value).second) fail("twice: " + key);
    rest_.remove_prefix(end + 1);
  }

  void begin_tag() {
    expect('<');
    Element element{.name = name(), .attributes = {}, .text = {}};
    for (;;) {
      blanks();
      if (rest_.empty()) return fail("an open tag");
      if (!markup_.error.empty() || rest_.front() == '>' || rest_.front() == '/') break;
      attribute(element);
    }
    const bool empty = rest_.front() == '/' || element.name == "meta";
    if (rest_.front() == '/') rest_.remove_prefix(1);
    expect('>');
    const bool style = element.name == "style";
    markup_.elements.push_back(std::move(element));
    if (!empty) open_.push_back(markup_.elements.size() - 1);
    if (style) {
      const std::size_t end = rest_.find("</style>");
      if (end == std::string_view::npos) return fail("an open style");
      top().text = rest_.substr(0, end);
      rest_.remove_prefix(end);
    }
  }

  std::string_view rest_;
  Markup markup_;
  std::vector<std::size_t> open_;
};

}  // namespace

std::vector<Element> Markup::named(std::string_view name) const {
  std::vector<Element> found;
  std::copy_if(elements.begin(), elements.end(), std::back_inserter(found),
               [&](const Element& element) { return element.name == name; });
  return found;
}

Markup read_markup(std::string_view text) {
  return Reader{text}.read();
}

}  // namespace zerodrift::report
