#include "sim/sweep/shared_settings.h"

#include "sim/accuracy/accuracy.h"
#include "sim/base/cpu_clock.h"
#include "sim/base/error.h"
#include "sim/base/file_output.h"
#include "sim/base/words.h"
#include "sim/scene/fingerprint.h"
#include "sim/scene/toml_output.h"
#include "sim/time/system.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include <unistd.h>

namespace flexframe::sim {
namespace {

namespace fs = std::filesystem;

// So many points for each place that is searched: a search takes some twenty runs, made cheaper another twenty.
constexpr long points_a_place = 10;
constexpr std::size_t most_places = 9;
// Of so many points, spread over the design, those at the ends of the keys are taken.
constexpr long looked_at = 1000;
// Of the asked accuracy: what is searched for at the places, and what cheaper settings may use of it there. The other half is for the
// points between: a pendulum whose modulus varies was 1.1e-2 off between places where 6.5e-3 was told.
constexpr double search_share = 0.5, kept_share = 0.5;
// What those may use of it that judge points between the places: looser and of fewer elements than a search finds them, but with all of its
// shapes, so that what these are worth elsewhere is seen. Points are judged so often, or so many of a large design: one took as long as
// thirty of them (slider-crank).
constexpr double judging_share = 0.35;
constexpr long judged_every = 50, judged_in_all = 20;
// What settings may use of it that are those of a search.
constexpr double found_share = 0.8;
// How far a point may be from the places: ranges of outputs and deformations by so much, steps by so much.
constexpr double like = 2.0, many_steps = 3.0;
constexpr int judged_samples = 400;  // enough to see the largest difference of two histories
// At the places a run ten times looser may be off by so much of the asked accuracy. Errors go with the tolerance to a power of 0.8 or more,
// so that the run itself keeps a third of it. Beside the judges alone a loose run of a double pendulum was right to 0.4 % by luck, the
// looser one 26 % off, and points between 5 %.
constexpr double looser_share = 2.0;
constexpr double loosest_beside = 0.1, tightest_beside = 1e-12;
// A run beside each point, ten times tighter: errors of time may grow there as they do at no place.
constexpr double between = 10.0;
constexpr int beside_samples = 50;

struct Refused {};  // a place that takes longer than a point may

std::vector<long> places_of(const Design& design) {
  const long n = std::min(design.size(), looked_at);
  const auto at = [&](long k) {
    return n > 1 ? static_cast<long>(static_cast<double>(k) * static_cast<double>(design.size() - 1) / static_cast<double>(n - 1)) : 0;
  };
  std::vector<long> out{at(n / 2)};
  for (std::size_t axis = 0; axis < design.axes().size(); ++axis) {
    long least = 0, most = 0;
    double low = 0.0, high = 0.0;
    for (long k = 0; k < n; ++k) {
      const double number = design.point(at(k))[axis].number;
      if (k == 0 || number < low) low = number, least = at(k);
      if (k == 0 || number > high) high = number, most = at(k);
    }
    for (const long place : {least, most})
      if (out.size() < most_places && std::find(out.begin(), out.end(), place) == out.end()) out.push_back(place);
  }
  return out;
}

std::vector<bool> columns_read(const Sweep& sweep) {
  std::vector<bool> read(sweep.columns.size(), false);
  for (const Response& response : sweep.responses) response.mark_read(read);
  return read;
}

// The largest error of columns that are read, of whole vectors (at most: their components may be off at different times).
double apart(const Histories& a, const Histories& reference, const std::vector<bool>& read, std::string& column) {
  const Difference d = compare_histories(a, reference, output_ranges(reference));
  std::map<std::string, double> squares;
  const auto vector_of = [&](std::size_t k) {
    return reference.columns[k].substr(0, reference.columns[k].rfind('.')) + "\n" + reference.units[k];
  };
  for (std::size_t k = 0; k < read.size(); ++k)
    squares[vector_of(k)] += read[k] ? std::pow(d.columns[static_cast<Eigen::Index>(k)], 2) : 0.0;
  double largest = 0.0;
  for (std::size_t k = 0; k < read.size(); ++k)
    if (const double off = std::sqrt(squares[vector_of(k)]); read[k] && off > largest) largest = off, column = reference.columns[k];
  return largest;
}

// How far a run of the same choices at another tolerance, so many times the run's, is off from it.
double apart_at(double factor, const Histories& run, const Scene& scene, SimulateOptions options, const std::vector<bool>& read,
                std::string& column) {
  Scene other = scene;
  other.simulation.tolerance = std::clamp(factor * scene.simulation.tolerance.value_or(default_tolerance), tightest_beside, loosest_beside);
  options.beside = nullptr;
  options.samples = beside_samples;
  return apart(simulate_histories(other, options), run, read, column);
}

struct Place {
  long point = 0;
  Scene scene;               // as it is written
  RememberedSettings found;  // to half of the accuracy
  std::vector<std::string> warnings;
  Histories judge;     // of a richer model
  double error = 0.0;  // of columns that are read: what the model of `found` and that one differ by, and what is left out in both
};

// Half as many modes and elements more, twice as many of stretching and twist, a tenth of the tolerance.
Scene richer(const Scene& scene) {
  Scene out = scene;
  const auto more = [](int count) { return count + (count + 1) / 2; };
  for (BodyDef& body : out.bodies) {
    auto* beam = std::get_if<BeamDef>(&body.kind);
    if (!beam) continue;
    const int modes = beam->keep_modes.value_or(0);
    beam->elements = more(beam->elements);
    beam->volumes = more(beam->volumes);
    for (std::optional<int>* count : {&beam->keep_axial, &beam->keep_torsion})
      if (*count) *count = 2 * **count;
      else if (beam->keep_modes) *count = 2 * modes;
    if (beam->keep_modes) beam->keep_modes = more(modes);
  }
  out.simulation.tolerance = std::max(tightest_beside, scene.simulation.tolerance.value_or(default_tolerance) / between);
  return out;
}

class Finder {
 public:
  Finder(const Sweep& sweep, const std::function<void()>& tick, double asked)
      : sweep_(sweep), tick_(tick), asked_(asked), read_(columns_read(sweep)) {}
  bool search(const fs::path& folder);
  std::optional<SharedSettings> share();

 private:
  SimulateOptions options() const;
  SimulateOptions run_options() const;  // of runs with chosen settings
  Histories run(const Scene& choices, const Place& place, SeenBeside* beside) const;
  bool time_is_sure(const Scene& choices) const;  // at all places, by looser runs
  // The largest error at all places, those of the runs that judge counted in; beyond what is asked where one cannot be run. Not all of them
  // are run once it is beyond that share of what is asked.
  double error_of(const Scene& choices, double share, std::string& column) const;
  bool take_cheaper(const std::function<bool(Scene&)>& change);
  void loosen(double factor);
  void take_fewer_elements(std::size_t body);
  void make_cheaper();

  const Sweep& sweep_;
  const std::function<void()>& tick_;
  double asked_;
  std::vector<bool> read_;
  std::vector<Place> places_;
  std::optional<Method> method_;
  Scene chosen_;
  double error_ = 0.0;
  std::string column_;
  double share_ = kept_share;  // what cheaper settings may use
};

SimulateOptions Finder::options() const {
  SimulateOptions o = sweep_options(sweep_);
  o.progress = [this, start = cpu_seconds()](double) {
    if (tick_) tick_();
    if (sweep_.question.longest > 0.0 && cpu_seconds() - start > sweep_.question.longest) throw Refused{};
  };
  return o;
}

SimulateOptions Finder::run_options() const {
  SimulateOptions o = options();
  o.accuracy.reset();
  o.method = method_;
  o.read = read_;
  return o;
}

// Each place to half of the accuracy, judged by a richer model; what a run to all of it warns of, its points warn of. False where one
// cannot be, or where friction, a stop or gravity is left out in one: at other points these may count.
bool Finder::search(const fs::path& folder) {
  for (const long point : places_of(sweep_.design)) {
    Place place;
    place.point = point;
    place.scene = sweep_scene(sweep_, sweep_.design.point(point));
    place.scene.simulation.accuracy.reset();
    SettingsMemory memory{folder / fmt::format("point_{}.toml", point), sha256(fmt::format("{} {}", sweep_.identity, point)), true};
    SimulateOptions o = options();
    o.accuracy = asked_;
    place.warnings = simulate_as_asked(place.scene, o).statistics.notes.texts(Severity::warning);
    o.accuracy = search_share * asked_;
    const Results results = simulate_as_asked(place.scene, o, &memory);
    if (!(results.statistics.error_estimate >= 0.0 && results.statistics.error_estimate <= asked_)) return false;
    memory.fresh = false;
    const std::optional<RememberedSettings> found = recall_settings(memory, place.scene);
    if (!found) return false;
    const Scene &before = place.scene, &after = found->scene;
    for (std::size_t k = 0; k < before.joints.size(); ++k)
      if (before.joints[k].friction.has_value() != after.joints[k].friction.has_value() ||
          before.joints[k].stop.has_value() != after.joints[k].stop.has_value())
        return false;
    if (before.simulation.gravity != after.simulation.gravity || !(places_.empty() || same_choices(before, places_.front().scene)))
      return false;
    place.found = *found;
    method_ = found->method;
    place.judge = run(richer(found->scene), place, nullptr);
    std::string column;
    place.error =
        apart(to_histories(results), place.judge, read_, column) + results.statistics.accuracy.value_or(AccuracyStatement{}).effects;
    if (place.error > search_share * asked_) return false;
    places_.push_back(std::move(place));
  }
  return true;
}

Histories Finder::run(const Scene& choices, const Place& place, SeenBeside* beside) const {
  Scene scene = place.scene;
  take_choices(choices, scene);
  SimulateOptions o = run_options();
  o.beside = beside;
  return simulate_histories(scene, o);
}

bool Finder::time_is_sure(const Scene& choices) const {
  return std::all_of(places_.begin(), places_.end(), [&](const Place& place) {
    Scene scene = place.scene;
    take_choices(choices, scene);
    try {
      std::string column;
      return apart_at(between, run(choices, place, nullptr), scene, run_options(), read_, column) <= looser_share * asked_;
    } catch (const SimulationError&) {
      return false;
    }
  });
}

double Finder::error_of(const Scene& choices, double share, std::string& column) const {
  double largest = 0.0;
  for (const Place& place : places_) {
    try {
      std::string here;
      const double error = apart(run(choices, place, nullptr), place.judge, read_, here) + place.error;
      if (error > largest) largest = error, column = here;
      if (largest > share * asked_) break;
    } catch (const SimulationError&) {
      return 2.0 * asked_;
    }
  }
  return largest;
}

// Changes the settings as often as they keep that share of the accuracy then.
bool Finder::take_cheaper(const std::function<bool(Scene&)>& change) {
  bool any = false;
  for (Scene next = chosen_; change(next); next = chosen_) {
    std::string column;
    const double error = error_of(next, share_, column);
    if (error > share_ * asked_ || (sweep_.question.estimate_error && !time_is_sure(next))) return any;
    chosen_ = next, error_ = error, column_ = column, any = true;
  }
  return any;
}

// Fewer of something: a third less, one at least.
int fewer(int count, int least) { return std::max(least, std::min(count - 1, 2 * count / 3)); }

void Finder::loosen(double factor) {
  constexpr double loosest = 1e-2;
  take_cheaper([&](Scene& scene) {
    const double looser = factor * scene.simulation.tolerance.value_or(default_tolerance);
    scene.simulation.tolerance = looser;
    return looser <= loosest;
  });
}

// Behind modes three elements each at least (accuracy_search.h).
void Finder::take_fewer_elements(std::size_t body) {
  take_cheaper([&](Scene& scene) {
    auto* of = std::get_if<BeamDef>(&scene.bodies[body].kind);
    if (!of || of->model != BeamModel::finite_element || of->all_elements) return false;
    const int least = 3 * of->keep_modes.value_or(of->elements);
    if (of->elements <= least) return false;
    of->elements = std::max(least, of->elements / 2);
    return true;
  });
}

void Finder::make_cheaper() {
  const auto of_beams = [](Scene& scene, const std::function<void(BeamDef&)>& change) {
    for (BodyDef& body : scene.bodies)
      if (auto* beam = std::get_if<BeamDef>(&body.kind)) change(*beam);
  };
  // First of all: besides modes these shapes add coordinates, and stiff ones, which a loose accuracy hardly sees.
  take_cheaper([&](Scene& scene) {
    bool any = false;
    of_beams(scene, [&](BeamDef& beam) { any = any || beam.keep_inertia, beam.keep_inertia = false; });
    return any;
  });
  loosen(10.0);
  for (std::size_t b = 0; b < chosen_.bodies.size(); ++b) {
    if (!std::holds_alternative<BeamDef>(chosen_.bodies[b].kind)) continue;
    const auto beam = [b](Scene& scene) -> BeamDef& { return std::get<BeamDef>(scene.bodies[b].kind); };
    take_cheaper([&](Scene& scene) { return std::exchange(beam(scene).keep_inertia, false); });
    const auto lower = [&](std::optional<int> BeamDef::*count, int least) {
      take_cheaper([&](Scene& scene) {
        std::optional<int>& modes = beam(scene).*count;
        if (!modes || *modes <= least) return false;
        modes = fewer(*modes, least);
        return true;
      });
    };
    lower(&BeamDef::keep_modes, 1);
    lower(&BeamDef::keep_axial, 0);
    lower(&BeamDef::keep_torsion, 0);
    take_fewer_elements(b);
  }
  loosen(3.0);
}

std::optional<SharedSettings> Finder::share() {
  // The settings of that place which keep the accuracy at all.
  bool kept = false;
  for (const Place& from : places_) {
    method_ = from.found.method;
    chosen_ = from.found.scene;
    error_ = error_of(chosen_, found_share, column_);
    if ((kept = error_ <= found_share * asked_)) break;
  }
  if (!kept) return std::nullopt;
  SharedSettings out;
  const Scene found = chosen_;
  const double found_error = error_;
  share_ = judging_share;
  for (std::size_t b = 0; b < chosen_.bodies.size(); ++b) take_fewer_elements(b);
  loosen(3.0);
  out.finer = chosen_;
  out.finer_error = error_;
  share_ = kept_share;
  chosen_ = found;
  error_ = found_error;
  make_cheaper();
  // Nothing may have become cheaper.
  std::optional<double>& tolerance = out.finer.simulation.tolerance;
  tolerance = std::max(tightest_beside,
                       std::min(tolerance.value_or(default_tolerance), chosen_.simulation.tolerance.value_or(default_tolerance) / between));
  out.written = places_.front().scene;
  out.chosen = chosen_;
  out.method = method_;
  out.asked = asked_;
  out.error = error_;
  out.column = column_;
  std::size_t most = 0;
  for (const Place& place : places_) {
    out.places.push_back(place.point);
    SeenBeside beside;
    const Histories h = run(chosen_, place, &beside);
    const VecX ranges = output_ranges(h);
    out.low = out.low.size() == 0 ? ranges : VecX(out.low.cwiseMin(ranges));
    out.high = out.high.size() == 0 ? ranges : VecX(out.high.cwiseMax(ranges));
    out.swings = out.swings.size() == 0 ? beside.swings : VecX(out.swings.cwiseMax(beside.swings));
    out.steps = std::max(out.steps, h.statistics.steps);
    if (place.warnings.size() <= most) continue;
    most = place.warnings.size();
    out.warnings.clear();
    for (const std::string& text : place.warnings) out.warnings.push_back(fmt::format("at point {}: {}", place.point, text));
  }
  return out;
}

// ---- The folder ------------------------------------------------------------------------------------------------------------------------

TomlValue numbers(const VecX& v) {
  std::vector<TomlValue> items;
  for (const double x : v) items.push_back(toml_number(x));
  return toml_list(std::move(items));
}

SettingsMemory memory_of(const Sweep& sweep, const fs::path& folder, const char* name) {
  return {folder / name, sha256(fmt::format("{} {}", sweep.identity, name)), false};
}

void write_shared(const Sweep& sweep, const fs::path& folder, const std::optional<SharedSettings>& shared) {
  TomlValue root;
  toml_put(root, "identity", toml_text(sweep.identity));
  toml_put(root, "shared", toml_truth(shared.has_value()));
  if (shared) {
    std::vector<TomlValue> places;
    for (const long point : shared->places) places.push_back(toml_count(point));
    toml_put(root, "places", toml_list(std::move(places)));
    toml_put(root, "asked", toml_number(shared->asked));
    toml_put(root, "error", toml_number(shared->error));
    toml_put(root, "finer_error", toml_number(shared->finer_error));
    toml_put(root, "column", toml_text(shared->column));
    toml_put(root, "low", numbers(shared->low));
    toml_put(root, "high", numbers(shared->high));
    toml_put(root, "swings", numbers(shared->swings));
    toml_put(root, "steps", toml_count(shared->steps));
    toml_put(root, "warnings", toml_texts(shared->warnings));
    SolverStatistics statistics;
    statistics.error_estimate = shared->error;
    statistics.accuracy = AccuracyStatement{};
    statistics.accuracy->asked = shared->asked;
    remember_settings(memory_of(sweep, folder, "chosen.toml"), {shared->chosen, shared->method, statistics, ""});
    remember_settings(memory_of(sweep, folder, "finer.toml"), {shared->finer, shared->method, statistics, ""});
  }
  write_whole_file(
      folder / "settings.toml",
      "# Settings that the points of this sweep share, and what the places looked like where they were found.\n" + write_toml(root));
}

// What another process, or an earlier one, has found for this sweep: `there` is false where that is nothing.
std::shared_ptr<const SharedSettings> read_shared(const Sweep& sweep, const fs::path& folder, bool& there) {
  there = false;
  std::error_code error;
  const fs::path file = folder / "settings.toml";
  if (!fs::is_regular_file(file, error)) return nullptr;
  try {
    const TomlValue document = read_toml(file);
    const TableReader root(document, file.string(), "");
    if (root.text("identity") != sweep.identity) return nullptr;
    if (!root.boolean("shared", false)) {
      there = true;
      return nullptr;
    }
    SharedSettings out;
    for (const int point : root.integers("places", 0, 2000000000)) out.places.push_back(point);
    out.asked = root.number("asked");
    out.error = root.number("error");
    out.finer_error = root.number("finer_error");
    out.column = root.text("column");
    const auto vector = [&](const char* key) {
      const std::vector<double> values = root.numbers(key, 0, 1000000);
      return VecX(Eigen::Map<const VecX>(values.data(), static_cast<Eigen::Index>(values.size())));
    };
    out.low = vector("low");
    out.high = vector("high");
    out.swings = vector("swings");
    out.steps = root.integer("steps", 0, 2000000000);
    out.warnings = root.texts("warnings");
    if (out.places.empty()) return nullptr;
    out.written = sweep_scene(sweep, sweep.design.point(out.places.front()));
    out.written.simulation.accuracy.reset();
    const auto chosen = recall_settings(memory_of(sweep, folder, "chosen.toml"), out.written);
    const auto finer = recall_settings(memory_of(sweep, folder, "finer.toml"), out.written);
    if (!chosen || !finer) return nullptr;
    out.chosen = chosen->scene;
    out.finer = finer->scene;
    out.method = chosen->method;
    there = true;
    return std::make_shared<const SharedSettings>(std::move(out));
  } catch (const InputError&) {
    return nullptr;  // damaged: found anew
  }
}

// Where the sweep asks for an accuracy by which settings may be shared.
std::optional<double> shared_accuracy(const Sweep& sweep) {
  const SweepQuestion& q = sweep.question;
  if (sweep.goal || q.tolerance) return std::nullopt;
  if (std::any_of(sweep.responses.begin(), sweep.responses.end(), [](const Response& r) { return r.reads_frequency(); }))
    return std::nullopt;
  // A key of words is a choice that the places cannot stand for.
  long keys = 0;
  for (const SweepAxis& axis : sweep.design.axes()) {
    if (!axis.chance && axis.numbers.empty()) return std::nullopt;
    ++keys;
  }
  const long places = std::min<long>(static_cast<long>(most_places), 1 + 2 * keys);
  if (keys == 0 || sweep.design.size() < points_a_place * places) return std::nullopt;
  if (q.accuracy) return q.accuracy;
  return std::nullopt;
}

}  // namespace

std::shared_ptr<const SharedSettings> find_shared_settings(const Sweep& sweep, const std::function<void()>& tick) {
  const std::optional<double> asked = shared_accuracy(sweep);
  if (!asked) return nullptr;
  const fs::path folder = sweep.folder / "settings";
  bool there = false;
  if (auto known = read_shared(sweep, folder, there); there) return known;
  const fs::path mine = sweep.folder / fmt::format("settings.{}", ::getpid());
  std::error_code error;
  fs::create_directories(mine, error);
  if (error) throw FileError(fmt::format("{}: cannot create the folder: {}", mine.string(), error.message()));
  std::optional<SharedSettings> found;
  try {
    Finder finder(sweep, tick, *asked);
    if (finder.search(mine)) found = finder.share();
  } catch (const Refused&) {
  } catch (const SimulationError&) {
  } catch (const InputError&) {
    // A place that is no mechanism: every point says by itself what it is.
  } catch (...) {
    fs::remove_all(mine, error);
    throw;
  }
  write_shared(sweep, mine, found);
  // Renaming fails where another process was faster: what it found counts. What belongs to another sweep goes first.
  read_shared(sweep, folder, there);
  if (!there) fs::remove_all(folder, error);
  fs::rename(mine, folder, error);
  if (error) fs::remove_all(mine, error);
  auto known = read_shared(sweep, folder, there);
  if (!there) throw FileError(fmt::format("{}: the settings that were found cannot be read", folder.string()));
  return known;
}

std::optional<SharedRun> run_with_shared(const Sweep& sweep, const SharedSettings& shared, const Scene& scene, long point,
                                         const SimulateOptions& options) {
  if (!same_choices(scene, shared.written)) return std::nullopt;
  Scene chosen = scene;
  take_choices(shared.chosen, chosen);
  const std::vector<bool> read = columns_read(sweep);
  SeenBeside beside;
  SimulateOptions o = options;
  o.accuracy.reset();
  o.method = shared.method;
  o.read = read;
  o.beside = &beside;
  SharedRun out;
  try {
    out.histories = simulate_histories(chosen, o);
    const Histories& h = out.histories;
    const VecX ranges = output_ranges(h);
    if (ranges.size() != shared.low.size() || beside.swings.size() != shared.swings.size()) return std::nullopt;
    if (static_cast<double>(h.statistics.steps) > many_steps * static_cast<double>(shared.steps)) return std::nullopt;
    for (Eigen::Index k = 0; k < ranges.size(); ++k)
      if (read[static_cast<std::size_t>(k)] && !(ranges[k] >= shared.low[k] / like && ranges[k] <= like * shared.high[k]))
        return std::nullopt;
    for (Eigen::Index b = 0; b < beside.swings.size(); ++b)
      if (!(beside.swings[b] <= like * shared.swings[b])) return std::nullopt;
    out.error = shared.error;
    out.column = shared.column;
    out.warnings = shared.warnings;
    if (options.estimate_error) {
      std::string column;
      const double error = apart_at(1.0 / between, h, chosen, o, read, column) + shared.finer_error;
      if (error > shared.asked) return std::nullopt;
      if (error > out.error) out.error = error, out.column = column;
    }
    for (const std::string& text : beside.notes.texts(Severity::warning)) out.warnings.push_back(text);
    // Multiplied, so that the points judged do not lie in rows of a grid.
    const auto every = static_cast<std::uint64_t>(std::max(judged_every, sweep.design.size() / judged_in_all));
    out.judged = static_cast<std::uint64_t>(point) * 2654435761ULL % 4294967296ULL % every == 0;
    if (!out.judged) return out;
    Scene finer = scene;
    take_choices(shared.finer, finer);
    o.beside = nullptr;
    o.samples = judged_samples;
    out.error = apart(h, simulate_histories(finer, o), read, out.column) + shared.finer_error;
    if (out.error > shared.asked)
      out.warnings.push_back(
          fmt::format("the settings that the points of this sweep share do not keep the requested accuracy of {:g} here: the "
                      "estimated error is {:.1e} of the range of {}, and points near it may be off as much: ask for more",
                      shared.asked, out.error, out.column));
    return out;
  } catch (const SimulationError&) {
    return std::nullopt;
  }
}

std::string shared_settings_text(const SharedSettings& s) {
  std::vector<std::string> bodies;
  for (const BodyDef& body : s.chosen.bodies) {
    const auto* beam = std::get_if<BeamDef>(&body.kind);
    if (!beam) continue;
    const std::string axial = beam->keep_axial ? fmt::format(", keep_axial = {}", *beam->keep_axial) : "";
    const std::string modes = beam->keep_modes ? fmt::format("{}{} of ", how_many(*beam->keep_modes, "modes"), axial) : "";
    bodies.push_back(fmt::format("'{}' {}{}", body.name, modes, how_many(beam->elements, "elements")));
  }
  return fmt::format("tolerance {:.1e}, {}{}{}; searched for at the points {}, largest error there {:.1e} of the range of {}",
                     s.chosen.simulation.tolerance.value_or(default_tolerance),
                     s.method ? "method " + std::string(method_name(*s.method)) : "method of the scene", bodies.empty() ? "" : ", ",
                     fmt::join(bodies, ", "), fmt::join(s.places, ", "), s.error, s.column);
}

}  // namespace flexframe::sim
