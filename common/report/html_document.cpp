// SPDX-License-Identifier: Apache-2.0
#include "common/report/html_document.h"

#include <cstddef>
#include <stdexcept>
#include <string_view>

#include "common/files/atomic_file.h"
#include "common/report/plain_text.h"
#include "common/report/style_sheet.h"

namespace zerodrift::report {
namespace {

constexpr std::size_t kMostWithoutContents = 3;  // sections and tables that are found by scrolling

// Writes blocks one after the other and counts what is numbered.
class Page {
 public:
  [[nodiscard]] std::string take() { return std::move(html_); }

  void head(const Document& document) {
    html_ +=
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
        "<meta http-equiv=\"Content-Security-Policy\""
        " content=\"default-src 'none'; style-src 'unsafe-inline'\">\n"
        "<meta name=\"color-scheme\" content=\"light dark\">\n";
    line("<title>", document.title, "</title>");
    html_ += "<style>\n";
    html_ += kStyleSheet;
    html_ += "</style>\n</head>\n<body>\n<main>\n<header>\n";
    line("<h1>", document.title, "</h1>");
    if (!document.subtitle.empty()) line("<p class=\"subtitle\">", document.subtitle, "</p>");
    html_ += "</header>\n";
    for (const std::string& doubt : document.doubts)
      line("<p class=\"doubt\"><b>Doubtful:</b> ", doubt, "</p>");
    if (!document.verdict.empty()) line("<p class=\"verdict\">", document.verdict, "</p>");
  }

  // The sections and their tables, as links.
  void contents(const Document& document) {
    std::size_t sections = 0;
    std::size_t tables = 0;
    std::string items;
    for (const Block& block : document.blocks) {
      if (const auto* heading = std::get_if<Heading>(&block)) {
        items += "<li><a href=\"#section-" + std::to_string(++sections) + "\">" +
                 escaped(heading->text) + "</a></li>\n";
      } else if (const auto* table = std::get_if<Table>(&block)) {
        const std::string number = std::to_string(++tables);
        items += "<li class=\"table\"><a href=\"#table-" + number + "\">Table " + number + ". " +
                 escaped(table->caption) + "</a></li>\n";
      }
    }
    if (sections + tables <= kMostWithoutContents) return;
    html_ += "<nav class=\"contents\" aria-label=\"Contents\">\n<ul>\n" + items + "</ul>\n</nav>\n";
  }

  void foot() {
    if (!footnotes_.empty()) {
      html_ += "<section class=\"footnotes\" aria-label=\"Footnotes\">\n<ol>\n";
      for (std::size_t i = 0; i < footnotes_.size(); ++i) footnote(i + 1);
      html_ += "</ol>\n</section>\n";
    }
    html_ += "</main>\n</body>\n</html>\n";
  }

  void operator()(const Heading& heading) {
    line("<h2 id=\"section-" + std::to_string(++sections_) + "\">", heading.text, "</h2>");
  }
  void operator()(const Subheading& heading) { line("<h3>", heading.text, "</h3>"); }

  void operator()(const Paragraph& paragraph) {
    html_ += "<p>" + escaped(paragraph.text) + reference(paragraph.footnote) + "</p>\n";
  }

  // The box around a table scrolls where the table is wider than the screen; it takes the
  // keyboard's focus so that arrow keys can do it too.
  void operator()(const Table& table) {
    const std::string id = "table-" + std::to_string(++tables_);
    html_ += "<div class=\"scroll\" role=\"region\" tabindex=\"0\" aria-labelledby=\"" + id +
             "\">\n<table>\n<caption id=\"" + id + "\"><b>Table " + std::to_string(tables_) +
             ".</b> " + escaped(table.caption) + reference(table.footnote) +
             "</caption>\n<thead>\n<tr>";
    for (const Column& column : table.columns)
      html_ += cell("th scope=\"col\"", column.align, column.name, "th");
    html_ += "</tr>\n</thead>\n<tbody>\n";
    for (const Row& row : table.rows) table_row(row, table.columns);
    html_ += "</tbody>\n</table>\n</div>\n";
  }

  void operator()(const Figure& figure) {
    const std::string number = std::to_string(++figures_);
    std::string name = figure.chart.title;
    if (!figure.caption.empty()) name += ". " + figure.caption;
    html_ += "<figure>\n<div class=\"scroll\" role=\"region\" tabindex=\"0\" aria-label=\"Figure " +
             number + "\">\n" + svg_of(figure.chart, "figure-" + number + "-", name) +
             "</div>\n<figcaption><b>Figure " + number + ". " + escaped(figure.chart.title) +
             ".</b> " + escaped(figure.caption) + reference(figure.footnote) +
             "</figcaption>\n</figure>\n";
  }

 private:
  void line(std::string_view begin, std::string_view text, std::string_view end) {
    html_.append(begin).append(escaped(text)).append(end).append("\n");
  }

  static std::string cell(std::string_view tag, Align align, std::string_view text,
                          std::string_view end) {
    std::string html{"<"};
    html.append(tag).append(align == Align::kRight ? " class=\"right\">" : ">");
    return html.append(escaped(text)).append("</").append(end).append(">");
  }

  void table_row(const Row& row, const std::vector<Column>& columns) {
    html_ += row.highlighted ? "<tr class=\"highlighted\">" : "<tr>";
    html_ += cell("th scope=\"row\"", columns[0].align, row.cells[0], "th");
    for (std::size_t i = 1; i < row.cells.size(); ++i)
      html_ += cell("td", columns[i].align, row.cells[i], "td");
    html_ += "</tr>\n";
  }

  // A link to the footnote, which it notes for the end; nothing for an empty one.
  std::string reference(const std::string& text) {
    if (text.empty()) return {};
    footnotes_.push_back(text);
    const std::string number = std::to_string(footnotes_.size());
    return "<sup><a id=\"reference-" + number + "\" href=\"#footnote-" + number +
           "\" aria-label=\"Footnote " + number + "\">" + number + "</a></sup>";
  }

  void footnote(std::size_t ordinal) {
    const std::string number = std::to_string(ordinal);
    html_ += "<li id=\"footnote-" + number + "\">" + escaped(footnotes_[ordinal - 1]) +
             " <a href=\"#reference-" + number + "\" aria-label=\"Back to reference " + number +
             "\">↩</a></li>\n";
  }

  std::string html_;
  std::size_t sections_ = 0;
  std::size_t tables_ = 0;
  std::size_t figures_ = 0;
  std::vector<std::string> footnotes_;
};

}  // namespace

std::optional<std::string> validate(const Document& document) {
  if (document.title.empty()) return "document: title is empty; a page needs one";
  bool below_a_heading = false;
  for (const Block& block : document.blocks) {
    if (std::holds_alternative<Heading>(block)) below_a_heading = true;
    if (const auto* sub = std::get_if<Subheading>(&block); sub != nullptr && !below_a_heading)
      return "subheading '" + one_line(sub->text) +
             "' stands before any heading; one must come first";
    if (const auto* table = std::get_if<Table>(&block)) {
      if (auto wrong = validate(*table)) return wrong;
    }
    if (const auto* figure = std::get_if<Figure>(&block)) {
      if (auto wrong = validate(figure->chart)) return wrong;
    }
  }
  return std::nullopt;
}

std::string html_of(const Document& document) {
  if (const auto wrong = validate(document)) throw std::invalid_argument(*wrong);
  Page page;
  page.head(document);
  page.contents(document);
  for (const Block& block : document.blocks) std::visit(page, block);
  page.foot();
  return page.take();
}

void write_html(const std::filesystem::path& path, const Document& document) {
  const std::string page = html_of(document);
  files::AtomicFile file{path};
  file.append(page);
  file.commit();
}

}  // namespace zerodrift::report
