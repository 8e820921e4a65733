// SPDX-License-Identifier: Apache-2.0
#include "common/report/html_document.h"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>

#include "common/files/file_error.h"
#include "common/report/report_error.h"
#include "tests/support/scratch_folder.h"
#include "tests/unit/report/example_document.h"
#include "tests/unit/report/markup.h"
#include "tests/unit/report/other_path.h"

namespace zerodrift::report {
namespace {

class HtmlDocument : public ScratchFolder {};

TEST(HtmlGolden, BodyOfAPageWithoutPictures) {
  const Document document{.title = "Report",
                          .subtitle = "Record a.csv",
                          .verdict = "Nothing is missing.",
                          .blocks = {Heading{"Result"}, Paragraph{"Text", "A note"},
                                     Table{"Drift",
                                           {{"scheme", Align::kLeft}, {"N"}},
                                           {{{"none", "1.0"}}, {{"svr", "0.5"}, true}},
                                           ""},
                                     Subheading{"Detail"}, Paragraph{"More"}}};
  const std::string page = html_of(document);
  const std::size_t body = page.find("<body>");
  ASSERT_NE(body, std::string::npos);
  EXPECT_EQ(
      page.substr(body),
      "<body>\n<main>\n<header>\n<h1>Report</h1>\n<p class=\"subtitle\">Record a.csv</p>\n"
      "</header>\n<p class=\"verdict\">Nothing is missing.</p>\n<h2 id=\"section-1\">Result</h2>\n"
      "<p>Text<sup><a id=\"reference-1\" href=\"#footnote-1\" aria-label=\"Footnote 1\">1</a>"
      "</sup></p>\n"
      "<div class=\"scroll\" role=\"region\" tabindex=\"0\" aria-labelledby=\"table-1\">\n"
      "<table>\n<caption id=\"table-1\"><b>Table 1.</b> Drift</caption>\n<thead>\n"
      "<tr><th scope=\"col\">scheme</th><th scope=\"col\" class=\"right\">N</th></tr>\n"
      "</thead>\n<tbody>\n"
      "<tr><th scope=\"row\">none</th><td class=\"right\">1.0</td></tr>\n"
      "<tr class=\"highlighted\"><th scope=\"row\">svr</th><td class=\"right\">0.5</td></tr>\n"
      "</tbody>\n</table>\n</div>\n<h3>Detail</h3>\n<p>More</p>\n"
      "<section class=\"footnotes\" aria-label=\"Footnotes\">\n<ol>\n"
      "<li id=\"footnote-1\">A note <a href=\"#reference-1\""
      " aria-label=\"Back to reference 1\">↩</a></li>\n</ol>\n</section>\n"
      "</main>\n</body>\n</html>\n");
}

TEST(HtmlLaws, ALongPageBeginsWithLinksToItsSectionsAndTables) {
  const Table table{"Drift & noise", {{"scheme", Align::kLeft}, {"N"}}, {{{"none", "1.0"}}}, ""};
  Document document{.title = "Report",
                    .subtitle = "",
                    .verdict = "Nothing is missing.",
                    .blocks = {Heading{"Result"}, table, Heading{"More"}}};
  EXPECT_EQ(html_of(document).find("<nav"), std::string::npos) << "three are seen at once";
  document.blocks.emplace_back(table);
  const std::string page = html_of(document);
  const std::size_t at = page.find("<p class=\"verdict\">Nothing is missing.</p>\n<nav");
  ASSERT_NE(at, std::string::npos);
  EXPECT_EQ(page.substr(page.find("<li", at), page.find("</ul>") - page.find("<li", at)),
            "<li><a href=\"#section-1\">Result</a></li>\n"
            "<li class=\"table\"><a href=\"#table-1\">Table 1. Drift &amp; noise</a></li>\n"
            "<li><a href=\"#section-2\">More</a></li>\n"
            "<li class=\"table\"><a href=\"#table-2\">Table 2. Drift &amp; noise</a></li>\n");
  for (const char* place : {"<h2 id=\"section-2\"", "<caption id=\"table-2\""})
    EXPECT_NE(page.find(place), std::string::npos) << place;
  const std::string print = page.substr(page.find("@media print"));
  EXPECT_NE(print.find(".contents { display: none; }"), std::string::npos);
}

TEST(HtmlLaws, PageIsWellFormedAndItsLinksResolve) {
  const Markup page = read_markup(html_of(example_document()));
  ASSERT_EQ(page.error, "");
  ASSERT_EQ(page.elements[0].name, "html");
  EXPECT_EQ(page.elements[0].attributes.at("lang"), "en");
  EXPECT_EQ(page.named("h1").size(), 1U);
  EXPECT_EQ(page.named("svg").size(), 2U);
  EXPECT_EQ(page.named("figure").size(), page.named("figcaption").size());
  std::set<std::string> ids;
  for (const Element& element : page.elements) {
    if (const auto id = element.attributes.find("id"); id != element.attributes.end()) {
      EXPECT_TRUE(ids.insert(id->second).second) << id->second << " stands twice";
    }
  }
  std::size_t links = 0;
  for (const Element& element : page.elements) {
    for (const char* name : {"href", "xlink:href"}) {
      const auto link = element.attributes.find(name);
      if (link == element.attributes.end()) continue;
      ++links;
      ASSERT_TRUE(link->second.starts_with('#')) << link->second;
      EXPECT_TRUE(ids.contains(link->second.substr(1))) << link->second;
    }
  }
  EXPECT_GT(links, 6U);  // three footnotes, there and back, and the symbols
}

TEST(HtmlLaws, PageNeedsNothingElse) {
  std::string page = html_of(example_document());
  for (const char* name : {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}) {
    for (std::size_t at = page.find(name); at != std::string::npos; at = page.find(name))
      page.erase(at, std::string_view{name}.size());
  }
  for (const char* outside : {"http:", "https:", "//", "<script", "url(", "@import", "src="})
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
}

TEST(HtmlLaws, EqualInputGivesEqualBytes) {
  EXPECT_EQ(html_of(example_document()), html_of(example_document()));
}

TEST(HtmlAbuse, HostileTextStaysText) {
  const std::string hostile =
      "</title></style><script>alert(1)</script>\" onload='x' &amp; \x1b\xff";
  const Chart chart{.title = hostile,
                    .x_label = hostile,
                    .y_label = hostile,
                    .curves = {{.name = hostile, .x = {0, 1}, .y = {0, 1}}}};
  const Document document{
      .title = hostile,
      .subtitle = hostile,
      .verdict = hostile,
      .blocks = {Heading{hostile}, Subheading{hostile}, Paragraph{hostile, hostile},
                 Table{hostile, {{hostile}}, {{{hostile}}}, hostile},
                 Figure{chart, hostile, hostile}}};
  const Markup page = read_markup(html_of(document));
  ASSERT_EQ(page.error, "");
  EXPECT_TRUE(page.named("script").empty());
  EXPECT_EQ(page.named("style").size(), 1U);
  for (const Element& element : page.elements) EXPECT_FALSE(element.attributes.contains("onload"));
}

TEST(HtmlAbuse, WrongDocumentsAreRefusedBeforeAnythingIsDrawn) {
  Document document{.title = "", .subtitle = "", .verdict = ""};
  EXPECT_EQ(validate(document), "document: title is empty; a page needs one");
  document.title = "T";
  document.blocks = {Subheading{"Detail"}};
  EXPECT_EQ(validate(document),
            "subheading 'Detail' stands before any heading; one must come first");
  document.blocks = {Table{}};
  EXPECT_NE(validate(document), std::nullopt);
  document.blocks = {Figure{
      Chart{.title = "a", .x_label = "", .y_label = "", .curves = {{.name = "b", .x = {1}}}}, ""}};
  EXPECT_NE(validate(document), std::nullopt);
  EXPECT_THROW(static_cast<void>(html_of(document)), std::invalid_argument);
}

TEST_F(HtmlDocument, IsWrittenWhole) {
  write("a.html", "old");
  write_html(path("a.html"), example_document());
  EXPECT_EQ(content(path("a.html")), html_of(example_document()));
  EXPECT_EQ(file_count(), 1U);
}

TEST_F(HtmlDocument, WithoutGnuplotTheOldPageStays) {
  write("a.html", "old");
  const OtherPath other{path("none").string()};
  EXPECT_THROW(write_html(path("a.html"), example_document()), ReportError);
  EXPECT_EQ(content(path("a.html")), "old");
  EXPECT_EQ(file_count(), 1U);
}

TEST_F(HtmlDocument, MissingFolderIsRefused) {
  EXPECT_THROW(write_html(path("none/a.html"), {.title = "T", .subtitle = "", .verdict = ""}),
               files::FileError);
}

}  // namespace
}  // namespace zerodrift::report
