// The look that the HTML pages of the program have in common: a run's page, reports of studies, sweeps and comparisons. Colours light and
// dark as variables, type, buttons, tables. A page is one file that opens from disk and fetches nothing.
#pragma once

#include <string>
#include <vector>

namespace flexframe::render {

// Colours and elements of every page (CSS).
const std::string& house_colours();

// A report's page up to its heading, which is `title` (plain text) with the button for light and dark; its own style (CSS) comes after the
// house's. The content follows, then house_tail().
std::string house_head(const std::string& title, const std::string& style = "");
// The end of the page, with the house's script and then its own.
std::string house_tail(const std::string& script = "");

// A table, its first row the heads; plain text. sorted: a click on a head sorts by its column, as numbers where most of its cells have one
// in front.
std::string house_table(const std::vector<std::vector<std::string>>& rows, bool sorted = false);

}  // namespace flexframe::render
