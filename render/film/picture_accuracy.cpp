#include "render/film/picture_accuracy.h"

#include "render/film/animation.h"
#include "render/film/vertex_errors.h"
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
#include <set>

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
// An output that counts for nothing: any difference is none of its size.
constexpr double beyond_measure = 1e300;
constexpr const char* witness_prefix = "picture(";

// A place of a body that the simulation is asked to keep.
struct Witness {
  sim::OutputDef output;
  double allowed = 0.0;  // m, of a rotation rad
};

// How many times largest a body's elastic displacement is drawn, and how many pixels a metre of it has, at most over the film.
struct BodySight {
  double scale = 1.0, per_metre = 0.0;
};

std::vector<BodySight> sights(const Animation& animation) {
  std::vector<BodySight> out(animation.bodies.size());
  const sim::Results& results = *animation.results;
  for (BodySight& body : out)
    for (const double s : animation.scales) body.scale = std::max(body.scale, s);
  for (const int k : looked_at(animation, pictures_looked_at)) {
    const PictureViews views(animation, k);
    const SamplePlace place = find_sample(results.times, picture_time(animation, k));
    for (size_t b = 0; b < out.size(); ++b) {
      const std::vector<glm::dvec3>& vertices = animation.bodies[b].mesh.positions;
      if (!animation.bodies[b].visible) continue;
      const glm::dmat4 pose = body_pose(results.bodies[b], place);
      const size_t step = std::max<size_t>(1, vertices.size() / 100);
      for (size_t i = 0; i < vertices.size(); i += step)
        out[b].per_metre = std::max(out[b].per_metre, views.pixels_per_metre(glm::dvec3(pose * glm::dvec4(vertices[i], 1.0))));
    }
  }
  return out;
}

// Corners of a rigid body's mesh farthest in three directions: with its origin they tell where it is.
std::vector<sim::Vec3> far_corners(const BodyModel& model) {
  std::vector<sim::Vec3> out;
  for (int axis = 0; axis < 3; ++axis) {
    const auto least = std::max_element(model.mesh.positions.begin(), model.mesh.positions.end(),
                                        [&](const glm::dvec3& a, const glm::dvec3& b) { return std::abs(a[axis]) < std::abs(b[axis]); });
    if (least != model.mesh.positions.end()) out.emplace_back(least->x, least->y, least->z);
  }
  return out;
}

// x/length of the node nearest to a beam's middle, so that a place there changes no elements.
double middle_of(const sim::BeamDef& beam) {
  const int pieces = beam.model == sim::BeamModel::mixed ? beam.volumes * beam.elements : beam.elements;
  const bool elements = beam.model == sim::BeamModel::finite_element || (beam.model == sim::BeamModel::mixed && beam.modes.empty());
  const int before = pieces / 2;
  return elements && pieces > 1 ? static_cast<double>(before) / pieces : 0.5;
}

// Names of places of the body, which it gets where it lacks them.
std::vector<std::string> places_of(sim::BodyDef& body, const sim::ResultBody& result, const BodyModel& model) {
  if (auto* rigid = std::get_if<sim::RigidDef>(&body.kind)) {
    std::vector<std::string> out{""};
    for (const sim::Vec3& corner : far_corners(model)) {
      out.push_back(fmt::format("corner {} of the picture", out.size()));
      rigid->frames[out.back()] = corner;
    }
    return out;
  }
  if (auto* beam = std::get_if<sim::BeamDef>(&body.kind)) {
    const double middle = middle_of(*beam);
    beam->frames["middle of the picture"] = middle;
    return {"root", "middle of the picture", "tip"};
  }
  // Nodes far from each other.
  std::vector<std::string> out{""};
  std::set<size_t> chosen;
  for (int axis = 0; axis < 3; ++axis) {
    size_t low = 0, high = 0;
    for (size_t n = 0; n < result.nodes.size(); ++n) {
      if (result.nodes[n].origin[axis] < result.nodes[low].origin[axis]) low = n;
      if (result.nodes[n].origin[axis] > result.nodes[high].origin[axis]) high = n;
    }
    if (!result.nodes.empty()) chosen.insert({low, high});
  }
  for (const size_t n : chosen) out.push_back(result.nodes[n].name);
  return out;
}

// How far what is drawn of a beam lies from its axis at most, m.
double girth(const sim::BeamDef& beam, const sim::ResultBody& result, const BodyModel& model) {
  double out = std::sqrt(std::max(0.0, result.section.area) / std::numbers::pi);
  for (const auto& loop : result.section.outline)
    for (const Eigen::Vector2d& corner : loop) out = std::max(out, corner.norm());
  if (!beam.axis)
    for (const glm::dvec3& v : model.mesh.positions) out = std::max(out, std::hypot(v.y, v.z));
  return out;
}

// Twist moves what lies beside a beam's axis, which no place on the axis tells: rotations of the middle and the tip against the root.
// metres: what their vertices may be off.
void add_twist(std::vector<Witness>& out, const sim::BodyDef& body, const sim::ResultBody& result, const BodyModel& model, double metres) {
  const auto* beam = std::get_if<sim::BeamDef>(&body.kind);
  const double radius = beam ? girth(*beam, result, model) : 0.0;
  if (!(radius > 0.0)) return;
  for (const char* place : {"middle of the picture", "tip"}) {
    Witness w;
    w.output.of = {body.name, place};
    w.output.line = body.line;
    w.output.quantity = sim::Quantity::rotation;
    w.output.relative_to = sim::FrameRef{body.name, "root"};
    w.output.name = fmt::format("{}twist of {}.{})", witness_prefix, body.name, place);
    w.allowed = metres / radius;
    out.push_back(w);
  }
}

// All that is asked of the simulation; frames that it needs are added to the scene.
std::vector<Witness> witnesses(sim::Scene& scene, const Animation& animation, bool pixels, double allowed) {
  std::vector<Witness> out;
  const sim::Results& results = *animation.results;
  const std::vector<BodySight> sight = sights(animation);
  for (size_t b = 0; b < results.bodies.size(); ++b) {
    const auto body =
        std::find_if(scene.bodies.begin(), scene.bodies.end(), [&](const sim::BodyDef& d) { return d.name == results.bodies[b].name; });
    if (body == scene.bodies.end() || !animation.bodies[b].visible) continue;
    if (pixels && sight[b].per_metre <= 0.0) continue;  // never seen
    const double metres = pixels ? allowed / sight[b].per_metre : allowed;
    const bool elastic = animation.bodies[b].flexible, exaggerated = elastic && sight[b].scale > 1.0;
    for (const std::string& place : places_of(*body, results.bodies[b], animation.bodies[b])) {
      Witness w;
      w.output.of = {body->name, place};
      w.output.line = body->line;
      w.output.quantity = sim::Quantity::position;
      w.output.name = fmt::format("{}{}{}{})", witness_prefix, body->name, place.empty() ? "" : ".", place);
      w.allowed = exaggerated ? 0.5 * metres : metres;
      out.push_back(w);
      if (!exaggerated) continue;
      w.output.quantity = sim::Quantity::displacement;
      w.output.name = fmt::format("{}deflection of {}{}{})", witness_prefix, body->name, place.empty() ? "" : ".", place);
      w.allowed = 0.5 * metres / (sight[b].scale - 1.0);
      out.push_back(w);
    }
    if (elastic) add_twist(out, *body, results.bodies[b], animation.bodies[b], exaggerated ? 0.5 * metres / sight[b].scale : metres);
  }
  return out;
}

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
sim::Results pilot_run(const sim::Scene& as_given, int every, const sim::SimulateOptions& options) {
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
      return sim::run_judged(scene, o, counts_for_scale).results;
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
};

WayShares way_shares(const Animation& animation, const sim::Scene& scene, bool pixels) {
  const auto in_unit = [&](const VertexDistance& d) { return pixels ? d.pixels : d.metres; };
  WayShares out;
  const MapErrors map = map_errors(animation, &scene, pictures_looked_at);
  out.map = in_unit(map.largest);
  if (map.largest.picture >= 0) out.map_body = animation.results->bodies[map.largest.body].name;
  out.samples = in_unit(sample_errors(animation, 4 * pictures_looked_at));
  out.raster = in_unit(raster_errors(animation, 2));
  if (!map.unknown.empty())
    out.doubt = fmt::format("the error of the kernel map of '{}' is not known: too few nodes", fmt::join(map.unknown, "', '"));
  return out;
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

bool is_witness(const std::string& column) { return column.starts_with(witness_prefix); }

// What the simulation is asked for: shares of the largest motion. An output that may be so many metres off has the size that makes them so.
struct Question {
  sim::Scene scene;
  std::vector<Witness> places;
  double accuracy = coarsest;
};

Question make_question(const sim::Scene& plain, const Animation& animation, bool pixels, double for_simulation) {
  Question out;
  out.scene = plain;
  out.places = witnesses(out.scene, animation, pixels, for_simulation / std::sqrt(2.0));
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

void drop_witnesses(sim::Results& results) {
  std::erase_if(results.outputs, [](const sim::ResultOutput& out) { return is_witness(out.column); });
  for (sim::ResultOutput& out : results.outputs) out.size = 0.0;
}

// found: what the search ended with.
sim::Results answer(const Question& question, const sim::SimulateOptions& options, const sim::SettingsMemory* memory,
                    const std::string& words, const std::shared_ptr<sim::RememberedSettings>& found) {
  sim::SettingsMemory own;
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
  const sim::Results pilot = pilot_run(plain, every, options);
  Animation first = make_animation(pilot, settings, &plain);
  WayShares way = way_shares(first, plain, asked.pixels);
  if (every > 1) {
    const VertexDistance between = thinned_errors(first, every);
    way.samples = asked.pixels ? between.pixels : between.metres;
  }
  std::vector<std::string> chosen;
  if (const int factor = finer_samples(way.samples, asked.value); factor > 1) {
    plain.simulation.output_rate *= factor;
    way.samples /= static_cast<double>(factor) * factor;
    chosen.push_back(fmt::format("output_rate {:g}", plain.simulation.output_rate));
  }
  const double for_simulation = std::max(least_for_simulation * asked.value, asked.value - way.map - way.samples - way.raster);
  sim::SimulateOptions o = options;
  o.tolerance.reset();
  o.accuracy.reset();
  const auto found = std::make_shared<sim::RememberedSettings>();
  Question question = make_question(plain, first, asked.pixels, for_simulation);
  sim::Results results = answer(question, o, memory, asked.words, found);
  Animation drawn = make_animation(results, settings, &plain);
  for (int more = 0; more < most_questions - 1; ++more) {
    // The pilot may have had other effects, so that deformations are exaggerated more or less than it told.
    Question next = make_question(plain, drawn, asked.pixels, for_simulation);
    if (!asks_for_more(next, question, results.statistics.error_estimate > question.accuracy)) break;
    question = std::move(next);
    results = answer(question, o, memory, asked.words, found);
    drawn = make_animation(results, settings, &plain);
  }

  // Judged with the nodes and cameras of the run itself.
  const double accuracy = question.accuracy, unit = for_simulation / accuracy;
  WayShares last = way_shares(drawn, plain, asked.pixels);
  last.samples = std::max(last.samples, way.samples);
  const double others = std::max(0.0, results.statistics.error_estimate) * unit + last.map + last.raster;
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
  double simulated = 0.0;
  if (!s.accuracy) {
    // No search came to an end: the scene as it stands, of which only the error of time is known.
    s.accuracy.emplace();
    s.accuracy->asked = accuracy;
    s.accuracy->time = std::max(0.0, s.error_estimate);
    shares.doubt = "no setting was found, so that only the error of the time integration is known";
  }
  sim::AccuracyStatement& a = *s.accuracy;
  simulated = std::max(0.0, s.error_estimate) * unit;
  shares.time = a.time * unit;
  shares.space = a.space * unit;
  shares.effects = a.effects * unit;
  shares.total = simulated + shares.map + shares.samples + shares.raster;
  if (simulated >= shares.map && is_witness(a.column)) {
    const std::string column = a.column.substr(a.column.find('(') + 1);
    shares.body = column.substr(0, column.find(')'));
  }
  s.notes = in_pictures_words(s.notes);
  a.chosen.insert(a.chosen.end(), chosen.begin(), chosen.end());
  a.search_cpu = sim::cpu_seconds() - start - s.cpu_seconds;
  if (!(shares.total <= shares.allowed)) {
    std::string advice = "ask for less";
    if (shares.map > 0.5 * shares.allowed)
      advice = fmt::format(
          "the error of the kernel map of '{}' alone is {}: it needs more nodes, another 'scheme', or its own shape functions "
          "(flexframe reduce)",
          last.map_body, distance_words(shares.map, shares.unit));
    s.notes.warn("", fmt::format("the pictures may miss the requested {}: the estimated error is {}; {}", asked.words,
                                 distance_words(shares.total, shares.unit), advice));
  }
  if (!shares.doubt.empty()) s.notes.warn("", fmt::format("the pictures may miss the requested {}: {}", asked.words, shares.doubt));
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
