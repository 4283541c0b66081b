#include "render/film/animation_colors.h"

#include "render/film/overlay.h"
#include "sim/base/notes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::film {

bool shares_of_yield(const std::vector<BodyModel>& bodies) {
  return std::any_of(bodies.begin(), bodies.end(), [](const BodyModel& m) { return m.yield_stress > 0.0; });
}

namespace {

// The upper end of the colours by the largest values of the surveyed moments; a note where a peak is left out.
double upper_end(Animation& animation, const Survey& survey, double& largest, double& at) {
  const ColorRange& range = animation.settings.range;
  // Each moment counts by the time around it: peaks are surveyed more densely.
  std::vector<std::pair<double, double>> values;
  double all = 0.0;
  const std::vector<Survey::Moment>& moments = survey.moments;
  largest = 0.0;
  for (size_t k = 0; k < moments.size(); ++k) {
    const double t = moments[k].t;
    if (range.window && (t < range.window->first || t > range.window->second)) continue;
    const double before = k > 0 ? moments[k - 1].t : t, after = k + 1 < moments.size() ? moments[k + 1].t : t;
    values.emplace_back(moments[k].largest_scalar, std::max(0.5 * (after - before), 1e-300));
    all += values.back().second;
    if (moments[k].largest_scalar > largest) largest = moments[k].largest_scalar, at = t;
  }
  if (values.empty() && range.window)
    throw sim::InputError(fmt::format(
        "[render] color_range.window [{:g}, {:g}] holds no moment of the run, which lasts from {:g} to {:g} s", range.window->first,
        range.window->second, animation.results->times[0], animation.results->times[animation.results->times.size() - 1]));
  std::sort(values.begin(), values.end());
  const double share = range.percentile.value_or(98.0) / 100.0;
  double sum = 0.0, value = largest;
  for (const auto& [v, weight] : values)
    if ((sum += weight) >= share * all * (1.0 - 1e-12)) {
      value = v;
      break;
    }
  // Without a word about it only a short peak far above the rest is left out.
  const bool short_peak = values.size() >= 20 && value > 0.0 && value < 0.5 * largest;
  return range.percentile ? value : short_peak ? value : largest;
}

// Stress in a unit that suits it, or in per cent of the yield stress, with what is left until something yields.
void set_stress_bar(Animation& animation, double reach, double largest, double at) {
  static const std::vector<std::string> labels = {"stress", "Tresca stress", "largest principal stress", "smallest principal stress"};
  const std::string& label = labels[static_cast<size_t>(animation.settings.stress)];
  if (!shares_of_yield(animation.bodies)) {
    const auto [unit, factor] = readable_unit("Pa", reach);
    animation.scalar_bar = {.label = label, .unit = unit, .factor = factor};
    return;
  }
  animation.scalar_bar = {.label = label + " / yield stress", .unit = "%", .factor = 100.0};
  if (largest > 0.0)
    (largest > 1.0 ? animation.warnings : animation.notes)
        .push_back(fmt::format("the smallest safety factor against yielding is {:.3g} at t = {:.4g} s{}", 1.0 / largest, at,
                               largest > 1.0 ? ": something yields, and the motion is not computed for that" : ""));
}

// Whether any body that is seen has what it is to be coloured by.
bool has_values(const Animation& animation, const Survey& survey) {
  if (survey.moments.empty()) return false;
  const double t = survey.moments.front().t;
  for (size_t b = 0; b < animation.bodies.size(); ++b) {
    const BodyModel& model = animation.bodies[b];
    if (!model.visible || model.mesh.triangles.empty()) continue;
    BodyMemory memory;
    ScalarMemory work;
    std::vector<float> scalars;
    if (model.flexible) update_displacement(model, animation.results->bodies[b], find_sample(animation.results->times, t), memory);
    update_scalars({model, *animation.results, b, animation.settings}, t, memory, work, scalars);
    if (!scalars.empty()) return true;
  }
  return false;
}

// What [render] color_by asks of a body, in words.
std::string values_wanted(const RenderSettings& settings) {
  if (settings.color_by == ColorBy::mode)
    return fmt::format("an elastic coordinate {} in which its displacement is linear (color_by = \"mode\")", settings.mode);
  if (settings.color_by == ColorBy::stress)
    return "stress: beams with a section, and bodies with stress modes have it (color_by = \"stress\")";
  if (settings.color_by == ColorBy::velocity) return "a speed: the run has one sample (color_by = \"velocity\")";
  if (settings.color_by == ColorBy::map_error)
    return "an error of its mesh's map that could be told: elastic bodies with a mesh and enough nodes have it (color_by = \"map_error\")";
  return "elastic displacement (color_by = \"strain\")";
}

// Two digits, but no powers of ten: "0.012", "200".
std::string percent_text(double percent) { return percent < 99.5 ? fmt::format("{:.2g}", percent) : fmt::format("{:.0f}", percent); }

// What rounding leaves of a value that is zero, in its unit: positions are held to the last bit of the scene's size, displacements in
// single precision, and a speed is their difference over one sample's spacing.
double rounding_of(const Animation& animation, const Survey& survey) {
  constexpr double eps = std::numeric_limits<double>::epsilon(), coarse = std::numeric_limits<float>::epsilon();
  const auto& times = animation.results->times;
  switch (animation.settings.color_by) {
    case ColorBy::strain:
      return eps;
    case ColorBy::displacement:
    case ColorBy::mode:
      return eps * machine_size(*animation.results, animation.bodies);
    case ColorBy::velocity:
      if (times.size() < 2) return 0.0;
      return (eps * machine_size(*animation.results, animation.bodies) + coarse * survey.largest_displacement) *
             static_cast<double>(times.size() - 1) / (times[times.size() - 1] - times[0]);
    default:
      return 0.0;
  }
}

// Without the effects axial and torsion strains lack what forces along a beam lengthen it by, and torques twist it, where the results do
// not hold it or, the strain of beams without a section, the mesh does not show it. Told where it counts.
void tell_of_left_out_strain(Animation& animation, double largest) {
  sim::Notes notes;
  for (size_t b = 0; b < animation.bodies.size(); ++b) {
    const sim::ResultBody& body = animation.results->bodies[b];
    if (!animation.bodies[b].visible) continue;
    const bool by_section = animation.bodies[b].beam_strain.has_value();
    if (by_section && body.load_strain.size() == 0) {
      for (const std::string& effect : body.unstrained)
        notes.warn(fmt::format("body '{}'", body.name),
                   fmt::format("effect '{}' is off: its colours do not include strain from {}; add \"{}\" to 'effects'", effect,
                               effect == "axial" ? "forces along it" : "torques about it", effect));
    }
    const auto way = std::find(body.unstrained.begin(), body.unstrained.end(), "axial");
    if (by_section || way == body.unstrained.end()) continue;
    const std::string remedy = "add \"axial\" to 'effects'";
    if (body.load_strain.size() == 0) {
      notes.warn(fmt::format("body '{}'", body.name),
                 "effect 'axial' is off: its colours do not include strain from forces along it; " + remedy);
      continue;
    }
    const Eigen::Index stations = body.strain_stations.size(), first = (way - body.unstrained.begin()) * stations;
    const double most = body.load_strain.middleCols(first, stations).cwiseAbs().maxCoeff();
    if (most > 0.01 * largest)
      notes.warn(
          fmt::format("body '{}'", body.name),
          fmt::format("effect 'axial' is off: its colours leave out up to {:.3g} µm/m from forces along it; {}", 1e6 * most, remedy));
  }
  for (std::string& text : notes.texts(sim::Severity::warning)) animation.warnings.push_back(std::move(text));
}

// How much the differences between samples may miss of the largest speed, as a share of it, in the picture that misses most. Of a vibration
// with w h = x from sample to sample (straight between them) the difference over one spacing misses x^2/6 at a sample and x^2/24 midway,
// that over three spacings x^2/2 and 9 x^2/24: half of what lies between them is x^2/6 or more. At the ends, where two of them are
// continued, they miss x^2/3 and 3 x^2, and beside them x^2/6 and x^2/2 or more.
double missed_speed(const Animation& animation, double t) {
  const sim::Results& results = *animation.results;
  const sim::VecX& times = results.times;
  double largest[2] = {0.0, 0.0};
  ScalarMemory work;
  std::vector<float> scalars;
  for (size_t b = 0; b < animation.bodies.size(); ++b) {
    const BodyModel& model = animation.bodies[b];
    if (!model.visible || model.rest.empty()) continue;
    for (const int k : {0, 1}) {
      update_speeds({model, results, b, animation.settings}, t, 1.0 + 2.0 * k, work, scalars);
      for (const float v : scalars) largest[k] = std::max(largest[k], static_cast<double>(v));
    }
  }
  const double spacing = (times[times.size() - 1] - times[0]) / static_cast<double>(times.size() - 1);
  const bool inside = t - 1.5 * spacing >= times[0] && t + 1.5 * spacing <= times[times.size() - 1];
  return largest[0] > 0.0 ? std::abs(largest[0] - largest[1]) * (inside ? 0.5 : 0.25) / largest[0] : 0.0;
}

// The median over moments of large speed: beside an impact the longer difference says nothing.
double missed_speed(const Animation& animation, const Survey& survey) {
  std::vector<double> moments, missed;
  for (const Survey::Moment& m : survey.moments)
    if (m.largest_scalar >= 0.8 * survey.largest_scalar) moments.push_back(m.t);
  const size_t step = 1 + moments.size() / 9;
  for (size_t k = step / 2; k < moments.size(); k += step) missed.push_back(missed_speed(animation, moments[k]));
  if (missed.empty()) return 0.0;
  std::nth_element(missed.begin(), missed.begin() + static_cast<std::ptrdiff_t>(missed.size() / 2), missed.end());
  return missed[missed.size() / 2];
}

// Stress counts what modes leave out of inertia, by accelerations that are differences of samples.
void tell_of_inertia(Animation& animation, const Survey& survey) {
  sim::Notes notes;
  for (size_t b = 0; b < animation.bodies.size(); ++b) {
    const BodyModel& model = animation.bodies[b];
    const sim::ResultBody& body = animation.results->bodies[b];
    if (!model.visible || !model.stress_of_loads) continue;
    const std::string owner = fmt::format("body '{}'", body.name);
    // Half a radian leaves 2 % of a circle's acceleration; beyond half a turn nothing tells how fast it is.
    constexpr double far = 0.5, told = 0.05;
    if (animation.results->times.size() < 3) {
      notes.warn(owner, "a run of fewer than three samples does not tell accelerations: its stress counts weight alone beside its modes");
      continue;
    }
    if (const double turn = turn_between_samples(body); turn > far) {
      notes.warn(owner, fmt::format("turns by {:.2g} rad from one sample to the next: the stress of its inertia is not known from that; a "
                                    "larger output_rate tells it",
                                    turn));
      continue;
    }
    ScalarMemory work;
    double largest = 0.0;
    const double unit = model.shares_of_yield && model.yield_stress > 0.0 ? model.yield_stress : 1.0;
    const size_t step = 1 + survey.moments.size() / 32;
    for (size_t k = 0; k < survey.moments.size(); k += step)
      largest = std::max(largest, doubt_of_inertia({model, *animation.results, b, animation.settings}, survey.moments[k].t, work) / unit);
    if (largest > told * survey.largest_scalar)
      notes.warn(owner, fmt::format("its stress may be off by {} % of the largest: its accelerations are differences from one sample to "
                                    "the next; a larger output_rate sharpens them",
                                    percent_text(100.0 * largest / survey.largest_scalar)));
  }
  for (std::string& text : notes.texts(sim::Severity::warning)) animation.warnings.push_back(std::move(text));
}

}  // namespace

void set_colors(Animation& animation, const Survey& survey) {
  // Nobody means a thousand times the yield stress: that is a stress in Pa.
  if (const auto& asked = animation.settings.color_range;
      asked && animation.settings.color_by == ColorBy::stress && shares_of_yield(animation.bodies) && asked->second > 1e3)
    animation.warnings.push_back(fmt::format(
        "color_range [{:g}, {:g}]: beside a yield stress colours are shares of it, 1 is where something yields; write color_range = [0, 1]",
        asked->first, asked->second));
  double all = survey.largest_scalar, at = 0.0;
  double largest = upper_end(animation, survey, all, at);
  const double rounding = rounding_of(animation, survey);
  if (largest > 0.0 && all <= rounding) {
    const ColorBy by = animation.settings.color_by;
    const auto [name, unit] = by == ColorBy::velocity ? std::pair("speed", "m/s")
                              : by == ColorBy::strain ? std::pair("strain", "m/m")
                                                      : std::pair("displacement", "m");
    animation.notes.push_back(
        fmt::format("no colours: the largest {}, {:.2g} {}, is no more than the rounding of positions", name, all, unit));
    largest = all = 0.0;
  } else if (largest > 0.0 && rounding > 0.01 * largest) {
    animation.warnings.push_back(fmt::format(
        "colours of the speed are uncertain by up to {:.2g} of {:.2g} m/s: they are differences of displacements, which have seven "
        "digits, from one sample to the next; a smaller output_rate keeps more of them",
        rounding, largest));
  }
  render::ScalarMap& map = animation.scalar_map;
  map.colormap = animation.settings.colormap;
  map.lightened = animation.settings.studio;
  map.levels = animation.settings.bands;
  map.isolines = animation.settings.isolines;
  const auto& range = animation.settings.color_range;
  map.upper = range ? range->second : largest;
  map.lower = range ? range->first : animation.settings.range.symmetric || is_signed(animation.settings) ? -largest : 0.0;
  map.logarithmic = animation.settings.range.logarithmic && map.upper > 0.0;
  if (map.logarithmic && !range) map.lower = 1e-3 * map.upper;
  // Values of single precision.
  const double rounded = 1e-6 * (map.upper - map.lower);
  if (survey.highest_scalar > map.upper + rounded) map.above = survey.highest_scalar;
  if (survey.lowest_scalar < map.lower - rounded) map.below = survey.lowest_scalar;
  const ColorBy by = animation.settings.color_by;
  if (by == ColorBy::none || by == ColorBy::body) return;
  if (by != ColorBy::displacement && largest <= 0.0 && !has_values(animation, survey)) {
    animation.warnings.push_back(fmt::format("no body has {}: none is coloured", values_wanted(animation.settings)));
    return;
  }
  if (largest <= 0.0 && !range) {
    if (by == ColorBy::map_error)
      animation.notes.emplace_back(
          "no map moves a mesh: the elements' own shapes have no error of one (color_by = \"map_error\"): none is coloured");
    else if (by != ColorBy::displacement) animation.notes.emplace_back("the values of color_by are 0 at all times: none is coloured");
    return;
  }
  const double reach = std::max(std::abs(animation.scalar_map.lower), std::abs(animation.scalar_map.upper));
  if (by == ColorBy::strain) {
    const bool small = reach < 0.01;
    animation.scalar_bar = {.label = "strain", .unit = small ? "µm/m" : "%", .factor = small ? 1e6 : 100.0};
  } else if (by == ColorBy::stress) {
    set_stress_bar(animation, reach, all, at);
    tell_of_inertia(animation, survey);
  } else {
    const auto [unit, factor] = readable_unit("m", reach);
    const bool velocity = by == ColorBy::velocity;
    animation.scalar_bar = {.label = velocity                   ? "speed"
                                     : by == ColorBy::map_error ? "map error, estimated"
                                     : by == ColorBy::mode      ? fmt::format("displacement by mode {}", animation.settings.mode)
                                                                : "elastic displacement",
                            .unit = velocity ? unit + "/s" : unit,
                            .factor = factor};
  }
  if (by == ColorBy::strain) tell_of_left_out_strain(animation, largest);
  if (by == ColorBy::velocity)
    if (const double missed = missed_speed(animation, survey); missed > 0.01)
      animation.warnings.push_back(
          fmt::format("colours of the speed are differences from one sample to the next and may be off by {} % where it is large: a larger "
                      "output_rate sharpens them",
                      percent_text(100.0 * missed)));
  if (by == ColorBy::map_error) {
    const bool beside =
                   std::any_of(animation.bodies.begin(), animation.bodies.end(), [](const BodyModel&m) { return m.doubt.has_value(); }),
               between =
                   std::any_of(animation.bodies.begin(), animation.bodies.end(), [](const BodyModel&m) { return m.error_bar.has_value(); });
    animation.notes.push_back(fmt::format("the mesh may be off by up to {:.3g} {} (t = {:.4g} s): estimated by {}{}{}",
                                          all * animation.scalar_bar->factor, animation.scalar_bar->unit, at,
                                          between ? "leaving out one node at a time" : "", between && beside ? ", and by " : "",
                                          beside ? "how far it lies beside its finite elements" : ""));
  }
  if (!range && all > largest * (1.0 + 1e-9))
    animation.notes.push_back(fmt::format(
        "colours end at {:.3g} {}; the largest value, {:.3g} {} at t = {:.4g} s, lies above: color_range = \"full\" takes it in",
        largest * animation.scalar_bar->factor, animation.scalar_bar->unit, all * animation.scalar_bar->factor, animation.scalar_bar->unit,
        at));
}

// Bodies whose faces are too coarse to colour them by what their corners have, at the moment when that is largest.
void mark_coarse(Animation& animation, const Survey& survey) {
  if (!animation.scalar_bar || survey.moments.empty()) return;
  const double range = animation.scalar_map.upper - animation.scalar_map.lower;
  const auto most = std::max_element(survey.moments.begin(), survey.moments.end(),
                                     [](const auto& a, const auto& b) { return a.largest_scalar < b.largest_scalar; });
  for (size_t b = 0; b < animation.bodies.size(); ++b) {
    BodyModel& model = animation.bodies[b];
    if (!model.visible || model.mesh.triangles.empty()) continue;
    BodyMemory memory;
    ScalarMemory work;
    work.wanted = true;
    std::vector<float> scalars;
    if (model.flexible) update_displacement(model, animation.results->bodies[b], find_sample(animation.results->times, most->t), memory);
    update_scalars({model, *animation.results, b, animation.settings}, most->t, memory, work, scalars);
    model.by_length = is_coarse(model.mesh.triangles, work.components, range);
  }
}

}  // namespace flexframe::film
