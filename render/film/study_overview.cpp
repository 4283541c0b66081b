#include "render/film/study_overview.h"

#include "render/draw/renderer.h"
#include "render/film/animation.h"
#include "render/film/flat.h"
#include "render/film/picture_accuracy.h"
#include "render/film/study_plan.h"
#include "render/film/vertex_errors.h"
#include "render/frame/layout.h"
#include "render/image/canvas.h"
#include "render/image/text.h"
#include "sim/base/cpu_clock.h"
#include "sim/base/words.h"
#include "sim/run/run_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>

namespace flexframe::film {
namespace {

constexpr double half_pixel = 0.5;
constexpr int pictures_compared = 60;
// Of the time allowed, for the reference; and how much longer a run may take than the one of ten times its tolerance did.
constexpr double share_of_reference = 0.45, usual_growth = 3.0;

struct TooLongRun {};

// What a point keeps: its results for the pictures.
struct Made {
  OverviewPoint point;
  std::shared_ptr<sim::Results> results;
};

class Runner {
 public:
  Runner(const OverviewOptions& options) : options_(options), start_(sim::cpu_seconds()) {}
  double spent() const { return sim::cpu_seconds() - start_; }
  // None where it fails or takes longer than `seconds`.
  std::shared_ptr<sim::Results> run(const sim::Scene& scene, double seconds, bool& too_long) const {
    sim::SimulateOptions o;
    o.estimate_error = o.check_effects = false;
    const double begin = sim::cpu_seconds();
    o.progress = [&](double) {
      if (options_.progress) options_.progress(std::min(1.0, spent() / options_.seconds));
      if (sim::cpu_seconds() - begin > seconds) throw TooLongRun{};
    };
    too_long = false;
    try {
      return std::make_shared<sim::Results>(sim::run_scene(scene, o));
    } catch (const TooLongRun&) {
      too_long = true;
    } catch (const sim::SimulationError&) {
    } catch (const sim::InputError&) {}
    return nullptr;
  }

 private:
  const OverviewOptions& options_;
  double start_;
};

bool undamped_beams(const sim::Scene& scene) {
  bool any = false;
  for (const sim::BodyDef& b : scene.bodies)
    if (const auto* beam = std::get_if<sim::BeamDef>(&b.kind)) {
      any = true;
      if (!beam->damping.ratio.empty() || beam->damping.mass != 0.0 || beam->damping.stiffness != 0.0) return false;
    }
  const bool touches = std::any_of(scene.joints.begin(), scene.joints.end(), [](const sim::JointDef& j) { return j.friction || j.stop; });
  return any && !touches;
}

// "1e-6".
std::string power_words(double tolerance) {
  const double power = std::log10(tolerance), whole = std::round(power);
  return std::abs(power - whole) < 1e-9 ? fmt::format("1e{:.0f}", whole) : fmt::format("{:.1e}", tolerance);
}

// Elements or modes of the beams in words: "10 elements", "3/8 elements"; empty: none.
std::string resolution_words(const sim::Scene& scene) {
  std::vector<int> counts;
  std::set<std::string> kinds;
  for (const sim::BodyDef& b : scene.bodies) {
    const auto* beam = std::get_if<sim::BeamDef>(&b.kind);
    if (!beam) continue;
    int n = beam->keep_modes.value_or(beam->elements);
    std::string kind = beam->keep_modes ? "modes" : "elements";
    if (beam->model == sim::BeamModel::mixed) n = beam->volumes, kind = "volumes";
    if (beam->model == sim::BeamModel::modal) {
      n = 0, kind = "eigenforms";
      for (const auto& [direction, numbers] : beam->modes)
        if (!numbers.empty()) n = std::max(n, *std::max_element(numbers.begin(), numbers.end()));
    }
    counts.push_back(n);
    kinds.insert(kind);
  }
  if (counts.empty()) return "";
  std::vector<int> shown = counts;
  std::sort(shown.begin(), shown.end());
  shown.erase(std::unique(shown.begin(), shown.end()), shown.end());
  const std::string numbers =
      shown.size() > 3 ? fmt::format("{} to {}", shown.front(), shown.back()) : fmt::format("{}", fmt::join(shown, "/"));
  const std::string kind = kinds.size() == 1 ? *kinds.begin() : "elements or modes";
  return shown.size() == 1 && kinds.size() == 1 ? sim::how_many(shown.front(), kind) : fmt::format("{} {}", numbers, kind);
}

// The reference: finer until the time is spent. error: in pixels, of the last one by the one before.
struct PictureReference {
  std::shared_ptr<sim::Results> results;
  sim::Scene scene;
  double pixels = 0.0;
  std::string words;
};

std::optional<PictureReference> make_reference(const sim::Scene& scene, const RenderSettings& settings, const Runner& runner,
                                               double seconds) {
  const double from = runner.spent();
  const bool elements = with_elements(scene, 1.0).has_value();  // of beams that the scene has as eigenforms
  const bool follow = undamped_beams(scene) && scene.simulation.method == sim::Method::automatic;
  std::optional<PictureReference> out;
  double factor = elements ? 1.0 : 2.0, tolerance = 1e-7, last = 0.0, factor_made = factor, tolerance_made = tolerance;
  const bool resolves = !resolution_words(scene).empty();
  const auto scene_at = [&](double times, double at) {
    sim::Scene fine = elements ? *with_elements(scene, times) : refined(scene, times, at, follow);
    fine.simulation.tolerance = at;
    if (follow) fine.simulation.method = sim::Method::exponential;
    return fine;
  };
  constexpr int most_levels = 4;
  for (int level = 0; level < most_levels; ++level) {
    const sim::Scene fine = scene_at(factor, tolerance);
    const double left = seconds - (runner.spent() - from);
    if (out && left < usual_growth * last) break;
    bool too_long = false;
    std::shared_ptr<sim::Results> results = runner.run(fine, std::max(0.2, left), too_long);
    if (!results) {
      if (out || tolerance > 1e-4) break;
      // Too dear from the start: something looser is better than nothing.
      tolerance *= 100.0;
      factor = 1.0;
      continue;
    }
    factor_made = factor, tolerance_made = tolerance;
    PictureReference next{results, fine, 0.0, ""};
    last = results->statistics.cpu_seconds;
    next.words = fmt::format("{}{}{}, tolerance {}", elements ? "finite elements, " : "",
                             factor > 1.0 && resolves ? fmt::format("{:g} times the resolution, ", factor) : "", results->statistics.method,
                             power_words(tolerance));
    if (out) {
      const Animation animation = make_animation(*next.results, settings, &fine);
      next.pixels = vertices_apart(animation, *out->results, &out->scene, pictures_compared).pixels;
    } else {
      next.pixels = -1.0;  // not known yet
    }
    out = std::move(next);
    if (out->pixels >= 0.0 && out->pixels < 0.01) break;
    factor = std::min(4.0, factor * 2.0);
    tolerance = std::max(1e-10, 0.1 * tolerance);
  }
  if (out && out->pixels < 0.0) {
    // Nothing finer in its time: what something coarser is off by is more than its own error.
    const sim::Scene coarse = scene_at(0.5 * factor_made, 10.0 * tolerance_made);
    bool too_long = false;
    if (const auto results = runner.run(coarse, std::max(0.5, last), too_long)) {
      const Animation animation = make_animation(*out->results, settings, &out->scene);
      out->pixels = vertices_apart(animation, *results, &coarse, pictures_compared).pixels;
    }
  }
  return out;
}

// A setting whose tolerances are gone down.
struct Ladder {
  sim::Scene scene;
  std::string words, series;  // series: with the method of its first run
  bool done = false;
  double last = 0.0;
};

std::vector<Ladder> ladders_of(const sim::Scene& scene) {
  std::vector<Ladder> out;
  const auto add = [&](double factor, bool follow) {
    Ladder l;
    l.scene = factor == 1.0 && !follow ? scene : refined(scene, factor, 1e-6, follow);
    if (follow) l.scene.simulation.method = sim::Method::exponential;
    l.scene.simulation.accuracy.reset();
    l.scene.simulation.picture_accuracy.reset();
    l.words = resolution_words(l.scene);
    if (std::any_of(out.begin(), out.end(),
                    [&](const Ladder& o) { return o.words == l.words && o.scene.simulation.method == l.scene.simulation.method; }))
      return;
    out.push_back(std::move(l));
  };
  add(1.0, false);
  if (undamped_beams(scene)) add(1.0, true);
  if (!resolution_words(scene).empty()) {
    add(0.5, false);
    add(2.0, false);
    if (undamped_beams(scene)) add(2.0, true);
  }
  for (const double factor : {1.0, 0.5})
    if (std::optional<sim::Scene> elements = with_elements(scene, factor)) {
      elements->simulation.accuracy.reset();
      elements->simulation.picture_accuracy.reset();
      const std::string words = resolution_words(*elements);
      out.push_back({std::move(*elements), words, "", false, 0.0});
    }
  return out;
}

// The film of another run with the cameras, scales and colours of the reference.
Animation like(const Animation& reference, const sim::Results& results, RenderSettings settings, const sim::Scene& scene) {
  settings.scales = reference.scales;
  Animation out = make_animation(results, settings, &scene);
  out.camera = reference.camera;
  out.fit = reference.fit;
  out.points = reference.points;
  out.views = reference.views;
  out.ground = reference.ground;
  out.bounds = reference.bounds;
  out.light = reference.light;
  out.scalar_map = reference.scalar_map;
  out.scalar_bar = reference.scalar_bar;
  out.panels = reference.panels;
  return out;
}

// CPU s of map and drawing of all pictures, from a few of them.
double cost_of_pictures(const Animation& animation, render::Renderer& renderer) {
  PictureMemory memory;
  const int looked = std::min(3, animation.count);
  double start = 0.0;
  for (int i = 0; i <= looked; ++i) {
    if (i == 1) start = sim::process_cpu_seconds();  // the first one opens the renderer
    update_picture(animation, static_cast<int>(static_cast<long long>(i) * (animation.count - 1) / std::max(1, looked)), memory);
    renderer.draw(memory.picture);
  }
  return animation.cpu_setup + (sim::process_cpu_seconds() - start) / looked * animation.count;
}

// The largest way of a vertex over the film, px.
double motion_of(const Animation& animation) {
  double out = 0.0;
  const sim::Results& results = *animation.results;
  const PictureViews views(animation, 0);
  for (size_t b = 0; b < animation.bodies.size(); ++b) {
    const std::vector<glm::dvec3>& vertices = animation.bodies[b].mesh.positions;
    const size_t step = std::max<size_t>(1, vertices.size() / 60);
    for (size_t i = 0; i < vertices.size(); i += step) {
      const auto at = [&](int k) {
        const SamplePlace place = find_sample(results.times, picture_time(animation, k));
        return glm::dvec3(body_pose(results.bodies[b], place) * glm::dvec4(vertices[i], 1.0));
      };
      const glm::dvec3 first = at(0);
      for (const int k : looked_at(animation, pictures_compared)) out = std::max(out, views.apart(first, at(k)));
    }
  }
  return out;
}

// Its error, and where that is below what the truth is known to, this.
double known_pixels(const StudyOverview& o, const OverviewPoint& p) { return std::max(p.pixels, o.reference_pixels); }

void find_front(StudyOverview& o) {
  std::vector<size_t> order(o.points.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return o.points[a].cpu() < o.points[b].cpu(); });
  double best = 1e300;
  for (const size_t i : order)
    if (known_pixels(o, o.points[i]) < 0.9 * best) o.points[i].front = true, best = known_pixels(o, o.points[i]);
  const double own = std::max(0.0, o.reference_pixels);
  for (const size_t i : order)
    if (o.points[i].pixels + own <= half_pixel) {
      o.recommended = static_cast<int>(i);
      return;
    }
  for (const size_t i : order)
    if (o.points[i].front) o.recommended = static_cast<int>(i);
}

// Errors below which pictures are alike, px.
constexpr double floor_of_pictures = 0.02;

// Four points of the front: the cheapest, the recommended, and those between and beyond whose pictures are least like these.
std::vector<int> shown_points(const StudyOverview& o) {
  std::vector<int> front;
  for (size_t i = 0; i < o.points.size(); ++i)
    if (o.points[i].front) front.push_back(static_cast<int>(i));
  std::sort(front.begin(), front.end(), [&](int a, int b) { return o.points[a].cpu() < o.points[b].cpu(); });
  // The cheapest one that a person could take for a picture of the scene.
  while (front.size() > 4 && o.points[front.front()].pixels > 0.2 * o.motion_pixels) front.erase(front.begin());
  std::set<int> chosen;
  const auto take = [&](size_t at) { chosen.insert(static_cast<int>(at)); };
  if (front.empty()) return {};
  take(0);
  const auto recommended = std::find(front.begin(), front.end(), o.recommended);
  if (recommended != front.end()) take(static_cast<size_t>(recommended - front.begin()));
  // The others where their pictures are least like those taken: by the largest gap in errors.
  const auto error = [&](int at) { return std::log10(std::max(floor_of_pictures, o.points[static_cast<size_t>(at)].pixels)); };
  const auto gap_of = [&](size_t k) {
    double gap = 1e300;
    for (const int c : chosen) gap = std::min(gap, std::abs(error(front[k]) - error(front[static_cast<size_t>(c)])));
    return gap;
  };
  while (chosen.size() < std::min<size_t>(4, front.size())) {
    size_t best = 0;
    for (size_t k = 1; k < front.size(); ++k)
      if (gap_of(k) > gap_of(best)) best = k;
    if (gap_of(best) <= 0.0) break;
    take(best);
  }
  std::vector<int> out;
  out.reserve(chosen.size());
  for (const int at : chosen) out.push_back(front[static_cast<size_t>(at)]);
  return out;
}

// ---- The figure -------------------------------------------------------------------------------------------------------------------

constexpr int width = 1600, plot_height = 610, column = 384, row = 216, gap = 12, margin = 14, caption = 46;

std::string seconds_words(double s) {
  return s < 0.995 ? fmt::format("{:.2g} s", s) : s < 9.95 ? fmt::format("{:.1f} s", s) : fmt::format("{:.0f} s", s);
}
std::string pixels_words(double p) { return p < 0.01 ? "< 0.01 px" : p < 9.95 ? fmt::format("{:.2g} px", p) : fmt::format("{:.0f} px", p); }

// With what the map and the truth are off by.
double whole_pixels(const StudyOverview& o, const OverviewPoint& p) { return p.pixels + o.map_pixels + std::max(0.0, o.reference_pixels); }

// Whether what differs between points is seen on a logarithmic axis of the whole cost; else points stand by what the simulation takes, and
// the axis is marked with the whole cost there.
bool whole_cost_tells(const StudyOverview& o) {
  double low = 1e300, high = 0.0;
  for (const OverviewPoint& p : o.points) low = std::min(low, p.cpu()), high = std::max(high, p.cpu());
  return high > 3.0 * low;
}

// "below half a pixel" in its ground (x, y, width, height), where the fewest of the lines from `first` on run.
void write_below_half(FlatDrawing& d, size_t first, const glm::dvec4& ground) {
  constexpr double wide = 140.0, high = 26.0;
  const auto in_the_way = [&](double x) {
    int out = 0;
    for (size_t k = first; k < d.strokes.size(); ++k)
      for (size_t i = 1; i < d.strokes[k].points.size(); ++i)
        for (int step = 0; step <= 50; ++step) {
          const glm::dvec2 at = glm::mix(d.strokes[k].points[i - 1], d.strokes[k].points[i], 0.02 * step);
          out += at.x > x && at.x < x + wide && at.y > ground.y && at.y < ground.y + high;
        }
    return out;
  };
  double best = ground.x + ground.z - wide - 8.0;
  for (const double x : {ground.x + 0.5 * (ground.z - wide), ground.x + 8.0})
    if (in_the_way(x) < in_the_way(best)) best = x;
  d.words.push_back({{best, ground.y + 20.0}, "below half a pixel", 15, {0.16f, 0.48f, 0.25f}, FlatAnchor::left});
}

FlatDrawing plot(const StudyOverview& o, const std::vector<int>& shown) {
  const double floor = 1e-3;  // of what is drawn, px
  const bool whole = whole_cost_tells(o);
  const double drawing = o.points.front().cpu_pictures;  // the same for all
  const auto cost = [&](const OverviewPoint& p) { return std::max(1e-4, whole ? p.cpu() : p.cpu_run); };
  const auto error = [&](const OverviewPoint& p) { return std::max(floor, known_pixels(o, p)); };
  double x0 = 1e300, x1 = 0.0, y0 = half_pixel, y1 = half_pixel;
  for (const OverviewPoint& p : o.points) {
    x0 = std::min(x0, cost(p)), x1 = std::max(x1, cost(p));
    y0 = std::min(y0, error(p)), y1 = std::max(y1, std::min(error(p), 2.0 * o.motion_pixels));
  }
  FlatDrawing d;
  d.width = 1060, d.height = plot_height;
  const FlatAxis x = flat_axis(x0, x1, false), y = flat_axis(y0, y1, false);
  const double left = 84, top = 20, right = 92, bottom = whole ? 62 : 82, w = d.width - left - right, h = d.height - top - bottom;
  const auto at = [&](double px, double py) { return glm::dvec2(left + w * x.at(px), top + h * (1.0 - std::clamp(y.at(py), 0.0, 1.0))); };
  // Below half a pixel: nobody sees it.
  const double edge = at(x0, half_pixel).y;
  d.fill_box(left, edge, w, top + h - edge, glm::vec3(0.90f, 0.96f, 0.91f));
  for (const double t : flat_ticks(x)) {
    d.strokes.push_back({{{left + w * x.at(t), top}, {left + w * x.at(t), top + h}}, 1.0, flat_faint, 1.0f, 0.0});
    const glm::dvec2 below{left + w * x.at(t), top + h + 22};
    d.words.push_back({below, whole ? flat_tick_text(t) : fmt::format("{:.4g}", t + drawing), 15, flat_ink, FlatAnchor::middle});
    if (!whole) d.words.push_back({below + glm::dvec2(0, 19), flat_tick_text(t), 14, flat_grey, FlatAnchor::middle});
  }
  for (const double t : flat_ticks(y)) {
    d.strokes.push_back({{{left, at(x0, t).y}, {left + w, at(x0, t).y}}, 1.0, flat_faint, 1.0f, 0.0});
    d.words.push_back({{left - 8, at(x0, t).y + 5}, flat_tick_text(t), 15, flat_ink, FlatAnchor::right});
    const double percent = 100.0 * t / o.motion_pixels;
    d.words.push_back({{left + w + 8, at(x0, t).y + 5}, fmt::format("{:.2g} %", percent), 15, flat_grey, FlatAnchor::left});
  }
  d.words.push_back({{d.width - 4.0, top - 5}, "of the motion", 13, flat_grey, FlatAnchor::right});
  d.strokes.push_back({{{left, edge}, {left + w, edge}}, 2.0, {0.20f, 0.58f, 0.30f}, 1.0f, 7.0});
  if (o.reference_pixels > 0.0 && y.at(o.reference_pixels) > 0.0 && y.at(o.reference_pixels) < 1.0) {
    const double below = at(x0, o.reference_pixels).y;
    d.strokes.push_back({{{left, below}, {left + w, below}}, 1.2, flat_grey, 1.0f, 3.0});
    d.words.push_back({{left + 8, below + 17}, "the truth is known no better", 14, flat_grey, FlatAnchor::left});
  }
  d.strokes.push_back({{{left, top}, {left, top + h}, {left + w, top + h}}, 1.4, flat_ink, 1.0f, 0.0});
  const std::string title =
      whole ? "CPU seconds: simulation, map and drawing"
            : fmt::format("CPU seconds: simulation, map and drawing (these two {}); grey: of the simulation", seconds_words(drawing));
  d.words.push_back({{left + 0.5 * w, d.height - 14.0}, title, 16, flat_ink, FlatAnchor::middle});
  d.words.push_back({{22, top + 0.5 * h}, "largest error of a vertex, pixels", 16, flat_ink, FlatAnchor::middle, false, true});
  // The front as a staircase.
  std::vector<const OverviewPoint*> front;
  for (const OverviewPoint& p : o.points)
    if (p.front) front.push_back(&p);
  std::sort(front.begin(), front.end(), [&](const auto* a, const auto* b) { return cost(*a) < cost(*b); });
  const size_t first_line = d.strokes.size();
  FlatStroke stairs{{}, 7.0, flat_faint * 0.93f, 1.0f, 0.0};
  for (size_t k = 0; k < front.size(); ++k) {
    if (k > 0) stairs.points.push_back(at(cost(*front[k]), error(*front[k - 1])));
    stairs.points.push_back(at(cost(*front[k]), error(*front[k])));
  }
  if (stairs.points.size() > 1) d.strokes.push_back(stairs);
  std::map<std::string, size_t> series;
  for (const OverviewPoint& p : o.points) series.try_emplace(p.series, series.size());
  for (const auto& [name, index] : series) {
    std::vector<const OverviewPoint*> own;
    for (const OverviewPoint& p : o.points)
      if (p.series == name) own.push_back(&p);
    const glm::vec3 color = flat_palette[index % flat_palette.size()];
    FlatStroke line{{}, 1.6, color, 0.6f, 0.0};
    for (const OverviewPoint* p : own) {
      line.points.push_back(at(cost(*p), error(*p)));
      d.discs.push_back({line.points.back(), p->front ? 6.0 : 4.0, color, p->pixels < std::max(floor, o.reference_pixels)});
    }
    if (line.points.size() > 1) d.strokes.push_back(line);
  }
  write_below_half(d, first_line, {left, edge, w, top + h - edge});
  // The pictures' letters, each beside its point where no other letter stands, and the recommended point.
  std::vector<glm::dvec2> letters;
  for (size_t k = 0; k < shown.size(); ++k) {
    const OverviewPoint& p = o.points[static_cast<size_t>(shown[k])];
    const glm::dvec2 c = at(cost(p), error(p));
    constexpr double apart = 20.0;  // a letter's size
    const glm::dvec2 beside[] = {{10, -9}, {10, 26}, {-26, 26}, {-26, -9}};
    const auto clear = [&](const glm::dvec2& way) {
      return std::all_of(letters.begin(), letters.end(), [&](const glm::dvec2& other) { return glm::distance(other, c + way) >= apart; });
    };
    const auto free = std::find_if(std::begin(beside), std::end(beside), clear);
    letters.push_back(c + (free == std::end(beside) ? beside[0] : *free));
    d.words.push_back({letters.back(), std::string(1, static_cast<char>('A' + k)), 20, flat_ink, FlatAnchor::left, true});
  }
  if (o.recommended >= 0) {
    const OverviewPoint& p = o.points[static_cast<size_t>(o.recommended)];
    const glm::dvec2 c = at(cost(p), error(p));
    FlatStroke ring{{}, 2.6, {0.80f, 0.15f, 0.10f}, 1.0f, 0.0};
    for (int k = 0; k <= 40; ++k) ring.points.emplace_back(c.x + 12 * std::cos(0.1571 * k), c.y + 12 * std::sin(0.1571 * k));
    d.strokes.push_back(ring);
  }
  return d;
}

void paste(const render::Image& from, render::Image& to, int x, int y) {
  for (int r = 0; r < from.height && y + r < to.height; ++r)
    for (int c = 0; c < from.width && x + c < to.width; ++c)
      for (int k = 0; k < 3; ++k)
        to.pixels[(static_cast<size_t>(y + r) * to.width + x + c) * 3 + k] =
            from.pixels[(static_cast<size_t>(r) * from.width + c) * from.channels + std::min(k, from.channels - 1)];
}

// So many source pixels around a place, enlarged: the true picture faded, and in red what the other has elsewhere.
render::Image difference(const render::Image& truth, const render::Image& other, const glm::dvec2& middle, double enlarge) {
  render::Image out = render::make_image(column, row, 3, 255);
  for (int y = 0; y < row; ++y)
    for (int x = 0; x < column; ++x) {
      const int sx = static_cast<int>(std::floor(middle.x + (x - 0.5 * column) / enlarge)),
                sy = static_cast<int>(std::floor(middle.y + (y - 0.5 * row) / enlarge));
      if (sx < 0 || sy < 0 || sx >= truth.width || sy >= truth.height) continue;
      const size_t at = (static_cast<size_t>(sy) * truth.width + sx) * truth.channels;
      int apart = 0;
      double grey = 0.0;
      for (int k = 0; k < 3; ++k) {
        apart = std::max(apart, std::abs(int(truth.pixels[at + k]) - int(other.pixels[at + k])));
        grey += truth.pixels[at + k] / 3.0;
      }
      const double share = std::min(1.0, apart / 96.0), pale = 0.45 * grey + 0.55 * 255.0;
      const double color[3] = {pale + share * (210.0 - pale), pale * (1.0 - share) + share * 25.0, pale * (1.0 - share) + share * 20.0};
      for (int k = 0; k < 3; ++k)
        out.pixels[(static_cast<size_t>(y) * column + x) * 3 + k] = static_cast<std::uint8_t>(std::lround(color[k]));
    }
  return out;
}

// Words in lines that fit, downwards.
struct TextColumn {
  render::Image& image;
  double x, y, wide;

  void write(const std::string& text, double size, const glm::vec3& color, render::Weight weight = render::Weight::regular) {
    std::string line;
    const auto flush = [&] {
      render::draw_text(image, {x, y}, line, size, color, weight);
      y += 1.35 * size;
      line.clear();
    };
    for (size_t from = 0; from < text.size();) {
      const size_t end = std::min(text.find(' ', from), text.size());
      const std::string word = text.substr(from, end - from);
      if (!line.empty() && render::text_width(line + " " + word, size, weight) > wide) flush();
      line += (line.empty() ? "" : " ") + word;
      from = end + 1;
    }
    flush();
  }
};

void words_beside(render::Image& image, const StudyOverview& o) {
  constexpr double from = 1084.0;
  TextColumn text{image, from, 112.0, width - from - margin};
  const glm::vec3 red{0.80f, 0.15f, 0.10f};
  if (o.recommended >= 0) {
    const OverviewPoint& p = o.points[static_cast<size_t>(o.recommended)];
    const bool kept = p.pixels + std::max(0.0, o.reference_pixels) <= half_pixel;
    const std::string run = pixels_words(p.pixels), whole = pixels_words(whole_pixels(o, p));
    const std::string with_map = run == whole ? "" : fmt::format(" ({} with map and truth)", whole);
    text.write(kept ? "Recommended" : "No simulation here keeps half a pixel; nearest", 19, red, render::Weight::bold);
    text.y += 8.0;
    text.write(p.name, 23, flat_ink, render::Weight::bold);
    text.y += 6.0;
    text.write(fmt::format("{} off at most{}: {:.2g}\u00a0% of the motion", run, with_map, p.percent), 18, flat_ink);
    text.write(fmt::format("{} of CPU to simulate, {} for map and drawing of {} pictures", seconds_words(p.cpu_run),
                           seconds_words(p.cpu_pictures), o.pictures),
               18, flat_ink);
    if (o.map_pixels > 0.1 * half_pixel) {
      text.y += 6.0;
      text.write(fmt::format("The map from the nodes of '{}' to its vertices is {} off besides, in every setting", o.map_body,
                             pixels_words(o.map_pixels)),
                 18, o.map_pixels > half_pixel ? red : flat_ink);
    }
    text.y += 14.0;
  }
  std::map<std::string, size_t> series;
  for (const OverviewPoint& p : o.points) series.try_emplace(p.series, series.size());
  for (const auto& [name, index] : series) {
    render::fill_disc(image, text.x + 7, text.y - 5, 6, flat_palette[index % flat_palette.size()]);
    render::draw_text(image, {text.x + 22, text.y}, render::fit_text(name, 17, text.wide - 22), 17, flat_ink);
    text.y += 25;
  }
  text.y += 4;
  render::fill_rectangle(image, {text.x, text.y - 9, 15, 7}, flat_faint * 0.93f);
  render::draw_text(image, {text.x + 22, text.y}, "front: nothing cheaper is as accurate", 17, flat_ink);
  text.y += 34;
  text.write(fmt::format("Along each line the tolerance falls. Truth: {}, itself off by {}.", o.reference,
                         o.reference_pixels >= 0.0 ? pixels_words(o.reference_pixels) : "an unknown distance"),
             15, flat_grey);
  for (const std::string& words : o.left_out) {
    text.y += 4.0;
    text.write(words, 15, flat_grey);
  }
}

// What the pictures of the figure are made of.
struct Pictured {
  const Animation& truth;
  const std::vector<Made>& made;
  const RenderSettings& settings;
  const sim::Scene& scene;
};

void draw_figure(StudyOverview& o, const std::string& title, const Pictured& of, const std::vector<int>& shown,
                 render::Renderer& renderer) {
  const Animation& truth = of.truth;
  const int height = 66 + plot_height + 2 * (row + gap) + caption + margin;
  o.figure = render::make_image(width, height, 3, 255);
  render::draw_text(o.figure, {margin, 42}, render::fit_text(title, 30, width - 2.0 * margin, render::Weight::bold), 30, flat_ink,
                    render::Weight::bold);
  paste(flat_image(plot(o, shown)), o.figure, 0, 62);
  words_beside(o.figure, o);
  // One moment for all pictures: where the first of them is farthest off.
  if (shown.empty()) return;
  const auto results_of = [&](int i) -> const sim::Results& { return *of.made[static_cast<size_t>(i)].results; };
  const VertexDistance first = vertices_apart(truth, results_of(shown.front()), &of.scene, pictures_compared);
  const int moment = std::max(0, first.picture);
  PictureMemory memory;
  const auto draw = [&](const Animation& animation) {
    update_picture(animation, moment, memory);
    aim_camera(truth, moment, truth.camera, memory.picture);
    return renderer.draw(memory.picture);
  };
  const render::Image right = draw(truth);
  glm::dvec2 middle(0.5 * right.width, 0.5 * right.height);
  const render::Layout layout = render::make_layout(memory.picture);
  render::project(render::make_view(memory.picture.camera, layout.scene, truth.bounds), first.world, middle);
  const int top = 66 + plot_height + caption;
  const bool kept =
      o.recommended >= 0 && o.points[static_cast<size_t>(o.recommended)].pixels + std::max(0.0, o.reference_pixels) <= half_pixel;
  const char* const mark = kept ? ", recommended" : ", nearest";
  for (size_t k = 0; k < shown.size(); ++k) {
    const OverviewPoint& p = o.points[static_cast<size_t>(shown[k])];
    const int x = margin + static_cast<int>(k) * (column + gap);
    const Animation film = like(truth, results_of(shown[k]), of.settings, of.scene);
    const render::Image picture = draw(film);
    const double fitting = std::max(static_cast<double>(picture.width) / column, static_cast<double>(picture.height) / row);
    render::Image cell = render::make_image(column, row, 3, 255);
    const render::Image small =
        render::reduce_image(picture, static_cast<int>(picture.width / fitting), static_cast<int>(picture.height / fitting));
    paste(small, cell, (column - small.width) / 2, (row - small.height) / 2);
    paste(cell, o.figure, x, top);
    const double enlarge = 3.0;
    paste(difference(right, picture, middle, enlarge), o.figure, x, top + row + gap);
    for (const int y : {top, top + row + gap})
      render::draw_frame(o.figure, {double(x), double(y), double(column), double(row)}, 1.0, flat_grey);
    const bool best = shown[k] == o.recommended;
    render::draw_text(o.figure, {double(x), top - 26.0},
                      render::fit_text(fmt::format("{}  {}", static_cast<char>('A' + k), p.name), 17, column, render::Weight::bold), 17,
                      best ? glm::vec3(0.80f, 0.15f, 0.10f) : flat_ink, render::Weight::bold);
    render::draw_text(o.figure, {double(x), top - 7.0},
                      fmt::format("{} off at most, {}{}", pixels_words(known_pixels(o, p)), seconds_words(p.cpu_run), best ? mark : ""), 15,
                      flat_ink);
    if (k > 0) continue;
    const glm::dvec2 at{x + 8.0, top + 2.0 * row + gap - 9.0};
    const std::string words = fmt::format("3 times, t = {:.3g} s: red is where the truth differs", picture_time(truth, moment));
    render::draw_text_rim(o.figure, at, words, 13, glm::vec3(1.0f));
    render::draw_text(o.figure, at, words, 13, flat_ink);
  }
}

}  // namespace

std::optional<StudyOverview> study_overview(const sim::Scene& given, const OverviewOptions& options, std::string& why) try {
  const RenderSettings settings = parse_render_settings(given.text, given.file.string());
  sim::Scene scene = given;
  scene.simulation.accuracy.reset();
  scene.simulation.picture_accuracy.reset();
  const Runner runner(options);
  const std::optional<PictureReference> reference = make_reference(scene, settings, runner, share_of_reference * options.seconds);
  if (!reference) {
    why = "no run for the truth came to an end in its time";
    return std::nullopt;
  }
  StudyOverview out;
  out.reference = reference->words;
  out.reference_pixels = reference->pixels;
  const Animation truth = make_animation(*reference->results, settings, &reference->scene);
  out.pictures = truth.count;
  out.motion_pixels = std::max(1.0, motion_of(truth));
  render::Renderer renderer;
  const double drawing = cost_of_pictures(truth, renderer);

  // Down the ladders by turns, the loosest first, as long as there is time.
  std::vector<Made> made;
  std::vector<Ladder> ladders = ladders_of(scene);
  int untried = 0;
  for (const double tolerance : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8})
    for (Ladder& ladder : ladders) {
      if (ladder.done) continue;
      const double left = 0.9 * options.seconds - runner.spent();
      if (left < usual_growth * ladder.last || left <= 0.0) {
        ++untried;
        continue;
      }
      sim::Scene one = ladder.scene;
      one.simulation.tolerance = tolerance;
      bool too_long = false;
      std::shared_ptr<sim::Results> results = runner.run(one, left, too_long);
      ladder.done = too_long;
      untried += too_long;
      if (!results) continue;
      const sim::SolverStatistics& s = results->statistics;
      ladder.last = s.cpu_seconds;
      Made m;
      const std::string own = ladder.words.empty() ? s.method : fmt::format("{}, {}", s.method, ladder.words);
      if (ladder.series.empty()) ladder.series = own;
      m.point.series = ladder.series;
      m.point.name = fmt::format("{}, {}", own, power_words(tolerance));
      m.point.tolerance = tolerance;
      m.point.cpu_run = s.cpu_seconds;
      m.point.cpu_pictures = drawing;
      m.point.pixels = vertices_apart(truth, *results, &one, pictures_compared).pixels;
      m.point.percent = 100.0 * m.point.pixels / out.motion_pixels;
      m.results = results;
      out.points.push_back(m.point);
      made.push_back(std::move(m));
    }
  if (out.points.empty()) {
    why = "no run came to an end in its time";
    return std::nullopt;
  }
  if (untried > 0)
    out.left_out.push_back(fmt::format("{} further settings were left out: more than {:.0f} CPU s.", untried, options.seconds));
  find_front(out);
  const MapErrors map = map_errors(truth, &reference->scene, pictures_compared);
  out.map_pixels = map.largest.pixels;
  out.map_body = map.largest.picture < 0 ? "" : reference->results->bodies[map.largest.body].name;
  if (!map.unknown.empty())
    out.left_out.push_back(fmt::format("The error of the map to '{}' is not known.", fmt::join(map.unknown, "', '")));
  const std::string name = scene.title.empty() ? scene.file.stem().string() : scene.title;
  const OverviewPoint& best = out.points[static_cast<size_t>(out.recommended)];
  draw_figure(out,
              fmt::format("{}: right to {} for {} of simulation", name, pixels_words(whole_pixels(out, best)), seconds_words(best.cpu_run)),
              {truth, made, settings, scene}, shown_points(out), renderer);
  return out;
} catch (const sim::InputError& error) {
  why = error.what();
  return std::nullopt;
} catch (const std::runtime_error& error) {
  why = error.what();
  return std::nullopt;
}

}  // namespace flexframe::film
