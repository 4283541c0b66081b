// flexframe compare: image regression.
#include "render/cli/commands.h"

#include "render/cli/compare_parts.h"
#include "render/cli/compare_results.h"
#include "render/cli/engine.h"
#include "render/cli/overwrite.h"
#include "render/cli/terminal.h"
#include "render/cli/version.h"
#include "render/image/compare_page.h"
#include "render/image/compare_summary.h"
#include "sim/base/file_output.h"
#include "sim/base/words.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <tuple>

namespace flexframe::cli {
namespace {

struct Options {
  std::string baseline, candidate, mask, report, junit, markdown, reason, shard, parts;
  EngineWords engine;
  std::vector<std::string> also, ignore;
  render::CompareOptions rule;
  std::optional<int> levels, cluster;
  std::optional<double> percent, mean;
  double page_size = 5.0;  // MB
  double pixels = 0.0;     // of two results files
  int measured = render::CompareRequest{}.measured, jobs = 0;
  bool json = false;
};

// What is asked for loosens what would contradict it: a share that may differ may lie together, levels that are none may be those of every
// pixel.
render::CompareOptions settle(const Options& o) {
  render::CompareOptions out = o.rule;
  const render::Gate usual;
  if (o.levels) {
    out.gate.levels = *o.levels;
    out.gate.cluster_levels = std::max(usual.cluster_levels, *o.levels);
    out.gate.faint_levels = std::max(usual.faint_levels, *o.levels);
    out.gate.local = std::max(usual.local, static_cast<double>(*o.levels));
    if (*o.levels > usual.levels) {
      out.gate.mean = *o.levels;
      out.deep.levels = 257 * *o.levels;
      out.deep.cluster_levels = out.deep.faint_levels = std::max(out.deep.cluster_levels, 257 * *o.levels);
      out.deep.mean = 257.0 * *o.levels;
    }
  }
  if (o.percent) {
    out.gate.share = out.deep.share = *o.percent / 100.0;
    if (out.gate.share > usual.share) {
      out.gate.cluster = out.deep.cluster = out.gate.faint = out.deep.faint = std::numeric_limits<int>::max();
      out.gate.weight = std::numeric_limits<long>::max();
      out.gate.local = std::numeric_limits<double>::infinity();
    }
  }
  if (o.cluster) {
    out.gate.cluster = out.deep.cluster = out.deep.faint = *o.cluster + 1;
    out.gate.faint = std::max(usual.faint, *o.cluster + 1);
    // A group of that many pixels, each by whatever it is.
    if (*o.cluster + 1 > usual.cluster) out.gate.weight = std::numeric_limits<long>::max();
  }
  if (o.mean) {
    out.gate.mean = *o.mean;
    if (*o.mean > usual.mean) out.gate.local = std::numeric_limits<double>::infinity();
    out.deep.mean = 257.0 * *o.mean;
  }
  return out;
}

// "[NAMES:]X,Y,WxH"; names may hold colons.
render::IgnoredRegion read_region(const std::string& text) {
  render::IgnoredRegion out;
  const std::size_t colon = text.rfind(':');
  if (colon != std::string::npos) out.pattern = text.substr(0, colon);
  const char *at = text.data() + (colon == std::string::npos ? 0 : colon + 1), *end = text.data() + text.size();
  const auto number = [&](int& value, char behind) {
    const auto [next, error] = std::from_chars(at, end, value);
    const bool good = error == std::errc() && (behind ? next != end && *next == behind : next == end);
    at = good && behind ? next + 1 : next;
    return good;
  };
  if (colon == 0 || !number(out.box.x, ',') || !number(out.box.y, ',') || !number(out.box.width, 'x') || !number(out.box.height, '\0') ||
      out.box.width < 1 || out.box.height < 1 ||
      std::max({std::abs(out.box.x), std::abs(out.box.y), out.box.width, out.box.height}) > 1 << 20)
    throw UsageError(
        fmt::format("--ignore {}: must be [NAMES:]X,Y,WxH in pixels from the upper left corner, for example 10,20,120x30 or "
                    "\"frame_0000?.png:10,20,120x30\"",
                    sim::quote(text)));
  return out;
}

render::CompareRequest make_request(const Options& o) {
  render::CompareRequest out{.baselines = {o.baseline}, .candidate = o.candidate, .rule = settle(o), .regions = {}, .mask = o.mask};
  out.baselines.insert(out.baselines.end(), o.also.begin(), o.also.end());
  for (const std::string& region : o.ignore) out.regions.push_back(read_region(region));
  out.measured = o.measured;
  out.threads = o.jobs;
  out.new_baseline = !o.reason.empty();
  return out;
}

// What a report says of its making: starts OpenGL once, to name what draws here.
render::Facts make_facts(const render::CompareRequest& request) {
  const render::Gate& gate = request.rule.gate;
  return {{"compared by", fmt::format("flexframe {}", FLEXFRAME_VERSION)},
          {"machine", machine_text()},
          {"renderer", renderer_text()},
          {"rule", request.rule.exact
                       ? std::string("equal pixels")
                       : fmt::format("at most {:.4g} % of the pixels differ by more than {} levels, fewer than {} that touch by more "
                                     "than {} or {} by more than {}, {} levels in all where they touch, the mean by at most {:.4g}, of 64 "
                                     "x 64 pixels by {:.4g}",
                                     100.0 * gate.share, gate.levels, gate.cluster, gate.cluster_levels, gate.faint, gate.faint_levels,
                                     gate.weight, gate.mean, gate.local)}};
}

void write_text(const std::string& file, const std::string& text) { sim::write_whole_file(file, text); }

void write_reports(const Options& o, const render::Comparison& comparison, const render::CompareRequest& request) {
  if (o.report.empty() && o.junit.empty() && o.markdown.empty()) return;
  const render::Facts facts = make_facts(request);
  const std::string title = o.baseline + " and " + o.candidate;
  if (!o.report.empty())
    write_text(o.report, render::comparison_page(
                             comparison, request,
                             {.title = title, .facts = facts, .file = o.report, .bytes = static_cast<std::size_t>(1e6 * o.page_size)}));
  if (!o.junit.empty()) write_text(o.junit, render::junit_text(comparison, "pictures of " + o.candidate, facts));
  if (!o.markdown.empty()) write_text(o.markdown, render::markdown_text(comparison, title, facts));
}

nlohmann::json pair_json(const render::ComparedPair& p) {
  nlohmann::json row = {{"name", p.name}, {"result", render::state_name(p.state)}};
  const render::ImageDifference& d = p.difference;
  if (render::was_measured(p.state)) {
    render::for_each_number(d, [&](const char* name, auto number) { row[name] = number; });
    if (!d.measured && !d.equal && d.full == 255) row["ssim"] = row["flip"] = nullptr;  // not among the worst
    row["ignored"] = d.ignored;
    if (d.box.width > 0) row["box"] = {d.box.x, d.box.y, d.box.width, d.box.height};
  }
  if (!p.baseline.empty()) row["baseline"] = p.baseline.string();
  if (!p.numbers.empty()) row["numbers"] = p.numbers;
  if (!p.reason.empty()) row["reason"] = p.reason;
  return row;
}

void print_json(const render::Comparison& comparison, const std::vector<std::string>& updated) {
  nlohmann::json pairs = nlohmann::json::array();
  for (const render::ComparedPair& p : comparison.pairs) pairs.push_back(pair_json(p));
  const nlohmann::json out = {{"passes", comparison.passes}, {"pictures", pairs}, {"updated", updated}, {"notes", comparison.notes}};
  // Names of files need not be UTF-8.
  fmt::print("{}\n", out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
}

void print_rows(const render::Comparison& comparison, const std::vector<std::string>& updated) {
  std::size_t equal = 0, within = 0, bad = 0;
  for (const render::ComparedPair& p : comparison.pairs) {
    const render::ImageDifference& d = p.difference;
    equal += p.state == render::PairState::equal;
    within += p.state == render::PairState::passes;
    const bool fails = p.state != render::PairState::equal && p.state != render::PairState::passes;
    bad += fails;
    if (p.state == render::PairState::equal && comparison.pairs.size() > 1) continue;
    if (p.state == render::PairState::passes || p.state == render::PairState::differs || p.state == render::PairState::other_numbers)
      fmt::print("{}: {}{}: largest difference {}/{}, mean {:.4g}/{}, {} pixels ({:.4g} %) over the limit, {} of them together{}\n", p.name,
                 render::state_name(p.state), d.broken.empty() ? "" : " (" + d.broken + ")", d.largest, d.full, d.mean, d.full,
                 d.pixels_over, 100.0 * d.share_over, d.cluster,
                 (d.measured ? fmt::format(", SSIM {:.5f}, FLIP {:.5f}", d.ssim, d.flip) : "") +
                     (d.box.width > 0 ? fmt::format(", within {}x{} at {},{}", d.box.width, d.box.height, d.box.x, d.box.y) : ""));
    else if (const std::string text = render::failure_text(p), state = render::state_name(p.state); text != state && !text.empty())
      fmt::print("{}: {}: {}\n", p.name, state, text);
    else fmt::print("{}: {}\n", p.name, state);
    if (!p.numbers.empty()) fmt::print("{}: {}\n", p.name, p.numbers);
  }
  fmt::print("{} equal, {} within the limit, {} different or missing\n", equal, within, bad);
  if (updated.empty()) return;
  const auto gone = std::count_if(comparison.pairs.begin(), comparison.pairs.end(),
                                  [](const auto& p) { return p.state == render::PairState::missing_candidate; });
  fmt::print("{} baselines updated{}\n", updated.size(),
             gone > 0 ? fmt::format(", {} of them removed: there is no new picture of their names", gone) : "");
}

// Pictures of a folder that cannot be read are bad input, told when all else is compared and written.
void refuse_unreadable(const render::Comparison& comparison) {
  const auto is_unreadable = [](const render::ComparedPair& p) { return p.state == render::PairState::unreadable; };
  const auto count = std::count_if(comparison.pairs.begin(), comparison.pairs.end(), is_unreadable);
  if (count == 0) return;
  const std::string& first = std::find_if(comparison.pairs.begin(), comparison.pairs.end(), is_unreadable)->reason;
  throw UsageError(first + (count > 1 ? fmt::format("; {} more picture{} cannot be read", count - 1, count > 2 ? "s" : "") : ""));
}

std::filesystem::path parts_folder(const Options& o) {
  if (!o.parts.empty()) return o.parts;
  std::string name = o.candidate;
  while (name.size() > 1 && name.back() == '/') name.pop_back();
  return name + "-parts";
}

// Shards of the pairs as tasks, then the comparison of all, which takes what they found and compares what they left.
int hand_over_comparison(const Options& o) {
  if (!o.shard.empty()) throw UsageError("--shard excludes --engine, which hands out shards itself");
  EngineJob work;
  work.name = "flexframe-compare";
  work.folder = std::filesystem::absolute(parts_folder(o)).lexically_normal();
  work.shards = o.engine.shards > 0 ? o.engine.shards : 4;
  work.last = words_without_engine();
  if (o.parts.empty()) work.last.insert(work.last.end(), {"--parts", parts_folder(o).string()});
  work.task = work.last;
  for (const char* word : {"--shard", "{}"}) work.task.emplace_back(word);
  if (o.jobs == 0) work.task.insert(work.task.end(), {"--jobs", "{cpus}"});
  return hand_over(work, o.engine);
}

// Words that judge or report pictures would do nothing for results: a test that asks for them is told.
void refuse_words_of_pictures(const Options& o) {
  const std::pair<bool, const char*> given[] = {{!o.also.empty(), "--also"},          {!o.ignore.empty(), "--ignore"},
                                                {!o.mask.empty(), "--mask"},          {o.levels.has_value(), "--levels"},
                                                {o.percent.has_value(), "--percent"}, {o.cluster.has_value(), "--cluster"},
                                                {o.mean.has_value(), "--mean"},       {o.rule.exact, "--exact"},
                                                {!o.report.empty(), "--report"},      {!o.junit.empty(), "--junit"},
                                                {!o.markdown.empty(), "--markdown"},  {!o.reason.empty(), "--update"},
                                                {!o.shard.empty(), "--shard"},        {!o.parts.empty(), "--parts"},
                                                {o.engine.elsewhere(), "--engine"}};
  for (const auto& [is, word] : given)
    if (is) throw UsageError(fmt::format("{} is for pictures: two results files are judged by --pixels and told as --json", word));
}

int run_comparison(const Options& o) {
  if (is_results_name(o.baseline) && is_results_name(o.candidate)) {
    refuse_words_of_pictures(o);
    ResultsComparison results;
    results.baseline = o.baseline;
    results.candidate = o.candidate;
    results.pixels = o.pixels;
    results.json = o.json;
    return compare_results(results);
  }
  if (o.pixels > 0.0)
    throw UsageError("--pixels is for two results files; pictures are judged by --levels, --percent, --cluster and --mean");
  if (o.reason.find_first_not_of(" \t\n") == std::string::npos && !o.reason.empty())
    throw UsageError("--update needs a reason, for example \"new colours\"");
  require_not_read({o.report, o.junit, o.markdown}, {o.baseline, o.candidate, o.mask});
  if (o.engine.elsewhere()) return hand_over_comparison(o);
  render::CompareRequest request = make_request(o);
  std::tie(request.shard, request.shards) = shard_of(o.shard);
  CompareParts parts(o.shard.empty() && o.parts.empty() ? std::filesystem::path() : parts_folder(o), request);
  const bool keeps = !o.shard.empty() || !o.parts.empty();
  if (keeps)
    request.recall = [&](render::ComparedPair& pair, std::span<const std::filesystem::path> baselines) {
      return parts.recall(pair, baselines);
    };
  render::Comparison comparison;
  try {
    comparison = render::compare_pictures(request);
  } catch (const std::runtime_error& e) {  // what was given cannot be read
    throw UsageError(e.what());
  }
  if (!o.shard.empty()) {
    parts.write(request.shard, request.shards, comparison);
    if (verbosity() != Verbosity::quiet)
      fmt::print("shard        {} of {}: {} pictures compared; flexframe compare ... --parts {} makes the verdict of all\n", request.shard,
                 request.shards, comparison.pairs.size(), parts_folder(o).string());
    return 0;
  }
  if (keeps) {
    const auto both = std::count_if(comparison.pairs.begin(), comparison.pairs.end(),
                                    [](const render::ComparedPair& p) { return !p.baseline.empty() && !p.candidate.empty(); });
    if (both > parts.recalled())
      comparison.notes.push_back(fmt::format("{} of {} pairs were not found compared in {} and are compared here", both - parts.recalled(),
                                             both, parts_folder(o).string()));
  }
  write_reports(o, comparison, request);
  std::vector<std::string> updated;
  try {
    if (!o.reason.empty()) render::need_new_pictures(comparison);
  } catch (const std::runtime_error& e) {  // what was given cannot be read
    throw UsageError(e.what());
  }
  if (!o.reason.empty()) updated = render::update_baselines(comparison, request, o.reason);
  if (verbosity() != Verbosity::quiet)
    for (const std::string& note : comparison.notes) fmt::print(stderr, "note: {}\n", note);
  if (o.json) print_json(comparison, updated);
  else print_rows(comparison, updated);
  if (updated.empty()) refuse_unreadable(comparison);
  return comparison.passes || !o.reason.empty() ? 0 : 1;
}

}  // namespace

Command add_compare(Program& program) {
  Subcommand words = program.subcommand("compare", "pictures compared: two PNG files, two folders of them as a test, or two results files");
  words.footer(R"(A is the baseline, B the new picture or folder. Pictures agree if they are equal, or if all of this holds: few enough
pixels differ by more than the limit, few of them touch (by more than 16 levels), the mean difference is small, and the numbers
that flexframe writes into its pictures (vertices, their range, colour range) agree to 1e-4. A picture that only one folder has
does not agree. Pictures of 16 bits (depth, scalar) are compared in their own units: differences of 32 of 65535 are none, no four
pixels that touch may be off by more than 256, the mean by 8. --levels and --percent loosen what would contradict them.
Any PNG files will do. Of two results files (.h5) of one scene the drawn vertices are compared: how many pixels and metres they are apart
at most, with the first one's cameras and exaggeration. What --ignore and --mask leave out counts nowhere; shares and means are those of
the rest.
Exit codes: 0 all agree, 1 some do not, 2 bad input, a picture of a folder that cannot be read among it (the others are compared).)");
  auto options = std::make_shared<Options>();
  words.option("A", options->baseline, "baseline: PNG file, folder or results file").required();
  words.option("B", options->candidate, "new: PNG file, folder or results file").required();
  words.option("--also", options->also, "a further baseline; a picture agrees if it agrees with any; may be repeated")
      .as("PATH")
      .one_word();
  words
      .option(
          "--ignore", options->ignore,
          "[NAMES:]X,Y,WxH: a rectangle that is not looked at, px from the upper left; NAMES with * and ? as in a shell; may be repeated")
      .as("BOX")
      .one_word();
  words.option("--mask", options->mask, "PNG of the pictures' size, or a folder of them by the pictures' names: white is not looked at")
      .as("PATH");
  words.option("--levels", options->levels, "ignore differences of up to this many of 255 levels (2)").range(0, 255);
  words.option("--percent", options->percent, "percentage of pixels that may differ by more than that (0.005)").range(0.0, 100.0);
  words.option("--cluster", options->cluster, "largest group of touching pixels that may differ by more than 16 levels (3)")
      .range(0, 1 << 30);
  words.option("--mean", options->mean, "largest mean difference in levels that is accepted (0.1)").range(0.0, 255.0);
  words.flag("--exact", options->rule.exact, "require identical pixels");
  words.option("--measure", options->measured, "SSIM and FLIP of this many pairs, the worst").range(0, 1 << 30).show_default();
  words.option("--pixels", options->pixels, "two results files: pixels that vertices may be apart; default: any distance").positive();
  words.option("-j,--jobs", options->jobs, "threads (as many as the machine has)").range(0, 256);
  words.option("--report", options->report, "HTML page: both pictures side by side, swiped, blinked, what differs, with zoom").as("FILE");
  words.option("--page-size", options->page_size, "MB that the page has at most: less of the pictures is shown")
      .range(0.1, 500.0)
      .show_default();
  words.option("--junit", options->junit, "JUnit's XML, for GitLab, Jenkins and others").as("FILE");
  words.option("--markdown", options->markdown, "counts and table in Markdown, for the summary of a job").as("FILE");
  words.option("--update", options->reason, "make B the baseline, with this reason in CHANGES.md beside A").as("REASON");
  words.flag("--json", options->json, "the measured differences as JSON on stdout");
  words.example("baseline/ new/ --report report.html", "two folders of pictures, with a page that shows what differs");
  words.example("a.png b.png --exact", "equal pixels only");
  words.example("loose.h5 tight.h5 --pixels 0.5", "two runs of a scene: no drawn vertex more than half a pixel apart");
  words.example("baseline/ new/ --also baseline-mesa25/ --ignore 0,690,1280x30 --junit report.xml",
                "what another renderer makes is as good; the lowest 30 rows are not looked at");
  words
      .option("--shard", options->shard,
              "every N-th pair from the I-th on, without a verdict: its findings go to the folder of --parts, for the comparison of all")
      .as("I/N");
  words.option("--parts", options->parts, "folder with what shards found, which is not compared again; default: B-parts").as("DIR");
  add_engine_words(words, options->engine);
  words.example("baseline/ new/ --engine parallel --shards 8 --report report.html",
                "eight tasks compare, one makes verdict and page of all");
  return {words, [options] { return run_comparison(*options); }};
}

}  // namespace flexframe::cli
