#include "sim/sweep/minimise.h"

#include "sim/base/error.h"
#include "sim/sweep/workers.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>

namespace flexframe::sim {
namespace {

namespace fs = std::filesystem;

// A row of a search has the place behind its responses.
std::size_t numbers_in_row(const Sweep& sweep) { return sweep.responses.size() + sweep.design.axes().size(); }

// None where the run lacks a number that is asked for.
std::optional<Judged> judge_row(const Sweep& sweep, const SweepRow& row) {
  if (row.end != PointEnd::done && row.end != PointEnd::warned) return std::nullopt;
  const SweepGoal& goal = *sweep.goal;
  Judged out;
  out.goal = (goal.maximise ? -1.0 : 1.0) * *row.responses[goal.response];
  for (const SweepLimit& limit : goal.limits)
    out.excess.push_back((limit.at_most ? 1.0 : -1.0) * (*row.responses[limit.response] - limit.bound));
  return out;
}

// The place of a row; empty for one whose process was ended before it could say.
std::vector<double> place_of(const Sweep& sweep, const SweepRow& row) {
  std::vector<double> out;
  for (std::size_t k = sweep.responses.size(); k < row.responses.size(); ++k)
    if (row.responses[k]) out.push_back(*row.responses[k]);
  return out;
}

struct Unfinished {};

// Search s (from 0), through the rows that it has; make: the next row, or throws Unfinished.
SearchEnd follow(const Sweep& sweep, int s, const std::vector<SweepRow>& rows,
                 const std::function<SweepRow(long point, const std::vector<double>& place)>& make) {
  std::size_t at = 0;
  SearchPlan plan;
  plan.keys = sweep.design.axes().size();
  plan.limits = sweep.goal->limits.size();
  plan.precision = sweep.question.goal.precision;
  plan.runs = sweep.design.runs();
  plan.start = [&](int attempt) { return sweep.design.start(s, attempt); };
  plan.judge = [&](const std::vector<double>& place) {
    const std::size_t k = at++;
    if (k >= rows.size()) return judge_row(sweep, make(static_cast<long>(s) * sweep.design.runs() + static_cast<long>(k), place));
    const std::vector<double> kept = place_of(sweep, rows[k]);
    if (!kept.empty() && kept != place)
      throw SimulationError(fmt::format("search {}: its kept rows are not those of this search; begin it anew, without --resume", s + 1));
    return judge_row(sweep, rows[k]);
  };
  return search_minimum(plan);
}

struct SearchRows {
  std::vector<SweepRow> rows;  // in the order in which they were made, without a gap
  RowsFile file;
};
SearchRows read_search(const Sweep& sweep, int s) {
  SearchRows out;
  const fs::path path = search_file(sweep.folder, s + 1, sweep.design.searches());
  if (identity_of_rows(path) != sweep.identity) return out;
  const long first = static_cast<long>(s) * sweep.design.runs();
  bool whole = true;
  out.file = read_rows(path, numbers_in_row(sweep), [&](SweepRow&& row) {
    whole = whole && row.point == first + static_cast<long>(out.rows.size());
    if (whole) out.rows.push_back(std::move(row));
  });
  return out;
}

// The work of one process: search s to its end. What it returns says how many runs it made and how many CPU s they took.
std::string work_at_search(const Sweep& sweep, int s, bool resume) {
  SearchRows kept;
  if (resume) kept = read_search(sweep, s);
  // Rows behind a damaged one do not follow from what is there.
  const bool whole = kept.file.damaged == 0 && kept.rows.size() == static_cast<std::size_t>(kept.file.rows);
  RowsWriter writer(search_file(sweep.folder, s + 1, sweep.design.searches()), sweep.identity, resume && whole && kept.file.there,
                    kept.file.bytes);
  if (!whole)
    for (const SweepRow& row : kept.rows) writer.append(row_line(row));
  long made = 0, without = 0;
  double cpu = 0.0;
  follow(sweep, s, kept.rows, [&](long point, const std::vector<double>& place) {
    SweepRow row = run_values(sweep, point, sweep.design.place(place));
    const bool good = row.end == PointEnd::done || row.end == PointEnd::warned;
    ++made;
    without += !good;
    cpu += row.cpu;
    row.responses.insert(row.responses.end(), place.begin(), place.end());
    writer.append(row_line(row));
    return row;
  });
  return fmt::format("{} {} {}", made, without, cpu);
}

// Rows that a file has, by its lines.
long lines_in(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return std::max<long>(0, std::count(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>(), '\n') - 1);
}

void judge_searches(const Sweep& sweep, const SweepTable& table, FoundMinimum& found) {
  const auto goal = static_cast<Eigen::Index>(sweep.goal->response);
  const double sign = sweep.goal->maximise ? -1.0 : 1.0;
  const auto value = [&](long point) { return sign * table.responses(point, goal); };
  for (const FoundMinimum::Search& s : found.searches)
    if (s.best >= 0 && (found.best < 0 || value(s.best) < value(found.best))) found.best = s.best;
  if (found.best < 0) return;
  // A search found the same if it came as low but for a thousandth of what it gained or the estimated error of the best run, or to the same
  // place within a hundredth.
  const double unsure = std::max(0.0, table.error[found.best]) * std::abs(value(found.best));
  const std::vector<double>& there = sweep.design.noted(found.best);
  for (std::size_t s = 0; s < found.searches.size(); ++s) {
    FoundMinimum::Search& search = found.searches[s];
    if (search.best < 0) continue;
    double worst = value(search.best);
    const long first = static_cast<long>(s) * sweep.design.runs();
    for (long i = first; i < first + search.runs; ++i)
      if (std::isfinite(value(i))) worst = std::max(worst, value(i));
    double apart = 0.0;
    const std::vector<double>& here = sweep.design.noted(search.best);
    for (std::size_t k = 0; k < here.size(); ++k) apart = std::max(apart, std::abs(here[k] - there[k]));
    search.same = value(search.best) - value(found.best) <= std::max(1e-3 * (worst - value(search.best)), unsure) || apart <= 0.01;
  }
}

void describe(const Sweep& sweep, const SweepTable& table, FoundMinimum& found) {
  const std::vector<double>& place = sweep.design.noted(found.best);
  const double near_end = 10.0 * sweep.question.goal.precision;
  for (std::size_t k = 0; k < place.size(); ++k) {
    if (place[k] <= near_end) found.at_ends.push_back(sweep.design.axes()[k].key + " (lower end)");
    if (1.0 - place[k] <= near_end) found.at_ends.push_back(sweep.design.axes()[k].key + " (upper end)");
  }
  for (const SweepLimit& limit : sweep.goal->limits) {
    const auto y = table.responses.col(static_cast<Eigen::Index>(limit.response));
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const double x : y)
      if (std::isfinite(x)) low = std::min(low, x), high = std::max(high, x);
    // On the limit, against how far the response went over all runs.
    if (std::abs(y[found.best] - limit.bound) <= 0.01 * (high - low)) found.active.push_back(limit.text);
  }
}

void warn(const Sweep& sweep, const SweepTable& table, FoundMinimum& found) {
  const char* word = sweep.goal->maximise ? "larger" : "smaller";
  const auto ended = std::count_if(found.searches.begin(), found.searches.end(), [](const auto& s) { return s.ended; });
  if (found.best < 0) {
    if (ended > 0)
      found.warnings.push_back(sweep.goal->limits.empty()
                                   ? "no run gave the response"
                                   : "no run keeps all limits: widen the ranges or the limits, or allow more runs (--runs)");
    return;
  }
  // Below what the usual tolerance leaves open.
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double y : table.responses.col(static_cast<Eigen::Index>(sweep.goal->response)))
    if (std::isfinite(y)) low = std::min(low, y), high = std::max(high, y);
  if (high - low <= 1e-6 * std::max(std::abs(low), std::abs(high)))
    found.warnings.push_back("the response changes by less than a millionth of its size over all runs: these keys do not decide it");
  const long same = std::count_if(found.searches.begin(), found.searches.end(), [](const auto& s) { return s.same; });
  const auto& winner = found.searches[found.best / sweep.design.runs()];
  if (winner.ended && winner.end == SearchEnd::out_of_runs)
    found.warnings.push_back(
        fmt::format("the search that found it had not settled after {} runs: more of them (--runs) find a {} value", winner.runs, word));
  if (found.searches.size() == 1)
    found.warnings.push_back(
        fmt::format("one search finds one {}: another place may be {} (--searches)", sweep.goal->maximise ? "maximum" : "minimum", word));
  else if (same == 1)
    found.warnings.push_back(
        fmt::format("one search of {} found it, the others ended elsewhere: a {} value may be missed (--searches)", ended, word));
  if (table.ends[found.best] == static_cast<std::uint8_t>(PointEnd::warned)) {
    const auto message = table.messages.find(found.best);
    found.warnings.push_back(fmt::format("its run warned: {}", message == table.messages.end() ? "" : message->second));
  }
}

}  // namespace

fs::path search_file(const fs::path& folder, int search, int searches) {
  return folder / "rows" / fmt::format("search_{}_of_{}.rows", search, searches);
}

bool keeps_limits(const Sweep& sweep, const SweepTable& table, long point) {
  for (const SweepLimit& limit : sweep.goal->limits) {
    const double x = table.responses(point, static_cast<Eigen::Index>(limit.response));
    if (!(limit.at_most ? x <= limit.bound : x >= limit.bound)) return false;
  }
  return true;
}

ShardReport run_searches(const Sweep& sweep, const SweepShard& options) {
  const auto start = std::chrono::steady_clock::now();
  std::error_code error;
  fs::create_directories(sweep.folder / "rows", error);
  if (error) throw FileError(fmt::format("{}: cannot create the folder: {}", (sweep.folder / "rows").string(), error.message()));
  const int searches = sweep.design.searches();
  std::vector<int> mine;
  for (int s = 0; s < searches; ++s)
    if (s % options.shards == options.shard % options.shards) mine.push_back(s);
  ShardReport report;
  for (const int s : mine) {
    if (options.resume) report.kept += static_cast<long>(read_search(sweep, s).rows.size());
    else fs::remove(search_file(sweep.folder, s + 1, searches), error);
  }
  const long most = static_cast<long>(mine.size()) * sweep.design.runs();
  std::size_t next = 0;
  WorkersPlan plan;
  plan.workers = std::max(1, std::min(options.workers > 0 ? options.workers : usable_cores(), static_cast<int>(mine.size())));
  plan.next = [&]() -> std::optional<long> { return next < mine.size() ? std::optional<long>(mine[next++]) : std::nullopt; };
  // One whose process was ended goes on with its rows.
  plan.work = [&](long s) { return work_at_search(sweep, static_cast<int>(s), true); };
  plan.done = [&](long, std::string&& text) {
    long made = 0, without = 0;
    double cpu = 0.0;
    if (std::sscanf(text.c_str(), "%ld %ld %lf", &made, &without, &cpu) != 3) return;
    report.made += made;
    report.without += without;
    report.cpu += cpu;
  };
  // The run at which it was ended counts as failed when the search goes on.
  plan.lost = [&](long s, const std::string& why) {
    const SearchRows kept = read_search(sweep, static_cast<int>(s));
    SweepRow row;
    row.point = s * sweep.design.runs() + static_cast<long>(kept.rows.size());
    row.end = PointEnd::crashed;
    row.responses.resize(numbers_in_row(sweep));
    row.message = fmt::format("its process was ended twice: {}", why);
    RowsWriter(search_file(sweep.folder, static_cast<int>(s) + 1, searches), sweep.identity, kept.file.there, kept.file.bytes)
        .append(row_line(row));
    ++report.made;
    ++report.without;
  };
  plan.tick = [&] {
    if (!options.progress) return;
    long done = 0;
    for (const int s : mine) done += lines_in(search_file(sweep.folder, s + 1, searches));
    options.progress(done, most);
  };
  work_at_points(plan);
  if (options.progress) options.progress(most, most);
  report.points = report.kept + report.made;
  report.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

Collected collect_searches(Sweep& sweep, FoundMinimum& found) {
  Collected out;
  SweepTable& table = out.table;
  table.reset(sweep.design.size(), static_cast<Eigen::Index>(sweep.responses.size()));
  const int searches = sweep.design.searches();
  found = {};
  for (int s = 0; s < searches; ++s) {
    Collected::Shard shard;
    shard.shard = s + 1;
    shard.shards = searches;
    const fs::path path = search_file(sweep.folder, s + 1, searches);
    std::error_code error;
    SearchRows kept;
    if (fs::exists(path, error) && identity_of_rows(path) != sweep.identity)
      shard.problem = "belongs to another sweep: its scene, options or program are not the same";
    else kept = read_search(sweep, s);
    FoundMinimum::Search search;
    search.runs = static_cast<long>(kept.rows.size());
    try {
      search.end = follow(sweep, s, kept.rows, [](long, const std::vector<double>&) -> SweepRow { throw Unfinished{}; });
      search.ended = true;
    } catch (const Unfinished&) {
      ++out.missing;
    }
    for (SweepRow& row : kept.rows) {
      std::vector<double> place = place_of(sweep, row);
      if (place.empty()) continue;
      const long point = row.point;
      row.responses.resize(sweep.responses.size());
      const std::optional<Judged> judged = judge_row(sweep, row);
      search.without += !judged;
      sweep.design.note(point, std::move(place));
      table.put(std::move(row));
      if (!judged || !keeps_limits(sweep, table, point)) continue;
      const auto goal = static_cast<Eigen::Index>(sweep.goal->response);
      const double sign = sweep.goal->maximise ? -1.0 : 1.0;
      if (search.best < 0 || sign * table.responses(point, goal) < sign * table.responses(search.best, goal)) search.best = point;
    }
    shard.points = shard.rows = search.runs;
    shard.damaged = kept.file.damaged;
    found.searches.push_back(search);
    out.shards.push_back(shard);
  }
  judge_searches(sweep, table, found);
  if (found.best >= 0) describe(sweep, table, found);
  warn(sweep, table, found);
  return out;
}

}  // namespace flexframe::sim
