#include "render/cli/compare_parts.h"

#include "render/cli/engine.h"
#include "render/cli/jobs.h"
#include "sim/base/file_output.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <array>
#include <fstream>
#include <sstream>
#include <utility>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using render::ComparedPair;
using render::PairState;

constexpr std::array states = {PairState::equal,      PairState::passes,           PairState::differs,          PairState::other_numbers,
                               PairState::other_size, PairState::missing_baseline, PairState::missing_candidate};

std::string rule_text(const render::CompareRequest& request) {
  std::string out = fmt::format("{} {}", program_fingerprint(), request.rule.exact);
  for (const render::Gate& g : {request.rule.gate, request.rule.deep})
    out += fmt::format(" {} {} {} {} {} {} {} {} {}", g.levels, g.share, g.cluster_levels, g.cluster, g.mean, g.weight, g.faint_levels,
                       g.faint, g.local);
  for (const render::IgnoredRegion& r : request.regions)
    out += fmt::format("\n{} {} {} {} {}", r.pattern, r.box.x, r.box.y, r.box.width, r.box.height);
  return out;
}

json row_of(const ComparedPair& p) {
  const render::ImageDifference& d = p.difference;
  return {{"state", render::state_name(p.state)},
          {"baseline", p.baseline.string()},
          {"numbers", p.numbers},
          {"sizes", {p.baseline_size.first, p.baseline_size.second, p.candidate_size.first, p.candidate_size.second}},
          {"machines", {p.baseline_machine, p.candidate_machine}},
          {"flags", {d.passes, d.equal, d.same_size}},
          {"counts", {d.full, d.largest, d.pixels_over, d.cluster, d.ignored}},
          {"box", {d.box.x, d.box.y, d.box.width, d.box.height}},
          {"broken", d.broken},
          {"mean", d.mean},
          {"share_over", d.share_over}};
}

// Throws json::exception for a row of another form.
ComparedPair pair_of(const json& row) {
  ComparedPair p;
  const auto state = row.at("state").get<std::string>();
  for (const PairState s : states)
    if (render::state_name(s) == state) p.state = s;
  p.baseline = row.at("baseline").get<std::string>();
  p.numbers = row.at("numbers").get<std::string>();
  const auto sizes = row.at("sizes").get<std::array<int, 4>>();
  p.baseline_size = {sizes[0], sizes[1]};
  p.candidate_size = {sizes[2], sizes[3]};
  std::tie(p.baseline_machine, p.candidate_machine) = row.at("machines").get<std::pair<std::string, std::string>>();
  render::ImageDifference& d = p.difference;
  const auto flags = row.at("flags").get<std::array<bool, 3>>();
  d.passes = flags[0];
  d.equal = flags[1];
  d.same_size = flags[2];
  const auto counts = row.at("counts").get<std::array<long, 5>>();
  d.full = static_cast<int>(counts[0]);
  d.largest = static_cast<int>(counts[1]);
  d.pixels_over = counts[2];
  d.cluster = counts[3];
  d.ignored = counts[4];
  const auto box = row.at("box").get<std::array<int, 4>>();
  d.box = {.x = box[0], .y = box[1], .width = box[2], .height = box[3]};
  d.broken = row.at("broken").get<std::string>();
  d.mean = row.at("mean").get<double>();
  d.share_over = row.at("share_over").get<double>();
  return p;
}

}  // namespace

CompareParts::CompareParts(fs::path folder, const render::CompareRequest& request)
    : folder_(std::move(folder)), question_(rule_text(request)), mask_(request.mask) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("part_") || !name.ends_with(".json")) continue;
    std::ifstream in(entry.path(), std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();  // of what cannot be read nothing is known
    const json rows = json::parse(text.view(), nullptr, false);
    if (!rows.is_object()) continue;
    for (const auto& [key, row] : rows.items()) known_[key] = row.dump(-1, ' ', false, json::error_handler_t::replace);
  }
}

bool CompareParts::recall(ComparedPair& pair, std::span<const fs::path> baselines) {
  std::string text = fmt::format("{}\n{}\n{}", question_, pair.name, sim::sha256_of_file(pair.candidate));
  for (const fs::path& baseline : baselines) text += "\n" + baseline.string() + " " + sim::sha256_of_file(baseline);
  std::error_code error;
  if (!mask_.empty()) text += "\n" + sim::sha256_of_file(fs::is_directory(mask_, error) ? mask_ / pair.name : mask_);
  const std::string key = sim::sha256(text);
  const std::lock_guard lock(guard_);
  keys_[pair.name] = key;
  const auto found = known_.find(key);
  if (found == known_.end()) return false;
  try {
    ComparedPair known = pair_of(json::parse(found->second));
    known.name = pair.name;
    known.candidate = pair.candidate;
    pair = std::move(known);
  } catch (const json::exception&) {
    return false;
  }
  ++recalled_;
  return true;
}

void CompareParts::write(int shard, int shards, const render::Comparison& comparison) const {
  json rows = json::object();
  for (const ComparedPair& pair : comparison.pairs)
    if (const auto key = keys_.find(pair.name); key != keys_.end() && pair.state != PairState::unreadable) rows[key->second] = row_of(pair);
  make_folder(folder_);
  sim::write_whole_file(folder_ / fmt::format("part_{}_of_{}.json", shard, shards),
                        rows.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
}

}  // namespace flexframe::cli
