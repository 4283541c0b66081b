#include "render/film/picture_accuracy.h"

#include "render/film/animation.h"
#include "render/film/vertex_errors.h"
#include "render/film/witnesses.h"
#include "sim/accuracy/accuracy.h"
#include "sim/accuracy/settings_memory.h"
#include "sim/base/cpu_clock.h"
#include "sim/base/file_output.h"
#include "sim/run/judged_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

namespace flexframe::film {
namespace {

// Pictures at which the way from samples to vertices is looked at.
constexpr int pictures_looked_at = 60;
// Tolerances of the run that tells cameras and scales: one after the other until it comes to the end.
constexpr std::array<double, 3> pilot_tolerances{1e-4, 1e-6, 1e-8};
// What samples and map may take of the distance before more samples are made, and what is left to the simulation at least.
constexpr double most_by_samples = 0.1, least_for_simulation = 0.4;
// The accuracies that a search is asked for, as shares of the largest motion.
constexpr double finest = 1e-9, coarsest = 0.05;
// What that run is asked for: a third of it calls for an effect.
constexpr double counts_for_scale = 0.3;
// A search more where a place may be off by so many times more or less than it was asked for, and as many searches at most.
constexpr double another_allowance = 1.5;
constexpr int most_questions = 3;
// By which what a place may be off is less than what a picture may: components add as squares.
constexpr double places_add_up = std::numbers::sqrt2;
// An output that counts for nothing: any difference is none of its size.
constexpr double beyond_measure = 1e300;

// The largest range of motion of a body's drawn points over a run, m.
double largest_motion(const sim::Results& results) {
  double out = 0.0;
  for (const sim::ResultBody& body : results.bodies) {
    const sim::Vec3 range = (body.position.colwise().maxCoeff() - body.position.colwise().minCoeff()).transpose();
    double reach = 0.0;
    for (const sim::ResultNode& node : body.nodes) reach = std::max(reach, node.origin.norm());
    const double turned = std::min(2.0, (body.orientation.rowwise() - body.orientation.row(0)).rowwise().norm().maxCoeff());
    out = std::max({out, range.maxCoeff(), std::max(reach, body.length) * turned});
    if (body.displacement.size() > 0) out = std::max(out, body.displacement.cwiseAbs().maxCoeff());
  }
  return out;
}

// The run that tells cameras and scales. Deformations are exaggerated by the largest: what beams go without must not be most of it, as
// stretching is where nothing bends; they are judged by that (LeftOutWorth::shown).
// every: so many times as many samples, between which less moves unseen.
sim::JudgedRun pilot_run(const sim::Scene& as_given, int every, const sim::SimulateOptions& options) {
  sim::Scene scene = as_given;
  scene.simulation.output_rate *= every;
  sim::SimulateOptions o = options;
  o.accuracy.reset();
  o.estimate_error = false;
  o.pictures = true;
  o.tell = {};
  for (const double tolerance : pilot_tolerances) {
    o.tolerance = tolerance;
    try {
      return sim::run_judged(scene, o, counts_for_scale);
    } catch (const sim::SimulationError&) {
      if (tolerance == pilot_tolerances.back()) throw;
    }
  }
  return {};
}

// What the way from samples and nodes to vertices takes, in the unit that is asked for.
struct WayShares {
  double map = 0.0, samples = 0.0, raster = 0.0;
  std::string map_body, doubt;
  bool map_by_shear = false;
};

WayShares way_shares(const Animation& animation, const sim::Scene& scene, bool pixels) {
  const auto in_unit = [&](const VertexDistance& d) { return pixels ? d.pixels : d.metres; };
  WayShares out;
  const MapErrors map = map_errors(animation, &scene, pictures_looked_at);
  out.map = in_unit(map.largest);
  out.map_by_shear = map.by_shear;
  if (map.largest.picture >= 0) out.map_body = animation.results->bodies[map.largest.body].name;
  out.samples = in_unit(sample_errors(animation, 4 * pictures_looked_at));
  out.raster = in_unit(raster_errors(animation, 2));
  if (!map.unknown.empty())
    out.doubt = fmt::format("the error of the kernel map of '{}' is not known: too few nodes", fmt::join(map.unknown, "', '"));
  return out;
}

// What the samples take where the pilot had `every` times as many. own: told by the run's own samples, which see what turns in between, but
// nothing that comes and goes between two of them: there what the pilot tells counts. (The pilot's noise is seen by its samples, too.)
double with_unseen(double own, double told, const Animation& pilot, int every) {
  constexpr double resolved = 5.0;
  const double truly = thinned_errors(pilot, every).metres, seen = sample_errors(pilot, 4 * pictures_looked_at, every).metres;
  return truly > resolved * seen ? std::max(own, told) : own * std::max(1.0, seen > 0.0 ? truly / seen : 1.0);
}

// How many times as many samples the pilot has: up to four times, none where they are many.
int pilot_samples(const sim::Scene& scene) {
  constexpr double enough = 2000.0, most = 4.0;
  return static_cast<int>(
      std::clamp(std::floor(enough / std::max(1.0, scene.simulation.duration * scene.simulation.output_rate)), 1.0, most));
}

// How many times as many samples keep their share, whole.
int finer_samples(double share, double allowed) {
  if (share <= most_by_samples * allowed) return 1;
  return std::min(1000, static_cast<int>(std::ceil(std::sqrt(share / (most_by_samples * allowed)))));
}

// What the simulation is asked for: shares of the largest motion. An output that may be so many metres off has the size that makes them so.
struct Question {
  sim::Scene scene;
  std::vector<Witness> places;
  double accuracy = coarsest;
};

Question make_question(const sim::Scene& plain, const Animation& animation, bool pixels, double for_simulation) {
  Question out;
  out.scene = plain;
  out.places = witnesses(out.scene, animation, pixels, for_simulation / places_add_up);
  for (sim::OutputDef& output : out.scene.outputs) output.size = beyond_measure;
  double least = std::numeric_limits<double>::infinity();
  for (const Witness& w : out.places)
    if (w.output.quantity != sim::Quantity::rotation) least = std::min(least, w.allowed);
  const double motion = largest_motion(*animation.results);
  if (std::isfinite(least) && motion > 0.0) out.accuracy = std::clamp(least / motion, finest, coarsest);
  for (Witness& w : out.places) {
    w.output.size = w.allowed / out.accuracy;
    out.scene.outputs.push_back(w.output);
  }
  return out;
}

bool is_witness(const std::string& column) { return column.starts_with(witness_prefix); }

void drop_witnesses(sim::Results& results) {
  std::erase_if(results.outputs, [](const sim::ResultOutput& out) { return is_witness(out.column); });
  for (sim::ResultOutput& out : results.outputs) out.size = 0.0;
}

// found: what the search ended with; own: where that is kept.
sim::Results answer(const Question& question, const sim::SimulateOptions& options, const sim::SettingsMemory* memory,
                    const std::string& words, const std::shared_ptr<sim::RememberedSettings>& found, sim::SettingsMemory& own) {
  own = {};
  *found = {};
  if (memory) {
    own = *memory;
    std::string text = memory->question + words;
    for (const Witness& w : question.places) text += fmt::format("{} {:.17g}\n", w.output.name, w.output.size);
    own.question = sim::sha256(text);
  }
  own.found = found;
  sim::Results results = sim::simulate_to_accuracy(question.scene, question.accuracy, options, &own);
  drop_witnesses(results);
  return results;
}

// What pictures show of the error that a run with these settings has, as a share of what is told of it, 0 to 1. error: as it is told, which
// may count more than what outputs were judged by; unit: px or m that an error of 1 would be.
double share_seen(const Animation& drawn, const Question& question, const sim::RememberedSettings& found, double error, double unit,
                  bool pixels) {
  if (!(error > 0.0)) return 1.0;
  const double seen = seen_errors(drawn, question.places, found.errors, pixels), judged = found.errors.error;
  if (seen < 0.0) return found.seen;  // settings of an earlier search
  // Where it is more it is of no place in particular: a place may be wrong by so much in one direction.
  const double beside = error > judged ? std::sqrt(error * error - judged * judged) * unit / places_add_up : 0.0;
  const double less = error < judged ? error / judged : 1.0;
  return std::min(1.0, std::hypot(less * seen, beside) / (error * unit));
}

// Whether a place must be kept closer than it was asked for, or, where the answer missed, need not be kept so close.
bool asks_for_more(const Question& next, const Question& before, bool missed) {
  return std::any_of(next.places.begin(), next.places.end(), [&](const Witness& w) {
    const auto old =
        std::find_if(before.places.begin(), before.places.end(), [&](const Witness& b) { return b.output.name == w.output.name; });
    if (old == before.places.end() || w.allowed < old->allowed / another_allowance) return true;
    return missed && w.allowed > another_allowance * old->allowed;
  });
}

// Notes of the run in the words of pictures: what a search says of shares of outputs that nobody asked for is said anew, in distances.
sim::Notes in_pictures_words(const sim::Notes& notes) {
  sim::Notes out;
  for (const sim::Note& note : notes.all()) {
    if (note.text.starts_with("the requested accuracy of")) continue;
    if (note.severity == sim::Severity::warning) out.warn(note.owner, note.text);
    else out.tell(note.owner, note.text);
  }
  return out;
}

// What is not kept or not known.
void warn_of_missed(const sim::PictureShares& shares, const WayShares& way, sim::Notes& notes) {
  if (!(shares.total <= shares.allowed)) {
    std::string advice = "ask for less";
    if (shares.map > 0.5 * shares.allowed && way.map_by_shear)
      advice = fmt::format("'{}' shears, and its sections are drawn square to its axis, which makes {}: use a smaller scale", way.map_body,
                           distance_words(shares.map, shares.unit));
    else if (shares.map > 0.5 * shares.allowed)
      advice = fmt::format(
          "the error of the kernel map of '{}' alone is {}: it needs more nodes, another 'scheme', or its own shape functions "
          "(flexframe reduce)",
          way.map_body, distance_words(shares.map, shares.unit));
    notes.warn("", fmt::format("the pictures may miss the requested {}: the estimated error is {}; {}", shares.asked,
                               distance_words(shares.total, shares.unit), advice));
  }
  if (!shares.doubt.empty()) notes.warn("", fmt::format("the pictures may miss the requested {}: {}", shares.asked, shares.doubt));
}

}  // namespace

sim::Results simulate_for_pictures(const sim::Scene& scene, const RenderSettings& settings, const sim::SimulateOptions& options,
                                   const sim::SettingsMemory* memory) {
  const sim::PictureAccuracy asked = scene.simulation.picture_accuracy.value();
  const double start = sim::cpu_seconds();
  sim::Scene plain = scene;
  plain.simulation.picture_accuracy.reset();
  plain.simulation.accuracy.reset();
  plain.simulation.tolerance.reset();
  const int every = pilot_samples(plain);
  const sim::JudgedRun told = pilot_run(plain, every, options);
  const sim::Results& pilot = told.results;
  Animation first = make_animation(pilot, settings, &plain);
  WayShares way = way_shares(first, plain, asked.pixels);
  if (every > 1) {
    const VertexDistance between = thinned_errors(first, every);
    way.samples = asked.pixels ? between.pixels : between.metres;
  }
  std::vector<std::string> chosen;
  int more_samples = 1;
  if (const int factor = finer_samples(way.samples, asked.value); factor > 1) {
    more_samples = factor;
    plain.simulation.output_rate *= factor;
    way.samples /= static_cast<double>(factor) * factor;
    chosen.push_back(fmt::format("output_rate {:g}", plain.simulation.output_rate));
  }
  const double for_simulation = std::max(least_for_simulation * asked.value, asked.value - way.map - way.samples - way.raster);
  sim::SimulateOptions o = options;
  o.tolerance.reset();
  o.accuracy.reset();
  o.weight_shares = told.shares;  // else each run whose motion is far below the mechanism's size finds them by one more
  const auto found = std::make_shared<sim::RememberedSettings>();
  sim::SettingsMemory kept_in;
  Question question = make_question(plain, first, asked.pixels, for_simulation);
  sim::Results results = answer(question, o, memory, asked.words, found, kept_in);
  Animation drawn = make_animation(results, settings, &plain);
  for (int more = 0; more < most_questions - 1; ++more) {
    // The pilot may have had other effects, so that deformations are exaggerated more or less than it told.
    Question next = make_question(plain, drawn, asked.pixels, for_simulation);
    if (!asks_for_more(next, question, results.statistics.error_estimate > question.accuracy)) break;
    question = std::move(next);
    results = answer(question, o, memory, asked.words, found, kept_in);
    drawn = make_animation(results, settings, &plain);
  }

  // Judged with the nodes and cameras of the run itself.
  const double accuracy = question.accuracy, unit = for_simulation / accuracy;
  WayShares last = way_shares(drawn, plain, asked.pixels);
  if (more_samples < every) last.samples = with_unseen(last.samples, way.samples, first, (every + more_samples - 1) / more_samples);
  if (const double seen = share_seen(drawn, question, *found, results.statistics.error_estimate, unit, asked.pixels); seen != found->seen) {
    found->seen = seen;
    if (kept_in.found) sim::remember_settings(kept_in, *found);
  }
  const double simulated = std::max(0.0, results.statistics.error_estimate) * unit * found->seen;
  const double others = simulated + last.map + last.raster;
  const bool by_samples = results.statistics.accuracy && others < asked.value && others + last.samples > asked.value;
  if (const int factor = finer_samples(last.samples, asked.value); by_samples && factor > 1) {
    // It vibrates as the pilot's loose steps did not: the same run once more, with more samples.
    plain.simulation.output_rate *= factor;
    results = sim::run_with_settings(*found, plain.simulation.output_rate, o);
    drop_witnesses(results);
    drawn = make_animation(results, settings, &plain);
    last = way_shares(drawn, plain, asked.pixels);
    chosen = {fmt::format("output_rate {:g}", plain.simulation.output_rate)};
  }
  sim::SolverStatistics& s = results.statistics;
  sim::PictureShares shares;
  shares.asked = asked.words;
  shares.unit = asked.pixels ? "px" : "m";
  shares.allowed = asked.value;
  shares.map = last.map;
  shares.samples = last.samples;
  shares.raster = last.raster;
  shares.doubt = last.doubt;
  shares.body = last.map_body;
  if (!s.accuracy) {
    // No search came to an end: the scene as it stands, of which only the error of time is known.
    s.accuracy.emplace();
    s.accuracy->asked = accuracy;
    s.accuracy->time = std::max(0.0, s.error_estimate);
    shares.doubt = "no setting was found, so that only the error of the time integration is known";
  }
  sim::AccuracyStatement& a = *s.accuracy;
  shares.time = a.time * unit * found->seen;
  shares.space = a.space * unit * found->seen;
  shares.effects = a.effects * unit * found->seen;
  shares.total = simulated + shares.map + shares.samples + shares.raster;
  if (simulated >= shares.map && is_witness(a.column)) {
    const std::string column = a.column.substr(a.column.find('(') + 1);
    shares.body = column.substr(0, column.find(')'));
  }
  s.notes = in_pictures_words(s.notes);
  a.chosen.insert(a.chosen.end(), chosen.begin(), chosen.end());
  a.search_cpu = sim::cpu_seconds() - start - s.cpu_seconds;
  warn_of_missed(shares, last, s.notes);
  a.picture = shares;
  return results;
}

std::string distance_words(double value, const std::string& unit) {
  if (unit != "m") return fmt::format("{:.2g} {}", value, unit);
  const std::pair<double, const char*> units[] = {{1.0, "m"}, {1e-3, "mm"}, {1e-6, "um"}, {1e-9, "nm"}};
  for (const auto& [factor, name] : units)
    if (std::abs(value) >= factor) return fmt::format("{:.3g} {}", value / factor, name);
  return fmt::format("{:.2g} m", value);
}

namespace {

struct Share {
  char letter;
  double value;
  const char* words;
};

std::array<Share, 6> shares_of(const sim::PictureShares& s) {
  return {{{'t', s.time, "time integration"},
           {'e', s.space, "elements or modes"},
           {'f', s.effects, "effects left out"},
           {'m', s.map, "map to vertices"},
           {'s', s.samples, "samples"},
           {'r', s.raster, "single precision and raster"}}};
}

}  // namespace

std::string shares_bar(const sim::PictureShares& shares, int width) {
  std::string bar;
  double upto = 0.0;
  for (const Share& share : shares_of(shares)) {
    upto += share.value;
    const double place = std::min(2.0 * width, width * upto / std::max(shares.allowed, 1e-300));
    bar.resize(std::max(bar.size(), static_cast<size_t>(std::lround(place))), share.letter);
  }
  if (bar.size() <= static_cast<size_t>(width)) return "[" + bar + std::string(static_cast<size_t>(width) - bar.size(), '.') + "]";
  return "[" + bar.substr(0, static_cast<size_t>(width)) + "]" + bar.substr(static_cast<size_t>(width));
}

std::vector<std::string> shares_words(const sim::PictureShares& shares) {
  std::vector<std::string> out;
  for (const Share& share : shares_of(shares))
    out.push_back(fmt::format("{} {} {}", share.letter, distance_words(share.value, shares.unit), share.words));
  return out;
}

}  // namespace flexframe::film
