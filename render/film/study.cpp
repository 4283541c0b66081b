#include "render/film/study.h"

#include "render/film/study_pictures.h"
#include "render/film/study_plan.h"
#include "sim/base/cpu_clock.h"
#include "sim/base/error.h"
#include "sim/base/file_output.h"
#include "sim/base/files_read.h"
#include "sim/base/words.h"
#include "sim/results/csv.h"
#include "sim/simulate.h"
#include "sim/start/make_system.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

namespace flexframe::film {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct TooLong : std::runtime_error {
  using std::runtime_error::runtime_error;
};

double median(std::vector<double> v) {
  if (v.empty()) return 0.0;
  std::sort(v.begin(), v.end());
  const size_t n = v.size();
  return n % 2 == 1 ? v[n / 2] : 0.5 * (v[n / 2 - 1] + v[n / 2]);
}

// Histories as CSV, every digit; the columns' units stand in the run's record.
std::string to_csv(const sim::Histories& h) {
  std::string out = "t";
  for (const std::string& c : h.columns) out += "," + c;
  out += '\n';
  for (Eigen::Index i = 0; i < h.times.size(); ++i) {
    out += fmt::format("{}", h.times[i]);
    for (Eigen::Index k = 0; k < h.values.rows(); ++k) out += fmt::format(",{}", h.values(k, i));
    out += '\n';
  }
  return out;
}

// A table of numbers with a header; `where` in messages. Throws sim::InputError.
sim::Histories from_csv(const fs::path& path) {
  std::ifstream file(path);
  if (!file) throw sim::InputError(fmt::format("{}: cannot be read", path.string()));
  std::string line;
  const auto split = [](const std::string& text) {
    std::vector<std::string> out(1);
    bool quoted = false;
    for (char c : text) {
      if (c == '"') quoted = !quoted;
      else if (c == ',' && !quoted) out.emplace_back();
      else if (c != '\r') out.back() += c;
    }
    return out;
  };
  std::getline(file, line);
  sim::require_whole(file, path);
  if (!file) throw sim::InputError(fmt::format("{}: is empty; a header line 't,...' is expected", path.string()));
  const std::vector<std::string> names = split(line);
  if (names.size() < 2 || names[0] != "t")
    throw sim::InputError(fmt::format("{}:1: the header must begin with 't' and name at least one output", path.string()));
  std::vector<std::vector<double>> rows;
  for (int number = 2; std::getline(file, line); ++number) {
    if (line.empty()) continue;
    const std::vector<std::string> cells = split(line);
    if (cells.size() != names.size())
      throw sim::InputError(fmt::format("{}:{}: {} numbers, the header has {} names", path.string(), number, cells.size(), names.size()));
    std::vector<double> row;
    for (const std::string& cell : cells) {
      double value = 0.0;
      const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
      if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value))
        throw sim::InputError(fmt::format("{}:{}: '{}' is no number", path.string(), number, cell));
      row.push_back(value);
    }
    if (!rows.empty() && row[0] <= rows.back()[0]) throw sim::InputError(fmt::format("{}:{}: times must rise", path.string(), number));
    rows.push_back(row);
  }
  sim::require_whole(file, path);
  if (rows.size() < 2) throw sim::InputError(fmt::format("{}: needs at least two samples", path.string()));
  sim::Histories h;
  h.columns.assign(names.begin() + 1, names.end());
  h.times.resize(static_cast<Eigen::Index>(rows.size()));
  h.values.resize(static_cast<Eigen::Index>(h.columns.size()), static_cast<Eigen::Index>(rows.size()));
  for (size_t i = 0; i < rows.size(); ++i) {
    h.times[static_cast<Eigen::Index>(i)] = rows[i][0];
    for (size_t k = 0; k < h.columns.size(); ++k) h.values(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(i)) = rows[i][k + 1];
  }
  return h;
}

// Elastic coordinates, joints between lumps among them.
int elastic_coordinates_of(const sim::Scene& scene) {
  const sim::System system = sim::make_system(scene);
  int n = 0;
  for (const sim::Part& p : system.model.parts) n += p.body.n;
  for (const sim::Flexure& f : system.model.flexures)
    for (int i : f.parts) n += system.model.parts[i].joint.nv;
  return n;
}

// One run: its histories and what it cost, kept in two files.
struct StudyRun {
  std::string key;
  sim::Histories histories;
  std::vector<double> cpu;
  int coordinates = 0;
  std::string method, failure;
};

class Runs {
 public:
  Runs(const StudyOptions& options, const std::string& text) : options_(options), folder_(options.folder / "runs"), text_(text) {
    std::error_code error;
    if (!options.resume) fs::remove_all(folder_, error);
    fs::create_directories(folder_, error);
    if (error) throw FileError(fmt::format("{}: cannot create the folder: {}", folder_.string(), error.message()));
  }

  void set_longest(double seconds) { longest_ = seconds; }

  // The first run, or what an interrupted study has of it.
  StudyRun first(const std::string& setting, const sim::Scene& scene) {
    StudyRun run;
    run.key = sim::sha256(fmt::format("{}\n{}\n{}\n{}", options_.version, text_, setting, longest_)).substr(0, 16);
    if (load(run)) return run;
    try {
      run.coordinates = elastic_coordinates_of(scene);
      run.histories = simulate(scene);
      run.cpu.push_back(run.histories.statistics.cpu_seconds);
      run.method = run.histories.statistics.method;
    } catch (const TooLong& e) {
      run.failure = e.what();
    } catch (const sim::SimulationError& e) {
      run.failure = e.what();
    } catch (const sim::InputError& e) {
      run.failure = e.what();
    }
    save(run, true);
    return run;
  }

  void again(StudyRun& run, const sim::Scene& scene) {
    run.cpu.push_back(simulate(scene).statistics.cpu_seconds);
    save(run, false);
  }

 private:
  sim::Histories simulate(const sim::Scene& scene) const {
    sim::SimulateOptions o;
    o.samples = 1000;
    const double start = sim::cpu_seconds();
    o.progress = [&](double) {
      if (options_.progress) options_.progress(-1.0, "");
      if (longest_ > 0.0 && sim::cpu_seconds() - start > longest_) throw TooLong(fmt::format("longer than {:.3g} CPU s", longest_));
    };
    return sim::simulate_histories(scene, o);
  }

  void save(const StudyRun& run, bool histories) const {
    if (histories && run.failure.empty()) sim::write_whole_file(folder_ / (run.key + ".csv"), to_csv(run.histories));
    const sim::VecX& sizes = run.histories.sizes;
    const json record = {{"cpu", run.cpu},
                         {"coordinates", run.coordinates},
                         {"method", run.method},
                         {"failure", run.failure},
                         {"units", run.histories.units},
                         {"energy_scale", run.histories.energy_scale},
                         {"sizes", std::vector<double>(sizes.begin(), sizes.end())}};
    sim::write_whole_file(folder_ / (run.key + ".json"), record.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  }

  bool load(StudyRun& run) const {
    std::ifstream file(folder_ / (run.key + ".json"));
    if (!file) return false;
    const json record = json::parse(file, nullptr, false);
    try {
      run.cpu = record.at("cpu").get<std::vector<double>>();
      run.coordinates = record.at("coordinates").get<int>();
      run.method = record.at("method").get<std::string>();
      run.failure = record.at("failure").get<std::string>();
      if (!run.failure.empty()) return true;
      run.histories = from_csv(folder_ / (run.key + ".csv"));
      run.histories.units = record.at("units").get<std::vector<std::string>>();
      run.histories.energy_scale = record.at("energy_scale").get<double>();
      const auto sizes = record.at("sizes").get<std::vector<double>>();
      if (!sizes.empty() && sizes.size() != run.histories.columns.size()) return false;
      run.histories.sizes = Eigen::Map<const sim::VecX>(sizes.data(), static_cast<Eigen::Index>(sizes.size()));
      return run.histories.units.size() == run.histories.columns.size();
    } catch (const std::exception&) {
      // A record that is damaged or of another make is run anew.
      const std::string key = run.key;
      run = StudyRun{};
      run.key = key;
      return false;
    }
  }

  const StudyOptions& options_;
  fs::path folder_;
  std::string text_;
  double longest_ = 0.0;
};

struct Reference {
  sim::Histories histories;
  sim::VecX ranges;
  double error = 0.0, cpu = 0.0;
  bool judged = false;
  std::string what;
};

// Refines until two agree to a thousandth of a per cent, or the time is spent.
Reference make_reference(const sim::Scene& scene, const StudyOptions& options, Runs& runs, double scene_cpu) {
  Reference out;
  const double start_tolerance = 0.1 * scene.simulation.tolerance.value_or(sim::default_tolerance);
  double tolerance = std::max(start_tolerance, 1e-10), factor = 1.0, cost = scene_cpu;
  std::optional<sim::Histories> last;
  const bool undamped = std::none_of(scene.bodies.begin(), scene.bodies.end(), [](const sim::BodyDef& b) {
    const auto* beam = std::get_if<sim::BeamDef>(&b.kind);
    return beam && (!beam->damping.ratio.empty() || beam->damping.mass != 0.0 || beam->damping.stiffness != 0.0);
  });
  double before = 0.0;  // the difference of the two levels before the last two
  // Explicit steps are by far the more accurate at a tolerance; they are left where the scene's vibrations are too fast for them.
  bool explicit_steps = scene.simulation.method == sim::Method::automatic;
  if (explicit_steps) {
    sim::Scene trial = refined(scene, factor, tolerance, undamped);
    trial.simulation.method = sim::Method::erk;
    runs.set_longest(std::max(1.0, 10.0 * scene_cpu));
    explicit_steps = runs.first("reference: trial of erk", trial).failure.empty();
    runs.set_longest(0.0);
  }
  for (int level = 0; level < 6; ++level) {
    // Space and time are refined together, so that the last difference bounds both errors.
    sim::Scene fine = refined(scene, factor, tolerance, explicit_steps && undamped);
    if (explicit_steps) fine.simulation.method = sim::Method::erk;
    const std::string setting = fmt::format("reference: {:g} times the elements, tolerance {:g}{}", factor, tolerance,
                                            explicit_steps ? undamped ? ", erk, few modes" : ", erk" : "");
    // A finer one may take longer than it looked.
    if (last) runs.set_longest(options.reference_seconds);
    const StudyRun run = runs.first(setting, fine);
    runs.set_longest(0.0);
    if (!run.failure.empty()) {
      if (!last) throw sim::SimulationError(fmt::format("the reference cannot be computed: {}", run.failure));
      break;
    }
    out.cpu += run.cpu.front();
    const double growth = last ? run.cpu.front() / std::max(cost, 1e-6) : 4.0;
    cost = run.cpu.front();
    if (last) {
      out.ranges = sim::output_ranges(run.histories);
      const sim::Difference d = sim::compare_histories(*last, run.histories, out.ranges);
      // A geometric series by its last two differences; a third of the difference at least.
      const double ratio = before > 0.0 ? d.largest / before : 0.0;
      out.error = d.largest * (ratio < 0.5 ? std::max(sim::error_of_difference, ratio / (1.0 - ratio)) : 1.0);
      before = d.largest;
      out.judged = true;
    }
    out.histories = run.histories;
    const std::string space = has_axis(scene, "kept")    ? fmt::format("{:g} times the elements of the scene, half {} modes, ", factor,
                                                                    explicit_steps && undamped ? "as many" : "of their")
                              : has_axis(scene, "modes") ? fmt::format("{:g} times the modes, elements or volumes of the scene, ", factor)
                                                         : "";
    out.what = fmt::format("{}{}, tolerance {:g}", space, run.method, tolerance);
    if (last && (out.error < 1e-6 || out.cpu + cost * std::clamp(growth, 2.0, 20.0) > options.reference_seconds)) break;
    last = run.histories;
    factor *= 2.0;
    tolerance = std::max(0.1 * tolerance, 1e-11);
  }
  out.ranges = sim::output_ranges(out.histories);
  return out;
}

Reference read_reference(const fs::path& path, const sim::Histories& base) {
  Reference out;
  const sim::Histories given = from_csv(path);
  out.histories = base;
  out.histories.times = given.times;
  out.histories.values.resize(base.values.rows(), given.times.size());
  for (size_t k = 0; k < base.columns.size(); ++k) {
    const auto at = std::find(given.columns.begin(), given.columns.end(), base.columns[k]);
    if (at == given.columns.end())
      throw sim::InputError(fmt::format("{}: has no column '{}'{}; it has {}", path.string(), base.columns[k],
                                        sim::did_you_mean(base.columns[k], given.columns), sim::list_words(given.columns)));
    out.histories.values.row(static_cast<Eigen::Index>(k)) = given.values.row(at - given.columns.begin());
  }
  out.ranges = sim::output_ranges(out.histories);
  try {
    sim::compare_histories(base, out.histories, out.ranges);
  } catch (const ArgumentError&) {
    throw sim::InputError(fmt::format("{}: has no sample at the scene's output times", path.string()));
  }
  out.what = path.filename().string();
  return out;
}

void tell_reference(const Reference& reference, bool given, Study& study) {
  study.reference = reference.what;
  study.reference_error = reference.error;
  study.reference_judged = reference.judged;
  study.reference_cpu = reference.cpu;
  if (reference.error > 1e-4)
    study.notes.push_back(fmt::format("the error of the reference is {:.1g}; give it more time with --reference-seconds", reference.error));
  if (!reference.judged && !given)
    study.notes.push_back(
        "the error of the reference is not known, since no finer one ends in its time: errors may be wrong by as much; give it more with "
        "--reference-seconds");
}

// Slope of log error over log knob by least squares, of the points above the floor.
void find_orders(Study& study) {
  for (const StudyPoint& p : study.points) {
    if (p.axis == "model") continue;  // its points differ in the method too
    if (std::any_of(study.orders.begin(), study.orders.end(),
                    [&](const StudyOrder& o) { return o.axis == p.axis && o.series == p.series; }))
      continue;
    StudyOrder order{p.axis, p.series, 0.0, 0};
    double sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
    for (const StudyPoint& q : study.points) {
      if (q.axis != p.axis || q.series != p.series || q.knob <= 0.0 || q.axis_error <= 0.0 || q.axis_floor || q.axis_error > 0.5) continue;
      const double x = std::log(q.knob), y = std::log(q.axis_error);
      sx += x, sy += y, sxx += x * x, sxy += x * y;
      ++order.points;
    }
    const double n = order.points, spread = n * sxx - sx * sx;
    // A slope needs three points to be one.
    if (order.points < 3 || spread <= 0.0) continue;
    order.order = (n * sxy - sx * sy) / spread;
    // Tolerances fall where counts rise.
    if (p.axis != "tolerance" && p.axis != "method") order.order = -order.order;
    study.orders.push_back(order);
  }
}

// The cheapest points at their accuracy, and the cheapest for each wish.
void find_front(Study& study) {
  std::vector<size_t> by_cpu;
  for (size_t i = 0; i < study.points.size(); ++i)
    if (study.points[i].error >= 0.0) by_cpu.push_back(i);
  std::sort(by_cpu.begin(), by_cpu.end(), [&](size_t a, size_t b) { return study.points[a].median_cpu < study.points[b].median_cpu; });
  double best = 1e300;
  for (size_t i : by_cpu)
    if (study.points[i].error < best) study.points[i].front = true, best = study.points[i].error;
  for (double wanted : {1e-2, 1e-3, 1e-4, 1e-5}) {
    StudyAdvice advice{wanted, -1};
    for (size_t i : by_cpu)
      // The reference may be wrong by its own error: only what keeps the wish in spite of that is recommended.
      if (study.points[i].error + study.reference_error <= wanted) {
        advice.point = static_cast<int>(i);
        break;
      }
    study.advice.push_back(advice);
  }
}

void check_options(const sim::Scene& scene, StudyOptions& options) {
  if (scene.outputs.empty()) throw sim::InputError(fmt::format("{}: has no [[output]]: a study measures outputs", scene.file.string()));
  for (const std::string& axis : options.axes) {
    if (std::find(study_axes().begin(), study_axes().end(), axis) == study_axes().end())
      throw sim::InputError(fmt::format("axis {} is unknown{}; allowed: {}", sim::quote(axis), sim::did_you_mean(axis, study_axes()),
                                        sim::list_words(study_axes())));
    if (!has_axis(scene, axis))
      throw sim::InputError(fmt::format("{}: the scene has nothing that the axis '{}' varies", scene.file.string(), axis));
  }
  if (!(options.reference_seconds > 0.0)) options.reference_seconds = options.seconds / 6.0;
  if (options.axes.empty())
    for (const std::string& axis : study_axes())
      if (has_axis(scene, axis)) options.axes.push_back(axis);
}

}  // namespace

const std::vector<std::string>& study_axes() {
  static const std::vector<std::string> axes{"tolerance", "method",     "elements", "kept",   "modes",  "volumes",
                                             "model",     "stiffening", "nodes",    "scheme", "samples"};
  return axes;
}

namespace {

std::vector<PlannedPoint> plan_all(const sim::Scene& scene, const StudyOptions& options) {
  std::vector<PlannedPoint> plan;
  for (const std::string& axis : options.axes) {
    std::vector<PlannedPoint> more = plan_axis(scene, axis);
    std::move(more.begin(), more.end(), std::back_inserter(plan));
  }
  return plan;
}

// The scene as it stands.
sim::Scene plain_scene(const sim::Scene& scene) {
  sim::Scene plain = scene;
  plain.simulation.tolerance = scene.simulation.tolerance.value_or(sim::default_tolerance);
  plain.simulation.accuracy.reset();
  plain.simulation.picture_accuracy.reset();
  return plain;
}
StudyRun first_run(Runs& runs, const PlannedPoint& p) {
  return runs.first(fmt::format("{} / {} / {} / {}", p.axis, p.series, p.label, p.setting), p.scene);
}
// Long runs are steady enough as they are.
bool to_be_repeated(const StudyRun& run, int repeats) {
  return run.failure.empty() && run.cpu.front() < 2.0 && static_cast<int>(run.cpu.size()) < repeats;
}

}  // namespace

void run_study_shard(const sim::Scene& scene, const StudyOptions& given, int shard, int shards) {
  StudyOptions options = given;
  check_options(scene, options);
  if (shards < 1 || shard < 1 || shard > shards)
    throw sim::InputError(fmt::format("shard {}/{} must be I/N with 1 <= I <= N", shard, shards));
  if (!(options.longest > 0.0)) throw sim::InputError("a shard of a study needs --longest, the CPU seconds after which a run is stopped");
  options.resume = true;
  Runs runs(options, scene.text);
  const std::vector<PlannedPoint> plan = plan_all(scene, options);
  if (shard == 1) {
    const sim::Scene plain = plain_scene(scene);
    const StudyRun base = runs.first("as it stands", plain);
    if (!base.failure.empty()) throw sim::SimulationError(base.failure);
    if (!options.reference) make_reference(plain, options, runs, base.cpu.front());
  }
  runs.set_longest(options.longest);
  for (size_t i = 0; i < plan.size(); ++i) {
    if (static_cast<int>(i % static_cast<size_t>(shards)) != shard % shards) continue;
    if (options.progress) options.progress(static_cast<double>(i) / static_cast<double>(plan.size()), plan[i].label);
    StudyRun run = first_run(runs, plan[i]);
    while (to_be_repeated(run, options.repeats)) runs.again(run, plan[i].scene);
  }
}

namespace {

constexpr double share_of_overview = 0.35;

void add_overview(const sim::Scene& scene, const StudyOptions& options, Study& study) {
  OverviewOptions o;
  o.seconds = share_of_overview * options.seconds;
  o.progress = [&](double) {
    if (options.progress) options.progress(-1.0, "pictures against time");
  };
  std::string why;
  study.overview = study_overview(scene, o, why);
  if (!study.overview) study.notes.push_back("no figure of pictures against time: " + why);
}

}  // namespace

Study run_study(const sim::Scene& scene, const StudyOptions& given) {
  StudyOptions options = given;
  check_options(scene, options);
  Study study;
  study.title = scene.title.empty() ? scene.file.stem().string() : scene.title;
  study.scene_file = scene.file.filename().string();
  study.command = options.command;
  Runs runs(options, scene.text);
  const auto show = [&](double fraction, const std::string& what) {
    if (options.progress) options.progress(fraction, what);
  };
  const double until = sim::process_cpu_seconds() + options.seconds;
  add_overview(scene, options, study);

  const std::vector<PlannedPoint> plan = plan_all(scene, options);

  // The scene as it stands sets the measure of time.
  show(0.0, "the scene as it stands");
  const sim::Scene plain = plain_scene(scene);
  const StudyRun base = runs.first("as it stands", plain);
  if (!base.failure.empty()) throw sim::SimulationError(base.failure);
  study.columns = base.histories.columns;
  show(0.02, "the reference");
  const Reference reference =
      options.reference ? read_reference(*options.reference, base.histories) : make_reference(plain, options, runs, base.cpu.front());
  tell_reference(reference, options.reference.has_value(), study);
  runs.set_longest(options.longest > 0.0 ? options.longest : std::max(5.0, 20.0 * base.cpu.front()));

  // First runs, then repeats in turn, so that a disturbance of the machine hits all points alike.
  std::vector<StudyRun> done;
  const double share = 1.0 / static_cast<double>(plan.size() * std::max(1, options.repeats) + 1);
  int unmade = 0;
  for (const PlannedPoint& p : plan) {
    if (sim::process_cpu_seconds() > until) {
      done.emplace_back();
      done.back().failure = fmt::format("left out: the study's {:g} CPU s were spent", options.seconds);
      ++unmade;
      continue;
    }
    show(0.2 + 0.75 * share * static_cast<double>(done.size()), fmt::format("{}: {}", p.axis, p.label));
    done.push_back(first_run(runs, p));
  }
  if (unmade > 0)
    study.notes.push_back(fmt::format("{} of {} settings were left out, because the study's {:g} CPU s were spent: --seconds gives it more",
                                      unmade, plan.size(), options.seconds));
  for (int r = 1; r < options.repeats; ++r)
    for (size_t i = 0; i < plan.size(); ++i) {
      if (sim::process_cpu_seconds() > until) break;
      show(0.2 + 0.75 * share * static_cast<double>(static_cast<size_t>(r) * plan.size() + i), "repeats");
      if (to_be_repeated(done[i], r + 1)) runs.again(done[i], plan[i].scene);
    }

  for (size_t i = 0; i < plan.size(); ++i) {
    StudyPoint p;
    p.axis = plan[i].axis;
    p.series = plan[i].series;
    p.label = plan[i].label;
    p.knob = plan[i].knob;
    p.setting = plan[i].setting;
    p.tolerance = *plan[i].scene.simulation.tolerance;
    p.failure = done[i].failure;
    p.method = done[i].method;
    p.coordinates = done[i].coordinates;
    p.cpu = done[i].cpu;
    p.median_cpu = median(done[i].cpu);
    if (p.failure.empty()) {
      if (done[i].histories.columns != study.columns) {
        p.failure = "it has other output columns";
      } else {
        const sim::Difference d = sim::compare_histories(done[i].histories, reference.histories, reference.ranges);
        p.error = d.largest;
        p.column = d.column >= 0 ? study.columns[d.column] : "";
        p.column_errors.assign(d.columns.data(), d.columns.data() + d.columns.size());
        p.floor = p.error < 3.0 * study.reference_error;
      }
    }
    study.points.push_back(p);
  }
  // Errors of one knob: against the first point of the series, its finest; that one's own error from the second by comparison.
  for (size_t i = 0; i < plan.size(); ++i) {
    if (plan[i].axis == "model") continue;
    size_t finest = i;
    while (finest > 0 && plan[finest - 1].axis == plan[i].axis && plan[finest - 1].series == plan[i].series) --finest;
    if (study.points[i].error < 0.0 || study.points[finest].error < 0.0 || finest == i || plan[i].knob <= 0.0) continue;
    study.points[i].axis_error =
        sim::compare_histories(done[i].histories, done[finest].histories, sim::output_ranges(done[finest].histories)).largest;
    if (i == finest + 1) study.points[i].axis_floor = true;
  }
  find_orders(study);
  find_front(study);

  show(0.96, "pictures");
  study_pictures(scene, options, study);
  show(1.0, "");
  return study;
}

}  // namespace flexframe::film
