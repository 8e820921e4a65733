// SPDX-License-Identifier: Apache-2.0
// A report as one HTML file that needs nothing else: no script, no network, light and dark, on a
// phone and on paper. It says nothing of when or where it was made: equal input gives equal bytes.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/report/chart.h"
#include "common/report/table.h"

namespace zerodrift::report {

struct Heading {
  std::string text;
};

struct Subheading {  // below a Heading
  std::string text;
};

struct Paragraph {
  std::string text;
  std::string footnote = {};  // none if empty
};

struct Figure {
  Chart chart;
  std::string caption;
  std::string footnote = {};  // none if empty
};

using Block = std::variant<Heading, Subheading, Paragraph, Table, Figure>;

// Tables, figures and footnotes are numbered in their order; footnotes are gathered at the end. A
// page of more than three sections and tables begins with links to them. All text is plain text.
struct Document {
  std::string title;
  std::string subtitle;  // what record this is about
  std::string verdict;   // the answer, in a sentence or two
  std::vector<Block> blocks = {};
  std::vector<std::string> doubts = {};  // what makes the answer doubtful; they stand before it
};

[[nodiscard]] std::optional<std::string> validate(const Document& document);

// The whole page. Throws std::invalid_argument where validate() objects, ReportError where a figure
// can't be drawn.
[[nodiscard]] std::string html_of(const Document& document);

// html_of() in a file that appears whole or not at all. Throws files::FileError as well.
void write_html(const std::filesystem::path& path, const Document& document);

}  // namespace zerodrift::report
