#include "render/image/compare_pairs.h"

#include "render/image/png.h"
#include "render/picture/picture_numbers.h"
#include "sim/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <numeric>
#include <set>
#include <thread>
#include <tuple>

#include <fnmatch.h>

namespace flexframe::render {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

constexpr const char* machine_key = "flexframe-environment";

// ".png" as Windows and cameras write it too.
bool is_png_name(const fs::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return ending == ".png";
}

// Links to files count whether they lead anywhere or not: what cannot be read is told. Links to folders are followed, each folder once.
void add_pictures(const fs::path& folder, const fs::path& part, std::set<fs::path>& seen, std::set<std::string>& names) {
  if (!seen.insert(fs::canonical(folder / part)).second) return;
  for (const auto& entry : fs::directory_iterator(folder / part)) {
    std::error_code none;
    const fs::path name = part / entry.path().filename();
    if (entry.is_directory(none)) add_pictures(folder, name, seen, names);
    else if (is_png_name(name) && (entry.is_regular_file(none) || entry.is_symlink(none))) names.insert(name.generic_string());
  }
}

std::set<std::string> pictures_below(const fs::path& folder) {
  std::set<fs::path> seen;
  std::set<std::string> names;
  add_pictures(folder, {}, seen, names);
  return names;
}

bool belongs(const IgnoredRegion& region, const std::string& name) {
  return region.pattern.empty() || ::fnmatch(region.pattern.c_str(), name.c_str(), 0) == 0;
}

// Calls work(i) for i < count on several threads; the first exception, by i, is thrown when all are done.
template <class Work>
void for_each_index(std::size_t count, int threads, const Work& work) {
  const std::size_t wanted = threads > 0 ? static_cast<std::size_t>(threads) : std::max(1u, std::thread::hardware_concurrency());
  std::vector<std::exception_ptr> failed(count);
  std::atomic<std::size_t> next{0};
  const auto run = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        work(i);
      } catch (...) {
        failed[i] = std::current_exception();
      }
    }
  };
  {
    std::vector<std::jthread> crew;
    for (std::size_t k = 1; k < std::min(wanted, count); ++k) crew.emplace_back(run);
    run();
  }
  for (const std::exception_ptr& failure : failed)
    if (failure) std::rethrow_exception(failure);
}

// White of a mask is not looked at; where it is transparent all is.
void add_mask(Bytes& ignored, const fs::path& file, const std::string& name, std::pair<int, int> size) {
  const Image mask = read_png(file);
  if (std::pair(mask.width, mask.height) != size)
    throw ArgumentError(fmt::format("{}: the mask has {} x {} pixels, the picture {} has {} x {}", file.string(), mask.width, mask.height,
                                    name, size.first, size.second));
  for (std::size_t i = 0; i < ignored.size(); ++i) {
    const std::uint8_t* p = &mask.pixels[i * mask.channels];
    const int opaque = mask.channels == 4 ? p[3] : 255;
    if ((p[0] + p[1] + p[2]) * opaque >= 3 * 128 * 255) ignored[i] = 1;
  }
}

// A picture that is damaged or cannot be read, as opposed to a mask.
struct UnreadablePicture : FileError {
  using FileError::FileError;
};

template <class Read>
auto read_picture(const Read& read) {
  try {
    return read();
  } catch (const FileError& error) {
    throw UnreadablePicture(error.what());
  }
}

// Pictures of 16 bits are compared as such where both have them.
ImageDifference compare_bytes(const Bytes& before, const Bytes& after, ComparedPair& pair, const CompareRequest& request, bool measure) {
  CompareOptions rule = request.rule;
  rule.measures = measure;
  Bytes ignored;
  const auto settle = [&](const auto& a, const auto& b) {
    pair.baseline_size = {a.width, a.height};
    pair.candidate_size = {b.width, b.height};
    if (pair.baseline_size == pair.candidate_size) ignored = ignored_pixels(request, pair.name, pair.candidate_size);
    rule.ignored = ignored;
    return compare_images(a, b, rule);
  };
  const std::string from = pair.baseline.string(), to = pair.candidate.string();
  if (png_depth(before) == 16 && png_depth(after) == 16) {
    auto [a, b] = read_picture([&] { return std::pair(decode_png16(before, from), decode_png16(after, to)); });
    // Grey and colour, with transparency and without.
    if (a.channels != b.channels) std::tie(a, b) = std::pair(decode_png16(before, from, 4), decode_png16(after, to, 4));
    return settle(a, b);
  }
  const auto [a, b] = read_picture([&] { return std::pair(decode_png(before, from), decode_png(after, to)); });
  return settle(a, b);
}

// The pair against its baseline.
void judge(ComparedPair& pair, const Bytes& after, const CompareRequest& request) {
  const Bytes before = read_picture([&] { return read_file(pair.baseline); });
  pair.difference = compare_bytes(before, after, pair, request, false);
  const ImageDifference& d = pair.difference;
  pair.state = !d.same_size ? PairState::other_size : d.equal ? PairState::equal : d.passes ? PairState::passes : PairState::differs;
  const auto text = [](const Bytes& bytes) { return parse_numbers(find_png_text(bytes, numbers_key)); };
  const auto a = text(before), b = text(after);
  pair.numbers = a && b ? numbers_difference(*a, *b) : "";
  if (!pair.numbers.empty() && !fails(pair.state)) pair.state = PairState::other_numbers;
  pair.baseline_machine = find_png_text(before, machine_key);
  pair.candidate_machine = find_png_text(after, machine_key);
}

// Which of two results is nearer: one that agrees, then the one of the right size, then the smaller mean difference.
bool is_nearer(const ComparedPair& a, const ComparedPair& b) {
  const auto rank = [](const ComparedPair& p) {
    return p.state == PairState::equal ? 0 : p.state == PairState::passes ? 1 : p.state == PairState::other_size ? 3 : 2;
  };
  return rank(a) != rank(b) ? rank(a) < rank(b) : a.difference.mean < b.difference.mean;
}

// Against each baseline that has the picture, until it is equal to one.
void compare_with_each(ComparedPair& pair, const std::vector<fs::path>& baselines, const CompareRequest& request) {
  const Bytes after = read_picture([&] { return read_file(pair.candidate); });
  ComparedPair best = pair;
  for (std::size_t k = 0; k < baselines.size(); ++k) {
    ComparedPair one = pair;
    one.baseline = baselines[k];
    judge(one, after, request);
    if (k == 0 || is_nearer(one, best)) best = std::move(one);
    if (best.state == PairState::equal) break;
  }
  pair = std::move(best);
}

// Of folders, a picture that cannot be read is a finding like others; one given by name is bad input.
void compare_pair(ComparedPair& pair, const std::vector<fs::path>& baselines, const CompareRequest& request, bool folders) {
  if (pair.state == PairState::missing_baseline || pair.state == PairState::missing_candidate) return;
  try {
    if (request.recall && read_picture([&] { return request.recall(pair, baselines); })) return;
    compare_with_each(pair, baselines, request);
  } catch (const UnreadablePicture& error) {
    if (!folders) throw;
    pair.state = PairState::unreadable;
    pair.reason = error.what();
  }
}

void need(bool holds, const std::string& sentence) {
  if (!holds) throw ArgumentError(sentence);
}

// Whether the path is a folder. Throws FileError if there is nothing.
bool is_folder(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) throw FileError(path.string() + ": cannot read: " + (error ? error.message() : "no such file or folder"));
  return fs::is_directory(path);
}

// Names on either side, and for each the baselines that have it.
std::vector<std::pair<ComparedPair, std::vector<fs::path>>> pair_up(const CompareRequest& request) {
  const bool folder = is_folder(request.candidate);
  const auto word = [](bool is) { return is ? "folder" : "file"; };
  std::vector<fs::path> there;
  for (const fs::path& baseline : request.baselines) {
    if (request.new_baseline && &baseline == &request.baselines.front() && !fs::exists(baseline)) continue;
    if (is_folder(baseline) != folder)
      throw ArgumentError(fmt::format("{} is a {} and {} a {}; two files or two folders are needed", baseline.string(), word(!folder),
                                      request.candidate.string(), word(folder)));
    there.push_back(baseline);
  }
  std::vector<std::pair<ComparedPair, std::vector<fs::path>>> out;
  const auto add = [&](const std::string& name, const fs::path& candidate, std::vector<fs::path> baselines) {
    ComparedPair pair;
    pair.name = name;
    pair.candidate = candidate;
    if (baselines.empty()) pair.state = PairState::missing_baseline;
    else pair.baseline = baselines.front();
    if (pair.candidate.empty()) pair.state = PairState::missing_candidate;
    out.emplace_back(std::move(pair), std::move(baselines));
  };
  if (!folder) {
    add(request.candidate.filename().string(), request.candidate, there);
    if (there.empty()) read_png(request.candidate);
    return out;
  }
  const std::set<std::string> after = pictures_below(request.candidate);
  std::set<std::string> names = after;
  std::vector<std::set<std::string>> before;
  for (const fs::path& baseline : there) {
    before.push_back(pictures_below(baseline));
    names.insert(before.back().begin(), before.back().end());
  }
  need(!names.empty(), "no PNG file below " + request.baselines.front().string() + " or " + request.candidate.string());
  for (const std::string& name : names) {
    std::vector<fs::path> baselines;
    for (std::size_t k = 0; k < there.size(); ++k)
      if (before[k].count(name)) baselines.push_back(there[k] / name);
    add(name, after.count(name) ? request.candidate / name : fs::path(), std::move(baselines));
  }
  return out;
}

// Those of the request's shard.
template <class Row>
void keep_shard(std::vector<Row>& rows, const CompareRequest& request) {
  std::size_t place = 0;
  std::erase_if(rows,
                [&](const Row&) { return static_cast<int>(place++ % static_cast<std::size_t>(request.shards)) != request.shard - 1; });
}

// SSIM and FLIP of the pairs that are worst.
void measure_worst(Comparison& comparison, const CompareRequest& request) {
  std::vector<std::size_t> chosen;
  for (const std::size_t i : worst_first(comparison)) {
    const ComparedPair& pair = comparison.pairs[i];
    if (was_measured(pair.state) && pair.state != PairState::equal) chosen.push_back(i);
  }
  chosen.resize(std::min(chosen.size(), static_cast<std::size_t>(std::max(0, request.measured))));
  for_each_index(chosen.size(), request.threads, [&](std::size_t k) {
    ComparedPair& pair = comparison.pairs[chosen[k]];
    pair.difference = compare_bytes(read_file(pair.baseline), read_file(pair.candidate), pair, request, true);
  });
}

}  // namespace

std::vector<std::uint8_t> ignored_pixels(const CompareRequest& request, const std::string& name, std::pair<int, int> size) {
  fs::path mask = request.mask;
  std::error_code none;
  if (!mask.empty() && fs::is_directory(mask, none)) mask = fs::exists(mask / name, none) ? mask / name : fs::path();
  std::vector<const IgnoredRegion*> regions;
  for (const IgnoredRegion& region : request.regions)
    if (belongs(region, name)) regions.push_back(&region);
  if (mask.empty() && regions.empty()) return {};
  const auto [width, height] = size;
  Bytes ignored(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0);
  if (!mask.empty()) add_mask(ignored, mask, name, size);
  for (const IgnoredRegion* region : regions) {
    const PixelBox& box = region->box;
    need(box.width > 0 && box.height > 0 && box.x < width && box.y < height && box.x + box.width > 0 && box.y + box.height > 0,
         fmt::format("the ignored region {},{},{}x{} lies outside of the picture {}, which has {} x {} pixels", box.x, box.y, box.width,
                     box.height, name, width, height));
    for (int y = std::max(0, box.y); y < std::min(height, box.y + box.height); ++y)
      for (int x = std::max(0, box.x); x < std::min(width, box.x + box.width); ++x)
        ignored[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] = 1;
  }
  need(std::find(ignored.begin(), ignored.end(), 0) != ignored.end(),
       fmt::format("{}: mask and ignored regions cover the whole picture, so that nothing is compared", name));
  return ignored;
}

std::string state_name(PairState state) {
  switch (state) {
    case PairState::equal:
      return "equal";
    case PairState::passes:
      return "passes";
    case PairState::differs:
      return "differs";
    case PairState::other_numbers:
      return "other numbers";
    case PairState::other_size:
      return "other size";
    case PairState::missing_baseline:
      return "missing baseline";
    case PairState::missing_candidate:
      return "missing picture";
    default:
      return "unreadable";
  }
}

bool fails(PairState state) { return state != PairState::equal && state != PairState::passes; }

bool was_measured(PairState state) {
  return state == PairState::equal || state == PairState::passes || state == PairState::differs || state == PairState::other_numbers;
}

std::vector<std::size_t> worst_first(const Comparison& comparison) {
  std::vector<std::size_t> order(comparison.pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto badness = [&](std::size_t i) {
    const ComparedPair& p = comparison.pairs[i];
    return (fails(p.state) ? 2.0 : 0.0) + (was_measured(p.state) ? p.difference.mean / p.difference.full : 1.0);
  };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return badness(a) > badness(b); });
  return order;
}

Comparison compare_pictures(const CompareRequest& request) {
  need(!request.baselines.empty(), "a comparison needs a baseline");
  auto paired = pair_up(request);
  Comparison out;
  need(request.shards >= 1 && request.shard >= 1 && request.shard <= request.shards, "a shard is one of 1 to their number");
  for (const auto& [pair, baselines] : paired) out.pairs.push_back(pair);
  for (const IgnoredRegion& region : request.regions)
    need(std::any_of(out.pairs.begin(), out.pairs.end(), [&](const ComparedPair& p) { return belongs(region, p.name); }),
         fmt::format("the ignored region {}: no picture has such a name", region.pattern));
  if (!request.mask.empty() && is_folder(request.mask)) {
    const std::set<std::string> masks = pictures_below(request.mask);
    need(!masks.empty(), "no PNG file below " + request.mask.string());
    for (const std::string& name : masks)
      if (std::none_of(out.pairs.begin(), out.pairs.end(), [&](const ComparedPair& p) { return p.name == name; }))
        out.notes.push_back(fmt::format("{}: a mask without a picture of that name", (request.mask / name).string()));
  }
  keep_shard(out.pairs, request);
  keep_shard(paired, request);
  const bool folders = fs::is_directory(request.candidate);
  for_each_index(out.pairs.size(), request.threads, [&](std::size_t i) { compare_pair(out.pairs[i], paired[i].second, request, folders); });
  if (request.shards == 1) measure_worst(out, request);
  out.passes = std::none_of(out.pairs.begin(), out.pairs.end(), [](const ComparedPair& p) { return fails(p.state); });
  return out;
}

void need_new_pictures(const Comparison& comparison) {
  for (const ComparedPair& p : comparison.pairs)
    if (p.state == PairState::missing_baseline || p.state == PairState::unreadable) read_png(p.candidate);
}

std::vector<std::string> update_baselines(const Comparison& comparison, const CompareRequest& request, const std::string& reason) {
  const fs::path& baseline = request.baselines.front();
  std::vector<std::string> changed;
  const bool folder = fs::is_directory(baseline) || (!fs::exists(baseline) && !is_png_name(baseline));
  need_new_pictures(comparison);
  for (const ComparedPair& p : comparison.pairs) {
    if (p.state == PairState::equal) continue;
    const fs::path target = folder ? baseline / p.name : baseline;
    if (p.state == PairState::missing_candidate) {
      for (const fs::path& from : request.baselines) fs::remove(from / p.name);
    } else {
      if (target.has_parent_path()) fs::create_directories(target.parent_path());
      write_file(target, read_file(p.candidate));
    }
    changed.push_back(folder ? p.name : target.filename().string());
  }
  if (changed.empty()) return changed;
  const fs::path notes = (folder ? baseline : baseline.has_parent_path() ? baseline.parent_path() : fs::path(".")) / "CHANGES.md";
  std::string text;
  std::error_code none;
  if (fs::is_regular_file(notes, none)) {
    const auto bytes = read_file(notes);
    text.assign(bytes.begin(), bytes.end());
  } else {
    text = "# Why baselines changed\n\n";
  }
  // A reason is one line.
  std::string line = fmt::format("- {}:", reason);
  for (const std::string& name : changed) line += " " + name;
  std::replace(line.begin(), line.end(), '\n', ' ');
  text += line + "\n";
  write_file(notes, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  return changed;
}

}  // namespace flexframe::render
