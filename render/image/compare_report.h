// Two pictures or two folders of pictures against each other, with a page that shows what differs.
#pragma once

#include "render/image/image_compare.h"

#include <filesystem>
#include <string>
#include <vector>

namespace flexframe::render {

enum class PairState { equal, passes, differs, other_numbers, other_size, missing_baseline, missing_candidate };

struct ComparedPair {
  std::string name;  // relative path
  std::filesystem::path baseline, candidate;
  PairState state = PairState::equal;
  ImageDifference difference;  // without its heat map unless asked for
  std::string numbers;  // how the numbers that travel with both pictures differ (render/picture/picture_numbers.h); empty: they agree
};

struct Comparison {
  std::vector<ComparedPair> pairs;  // sorted by name
  bool passes = true;               // every pair equal or within the rule
};

// Two PNG files, or two folders whose PNG files (below them, at any depth) are paired by their relative paths. A picture
// that only one side has does not pass, nor one whose numbers differ while its pixels pass. keep_heat: heat maps stay in the pairs
// (memory). new_baseline: a baseline that does not exist yet is no error, all its pictures are missing. Throws FileError for what
// cannot be read, ArgumentError if one is a file and the other a folder, or there is no picture at all.
Comparison compare_pictures(const std::filesystem::path& baseline, const std::filesystem::path& candidate,
                            const CompareOptions& options = {}, bool keep_heat = false, bool new_baseline = false);

std::string state_name(
    PairState state);  // "equal", "passes", "differs", "other numbers", "other size", "missing baseline", "missing picture"

// One HTML file with everything in it: measures of all pairs, and baseline, new picture and heat map side by side of
// those that do not pass (of all that are not equal if none fails).
std::string comparison_page(const Comparison& comparison, const std::string& title);

// Makes the candidate's pictures the baseline (whole or not at all, each) for every pair that is not equal, and notes the
// reason in CHANGES.md beside them. Pictures that only the baseline has are removed. Returns the names changed.
std::vector<std::string> update_baselines(const Comparison& comparison, const std::filesystem::path& baseline, const std::string& reason);

}  // namespace flexframe::render
