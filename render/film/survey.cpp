#include "render/film/survey.h"

#include "interp/parallel.h"
#include "interp/scalars.h"
#include "interp/watch.h"
#include "render/frame/camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <set>

namespace flexframe::film {
namespace {

constexpr int even_moments = 200, peak_moments = 32;
constexpr double most_looks = 1e6;  // at bodies, to find peaks of what colours them
constexpr int window_moments = 16;  // within the camera's window, which may be shorter than the time between two others
constexpr int moments_of_a_thread = 8;
constexpr size_t turn_moments = 2;    // where a body's turn is measured: a pass over its triangles each
constexpr int support_budget = 6000;  // points of all bodies at one moment

// Vertices furthest in 26 directions, and an even choice of the rest.
std::vector<int> support_of(const render::Mesh& mesh, int most) {
  std::set<int> chosen;
  const int n = static_cast<int>(mesh.positions.size());
  if (n == 0) return {};
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        if (x == 0 && y == 0 && z == 0) continue;
        const glm::dvec3 direction(x, y, z);
        int best = 0;
        for (int i = 1; i < n; ++i)
          if (glm::dot(mesh.positions[i], direction) > glm::dot(mesh.positions[best], direction)) best = i;
        chosen.insert(best);
      }
  const int even = std::min(n, most);
  for (int k = 0; k < even; ++k) chosen.insert(static_cast<int>(static_cast<long long>(k) * n / even));
  return {chosen.begin(), chosen.end()};
}

glm::dvec3 transform(const glm::dmat4& pose, const glm::dvec3& p) { return glm::dvec3(pose * glm::dvec4(p, 1.0)); }

// What is seen of the bodies, undeformed.
std::vector<render::Bounds> boxes_of(const sim::Results& results, const std::vector<BodyModel>& bodies) {
  std::vector<render::Bounds> boxes;
  for (size_t b = 0; b < bodies.size(); ++b) {
    render::Bounds box;
    if (bodies[b].visible)
      for (const glm::dvec3& p : bodies[b].mesh.positions) box.add(p);
    if (bodies[b].visible && box.empty())
      for (const sim::ResultNode& node : results.bodies[b].nodes) box.add(glm::dvec3(node.origin.x(), node.origin.y(), node.origin.z()));
    boxes.push_back(box);
  }
  return boxes;
}

// Samples at which the box of a body reaches farthest in one of 26 directions: pictures may fall between them.
std::set<double> extreme_times(const sim::Results& results, const std::vector<render::Bounds>& boxes) {
  std::array<double, 26> best;
  std::array<Eigen::Index, 26> at{};
  best.fill(-1e300);
  // A body's box moves little from sample to sample: about 40 000 places are enough.
  const Eigen::Index nt = results.times.size(), step = std::max<Eigen::Index>(1, nt * static_cast<Eigen::Index>(boxes.size()) / 40000);
  for (Eigen::Index i = 0; i < nt; i += step)
    for (size_t b = 0; b < boxes.size(); ++b) {
      if (boxes[b].empty()) continue;
      const glm::dmat4 pose = body_pose(results.bodies[b], {i, 0.0});
      const glm::dvec3 middle = transform(pose, boxes[b].centre()), half = 0.5 * (boxes[b].upper - boxes[b].lower);
      for (int d = 0; d < 27; ++d) {
        if (d == 13) continue;
        const glm::dvec3 way = glm::normalize(glm::dvec3(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1));
        const glm::dvec3 local = glm::abs(glm::transpose(glm::dmat3(pose)) * way);
        const double reach = glm::dot(way, middle) + glm::dot(local, half);
        const size_t k = d < 13 ? d : d - 1;
        if (reach <= best[k] + 1e-9 * std::abs(best[k])) continue;
        best[k] = reach;
        at[k] = i;
      }
    }
  std::set<double> times;
  for (size_t k = 0; k < best.size(); ++k)
    if (best[k] > -1e300) times.insert(results.times[at[k]]);
  return times;
}

// The speed of a body about a moment, m/s, by the corners of its box and its nodes: near that of the fastest vertex.
double rough_speed(const sim::Results& results, const sim::ResultBody& body, const render::Bounds& box, double t) {
  const sim::VecX& times = results.times;
  const Eigen::Index n = times.size();
  if (n < 2 || box.empty()) return 0.0;
  const double half = 0.5 * (times[n - 1] - times[0]) / static_cast<double>(n - 1);
  const double t0 = std::max(times[0], t - half), t1 = std::min(times[n - 1], t + half);
  const SamplePlace a = find_sample(times, t0), b = find_sample(times, t1);
  const glm::dmat4 before = body_pose(body, a), after = body_pose(body, b);
  std::vector<glm::dvec3> corners;
  render::append_corners(corners, box);
  double way = 0.0, bent = 0.0;
  for (const glm::dvec3& p : corners) way = std::max(way, glm::length(transform(after, p) - transform(before, p)));
  const auto row = [](const auto& series, const SamplePlace& at) -> Eigen::RowVectorXd {
    if (at.share <= 0.0) return series.row(at.index);
    return (1.0 - at.share) * series.row(at.index) + at.share * series.row(at.index + 1);
  };
  if (body.displacement.size() > 0) {
    const Eigen::RowVectorXd moved = row(body.displacement, b) - row(body.displacement, a);
    for (Eigen::Index k = 0; k + 2 < moved.size(); k += 3) bent = std::max(bent, moved.segment<3>(k).norm());
  }
  return (way + bent) / (t1 - t0);
}

// Numbers of a moment that are large where colours are: of the body that has most, or, of what is elastic, of each of its coordinates.
void measure_peaks(const sim::Results& results, const std::vector<render::Bounds>& boxes, ColorBy by, double t,
                   std::vector<double>& measures) {
  constexpr Eigen::Index coordinates = 12;  // of a body: the first, which move most
  measures.clear();
  const SamplePlace place = find_sample(results.times, t);
  const bool elastic = by == ColorBy::strain || by == ColorBy::stress || by == ColorBy::mode;
  double fastest = 0.0;
  for (size_t b = 0; b < boxes.size(); ++b) {
    const sim::ResultBody& body = results.bodies[b];
    if (boxes[b].empty()) continue;
    if (by == ColorBy::velocity) fastest = std::max(fastest, rough_speed(results, body, boxes[b], t));
    if (!elastic) continue;
    for (Eigen::Index k = 0; k < std::min(coordinates, body.q.cols()); ++k) measures.push_back(std::abs(body.q(place.index, k)));
    if (body.load_strain.size() > 0) measures.push_back(body.load_strain.row(place.index).cwiseAbs().maxCoeff());
    if (body.node_von_mises.size() > 0) measures.push_back(body.node_von_mises.row(place.index).maxCoeff());
  }
  if (by == ColorBy::velocity) measures.push_back(fastest);
}

// Times of the survey, ascending.
std::vector<double> survey_times(const sim::Results& results, const RenderSettings& settings, const std::vector<render::Bounds>& boxes) {
  const int count = picture_count(results.times, settings.frame_rate, settings.speed);
  const auto time = [&](int k) { return picture_time(results.times, settings.frame_rate, settings.speed, k); };
  std::set<int> chosen;
  if (count <= even_moments) {
    for (int k = 0; k < count; ++k) chosen.insert(k);
  } else {
    for (int k = 0; k < even_moments; ++k) chosen.insert(static_cast<int>(static_cast<long long>(k) * (count - 1) / (even_moments - 1)));
    std::vector<std::pair<double, int>> peaks;
    for (int k = 0; k < count; ++k) {
      const SamplePlace place = find_sample(results.times, time(k));
      double largest = 0.0;
      for (const sim::ResultBody& body : results.bodies)
        if (body.displacement.size() > 0) largest = std::max(largest, body.displacement.row(place.index).cwiseAbs().maxCoeff());
      peaks.emplace_back(-largest, k);
    }
    std::partial_sort(peaks.begin(), peaks.begin() + peak_moments, peaks.end());
    for (int k = 0; k < peak_moments; ++k) chosen.insert(peaks[k].second);
    // Peaks of other colours than displacement.
    const int step = 1 + static_cast<int>(static_cast<double>(count) * static_cast<double>(boxes.size()) / most_looks);
    std::vector<std::vector<std::pair<double, int>>> of;
    std::vector<double> measures;
    for (int k = 0; k < count; k += step) {
      measure_peaks(results, boxes, settings.color_by, time(k), measures);
      of.resize(measures.size());
      for (size_t m = 0; m < measures.size(); ++m) of[m].emplace_back(-measures[m], k);
    }
    const size_t each = of.empty() ? 0 : std::max<size_t>(2, peak_moments / of.size());
    for (auto& order : of) {
      const auto end = order.begin() + static_cast<std::ptrdiff_t>(std::min(each, order.size()));
      std::partial_sort(order.begin(), end, order.end());
      for (auto peak = order.begin(); peak != end; ++peak)
        if (peak->first < 0.0) chosen.insert(peak->second);
    }
  }
  std::vector<double> times;
  times.reserve(chosen.size());
  for (int k : chosen) times.push_back(time(k));
  return times;
}

}  // namespace

namespace {

// What multiplies the columns of a modal body's stress.
void stress_coordinates(const ColoredBody& of, const SamplePlace& place, std::vector<double>& q) {
  const sim::ResultBody& body = of.results.bodies[of.body];
  elastic_coordinates(body, place, q);
  if (!of.model.stress_of_loads) return;
  const sim::InertiaLoads loads = inertia_loads(body, of.results.times, place, of.model.gravity);
  q.insert(q.end(), loads.begin(), loads.end());
}

// A number of each stress (6 a vertex: xx yy zz xy yz xz).
void measure_stress(StressMeasure measure, std::span<const float> stress, std::span<float> out) {
  if (measure == StressMeasure::von_mises) interp::compute_von_mises(stress, out);
  else if (measure == StressMeasure::tresca) interp::compute_tresca(stress, out);
  else interp::compute_principal(stress, measure == StressMeasure::max_principal ? 2 : 0, out);
}

// Where vertices have other stresses besides, the one that counts.
void take_other_stress(const BodyModel& model, StressMeasure measure, ScalarMemory& work, std::vector<float>& scalars) {
  for (const BodyModel::OtherStress& other : model.other_stress) {
    work.before.resize(6 * other.vertices.size());
    work.after.resize(other.vertices.size());
    interp::apply_modes(other.stress, work.body.q, work.before, 1);
    measure_stress(measure, work.before, work.after);
    for (size_t k = 0; k < other.vertices.size(); ++k) {
      float& shown = scalars[static_cast<size_t>(other.vertices[k])];
      shown = measure == StressMeasure::min_principal ? std::min(shown, work.after[k]) : std::max(shown, work.after[k]);
    }
  }
}

// Stress of every vertex, Pa or a share of the yield stress.
void update_stress(const ColoredBody& of, double t, ScalarMemory& work, std::vector<float>& scalars) {
  const BodyModel& model = of.model;
  const sim::ResultBody& body = of.results.bodies[of.body];
  const SamplePlace place = find_sample(of.results.times, t);
  const StressMeasure measure = of.settings.stress;
  const size_t vertices = model.rest.size() / 3;
  if (!model.vertex_nodes.empty() && body.node_von_mises.size() > 0) {
    if (measure != StressMeasure::von_mises) return;
    const Eigen::Index next = std::min(place.index + 1, of.results.times.size() - 1);
    for (const int node : model.vertex_nodes)
      scalars.push_back(
          static_cast<float>((1.0 - place.share) * body.node_von_mises(place.index, node) + place.share * body.node_von_mises(next, node)));
  } else if (model.stress) {
    stress_coordinates(of, place, work.body.q);
    work.before.resize(6 * vertices);
    interp::apply_modes(*model.stress, work.body.q, work.before, 1);
    scalars.resize(vertices);
    measure_stress(measure, work.before, scalars);
    // What lies between the corners of faces follows from their components where one stress is there.
    if (work.wanted && measure == StressMeasure::von_mises && model.other_stress.empty()) work.components = work.before;
    take_other_stress(model, measure, work, scalars);
  } else if (model.beam_stress) {
    elastic_coordinates(body, place, work.body.q);
    load_strains(body, place, work.body.load_strain);
    scalars.resize(vertices);
    beam_stresses(*model.beam_stress, {body, work.body.q, work.body.load_strain}, measure, scalars);
  }
  if (of.shares && model.yield_stress > 0.0) {
    const auto share = static_cast<float>(1.0 / model.yield_stress);
    for (float& value : scalars) value *= share;
    for (float& value : work.components) value *= share;
  } else if (of.shares && model.shares_of_yield) {
    std::fill(scalars.begin(), scalars.end(), std::numeric_limits<float>::quiet_NaN());
    work.components.clear();
  }
}

}  // namespace

double doubt_of_inertia(const ColoredBody& of, double t, ScalarMemory& work) {
  const BodyModel& model = of.model;
  const sim::ResultBody& body = of.results.bodies[of.body];
  if (!model.stress_of_loads || !model.stress) return 0.0;
  const sim::VecX& times = of.results.times;
  const SamplePlace place = find_sample(times, t);
  const sim::InertiaLoads doubt =
      (inertia_loads(body, times, place, model.gravity) - inertia_loads(body, times, place, model.gravity, 2)) / 3.0;
  work.body.q.assign(static_cast<size_t>(body.q.cols()), 0.0);
  work.body.q.insert(work.body.q.end(), doubt.begin(), doubt.end());
  work.before.resize(2 * model.rest.size());
  work.after.resize(model.rest.size() / 3);
  interp::apply_modes(*model.stress, work.body.q, work.before, 1);
  interp::compute_von_mises(work.before, work.after);
  return static_cast<double>(*std::max_element(work.after.begin(), work.after.end()));
}

int update_stress_vectors(const ColoredBody& of, double t, ScalarMemory& work, std::vector<float>& vectors) {
  const BodyModel& model = of.model;
  const sim::ResultBody& body = of.results.bodies[of.body];
  const bool unknown = of.shares && model.shares_of_yield && !(model.yield_stress > 0.0);
  if (!model.other_stress.empty()) return 0;
  if (of.settings.stress != StressMeasure::von_mises || unknown || !(model.stress || model.beam_stress) || !model.vertex_nodes.empty())
    return 0;
  const int width = model.stress ? 6 : 3;
  const size_t vertices = model.rest.size() / 3;
  vectors.resize(static_cast<size_t>(width) * vertices);
  if (model.stress) {
    stress_coordinates(of, find_sample(of.results.times, t), work.body.q);
    interp::apply_modes(*model.stress, work.body.q, vectors, 1);
    constexpr float root3 = std::numbers::sqrt3_v<float>;
    for (size_t v = 0; v < vertices; ++v) {
      float* const s = vectors.data() + 6 * v;  // xx yy zz xy yz xz
      const float across = 0.5f * root3 * (s[0] - s[1]), along = 0.5f * (s[0] + s[1]) - s[2];
      s[0] = across;
      s[1] = along;
      s[2] = 0.0f;
      for (int k = 3; k < 6; ++k) s[k] *= root3;
    }
  } else {
    elastic_coordinates(body, find_sample(of.results.times, t), work.body.q);
    load_strains(body, find_sample(of.results.times, t), work.body.load_strain);
    beam_stress_vectors(*model.beam_stress, {body, work.body.q, work.body.load_strain}, vectors);
  }
  if (of.shares && model.yield_stress > 0.0)
    for (float& value : vectors) value = static_cast<float>(value / model.yield_stress);
  return width;
}

void update_speeds(const ColoredBody& of, double t, double spacings, ScalarMemory& work, std::vector<float>& scalars) {
  const BodyModel& model = of.model;
  const sim::ResultBody& body = of.results.bodies[of.body];
  const sim::VecX& times = of.results.times;
  const size_t vertices = model.rest.size() / 3;
  const Eigen::Index n = times.size();
  const double first = times[0], last = times[n - 1], half = 0.5 * spacings * (last - first) / static_cast<double>(n - 1);
  // At the ends no difference looks to both sides: what the two nearest ones tell goes on as a straight line.
  const bool begins = t - half<first, ends = t + half> last, long_enough = last - first >= 4.0 * half * (1.0 - 1e-9);
  const bool beyond = begins != ends && long_enough;
  const double centre = !beyond ? t : begins ? first + half : last - half, aside = begins ? centre + 2.0 * half : centre - 2.0 * half;
  scalars.resize(vertices);
  if (work.wanted) work.components.resize(3 * vertices);
  const auto add_difference = [&](double at, double factor, bool anew) {
    const double t0 = std::max(first, at - half), t1 = std::min(last, at + half);
    const SamplePlace p0 = find_sample(times, t0), p1 = find_sample(times, t1);
    const auto displaced = [&](const SamplePlace& place, std::vector<float>& out) {
      if (!model.flexible) return;
      update_displacement(model, body, place, work.body);
      out = work.body.displacement;
    };
    displaced(p0, work.before);
    displaced(p1, work.after);
    const glm::dmat4 pose0 = body_pose(body, p0), pose1 = body_pose(body, p1);
    if (anew) work.velocity.assign(vertices, glm::dvec3(0.0));
    for (size_t i = 0; i < vertices; ++i) {
      glm::dvec3 a(model.rest[3 * i], model.rest[3 * i + 1], model.rest[3 * i + 2]), b = a;
      if (model.flexible) {
        a += glm::dvec3(work.before[3 * i], work.before[3 * i + 1], work.before[3 * i + 2]);
        b += glm::dvec3(work.after[3 * i], work.after[3 * i + 1], work.after[3 * i + 2]);
      }
      work.velocity[i] += factor * (transform(pose1, b) - transform(pose0, a)) / (t1 - t0);
    }
  };
  const double share = beyond ? (t - centre) / (aside - centre) : 0.0;
  add_difference(centre, 1.0 - share, true);
  if (share != 0.0) add_difference(aside, share, false);
  for (size_t i = 0; i < vertices; ++i) {
    scalars[i] = static_cast<float>(glm::length(work.velocity[i]));
    for (int c = 0; c < 3 && work.wanted; ++c) work.components[3 * i + c] = static_cast<float>(work.velocity[i][c]);
  }
}

void update_scalars(const ColoredBody& of, double t, const BodyMemory& memory, ScalarMemory& work, std::vector<float>& scalars) {
  const BodyModel& model = of.model;
  const sim::Results& results = of.results;
  const RenderSettings& settings = of.settings;
  const sim::ResultBody& body = results.bodies[of.body];
  const ColorBy color_by = settings.color_by;
  const size_t vertices = model.rest.size() / 3;
  scalars.clear();
  work.components.clear();
  if (vertices == 0) return;
  if (color_by == ColorBy::displacement && model.flexible) {
    scalars.resize(vertices);
    interp::compute_magnitude(memory.displacement, scalars);
    if (work.wanted) work.components = memory.displacement;
  } else if (color_by == ColorBy::stress) {
    update_stress(of, t, work, scalars);
  } else if (color_by == ColorBy::strain && model.flexible) {
    scalars.resize(vertices);
    if (model.beam_strain) {
      const SamplePlace place = find_sample(results.times, t);
      elastic_coordinates(body, place, work.body.q);
      load_strains(body, place, work.body.load_strain);
      beam_stresses(*model.beam_strain, {body, work.body.q, work.body.load_strain}, StressMeasure::von_mises, scalars);
    } else if (const interp::ModeColumns* modes = model.modes ? &*model.modes : model.strain_modes ? &*model.strain_modes : nullptr) {
      // What the nodes do in second order makes up for what the modes lengthen as they turn, and strains nothing.
      elastic_coordinates(body, find_sample(results.times, t), work.body.q);
      work.before.resize(model.rest.size());
      interp::apply_modes(*modes, work.body.q, work.before, 1);
      interp::compute_strain(model.view(), model.welded, work.before, scalars, true);
    } else {
      interp::compute_strain(model.view(), model.welded, memory.displacement, scalars);
    }
  } else if (color_by == ColorBy::mode && model.modes && settings.mode <= body.q.cols()) {
    // Displacement by one coordinate alone.
    elastic_coordinates(body, find_sample(results.times, t), work.body.q);
    for (size_t k = 0; k < work.body.q.size(); ++k)
      if (static_cast<int>(k) + 1 != settings.mode) work.body.q[k] = 0.0;
    work.before.resize(model.rest.size());
    interp::apply_modes(*model.modes, work.body.q, work.before, 1);
    if (body.shown_columns.size() > 0) {
      // What a small coordinate moves the body frame by.
      const sim::Vec6 frame = body.shown_columns.col(settings.mode - 1) * work.body.q[settings.mode - 1];
      for (size_t i = 0; i + 2 < work.before.size(); i += 3) {
        const sim::Vec3 x(model.rest[i], model.rest[i + 1], model.rest[i + 2]);
        const sim::Vec3 moved = frame.head<3>() + frame.tail<3>().cross(x);
        for (size_t a = 0; a < 3; ++a) work.before[i + a] -= static_cast<float>(moved[static_cast<Eigen::Index>(a)]);
      }
    }
    scalars.resize(vertices);
    interp::compute_magnitude(work.before, scalars);
    if (work.wanted) work.components = work.before;
  } else if (color_by == ColorBy::map_error && model.flexible) {
    map_error(model, body, find_sample(results.times, t), work.body, scalars);
  } else if (color_by == ColorBy::velocity && results.times.size() > 1) {
    update_speeds(of, t, 1.0, work, scalars);
  }
}

bool is_coarse(const std::vector<glm::ivec3>& triangles, const std::vector<float>& components, double range) {
  if (components.empty() || triangles.empty() || !(range > 0.0)) return false;
  int last = 0;
  for (const glm::ivec3& t : triangles) last = std::max({last, t.x, t.y, t.z});
  const size_t width = components.size() % (6 * static_cast<size_t>(last + 1)) == 0 ? 6 : 3;
  const auto value = [&](const glm::dvec3& a, const glm::dvec3& b) {
    if (width == 3) return glm::length(a);
    const glm::dvec3 apart = a - glm::dvec3(a.y, a.z, a.x);
    return std::sqrt(0.5 * glm::dot(apart, apart) + 3.0 * glm::dot(b, b));
  };
  const auto part = [&](int v, size_t from) {
    const float* const at = components.data() + width * v + from;
    return glm::dvec3(at[0], at[1], at[2]);
  };
  for (const glm::ivec3& t : triangles) {
    glm::dvec3 first(0.0), second(0.0);
    double mean = 0.0;
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 a = part(t[k], 0), b = width == 6 ? part(t[k], 3) : glm::dvec3(0.0);
      first += a / 3.0;
      second += b / 3.0;
      mean += value(a, b) / 3.0;
    }
    if (mean - value(first, second) > 0.005 * range) return true;
  }
  return false;
}

namespace {

// One moment of the survey, and a thread's memory for making it.
struct Seen {
  Survey::Moment moment;
  std::vector<double> reach;  // largest displacement of each body, m
};
struct SurveyMemory {
  std::vector<BodyMemory> bodies;
  ScalarMemory scalars;
  std::vector<float> values;
};

Seen see(const sim::Results& results, const std::vector<BodyModel>& bodies, const RenderSettings& settings,
         const std::vector<std::vector<int>>& chosen, double t, SurveyMemory& memory) {
  const SamplePlace place = find_sample(results.times, t);
  Seen seen{.moment = {.t = t, .largest_scalar = 0.0, .pose = {}, .displacement = {}}, .reach = std::vector<double>(bodies.size(), 0.0)};
  for (size_t b = 0; b < bodies.size(); ++b) {
    const sim::ResultBody& body = results.bodies[b];
    BodyMemory& own = memory.bodies[b];
    seen.moment.pose.push_back(body_pose(body, place));
    std::vector<glm::vec3> moved;
    // What is not drawn decides on no colours and scales.
    if (!bodies[b].visible) {
      seen.moment.displacement.emplace_back();
      continue;
    }
    const auto coloured = [&](double value) {
      if (!std::isfinite(value)) return;
      seen.moment.largest_scalar = std::max(seen.moment.largest_scalar, std::abs(value));
      seen.moment.lowest_scalar = std::min(seen.moment.lowest_scalar, value);
      seen.moment.highest_scalar = std::max(seen.moment.highest_scalar, value);
    };
    if (bodies[b].flexible) {
      update_displacement(bodies[b], body, place, own);
      const std::vector<float>& u = own.displacement;
      double square = 0.0, least = std::numeric_limits<double>::infinity();
      for (size_t i = 0; i + 2 < u.size(); i += 3) {
        const double here = double(u[i]) * u[i] + double(u[i + 1]) * u[i + 1] + double(u[i + 2]) * u[i + 2];
        square = std::max(square, here);
        least = std::min(least, here);
      }
      seen.reach[b] = std::sqrt(square);
      if (settings.color_by == ColorBy::displacement) coloured(std::sqrt(least));
      for (int i : chosen[b]) {
        const float* const at = u.data() + 3 * static_cast<std::ptrdiff_t>(i);
        moved.emplace_back(at[0], at[1], at[2]);
      }
    } else if (bodies[b].mesh.positions.empty() && bodies[b].visible && body.displacement.size() > 0) {
      node_motion(body, place, own.node_displacement, own.node_rotation);
      for (Eigen::Index k = 0; k < own.node_displacement.rows(); ++k) {
        const Eigen::RowVector3d u = own.node_displacement.row(k);
        moved.emplace_back(u.x(), u.y(), u.z());
        seen.reach[b] = std::max(seen.reach[b], u.norm());
      }
    }
    seen.moment.displacement.push_back(std::move(moved));
    if (settings.color_by != ColorBy::none && settings.color_by != ColorBy::body && settings.color_by != ColorBy::displacement) {
      update_scalars({bodies[b], results, b, settings}, t, own, memory.scalars, memory.values);
      for (const float s : memory.values) coloured(static_cast<double>(s));
    }
    if (settings.color_by == ColorBy::displacement) coloured(seen.reach[b]);
  }
  return seen;
}

}  // namespace

Survey survey_motion(const sim::Results& results, const std::vector<BodyModel>& bodies, const RenderSettings& settings) {
  Survey survey;
  const int most = std::clamp(support_budget / std::max(1, static_cast<int>(bodies.size())), 8, 200);
  std::vector<std::vector<int>> chosen;
  for (size_t b = 0; b < bodies.size(); ++b) {
    chosen.push_back(bodies[b].visible ? support_of(bodies[b].mesh, most) : std::vector<int>{});
    std::vector<glm::dvec3> points;
    for (int i : chosen[b]) points.push_back(bodies[b].mesh.positions[i]);
    // A body without a mesh is seen by its nodes.
    if (bodies[b].mesh.positions.empty() && bodies[b].visible)
      for (const sim::ResultNode& node : results.bodies[b].nodes) points.emplace_back(node.origin.x(), node.origin.y(), node.origin.z());
    survey.support.push_back(std::move(points));
  }

  const std::vector<render::Bounds> boxes = boxes_of(results, bodies);
  std::vector<double> times = survey_times(results, settings, boxes);
  for (const double t : extreme_times(results, boxes)) times.push_back(t);
  const auto look_within = [&](const std::pair<double, double>& window) {
    for (int k = 0; k <= window_moments; ++k) {
      const double t = window.first + (window.second - window.first) * k / window_moments;
      if (t >= results.times[0] && t <= results.times[results.times.size() - 1]) times.push_back(t);
    }
  };
  if (settings.camera.window) look_within(*settings.camera.window);
  // Colours that count what is seen in a window shorter than the time between two pictures.
  if (const auto& window = settings.range.window;
      window && std::none_of(times.begin(), times.end(), [&](double t) { return t >= window->first && t <= window->second; }))
    look_within(*window);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  std::vector<Seen> seen(times.size());
  // On all cores: drawing waits for it.
  interp::parallel_chunks(static_cast<int>(times.size()), moments_of_a_thread, interp::thread_count(0), [&](int first, int last) {
    SurveyMemory memory{.bodies = std::vector<BodyMemory>(bodies.size()), .scalars = {}, .values = {}};
    for (int k = first; k < last; ++k) {
      interp::look();
      seen[k] = see(results, bodies, settings, chosen, times[k], memory);
    }
  });
  for (Seen& s : seen) {
    for (double reach : s.reach) survey.largest_displacement = std::max(survey.largest_displacement, reach);
    survey.largest_scalar = std::max(survey.largest_scalar, s.moment.largest_scalar);
    survey.lowest_scalar = std::min(survey.lowest_scalar, s.moment.lowest_scalar);
    survey.highest_scalar = std::max(survey.highest_scalar, s.moment.highest_scalar);
    survey.moments.push_back(std::move(s.moment));
  }

  // Only linear exaggeration is warned of; a body turns most, as good as, where it is displaced most.
  BodyMemory memory;
  for (size_t b = 0; b < bodies.size() && !settings.corotated; ++b) {
    if (!bodies[b].flexible || !bodies[b].visible) continue;
    std::vector<size_t> order(seen.size());
    std::iota(order.begin(), order.end(), size_t{0});
    const auto end = order.begin() + static_cast<std::ptrdiff_t>(std::min(turn_moments, order.size()));
    std::partial_sort(order.begin(), end, order.end(),
                      [&](size_t i, size_t j) { return std::pair(-seen[i].reach[b], i) < std::pair(-seen[j].reach[b], j); });
    for (auto k = order.begin(); k != end; ++k) {
      update_displacement(bodies[b], results.bodies[b], find_sample(results.times, times[*k]), memory);
      survey.largest_turn = std::max(survey.largest_turn, interp::largest_rotation(bodies[b].view(), memory.displacement));
    }
  }
  return survey;
}

std::vector<glm::dvec3> motion_points(const Survey& survey, const std::vector<double>& scales, int follow,
                                      const std::pair<double, double>* window) {
  std::vector<glm::dvec3> points;
  for (const Survey::Moment& moment : survey.moments) {
    if (window && (moment.t < window->first || moment.t > window->second)) continue;
    glm::dvec3 way(0.0);
    if (follow >= 0) way = glm::dvec3(moment.pose[follow][3] - survey.moments.front().pose[follow][3]);
    for (size_t b = 0; b < moment.pose.size(); ++b)
      for (size_t i = 0; i < survey.support[b].size(); ++i) {
        if (moment.displacement[b].empty()) {
          points.push_back(transform(moment.pose[b], survey.support[b][i]) - way);
          continue;
        }
        for (double scale : scales)
          points.push_back(transform(moment.pose[b], survey.support[b][i] + scale * glm::dvec3(moment.displacement[b][i])) - way);
      }
  }
  return points;
}

double machine_size(const sim::Results& results, const std::vector<BodyModel>& bodies) {
  render::Bounds bounds;
  std::vector<render::Bounds> boxes(results.bodies.size());
  for (size_t b = 0; b < std::min(bodies.size(), boxes.size()); ++b)
    if (bodies[b].visible)
      for (const glm::dvec3& p : bodies[b].mesh.positions) boxes[b].add(p);
  const Eigen::Index nt = results.times.size(), step = std::max<Eigen::Index>(1, nt / 64);
  for (Eigen::Index i = 0; i < nt; i += step)
    for (size_t b = 0; b < boxes.size(); ++b) {
      const sim::ResultBody& body = results.bodies[b];
      const glm::dmat4 pose = body_pose(body, {i, 0.0});
      bounds.add(glm::dvec3(pose[3]));
      std::vector<glm::dvec3> corners;
      render::append_corners(corners, boxes[b]);
      for (const glm::dvec3& p : corners) bounds.add(transform(pose, p));
      for (const sim::ResultNode& node : body.nodes) bounds.add(transform(pose, {node.origin.x(), node.origin.y(), node.origin.z()}));
    }
  const double size = 2.0 * bounds.radius();
  return size > 0.0 ? size : 1.0;
}

}  // namespace flexframe::film
