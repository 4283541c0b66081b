// Pictures paired by name and judged: one baseline or several, parts that are not looked at, on several threads.
#pragma once

#include "render/image/image_compare.h"

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace flexframe::render {

enum class PairState { equal, passes, differs, other_numbers, other_size, missing_baseline, missing_candidate, unreadable };

// A rectangle that is not looked at, px from the upper left corner. pattern: names of the pictures it belongs to (*, ? and [] as in a
// shell, * also over /); empty: all.
struct IgnoredRegion {
  std::string pattern;
  PixelBox box;
};

struct ComparedPair {
  std::string name;                           // relative path
  std::filesystem::path baseline, candidate;  // baseline: the one it agrees with, else the nearest
  PairState state = PairState::equal;
  ImageDifference difference;  // its heat map too where SSIM and FLIP were measured
  std::string reason;          // of an unreadable pair: file and what is wrong with it
  std::string numbers;  // how the numbers that travel with both pictures differ (render/picture/picture_numbers.h); empty: they agree
  std::pair<int, int> baseline_size{0, 0}, candidate_size{0, 0};  // px; 0: not read
  std::string baseline_machine, candidate_machine;  // renderer and processor that the file names ("flexframe-environment"); often empty
};

struct CompareRequest {
  std::vector<std::filesystem::path> baselines;  // PNG files or folders; a picture agrees if it agrees with any. The first is updated
  std::filesystem::path candidate;               // a PNG file, or a folder like the baselines
  CompareOptions rule;                           // `measures` and `ignored` are set here
  std::vector<IgnoredRegion> regions;
  std::filesystem::path mask;  // PNG of the pictures' size, or a folder of them by the pictures' names: white is not looked at
  int measured = 12;           // SSIM and FLIP of this many pairs: those with the largest mean difference, failing ones first
  int threads = 0;             // 0: as many as the machine has
  bool new_baseline = false;   // the first baseline need not exist
  int shard = 1, shards = 1;   // every shards-th pair by name, from the shard-th on; nothing is measured beyond the rule then
  // Fills in what an earlier comparison of the same pictures by the same rule found, of all baselines of the pair; false: it is compared.
  // Called on several threads.
  std::function<bool(ComparedPair& pair, std::span<const std::filesystem::path> baselines)> recall = {};
};

struct Comparison {
  std::vector<ComparedPair> pairs;  // sorted by name
  std::vector<std::string> notes;   // what the user should know: masks that belong to no picture
  bool passes = true;               // every pair equal or within the rule
};

// Two PNG files, or folders whose PNG files (below them, at any depth) are paired by their relative paths. A picture that only one side has
// does not pass, nor one whose numbers differ while its pixels pass, nor one of a folder that is damaged or cannot be read: the others are
// compared all the same. The result does not depend on the number of threads. Throws FileError for a file given by name that cannot be
// read; ArgumentError if some are files and others folders, if there is no picture at all, if a region lies outside of
// its picture or belongs to none, if a mask has another size, and if nothing is left to look at.
Comparison compare_pictures(const CompareRequest& request);

// What the request leaves out of this pair: one byte a pixel, 1 is not looked at; empty: all is looked at. Throws as compare_pictures does.
std::vector<std::uint8_t> ignored_pixels(const CompareRequest& request, const std::string& name, std::pair<int, int> size);

// "equal", "passes", "differs", "other numbers", "other size", "missing baseline", "missing picture", "unreadable"
std::string state_name(PairState state);
// Neither equal nor within the rule.
bool fails(PairState state);
// Both pictures were there and of one size.
bool was_measured(PairState state);

// Pairs by how far apart they are: those that fail first, among them those that could not be measured, then by mean difference.
std::vector<std::size_t> worst_first(const Comparison& comparison);

// Throws FileError if a new picture that nothing was compared with cannot be read.
void need_new_pictures(const Comparison& comparison);

// Makes the candidate's pictures the first baseline (whole or not at all, each) for every pair that is not equal, and notes the
// reason in CHANGES.md beside them. Pictures that only baselines have are removed from all of them. Returns the names changed.
// need_new_pictures first: nothing is changed where that throws.
std::vector<std::string> update_baselines(const Comparison& comparison, const CompareRequest& request, const std::string& reason);

}  // namespace flexframe::render
