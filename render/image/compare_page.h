// The page of a comparison: one HTML file with everything in it, for any browser; its style and script: render/image/compare_page/.
#pragma once

#include "render/image/compare_summary.h"

#include <filesystem>
#include <string>

namespace flexframe::render {

struct ComparePageOptions {
  std::string title;
  Facts facts;                    // said above the table
  std::filesystem::path file;     // where the page will lie: links to the pictures go from there
  std::size_t bytes = 5'000'000;  // of the page at most; at least the table is written
};

// A table of all pairs, and of those that do not pass (of all that are not equal if none fails), worst first, as many as fit: measures,
// and both pictures side by side, swiped, blinked or as what differs, with a zoom onto the differing box. Pictures that are too large for
// their share of `bytes` are cut to the differing box or reduced, which stands under them; the rest are links to the files.
std::string comparison_page(const Comparison& comparison, const CompareRequest& request, const ComparePageOptions& options);

}  // namespace flexframe::render
