#include "sim/sweep/sweep.h"

#include "sim/accuracy/accuracy.h"
#include "sim/base/cpu_clock.h"
#include "sim/base/error.h"
#include "sim/base/file_output.h"
#include "sim/base/words.h"
#include "sim/results/recorder.h"
#include "sim/results/sampling.h"
#include "sim/scene/fingerprint.h"
#include "sim/scene/parameters.h"
#include "sim/scene/scene_reader.h"
#include "sim/scene/toml_output.h"
#include "sim/start/make_system.h"
#include "sim/sweep/minimise.h"
#include "sim/sweep/shared_settings.h"
#include "sim/sweep/workers.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <regex>

namespace flexframe::sim {
namespace {

namespace fs = std::filesystem;

struct TooLong {};
std::string too_long_text(double longest) { return fmt::format("longer than {:g} CPU s", longest); }

// The question without the scene's place, which does not decide the rows.
TomlValue question_table(const SweepQuestion& q) {
  TomlValue out;
  toml_put(out, "set", toml_texts(q.design.settings));
  if (!q.design.sample.empty()) toml_put(out, "sample", toml_text(q.design.sample));
  if (!q.design.sensitivity.empty()) toml_put(out, "sensitivity", toml_text(q.design.sensitivity));
  // As a text: a TOML number of this kind has 53 bits only.
  toml_put(out, "seed", toml_text(fmt::format("{}", q.design.seed)));
  toml_put(out, "responses", toml_texts(q.responses));
  if (q.tolerance) toml_put(out, "tolerance", toml_number(*q.tolerance));
  if (q.accuracy) toml_put(out, "accuracy", toml_number(*q.accuracy));
  if (q.max_steps) toml_put(out, "max_steps", toml_number(*q.max_steps));
  if (!q.method.empty()) toml_put(out, "method", toml_text(q.method));
  toml_put(out, "error_estimate", toml_truth(q.estimate_error));
  toml_put(out, "effect_check", toml_truth(q.check_effects));
  toml_put(out, "strict", toml_truth(q.strict));
  if (q.longest > 0.0) toml_put(out, "longest", toml_number(q.longest));
  if (!q.goal.text.empty()) {
    toml_put(out, q.goal.maximise ? "maximise" : "minimise", toml_text(q.goal.text));
    toml_put(out, "limits", toml_texts(q.goal.limits));
    toml_put(out, "searches", toml_count(q.design.searches));
    toml_put(out, "runs", toml_count(q.design.runs));
    toml_put(out, "precision", toml_number(q.goal.precision));
  }
  return out;
}

SweepQuestion read_question(const fs::path& file, std::string& identity, std::string& program, int& shards) {
  const TomlValue document = read_toml(file);
  const TableReader root(document, file.string(), "");
  root.allow({"scene", "identity", "program", "shards", "question"});
  program = root.text("program");
  identity = root.text("identity");
  shards = static_cast<int>(root.number("shards", {.low = 1.0, .high = 1e6, .what = "a number from 1 to 1e6"}));
  SweepQuestion q;
  q.scene = root.text("scene");
  root.required("question");
  const TableReader t = *root.table("question");
  t.allow({"set", "sample", "sensitivity", "seed", "responses", "tolerance", "accuracy", "max_steps", "method", "error_estimate",
           "effect_check", "strict", "longest", "minimise", "maximise", "limits", "searches", "runs", "precision"});
  q.design.settings = t.texts("set");
  q.design.sample = t.text("sample", "");
  q.design.sensitivity = t.text("sensitivity", "");
  const std::string seed = t.text("seed");
  const auto [end, wrong] = std::from_chars(seed.data(), seed.data() + seed.size(), q.design.seed);
  if (wrong != std::errc() || end != seed.data() + seed.size()) t.fail("seed", "must be a whole number between quotes");
  q.responses = t.texts("responses");
  q.tolerance = t.optional_number("tolerance");
  q.accuracy = t.optional_number("accuracy");
  q.max_steps = t.optional_number("max_steps");
  q.method = t.text("method", "");
  q.estimate_error = t.boolean("error_estimate", true);
  q.check_effects = t.boolean("effect_check", true);
  q.strict = t.boolean("strict", false);
  q.longest = t.number("longest", 0.0, not_negative);
  q.goal.maximise = t.text("minimise", "").empty();
  q.goal.text = t.text(q.goal.maximise ? "maximise" : "minimise", "");
  if (q.goal.text.empty()) return q;
  q.goal.limits = t.texts("limits");
  q.goal.precision = t.number("precision", q.goal.precision, positive);
  q.design.searches = static_cast<int>(t.number("searches", {.low = 1.0, .high = 1e6, .what = "a number from 1 to 1e6"}));
  q.design.runs = static_cast<int>(t.number("runs", {.low = 1.0, .high = 1e6, .what = "a number from 1 to 1e6"}));
  return q;
}

Scene scene_at(const std::string& text, const fs::path& file, const std::vector<std::string>& settings) {
  return make_scene(parse_document(text, file, settings));
}

// Columns of the histories, of the first points that make a mechanism.
std::vector<std::string> columns_of(const Sweep& sweep) {
  constexpr long most_tried = 8;
  std::string first;
  for (long k = 0; k < std::min(sweep.design.size(), most_tried); ++k) {
    try {
      const bool searched = sweep.design.searches() > 0;
      const std::vector<std::string> settings =
          searched ? sweep.design.settings(sweep.design.place(sweep.design.start(0, static_cast<int>(k)))) : sweep.design.settings(k);
      const Scene scene = scene_at(sweep.scene_text, sweep.question.scene, settings);
      System system = make_system(scene);
      return CurrentOutputs(system).columns();
    } catch (const Error& problem) {
      if (first.empty()) first = problem.what();
    }
  }
  throw InputError(first);
}

SimulateOptions options_of(const SweepQuestion& q) {
  SimulateOptions options;
  options.tolerance = q.tolerance;
  options.accuracy = q.accuracy;
  options.max_steps = q.max_steps;
  if (!q.method.empty()) {
    const std::vector<std::string>& known = method_words();
    const auto found = std::find(known.begin(), known.end(), q.method);
    if (found == known.end())
      throw InputError(
          fmt::format("--method {} is unknown{} allowed: {}", quote(q.method), did_you_mean(q.method, known), list_words(known)));
    options.method = static_cast<Method>(found - known.begin());
  }
  options.estimate_error = q.estimate_error;
  options.check_effects = q.check_effects;
  return options;
}

// What the samples of the run are too few for.
void tell_of_samples(const Sweep& sweep, const std::string& text, SweepRow& row) {
  row.message += (row.message.empty() ? "" : "; ") + text;
  row.end = sweep.question.strict ? PointEnd::failed : PointEnd::warned;
  if (sweep.question.strict) std::fill(row.responses.begin(), row.responses.end(), std::nullopt);
}

void check_samples(const Sweep& sweep, const std::vector<std::size_t>& coarse, const Results* results, SweepRow& row) {
  const auto frequency = [](const Response& response) { return response.reads_frequency(); };
  if (results && std::any_of(sweep.responses.begin(), sweep.responses.end(), frequency))
    if (const auto fast = faster_than_samples(*results))
      tell_of_samples(sweep, fmt::format("{} {}: frequencies come out too low", fast->owner, fast_motion_text(*fast)), row);
  if (coarse.empty()) return;
  std::vector<std::string> names;
  names.reserve(coarse.size());
  for (const std::size_t k : coarse) names.push_back(sweep.responses[k].name());
  tell_of_samples(
      sweep,
      fmt::format("{} would change by more than {} with more samples: take a larger output_rate", list_words(names), unasked_accuracy),
      row);
}

// The numbers of a run. results: of the same run, null where no response reads a frequency.
void respond(const Sweep& sweep, const std::vector<Design::Value>& values, const Histories& histories, const Results* results,
             SweepRow& row) {
  std::vector<double> numbers;
  for (std::size_t k = 0; k < values.size(); ++k)
    if (sweep.design.axes()[k].chance || !sweep.design.axes()[k].numbers.empty()) numbers.push_back(values[k].number);
  // A setting may change the columns: an output's body, its quantity.
  if (histories.columns != sweep.columns) throw SimulationError("its outputs have other columns than those of the first point");
  std::vector<std::string> problems, slow;
  std::vector<std::size_t> coarse;
  for (std::size_t k = 0; k < sweep.responses.size(); ++k) {
    try {
      row.responses[k] = sweep.responses[k].value(histories, numbers);
      if (const auto share = sweep.responses[k].share_of_sampling(histories, numbers); share && *share > unasked_accuracy)
        coarse.push_back(k);
      if (std::string text = sweep.responses[k].too_few_periods(histories, numbers); !text.empty()) slow.push_back(std::move(text));
    } catch (const SimulationError& problem) {
      problems.push_back(problem.what());
    }
  }
  for (const std::string& text : slow) tell_of_samples(sweep, text, row);
  check_samples(sweep, coarse, results, row);
  if (problems.empty()) return;
  row.end = PointEnd::lacking;
  row.message += (row.message.empty() ? "" : "; ") + fmt::format("{}", fmt::join(problems, "; "));
}

// The response that an expression, or a name, stands for; it is added where there is none yet.
std::size_t response_for(Sweep& sweep, const std::string& text, const std::vector<std::string>& keys) {
  const auto known = std::find(sweep.names.begin(), sweep.names.end(), split_response(text).first);
  if (known != sweep.names.end()) return static_cast<std::size_t>(known - sweep.names.begin());
  sweep.responses.emplace_back(text, sweep.columns, keys);
  sweep.names.push_back(sweep.responses.back().name());
  return sweep.names.size() - 1;
}

SweepLimit read_limit(Sweep& sweep, const std::string& text, const std::vector<std::string>& keys) {
  const std::size_t at = std::min(text.find("<="), text.find(">="));
  const auto refuse = [&](const std::string& why) {
    throw InputError(fmt::format("--limit {}: {}; wanted: EXPRESSION <= NUMBER or EXPRESSION >= NUMBER", quote(text), why));
  };
  if (at == std::string::npos) refuse("has neither <= nor >=");
  SweepLimit out;
  out.text = text;
  out.at_most = text[at] == '<';
  try {
    out.bound = Parameters().number(split_response(text.substr(at + 2)).first, "*");
  } catch (const InputError&) {
    refuse(fmt::format("{} is no number", quote(text.substr(at + 2))));
  }
  out.response = response_for(sweep, text.substr(0, at), keys);
  return out;
}

void add_goal(Sweep& sweep, const std::vector<std::string>& keys) {
  if (minimiser_version().empty()) search_minimum({});
  const GoalWords& words = sweep.question.goal;
  SweepGoal goal;
  goal.response = response_for(sweep, words.text, keys);
  goal.maximise = words.maximise;
  for (const std::string& limit : words.limits) goal.limits.push_back(read_limit(sweep, limit, keys));
  sweep.goal = goal;
}

std::vector<std::string> numeric_keys(const Design& design) {
  std::vector<std::string> keys;
  for (const SweepAxis& axis : design.axes())
    if (axis.chance || !axis.numbers.empty()) keys.push_back(axis.key);
  return keys;
}

}  // namespace

Sweep make_sweep(const SweepQuestion& question, const fs::path& folder, const std::string& program) {
  Sweep sweep{folder, question, Design(question.design), {}, {}, program, {}, {}, {}, {}, {}, 1};
  sweep.question.scene = fs::absolute(question.scene).lexically_normal();
  options_of(question);
  if (question.responses.empty() && question.goal.text.empty())
    throw InputError("a sweep needs at least one --response, such as --response \"max(abs(slider.x))\"");
  sweep.scene_text = read_text_file(question.scene);
  // What is wrong with the scene is told with its name as it was given.
  make_scene(parse_document(sweep.scene_text, question.scene, sweep.design.fixed()));
  const SceneDocument document = parse_document(sweep.scene_text, sweep.question.scene, sweep.design.fixed());
  sweep.inputs = inputs_fingerprint(document);
  TomlValue root;
  toml_put(root, "question", question_table(question));
  const std::string by = question.goal.text.empty() ? "" : "\n" + minimiser_version();
  sweep.identity = sha256(fmt::format("{}\n{}\n{}{}", write_toml(root), sweep.inputs, program, by));
  sweep.columns = columns_of(sweep);
  const std::vector<std::string> keys = numeric_keys(sweep.design);
  for (const std::string& text : question.responses) {
    sweep.responses.emplace_back(text, sweep.columns, keys);
    const std::string& name = sweep.responses.back().name();
    if (std::find(sweep.names.begin(), sweep.names.end(), name) != sweep.names.end())
      throw InputError(fmt::format("--response {}: there are two of this name", quote(name)));
    sweep.names.push_back(name);
  }
  if (!question.goal.text.empty()) add_goal(sweep, keys);
  return sweep;
}

void write_question(const Sweep& sweep) {
  TomlValue root;
  toml_put(root, "scene", toml_text(sweep.question.scene.string()));
  toml_put(root, "identity", toml_text(sweep.identity));
  toml_put(root, "program", toml_text(sweep.program));
  toml_put(root, "shards", toml_count(sweep.shards));
  toml_put(root, "question", question_table(sweep.question));
  write_whole_file(sweep.folder / "sweep.toml",
                   "# A sweep of flexframe: what was asked. Written by the program; rows/ holds what is done.\n" + write_toml(root));
}

Sweep read_sweep(const fs::path& folder, const std::string& program) {
  const fs::path file = folder / "sweep.toml";
  std::error_code error;
  if (!fs::exists(file, error)) throw InputError(fmt::format("{}: no sweep was begun here: the folder has no sweep.toml", folder.string()));
  std::string identity, begun_with;
  int shards = 1;
  const SweepQuestion question = read_question(file, identity, begun_with, shards);
  Sweep sweep = make_sweep(question, folder, program.empty() ? begun_with : program);
  sweep.shards = shards;
  if (sweep.identity != identity)
    throw InputError(
        fmt::format("{}: the scene {}, a file that it names, or the program is not the one that the sweep was begun with; begin "
                    "it anew",
                    folder.string(), sweep.question.scene.string()));
  return sweep;
}

Scene sweep_scene(const Sweep& sweep, const std::vector<Design::Value>& values) {
  return scene_at(sweep.scene_text, sweep.question.scene, sweep.design.settings(values));
}

SimulateOptions sweep_options(const Sweep& sweep) { return options_of(sweep.question); }

SweepRow run_point(const Sweep& sweep, long point, const std::function<void()>& stop, const SharedSettings* shared) {
  return run_values(sweep, point, sweep.design.point(point), stop, shared);
}

SweepRow run_values(const Sweep& sweep, long point, const std::vector<Design::Value>& values, const std::function<void()>& stop,
                    const SharedSettings* shared) {
  const SweepQuestion& q = sweep.question;
  const double start = cpu_seconds();
  SweepRow row;
  row.point = point;
  row.responses.resize(sweep.responses.size());
  try {
    const Scene scene = sweep_scene(sweep, values);
    SimulateOptions options = options_of(q);
    options.progress = [&](double) {
      if (stop) stop();
      if (q.longest > 0.0 && cpu_seconds() - start > q.longest) throw TooLong{};
    };
    const auto tell = [&](const std::vector<std::string>& warnings, double error, const std::string& column) {
      row.error = error;
      row.column = column;
      row.message = fmt::format("{}", fmt::join(warnings, "; "));
      if (!warnings.empty()) row.end = q.strict ? PointEnd::failed : PointEnd::warned;
    };
    if (const auto run = shared ? run_with_shared(sweep, *shared, scene, point, options) : std::nullopt) {
      tell(run->warnings, run->error, run->column);
      if (row.end != PointEnd::failed) respond(sweep, values, run->histories, nullptr, row);
    } else {
      const Results results = simulate_as_asked(scene, options);
      tell(results.statistics.notes.texts(Severity::warning), results.statistics.error_estimate, results.statistics.error_column);
      if (row.end != PointEnd::failed) respond(sweep, values, to_histories(results), &results, row);
    }
  } catch (const InputError& problem) {
    row.end = PointEnd::refused;
    row.message = problem.what();
  } catch (const SimulationError& problem) {
    row.end = PointEnd::failed;
    row.message = problem.what();
  } catch (const TooLong&) {
    row.end = PointEnd::too_long;
    row.message = too_long_text(q.longest);
  } catch (const std::bad_alloc&) {
    row.end = PointEnd::failed;
    row.message = "out of memory";
  }
  row.cpu = cpu_seconds() - start;
  return row;
}

fs::path rows_file(const fs::path& folder, int shard, int shards) {
  return folder / "rows" / fmt::format("shard_{}_of_{}.rows", shard, shards);
}

std::vector<std::pair<int, int>> shards_in(const fs::path& folder) {
  std::vector<std::pair<int, int>> out;
  std::error_code error;
  const std::regex name("shard_([0-9]{1,6})_of_([0-9]{1,6})\\.rows");
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / "rows", error)) {
    std::smatch match;
    const std::string file = entry.path().filename().string();
    if (!std::regex_match(file, match, name)) continue;
    const int shard = std::stoi(match[1]), shards = std::stoi(match[2]);
    if (shard >= 1 && shard <= shards) out.emplace_back(shards, shard);
  }
  std::sort(out.begin(), out.end());
  return out;
}

ShardReport run_shard(const Sweep& sweep, const SweepShard& options) {
  const auto start = std::chrono::steady_clock::now();
  if (options.shards < 1 || options.shard < 1 || options.shard > options.shards)
    throw InputError(fmt::format("--shard {}/{} must be I/N with whole numbers, 1 <= I <= N", options.shard, options.shards));
  if (sweep.goal) return run_searches(sweep, options);
  std::error_code error;
  fs::create_directories(sweep.folder / "rows", error);
  if (error) throw FileError(fmt::format("{}: cannot create the folder: {}", (sweep.folder / "rows").string(), error.message()));
  const fs::path path = rows_file(sweep.folder, options.shard, options.shards);
  // Point k of the shard is first + k * shards.
  const long step = options.shards, first = options.shard % step;
  const long count = first < sweep.design.size() ? (sweep.design.size() - first + step - 1) / step : 0;
  std::vector<bool> there(count, false);
  ShardReport report;
  report.points = count;
  const auto note = [&](SweepRow&& row) {
    if (row.point >= first && row.point < sweep.design.size() && (row.point - first) % step == 0) there[(row.point - first) / step] = true;
  };
  RowsFile old;
  bool keep = false;
  if (options.resume) {
    std::vector<std::pair<int, int>> files{{options.shards, options.shard}};
    if (options.shards == 1) files = shards_in(sweep.folder);
    for (const auto& [shards, shard] : files) {
      const fs::path file = rows_file(sweep.folder, shard, shards);
      if (identity_of_rows(file) != sweep.identity) continue;
      const RowsFile rows = read_rows(file, sweep.responses.size(), note);
      if (file == path) old = rows, keep = true;
    }
  } else if (options.shards == 1) {
    for (const auto& [shards, shard] : shards_in(sweep.folder)) fs::remove(rows_file(sweep.folder, shard, shards));
  }
  report.kept = std::count(there.begin(), there.end(), true);
  RowsWriter writer(path, sweep.identity, keep, old.bytes);

  std::shared_ptr<const SharedSettings> shared;
  if (report.kept < report.points) {
    const double began = cpu_seconds();
    shared = find_shared_settings(sweep, [&] {
      if (options.progress) options.progress(report.kept, count);
    });
    report.settings_cpu = cpu_seconds() - began;
    if (shared) report.settings = shared_settings_text(*shared);
  }

  long at = 0;
  WorkersPlan plan;
  plan.workers =
      static_cast<int>(std::min<long>(options.workers > 0 ? options.workers : usable_cores(), std::max(1L, report.points - report.kept)));
  plan.next = [&]() -> std::optional<long> {
    while (at < count && there[at]) ++at;
    return at < count ? std::optional<long>(first + step * at++) : std::nullopt;
  };
  plan.work = [&](long point) { return row_line(run_point(sweep, point, {}, shared.get())); };
  plan.done = [&](long, std::string&& line) {
    writer.append(line);
    const std::optional<SweepRow> row = read_row_line(line, sweep.responses.size());
    ++report.made;
    if (!row) return;
    report.cpu += row->cpu;
    report.without += row->end != PointEnd::done && row->end != PointEnd::warned;
  };
  plan.lost = [&](long point, const std::string& why) {
    SweepRow row;
    row.point = point;
    row.end = why.empty() ? PointEnd::too_long : PointEnd::crashed;
    row.responses.resize(sweep.responses.size());
    row.message = why.empty() ? too_long_text(sweep.question.longest) : fmt::format("its process was ended twice: {}", why);
    writer.append(row_line(row));
    ++report.made;
    ++report.without;
  };
  if (sweep.question.longest > 0.0) plan.longest = 2.0 * sweep.question.longest + 10.0;
  plan.tick = [&] {
    if (options.progress) options.progress(report.kept + report.made, count);
  };
  work_at_points(plan);
  if (options.progress) options.progress(count, count);
  report.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

double pilot_cpu(const Sweep& sweep, int most, double seconds) {
  std::vector<double> cpu;
  double spent = 0.0;
  const std::shared_ptr<const SharedSettings> shared = find_shared_settings(sweep, {});
  const long n = std::min<long>(most, sweep.design.size());
  for (long k = 0; k < n && spent < seconds; ++k) {
    const long point = n > 1 ? k * (sweep.design.size() - 1) / (n - 1) : 0;
    cpu.push_back(sweep.goal ? run_values(sweep, point, sweep.design.place(sweep.design.start(static_cast<int>(k)))).cpu
                             : run_point(sweep, point, {}, shared.get()).cpu);
    spent += cpu.back();
  }
  std::sort(cpu.begin(), cpu.end());
  return cpu[cpu.size() / 2];
}

}  // namespace flexframe::sim
