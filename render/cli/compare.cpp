// flexframe compare: image regression.
#include "render/cli/commands.h"

#include "render/base/file.h"
#include "render/image/compare_report.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>

namespace flexframe::cli {
namespace {

struct Options {
  std::string baseline, candidate, report, reason;
  render::CompareOptions rule;
  std::optional<int> levels, cluster;
  std::optional<double> percent, mean;
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
    if (*o.levels > usual.levels) {
      out.gate.mean = *o.levels;
      out.deep.levels = 257 * *o.levels;
      out.deep.cluster_levels = std::max(out.deep.cluster_levels, 257 * *o.levels);
      out.deep.mean = 257.0 * *o.levels;
    }
  }
  if (o.percent) {
    out.gate.share = out.deep.share = *o.percent / 100.0;
    if (out.gate.share > usual.share) out.gate.cluster = out.deep.cluster = std::numeric_limits<int>::max();
  }
  if (o.cluster) out.gate.cluster = out.deep.cluster = *o.cluster + 1;
  if (o.mean) {
    out.gate.mean = *o.mean;
    out.deep.mean = 257.0 * *o.mean;
  }
  return out;
}

void print_json(const render::Comparison& comparison, const std::vector<std::string>& updated) {
  nlohmann::json pairs = nlohmann::json::array();
  for (const render::ComparedPair& p : comparison.pairs) {
    nlohmann::json row = {{"name", p.name}, {"result", render::state_name(p.state)}};
    if (p.state == render::PairState::passes || p.state == render::PairState::differs || p.state == render::PairState::equal ||
        p.state == render::PairState::other_numbers)
      render::for_each_number(p.difference, [&](const char* name, auto number) { row[name] = number; });
    if (!p.numbers.empty()) row["numbers"] = p.numbers;
    pairs.push_back(std::move(row));
  }
  fmt::print("{}\n", nlohmann::json({{"passes", comparison.passes}, {"pictures", pairs}, {"updated", updated}}).dump(2));
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
      fmt::print("{}: {}: largest difference {}/{}, mean {:.4g}/{}, {} pixels ({:.4g} %) over the limit, {} of them together{}\n", p.name,
                 render::state_name(p.state), d.largest, d.full, d.mean, d.full, d.pixels_over, 100.0 * d.share_over, d.cluster,
                 d.full == 255 ? fmt::format(", SSIM {:.5f}, FLIP {:.5f}", d.ssim, d.flip) : "");
    else fmt::print("{}: {}\n", p.name, render::state_name(p.state));
    if (!p.numbers.empty()) fmt::print("{}: {}\n", p.name, p.numbers);
  }
  fmt::print("{} equal, {} within the limit, {} different or missing\n", equal, within, bad);
  if (!updated.empty()) fmt::print("{} baselines updated\n", updated.size());
}

}  // namespace

Command add_compare(Program& program) {
  Subcommand words = program.subcommand("compare", "Image regression: two PNG files or two folders of them");
  words.footer(R"(A is the baseline, B the new picture or folder. Pictures agree if they are equal, or if all of this holds: few enough
pixels differ by more than the limit, few of them touch (by more than 16 levels), the mean difference is small, and the numbers
that flexframe writes into its pictures (vertices, their range, colour range) agree to 1e-4. A picture that only one folder has
does not agree. Pictures of 16 bits (depth, scalar) are compared in their own units: differences of 32 of 65535 are none, no four
pixels that touch may be off by more than 256, the mean by 8. --levels and --percent loosen what would contradict them.
Exit codes: 0 all agree, 1 some do not, 2 bad input.)");
  auto options = std::make_shared<Options>();
  words.option("A", options->baseline, "baseline: PNG file or folder").required();
  words.option("B", options->candidate, "new: PNG file or folder").required();
  words.option("--levels", options->levels, "ignore differences of up to this many of 255 levels (2)").range(0, 255);
  words.option("--percent", options->percent, "percentage of pixels that may differ by more than that (0.005)").range(0.0, 100.0);
  words.option("--cluster", options->cluster, "largest group of touching pixels that may differ by more than 16 levels (3)")
      .range(0, 1 << 30);
  words.option("--mean", options->mean, "largest mean difference in levels that is accepted (0.1)").range(0.0, 255.0);
  words.flag("--exact", options->rule.exact, "require identical pixels");
  words.option("--report", options->report, "HTML page with baseline, new picture and heat map side by side").as("FILE");
  words.option("--update", options->reason, "make B the baseline, with this reason in CHANGES.md beside A");
  words.flag("--json", options->json, "the measured differences as JSON on stdout");
  words.example("baseline/ new/ --report report.html", "two folders of pictures, with a page that shows them side by side");
  words.example("a.png b.png --exact", "equal pixels only");
  return {words, [options] {
            if (options->reason.find_first_not_of(" \t\n") == std::string::npos && !options->reason.empty())
              throw UsageError("--update needs a reason, for example \"new colours\"");
            const render::CompareOptions rule = settle(*options);
            render::Comparison comparison;
            try {
              comparison =
                  render::compare_pictures(options->baseline, options->candidate, rule, !options->report.empty(), !options->reason.empty());
            } catch (const std::runtime_error& e) {  // what was given cannot be read
              throw UsageError(e.what());
            }
            if (!options->report.empty()) {
              const std::string page = render::comparison_page(comparison, options->baseline + " and " + options->candidate);
              render::write_file(options->report, std::span(reinterpret_cast<const std::uint8_t*>(page.data()), page.size()));
            }
            std::vector<std::string> updated;
            if (!options->reason.empty()) updated = render::update_baselines(comparison, options->baseline, options->reason);
            if (options->json) print_json(comparison, updated);
            else print_rows(comparison, updated);
            return comparison.passes || !options->reason.empty() ? 0 : 1;
          }};
}

}  // namespace flexframe::cli
