// SPDX-License-Identifier: Apache-2.0
// gnuplot's SVG made fit to stand in a page beside others.
#pragma once

#include <string>

#include "common/report/picture_script.h"

namespace zerodrift::report {

// Of gnuplot's output, without what a page doesn't need (XML declaration, comments, its version,
// tool tips, unused filters, its font): an <svg> element named `accessible_name`, ids and
// references beginning with `id_prefix`, placeholders replaced by the escaped labels. O(length).
[[nodiscard]] std::string inline_svg(const std::string& gnuplot_svg, const PictureScript& picture,
                                     const std::string& id_prefix,
                                     const std::string& accessible_name);

}  // namespace zerodrift::report
