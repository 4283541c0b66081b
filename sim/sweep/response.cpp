#include "sim/sweep/response.h"

#include "sim/base/error.h"
#include "sim/base/words.h"
#include "sim/results/spectrum.h"
#include "sim/scene/parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

enum Word : std::size_t { max_of, min_of, mean, rms, range, final, initial, integral, time_of_max, time_of_min, time_of, frequency };

bool in_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_'; }

// The place behind the bracket that closes the one at `open`; npos where none does.
std::size_t behind_bracket(const std::string& text, std::size_t open) {
  int depth = 0;
  for (std::size_t at = open; at < text.size(); ++at) {
    if (text[at] == '(') ++depth;
    if (text[at] == ')' && --depth == 0) return at + 1;
  }
  return std::string::npos;
}

bool has_top_comma(const std::string& text) {
  int depth = 0;
  for (const char c : text) {
    if (c == '(') ++depth;
    else if (c == ')') --depth;
    else if (c == ',' && depth == 0) return true;
  }
  return false;
}

// A call of one of the words with one argument: from `begin` to `end`, its argument.
struct Call {
  std::size_t begin, end, word;
  std::string argument;
};

// The outermost calls, in order.
std::vector<Call> calls_in(const std::string& text) {
  std::vector<Call> calls;
  for (std::size_t at = 0; at < text.size();) {
    if (!in_name(text[at])) {
      ++at;
      continue;
    }
    const std::size_t begin = at;
    while (at < text.size() && (in_name(text[at]) || text[at] == '.')) ++at;
    const std::vector<std::string>& words = response_words();
    const auto word = std::find(words.begin(), words.end(), text.substr(begin, at - begin));
    std::size_t open = at;
    while (open < text.size() && text[open] == ' ') ++open;
    if (word == words.end() || open >= text.size() || text[open] != '(') continue;
    const std::size_t end = behind_bracket(text, open);
    if (end == std::string::npos) continue;
    const std::string argument = text.substr(open + 1, end - open - 2);
    if (has_top_comma(argument)) continue;
    calls.push_back({begin, end, static_cast<std::size_t>(word - words.begin()), argument});
    at = end;
  }
  return calls;
}

// The name in an expression of the k-th call taken out of it.
std::string standing_for(std::size_t k) { return fmt::format("response__{}_", k); }

// Trapezoidal rule.
double over_time(const VecX& t, const VecX& x) {
  double sum = 0.0;
  for (Eigen::Index i = 1; i < t.size(); ++i) sum += 0.5 * (x[i] + x[i - 1]) * (t[i] - t[i - 1]);
  return sum;
}

// The largest value, between samples by the parabola through the largest and its neighbours.
double peak(const VecX& t, const VecX& x) {
  Eigen::Index i = 0;
  const double most = x.maxCoeff(&i);
  if (i == 0 || i + 1 == x.size()) return most;
  // Slopes on both sides, and how the parabola bends.
  const double a = t[i] - t[i - 1], b = t[i + 1] - t[i], left = (x[i] - x[i - 1]) / a, right = (x[i + 1] - x[i]) / b;
  const double bend = (right - left) / (a + b), slope = (left * b + right * a) / (a + b);
  return bend < 0.0 ? most - slope * slope / (4.0 * bend) : most;
}

// Without every second sample, the first or the second one of the inner ones on; first and last stay: what a run begins and ends with is no
// matter of sampling.
Histories every_second(const Histories& h, Eigen::Index left_out) {
  const Eigen::Index n = h.times.size();
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < n; ++i)
    if (i == 0 || i == n - 1 || i % 2 != left_out % 2) kept.push_back(i);
  Histories out;
  out.columns = h.columns;
  out.times.resize(static_cast<Eigen::Index>(kept.size()));
  out.values.resize(h.values.rows(), out.times.size());
  for (Eigen::Index i = 0; i < out.times.size(); ++i) out.times[i] = h.times[kept[i]], out.values.col(i) = h.values.col(kept[i]);
  return out;
}

// Of the largest line but the mean, between its neighbours by the parabola through the logarithms of the three (for Hann's window good to
// a few hundredths of a line).
double strongest_frequency(const VecX& t, const VecX& x) {
  const Spectrum s = amplitude_spectrum(t, x);
  Eigen::Index at = 1;
  for (Eigen::Index k = 2; k < s.amplitude.size(); ++k)
    if (s.amplitude[k] > s.amplitude[at]) at = k;
  if (!(s.amplitude[at] > 1e-12 * x.cwiseAbs().maxCoeff())) throw SimulationError("it does not vibrate");
  double shift = 0.0;
  if (at > 1 && at + 1 < s.amplitude.size() && s.amplitude[at - 1] > 0.0 && s.amplitude[at + 1] > 0.0) {
    const double a = std::log(s.amplitude[at - 1]), b = std::log(s.amplitude[at]), c = std::log(s.amplitude[at + 1]);
    if (a - 2.0 * b + c < 0.0) shift = std::clamp(0.5 * (a - c) / (a - 2.0 * b + c), -0.5, 0.5);
  }
  return s.at[at] + shift * (s.at[1] - s.at[0]);
}

}  // namespace

const std::vector<std::string>& response_words() {
  static const std::vector<std::string> words = {"max",     "min",      "mean",        "rms",         "range",   "final",
                                                 "initial", "integral", "time_of_max", "time_of_min", "time_of", "frequency"};
  return words;
}

std::pair<std::string, std::string> split_response(const std::string& text) {
  const auto trim = [](std::string word) {
    word.erase(0, word.find_first_not_of(' '));
    word.erase(word.find_last_not_of(' ') + 1);
    return word;
  };
  const std::size_t equals = text.find('=');
  if (equals != std::string::npos && equals > 0 && equals + 1 < text.size() && text[equals + 1] != '=') {
    const std::string name = trim(text.substr(0, equals));
    if (!name.empty() && std::all_of(name.begin(), name.end(), in_name) && !(name[0] >= '0' && name[0] <= '9'))
      return {name, trim(text.substr(equals + 1))};
  }
  return {trim(text), trim(text)};
}

Response::Formula Response::read(const std::string& text, const Known& known, bool of_histories) {
  Formula out;
  std::string plain;
  std::size_t done = 0;
  std::vector<std::string> names;
  std::vector<std::pair<Formula::Source, std::size_t>> sources;
  for (const Call& call : calls_in(text)) {
    Reduction inner{call.word, text.substr(call.begin, call.end - call.begin), read(call.argument, known, true)};
    names.push_back(standing_for(out.reductions.size()));
    sources.emplace_back(Formula::Source::reduction, out.reductions.size());
    out.reductions.push_back(std::make_shared<const Reduction>(std::move(inner)));
    plain += text.substr(done, call.begin - done) + names.back();
    done = call.end;
  }
  plain += text.substr(done);
  const auto offer = [&](std::span<const std::string> words, Formula::Source source) {
    for (std::size_t k = 0; k < words.size(); ++k) {
      names.push_back(words[k]);
      sources.emplace_back(source, k);
    }
  };
  offer(known.settings, Formula::Source::setting);
  if (of_histories) offer(known.columns, Formula::Source::column);
  try {
    out.expression = Expression(plain, names);
  } catch (const InputError& problem) {
    std::string message = problem.what();
    if (!of_histories) {
      // Right but for a history that stands where a number must.
      offer(known.columns, Formula::Source::column);
      try {
        const Expression with_histories(plain, names);
        const std::vector<std::string>& read = with_histories.variables();
        const auto column = std::find_if(read.begin(), read.end(), [&](const std::string& name) {
          return std::find(known.columns.begin(), known.columns.end(), name) != known.columns.end();
        });
        if (column != read.end())
          throw InputError(
              fmt::format("{} is a history: say what of it is wanted, as max({}) or final({})", quote(*column), *column, *column));
      } catch (const InputError& other) {
        message = other.what();
      }
    }
    // A name that is none is read as part of the expression, which it makes wrong.
    const std::size_t equals = text.find('=');
    if (equals != std::string::npos && equals > 0 && text.find_first_of("=<>!()") == equals && text.substr(equals + 1, 1) != "=")
      throw InputError(fmt::format("the name {} before = must be of the letters a-z and A-Z, digits and _, and begin with no digit",
                                   quote(text.substr(0, equals))));
    // Names that stand for calls are not the user's.
    for (std::size_t k = 0; k < out.reductions.size(); ++k)
      if (const std::size_t at = message.find(names[k] + ", "); at != std::string::npos) message.erase(at, names[k].size() + 2);
    // Columns of the message count in what is read, which is not the user's text where calls were taken out of it.
    if (!out.reductions.empty() && message.starts_with("column ")) message = message.substr(message.find(": ") + 2);
    throw InputError(fmt::format("{}; a history becomes a number by {}; histories: {}", message, list_words(response_words()),
                                 list_words(known.columns)));
  }
  if (!of_histories && out.expression.depends_on_time()) throw InputError("the time t stands in max(...), final(...) and their like only");
  for (const std::string& variable : out.expression.variables())
    out.reads.push_back(sources[std::find(names.begin(), names.end(), variable) - names.begin()]);
  return out;
}

Response::Response(const std::string& text, std::span<const std::string> columns, std::span<const std::string> settings) {
  const auto [name, expression] = split_response(text);
  name_ = name;
  try {
    formula_ = read(expression, {columns, settings}, false);
  } catch (const InputError& problem) {
    throw InputError(fmt::format("--response {}: {}", quote(text), problem.what()));
  }
}

// What a formula of histories has been at the samples.
VecX Response::series(const Formula& of, const Histories& h, std::span<const double> settings, Seen seen) {
  std::vector<double> variables(of.reads.size());
  for (std::size_t k = 0; k < of.reads.size(); ++k) {
    const auto [source, at] = of.reads[k];
    if (source == Formula::Source::setting) variables[k] = settings[at];
    if (source == Formula::Source::reduction) variables[k] = reduce(*of.reductions[at], h, settings, seen);
  }
  VecX x(h.times.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    for (std::size_t k = 0; k < of.reads.size(); ++k)
      if (of.reads[k].first == Formula::Source::column) variables[k] = h.values(static_cast<Eigen::Index>(of.reads[k].second), i);
    x[i] = of.expression.value(h.times[i], variables.data());
  }
  return x;
}

double Response::reduce(const Reduction& reduction, const Histories& h, std::span<const double> settings, Seen seen) {
  const VecX x = series(reduction.of, h, settings, seen);
  const VecX& t = h.times;
  const Eigen::Index last = x.size() - 1;
  const double duration = t[last] - t[0];
  Eigen::Index at = 0;
  switch (static_cast<Word>(reduction.word)) {
    case max_of:
      return seen == Seen::between ? peak(t, x) : x.maxCoeff();
    case min_of:
      return seen == Seen::between ? -peak(t, -x) : x.minCoeff();
    case mean:
      return over_time(t, x) / duration;
    case rms:
      return std::sqrt(over_time(t, x.cwiseAbs2()) / duration);
    case range:
      return seen == Seen::between ? peak(t, x) + peak(t, -x) : x.maxCoeff() - x.minCoeff();
    case final:
      return x[last];
    case initial:
      return x[0];
    case integral:
      return over_time(t, x);
    case time_of_max:
      return x.maxCoeff(&at), t[at];
    case time_of_min:
      return x.minCoeff(&at), t[at];
    case time_of:
      while (at <= last && x[at] == 0.0) ++at;
      if (at > last) throw SimulationError(fmt::format("{} is never true", reduction.text));
      return t[at];
    case frequency:
      try {
        return strongest_frequency(t, x);
      } catch (const std::runtime_error& problem) {
        throw SimulationError(fmt::format("{}: {}", reduction.text, problem.what()));
      }
  }
  return 0.0;
}

double Response::value(const Histories& histories, std::span<const double> settings, Seen seen) const {
  std::vector<double> variables(formula_.reads.size());
  for (std::size_t k = 0; k < variables.size(); ++k) {
    const auto [source, at] = formula_.reads[k];
    variables[k] = source == Formula::Source::setting ? settings[at] : reduce(*formula_.reductions[at], histories, settings, seen);
  }
  try {
    return formula_.expression.value(0.0, variables.data());
  } catch (const SimulationError& problem) {
    // Names that stand for calls and the time are not the user's.
    std::string message = problem.what();
    const auto replace = [&](const std::string& what, const std::string& by) {
      for (std::size_t at = message.find(what); at != std::string::npos; at = message.find(what, at + by.size()))
        message.replace(at, what.size(), by);
    };
    for (std::size_t k = 0; k < formula_.reductions.size(); ++k) replace(standing_for(k), formula_.reductions[k]->text);
    replace(" at t = 0 s", "");
    throw SimulationError(message);
  }
}

double Response::value(const Histories& histories, std::span<const double> settings) const {
  return value(histories, settings, Seen::samples);
}

void Response::mark_read(const Formula& formula, std::vector<bool>& columns) {
  for (const auto& [source, at] : formula.reads)
    if (source == Formula::Source::column) columns[at] = true;
  for (const auto& reduction : formula.reductions) mark_read(reduction->of, columns);
}

std::string Response::too_few_periods(const Formula& formula, const Histories& h, std::span<const double> settings) {
  // Of sines of any phase two periods and more are told to 3 %, of one and a half a third is missing. The largest line of a drift is the
  // first one.
  constexpr double fewest = 2.0;
  const double duration = h.times[h.times.size() - 1] - h.times[0];
  for (const auto& reduction : formula.reductions) {
    if (std::string inner = too_few_periods(reduction->of, h, settings); !inner.empty()) return inner;
    if (reduction->word != frequency) continue;
    const double periods = strongest_frequency(h.times, series(reduction->of, h, settings, Seen::samples)) * duration;
    if (periods < fewest)
      return fmt::format("{}: only {:.2g} of its periods are in the run: it is a drift, or the run is too short to tell it",
                         reduction->text, periods);
  }
  return {};
}

std::string Response::too_few_periods(const Histories& histories, std::span<const double> settings) const {
  return too_few_periods(formula_, histories, settings);
}

bool Response::reads_frequency() const {
  return std::any_of(formula_.reductions.begin(), formula_.reductions.end(), [](const auto& r) { return r->word == frequency; });
}

double Response::largest(const Histories& h, std::span<const double> settings) const {
  double out = 0.0;
  for (const auto& r : formula_.reductions)
    if (r->word <= integral) out = std::max(out, series(r->of, h, settings, Seen::samples).cwiseAbs().maxCoeff());
  return out;
}

std::optional<double> Response::share_of_sampling(const Histories& h, std::span<const double> settings) const {
  const auto any = [&](auto what) {
    return std::any_of(formula_.reductions.begin(), formula_.reductions.end(), [&](const auto& r) { return what(r->word); });
  };
  const auto sampled = [](std::size_t word) { return word != final && word != initial; };
  if (reads_frequency() || !any(sampled)) return {};
  if (h.times.size() < 3) {
    // Nothing lies between them that could be left out.
    double share = 0.0;
    for (const auto& r : formula_.reductions) {
      const VecX x = series(r->of, h, settings, Seen::samples);
      if (x.maxCoeff() > x.minCoeff()) share = std::max(share, (x.maxCoeff() - x.minCoeff()) / x.cwiseAbs().maxCoeff());
    }
    return share;
  }
  // A time is one of the samples: the next one is as far off as it may be. Trapezoids lose four times as much by twice the step, parabolas
  // eight times.
  const bool times = !any([](std::size_t word) { return word <= integral; });
  const double lost = times ? 1.0 : any([](std::size_t word) { return word == mean || word == rms || word == integral; }) ? 3.0 : 7.0;
  const double all = value(h, settings), between = value(h, settings, Seen::between), duration = h.times[h.times.size() - 1] - h.times[0];
  double off = std::abs(all - between);
  for (const Eigen::Index left_out : {1, 2}) {
    try {
      off = std::max(off, std::abs(between - value(every_second(h, left_out), settings, Seen::between)) / lost);
    } catch (const SimulationError&) {
      // A condition that only samples left out have seen.
      return 1.0;
    }
  }
  constexpr double rounding = 1e-12;
  if (off <= rounding * std::max(1.0, duration) * largest(h, settings)) return 0.0;
  return (1.0 - rounding) * off / (times ? duration : std::abs(all));
}

}  // namespace flexframe::sim
