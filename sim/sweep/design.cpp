#include "sim/sweep/design.h"

#include "sim/base/error.h"
#include "sim/base/plain_text.h"
#include "sim/base/words.h"
#include "sim/scene/parameters.h"

#include <fmt/format.h>

#include <boost/math/special_functions/erf.hpp>
#include <boost/random/sobol.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <numeric>

namespace flexframe::sim {
namespace {

constexpr long most_points = 100'000'000;
constexpr std::size_t most_drawn = 500;

// Numbers by chance that depend on their place alone: the mixing step of SplitMix64 (Steele, Lea, Flood 2014).
std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}
std::uint64_t chance(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) { return mix(mix(mix(seed) ^ stream) ^ index); }
// Between 0 and 1, both left out.
double fraction_of(std::uint64_t bits) { return (static_cast<double>(bits >> 11) + 0.5) * 0x1p-53; }

// The place of `index` in a permutation of 0..n-1: a Feistel network over the next power of four, walked until it comes back below n.
std::uint64_t permuted(std::uint64_t index, std::uint64_t n, std::uint64_t key) {
  unsigned half = 1;
  while ((1ull << (2 * half)) < n) ++half;
  const std::uint64_t mask = (1ull << half) - 1;
  do {
    std::uint64_t left = index >> half, right = index & mask;
    for (std::uint64_t round = 0; round < 6; ++round) {
      const std::uint64_t next = left ^ (chance(key, round, right) & mask);
      left = right;
      right = next;
    }
    index = left << half | right;
  } while (index >= n);
  return index;
}

double normal_share(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }
double normal_quantile(double u) { return -std::numbers::sqrt2 * boost::math::erfc_inv(2.0 * u); }

// The parts of a text between separators that stand in no brackets and no quotes.
std::vector<std::string> split_top(const std::string& text, char between) {
  std::vector<std::string> parts(1);
  int depth = 0;
  char quoted = 0;
  for (const char c : text) {
    if (quoted) quoted = c == quoted ? 0 : quoted;
    else if (c == '"' || c == '\'') quoted = c;
    else if (c == '(' || c == '[' || c == '{') ++depth;
    else if (c == ')' || c == ']' || c == '}') --depth;
    if (c == between && depth == 0 && !quoted) parts.emplace_back();
    else parts.back() += c;
  }
  for (std::string& part : parts) {
    part.erase(0, part.find_first_not_of(' '));
    part.erase(part.find_last_not_of(' ') + 1);
  }
  return parts;
}

// "0.2", "200 mm", "pi/4" in SI; none where it says no number.
std::optional<double> number_of(const std::string& text) {
  try {
    return Parameters().number(text, "*");
  } catch (const InputError&) {
    return std::nullopt;
  }
}

[[noreturn]] void refuse(const std::string& setting, const std::string& why) {
  throw InputError(fmt::format("--set {}: {}", quote(setting), why));
}

// "uniform(a,b)" and its like; none where the text is none of them.
std::optional<Distribution> distribution_of(const std::string& text, const std::string& setting) {
  const std::pair<const char*, Distribution::Kind> kinds[] = {
      {"uniform(", Distribution::Kind::uniform}, {"loguniform(", Distribution::Kind::loguniform}, {"normal(", Distribution::Kind::normal}};
  for (const auto& [word, kind] : kinds) {
    if (!text.starts_with(word) || !text.ends_with(')')) continue;
    const std::string inside = text.substr(std::string(word).size(), text.size() - std::string(word).size() - 1);
    std::vector<double> numbers;
    for (const std::string& part : split_top(inside, ',')) {
      const std::optional<double> number = number_of(part);
      if (!number) refuse(setting, fmt::format("{} is no number", quote(part)));
      numbers.push_back(*number);
    }
    const bool normal = kind == Distribution::Kind::normal;
    if (numbers.size() != 2 && !(normal && numbers.size() == 4))
      refuse(setting, fmt::format("{} takes {}, found {} numbers", quote(word + std::string("...)")),
                                  normal ? "mean and deviation, or mean, deviation, low and high" : "two numbers", numbers.size()));
    Distribution out{kind, numbers[0], numbers[1]};
    if (numbers.size() == 4) out.low = numbers[2], out.high = numbers[3];
    if (normal && !(out.b > 0.0)) refuse(setting, "the deviation must be > 0");
    if (!normal && !(out.a < out.b)) refuse(setting, "the second number must be larger than the first");
    if (kind == Distribution::Kind::loguniform && !(out.a > 0.0)) refuse(setting, "both ends must be > 0");
    if (out.low && !(*out.low < *out.high)) refuse(setting, "low must be less than high");
    if (out.low && !(normal_share((*out.high - out.a) / out.b) - normal_share((*out.low - out.a) / out.b) > 1e-9))
      refuse(setting, "hardly any value lies between low and high");
    return out;
  }
  return std::nullopt;
}

// "a:b:n", "a:b:n:log", "a:b", "a:b:log"; false where the text is none of them.
bool read_range(const std::string& text, const std::string& setting, SweepAxis& axis) {
  std::vector<std::string> parts = split_top(text, ':');
  if (parts.size() < 2 || parts.size() > 4) return false;
  const bool log = parts.back() == "log";
  if (log) parts.pop_back();
  if (parts.size() < 2 || parts.size() > 3) return false;
  const std::optional<double> from = number_of(parts[0]), to = number_of(parts[1]);
  if (!from || !to) return false;
  if (log && !(*from > 0.0 && *to > 0.0)) refuse(setting, "both ends of a range in equal ratios must be > 0");
  axis.logarithmic = log;
  if (parts.size() == 2) {
    if (!(*from < *to)) refuse(setting, "the second number must be larger than the first");
    axis.chance = Distribution{log ? Distribution::Kind::loguniform : Distribution::Kind::uniform, *from, *to};
    return true;
  }
  long count = 0;
  const auto [end, wrong] = std::from_chars(parts[2].data(), parts[2].data() + parts[2].size(), count);
  if (wrong != std::errc() || end != parts[2].data() + parts[2].size() || count < 2 || count > 1'000'000)
    refuse(setting, fmt::format("the number of values must be a whole number from 2 to 1000000, found {}", quote(parts[2])));
  for (long k = 0; k < count; ++k) {
    const double s = static_cast<double>(k) / static_cast<double>(count - 1);
    const double value = k == 0 ? *from : k == count - 1 ? *to : log ? *from * std::pow(*to / *from, s) : *from + s * (*to - *from);
    // 0.29, not 0.29000000000000004.
    axis.values.push_back(fmt::format("{:.15g}", value));
    const char* behind = nullptr;
    axis.numbers.push_back(leading_number(axis.values.back().c_str(), &behind));
  }
  return true;
}

}  // namespace

double Distribution::quantile(double u) const {
  switch (kind) {
    case Kind::uniform:
      return a + u * (b - a);
    case Kind::loguniform:
      return a * std::pow(b / a, u);
    case Kind::normal:
      break;
  }
  if (!low) return a + b * normal_quantile(u);
  const double from = normal_share((*low - a) / b), to = normal_share((*high - a) / b);
  return std::clamp(a + b * normal_quantile(std::clamp(from + u * (to - from), 1e-300, 1.0 - 1e-16)), *low, *high);
}

void Design::read_setting(const std::string& setting) {
  const std::size_t equals = setting.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == setting.size())
    refuse(setting, "must be KEY=VALUES, for example body.rod.length=0.2:0.4:21 or mu=0.05,0.1,0.2");
  SweepAxis axis;
  axis.key = setting.substr(0, equals);
  const std::string text = setting.substr(equals + 1);
  const auto same_key = [&](const std::string& other) { return other.starts_with(axis.key + "="); };
  if (std::any_of(axes_.begin(), axes_.end(), [&](const SweepAxis& other) { return other.key == axis.key; }) ||
      std::any_of(fixed_.begin(), fixed_.end(), same_key))
    refuse(setting, "the key is set twice");
  axis.chance = distribution_of(text, setting);
  if (!axis.chance && !read_range(text, setting, axis)) {
    axis.values = split_top(text, ',');
    if (axis.values.size() == 1) {
      fixed_.push_back(setting);
      return;
    }
    for (const std::string& value : axis.values) {
      if (value.empty()) refuse(setting, "a value of the list is empty");
      if (const std::optional<double> number = number_of(value)) axis.numbers.push_back(*number);
    }
    if (axis.numbers.size() != axis.values.size()) axis.numbers.clear();
  }
  axes_.push_back(std::move(axis));
}

void Design::read_draws(const std::string& words, bool sensitivity) {
  if (words.empty()) return;
  const char* option = sensitivity ? "--sensitivity" : "--sample";
  const std::vector<std::string> known =
      sensitivity ? std::vector<std::string>{"sobol", "morris"} : std::vector<std::string>{"lhs", "sobol", "random"};
  const std::size_t colon = words.find(':');
  const std::string word = words.substr(0, colon);
  if (std::find(known.begin(), known.end(), word) == known.end())
    throw InputError(
        fmt::format("{} {}: {} is unknown{} allowed: {}", option, quote(words), quote(word), did_you_mean(word, known), list_words(known)));
  const std::string count = colon == std::string::npos ? "" : words.substr(colon + 1);
  const auto [end, wrong] = std::from_chars(count.data(), count.data() + count.size(), draws_);
  if (wrong != std::errc() || end != count.data() + count.size() || draws_ < 1 || draws_ > most_points)
    throw InputError(fmt::format("{} {}: must be {}:N with a whole number N >= 1", option, quote(words), word));
  if (sensitivity) sampling_ = word == "sobol" ? Sampling::sobol_indices : Sampling::morris;
  else sampling_ = word == "lhs" ? Sampling::latin : word == "sobol" ? Sampling::sobol : Sampling::random;
}

void Design::read_searches(const DesignWords& words) {
  searches_ = words.searches;
  runs_ = words.runs;
  sampling_ = Sampling::searched;
  if (!words.sample.empty() || !words.sensitivity.empty())
    throw InputError("--minimise and --maximise choose their points themselves: --sample and --sensitivity do not go with them");
  for (const SweepAxis& axis : axes_) {
    if (axis.chance && axis.chance->kind != Distribution::Kind::normal) continue;
    throw InputError(fmt::format("--set {}: a search needs the range in which it may go, {}=LOW:HIGH or LOW:HIGH:log", axis.key, axis.key));
  }
  if (axes_.empty()) throw InputError("a search needs at least one --set KEY=LOW:HIGH");
  constexpr std::size_t most_searched = 50;
  if (axes_.size() > most_searched) throw InputError(fmt::format("a search takes at most {} keys", most_searched));
  size_ = static_cast<long>(searches_) * runs_;
}

Design::Design(const DesignWords& words) : seed_(words.seed) {
  for (const std::string& setting : words.settings) read_setting(setting);
  if (!words.sample.empty() && !words.sensitivity.empty())
    throw InputError("--sample excludes --sensitivity, which draws points of its own");
  read_draws(words.sample, false);
  read_draws(words.sensitivity, true);
  for (std::size_t k = 0; k < axes_.size(); ++k)
    if (axes_[k].chance) drawn_.push_back(k);
  if (words.searches > 0) {
    read_searches(words);
    return;
  }
  if (axes_.empty()) throw InputError("a sweep needs at least one --set with several values, such as body.rod.length=0.2:0.4:21");
  if (sampling_ == Sampling::none && !drawn_.empty())
    throw InputError(
        fmt::format("--set {} draws its values by chance: say how many with --sample lhs:N, sobol:N or random:N, or give "
                    "the number of values behind the range, {}=LOW:HIGH:N",
                    axes_[drawn_[0]].key, axes_[drawn_[0]].key));
  if (sampling_ != Sampling::none && drawn_.empty())
    throw InputError(
        "--sample and --sensitivity draw values by chance: at least one --set must be LOW:HIGH, uniform(...), loguniform(...) "
        "or normal(...)");
  if (!words.sensitivity.empty() && drawn_.size() < axes_.size())
    throw InputError("--sensitivity takes keys that vary by chance only: LOW:HIGH, uniform(...), loguniform(...) or normal(...)");
  if (drawn_.size() > most_drawn) throw InputError(fmt::format("at most {} keys may vary by chance", most_drawn));
  const long d = static_cast<long>(drawn_.size());
  double points = 1.0;
  if (sampling_ != Sampling::none) {
    const long block = sampling_ == Sampling::sobol_indices ? d + 2 : sampling_ == Sampling::morris ? d + 1 : 1;
    points = static_cast<double>(draws_) * static_cast<double>(block);
    per_grid_ = static_cast<long>(points);
  }
  for (const SweepAxis& axis : axes_)
    if (!axis.chance) points *= static_cast<double>(axis.values.size());
  if (points > static_cast<double>(most_points))
    throw InputError(fmt::format("these are {:.3g} points; at most {} are allowed", points, most_points));
  size_ = static_cast<long>(points);
}

std::vector<double> Design::sobol_row(long row, std::size_t columns) const {
  // Its first point, all zero, is left out by the library.
  boost::random::sobol engine(columns);
  engine.seed(static_cast<std::uint64_t>(row));
  std::vector<double> out(columns);
  for (double& u : out) u = fraction_of(engine());
  return out;
}

Design::Move Design::move(long path, long k) const {
  const std::size_t d = drawn_.size();
  std::vector<std::size_t> order(d);
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = d; i-- > 1;) std::swap(order[i], order[chance(seed_, 1000 + i, static_cast<std::uint64_t>(path)) % (i + 1)]);
  const std::size_t axis = order[k];
  const bool up = chance(seed_, 3000 + axis, static_cast<std::uint64_t>(path)) & 1;
  return {drawn_[axis], up ? 2.0 / 3.0 : -2.0 / 3.0};
}

// Place of a draw in the distribution of each key that varies by chance, 0 to 1.
std::vector<double> Design::shares(long draw) const {
  const std::size_t d = drawn_.size();
  if (sampling_ == Sampling::sobol) return sobol_row(draw, d);
  if (sampling_ == Sampling::sobol_indices) {
    const long block = draw / static_cast<long>(d + 2), k = draw % static_cast<long>(d + 2);
    const std::vector<double> row = sobol_row(block, 2 * d);
    const auto half = row.begin() + static_cast<std::ptrdiff_t>(d);
    std::vector<double> out(k == 1 ? half : row.begin(), k == 1 ? row.end() : half);
    if (k >= 2) out[k - 2] = row[d + k - 2];
    return out;
  }
  std::vector<double> out(d);
  if (sampling_ == Sampling::morris) {
    const long path = draw / static_cast<long>(d + 1), k = draw % static_cast<long>(d + 1);
    for (std::size_t i = 0; i < d; ++i) {
      const double base = chance(seed_, 2000 + i, static_cast<std::uint64_t>(path)) & 1 ? 1.0 / 3.0 : 0.0;
      const bool up = chance(seed_, 3000 + i, static_cast<std::uint64_t>(path)) & 1;
      out[i] = up ? base : base + 2.0 / 3.0;
    }
    for (long step = 0; step < k; ++step) {
      const Move m = move(path, step);
      const auto at = std::find(drawn_.begin(), drawn_.end(), m.axis) - drawn_.begin();
      out[at] += m.step;
    }
    // A normal distribution that is not cut off has no ends.
    for (std::size_t i = 0; i < d; ++i) {
      const Distribution& c = *axes_[drawn_[i]].chance;
      if (c.kind == Distribution::Kind::normal && !c.low) out[i] = 0.01 + 0.98 * out[i];
    }
    return out;
  }
  const auto n = static_cast<std::uint64_t>(draws_), at = static_cast<std::uint64_t>(draw);
  for (std::size_t i = 0; i < d; ++i) {
    const double u = fraction_of(chance(seed_, i, at));
    out[i] = sampling_ == Sampling::random
                 ? u
                 : (static_cast<double>(permuted(at, n, chance(seed_, 1'000'000 + i, 0))) + u) / static_cast<double>(n);
  }
  return out;
}

std::vector<Design::Value> Design::place(const std::vector<double>& shares) const {
  std::vector<Value> out(axes_.size());
  for (std::size_t k = 0; k < axes_.size(); ++k) {
    out[k].number = axes_[k].chance->quantile(shares[k]);
    out[k].text = fmt::format("{}", out[k].number);
  }
  return out;
}

std::vector<double> Design::start(int search, int attempt) const {
  std::vector<double> out(axes_.size(), 0.5);
  if (search == 0 && attempt == 0) return out;
  const auto n = static_cast<std::uint64_t>(std::max(1, searches_ - 1)), at = static_cast<std::uint64_t>(std::max(0, search - 1));
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double u = fraction_of(chance(seed_, 4000 + i + 100 * static_cast<std::uint64_t>(attempt), static_cast<std::uint64_t>(search)));
    out[i] = attempt > 0 ? u : (static_cast<double>(permuted(at, n, chance(seed_, 1'000'000 + i, 0))) + u) / static_cast<double>(n);
  }
  return out;
}

const std::vector<double>& Design::noted(long index) const {
  const auto found = noted_.find(index);
  if (found == noted_.end()) throw ArgumentError(fmt::format("no search made point {}", index));
  return found->second;
}

std::vector<Design::Value> Design::point(long index) const {
  if (index < 0 || index >= size_) throw ArgumentError(fmt::format("the design has {} points, no point {}", size_, index));
  if (sampling_ == Sampling::searched) return place(noted(index));
  std::vector<Value> out(axes_.size());
  if (!drawn_.empty()) {
    const std::vector<double> u = shares(index % per_grid_);
    for (std::size_t i = 0; i < drawn_.size(); ++i) {
      Value& value = out[drawn_[i]];
      value.number = axes_[drawn_[i]].chance->quantile(u[i]);
      value.text = fmt::format("{}", value.number);
    }
  }
  long rest = index / per_grid_;
  for (std::size_t k = axes_.size(); k-- > 0;) {
    const SweepAxis& axis = axes_[k];
    if (axis.chance) continue;
    const auto count = static_cast<long>(axis.values.size());
    const std::size_t at = rest % count;
    rest /= count;
    out[k] = {axis.values[at], axis.numbers.empty() ? static_cast<double>(at) : axis.numbers[at]};
  }
  return out;
}

std::vector<std::string> Design::settings(const std::vector<Value>& values) const {
  std::vector<std::string> out = fixed_;
  for (std::size_t k = 0; k < axes_.size(); ++k) out.push_back(fmt::format("{}={}", axes_[k].key, values[k].text));
  return out;
}

}  // namespace flexframe::sim
