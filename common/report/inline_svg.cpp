// SPDX-License-Identifier: Apache-2.0
#include "common/report/inline_svg.h"

#include <array>
#include <cstddef>
#include <map>
#include <string_view>

#include "common/report/plain_text.h"
#include "common/report/report_error.h"

namespace zerodrift::report {
namespace {

// Elements that go with all they hold.
constexpr std::array<std::string_view, 3> kDropped{"title", "desc", "filter"};

std::string_view element_name(std::string_view tag) {
  tag.remove_prefix(tag.starts_with("</") ? 2 : 1);
  return tag.substr(0, tag.find_first_of(" \t\r\n/>"));
}

// The value of an attribute, in either kind of quotes; empty if it isn't there.
std::string_view attribute(std::string_view tag, std::string_view name) {
  for (const char quote : {'"', '\''}) {
    const std::string begin = std::string{name} + '=' + quote;
    const std::size_t at = tag.find(begin);
    if (at == std::string_view::npos) continue;
    const std::string_view rest = tag.substr(at + begin.size());
    return rest.substr(0, rest.find(quote));
  }
  return {};
}

void insert_after_each(std::string& text, std::string_view what, std::string_view inserted) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at)) {
    text.insert(at + what.size(), inserted);
    at += what.size() + inserted.size();
  }
}

void erase_attribute(std::string& tag, std::string_view name) {
  const std::string begin = ' ' + std::string{name} + "=\"";
  const std::size_t at = tag.find(begin);
  if (at == std::string::npos) return;
  tag.erase(at, tag.find('"', at + begin.size()) + 1 - at);
}

std::string own_tag(std::string_view tag, const std::string& id_prefix) {
  std::string own{tag};
  for (const std::string_view place : {" id='", " id=\"", "href='#", "href=\"#", "url(#"}) {
    insert_after_each(own, place, id_prefix);
  }
  erase_attribute(own, "font-family");  // the page's
  return own;
}

std::string root_tag(std::string_view tag, const std::string& accessible_name) {
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\""
         " viewBox=\"" +
         escaped(attribute(tag, "viewBox")) + "\" role=\"img\" aria-label=\"" +
         escaped(accessible_name) + "\" font-family=\"system-ui, sans-serif\">";
}

using Replacements = std::map<std::string, std::string, std::less<>>;

Replacements replacements_of(const PictureScript& picture) {
  Replacements found;
  for (std::size_t i = 0; i < picture.labels.size(); ++i)
    found.emplace(picture.placeholders[i], escaped(picture.labels[i]));
  return found;
}

bool is_blank(std::string_view text) {
  return text.find_first_not_of(" \t\r\n") == std::string_view::npos;
}

// Text between two tags: at most a line end for blank text, the label for its placeholder.
std::string own_text(std::string_view text, const Replacements& labels, bool at_line_begin) {
  if (is_blank(text)) return at_line_begin || text.find('\n') == std::string_view::npos ? "" : "\n";
  const auto label = labels.find(text);
  return label != labels.end() ? label->second : std::string{text};
}

// Adds an end tag, or takes the element away again if it is an empty group.
void close(std::string& svg, std::string_view tag) {
  const std::size_t begin = svg.rfind('<');
  const bool empty_group = tag == "</g>" && begin != std::string::npos &&
                           std::string_view{svg}.substr(begin).starts_with("<g ") &&
                           is_blank(std::string_view{svg}.substr(svg.find('>', begin) + 1));
  if (empty_group) {
    svg.erase(begin);
  } else {
    svg += tag;
  }
}

// Consumes one piece of markup, or of text, from the front.
std::string_view take_piece(std::string_view& rest) {
  const bool markup = rest.front() == '<';
  const std::size_t end =
      markup ? rest.find(rest.starts_with("<!--") ? "-->" : ">") : rest.find('<');
  if (markup && end == std::string_view::npos)
    throw ReportError("gnuplot's picture is cut off; is its disk or memory full?");
  const std::size_t length = !markup ? end : rest.starts_with("<!--") ? end + 3 : end + 1;
  const std::string_view piece = rest.substr(0, length);
  rest.remove_prefix(piece.size());
  return piece;
}

void skip_element(std::string_view& rest, std::string_view name) {
  const std::string end = "</" + std::string{name} + ">";
  const std::size_t at = rest.find(end);
  rest.remove_prefix(at == std::string_view::npos ? rest.size() : at + end.size());
}

bool is_dropped(std::string_view name) {
  for (const std::string_view dropped : kDropped) {
    if (name == dropped) return true;
  }
  return false;
}

}  // namespace

std::string inline_svg(const std::string& gnuplot_svg, const PictureScript& picture,
                       const std::string& id_prefix, const std::string& accessible_name) {
  const Replacements labels = replacements_of(picture);
  const std::string legend = legend_svg(picture.legend, picture.height_px, id_prefix);
  std::string_view rest = gnuplot_svg;
  const std::size_t root = rest.find("<svg");
  if (root == std::string_view::npos || rest.find("</svg>") == std::string_view::npos)
    throw ReportError("gnuplot's picture is no whole SVG; is its disk or memory full?");
  rest.remove_prefix(root);
  std::string svg;
  while (!rest.empty()) {
    const std::string_view piece = take_piece(rest);
    if (!piece.starts_with('<')) {
      svg += own_text(piece, labels, svg.ends_with('\n'));
      continue;
    }
    if (piece.starts_with("<!")) continue;
    const std::string_view name = element_name(piece);
    if (is_dropped(name)) {
      skip_element(rest, name);
    } else if (piece.starts_with("</")) {
      if (name == "svg") svg += legend;
      close(svg, piece);
    } else {
      svg += name == "svg" ? root_tag(piece, accessible_name) : own_tag(piece, id_prefix);
    }
  }
  return svg;
}

}  // namespace zerodrift::report
