#include "render/film/page_colors.h"

#include "render/film/survey.h"

#include <algorithm>
#include <cmath>

namespace flexframe::film {
namespace {

using Json = nlohmann::ordered_json;

// How a body moves at a picture, as the speed of pictures is made: from half a sample's spacing before to half after it.
struct Change {
  glm::dmat4 drift{0.0};  // (pose after - pose before) / time between
  Eigen::VectorXf rates;  // of the weights, 1/s
};

Change change_at(const Animation& animation, int b, const ShapeBasis& basis, double t, BodyMemory& memory) {
  const sim::VecX& times = animation.results->times;
  const sim::ResultBody& body = animation.results->bodies[b];
  const Eigen::Index n = times.size();
  const double first = times[0], last = times[n - 1], half = 0.5 * (last - first) / static_cast<double>(n - 1);
  const double t0 = std::max(first, t - half), t1 = std::min(last, t + half);
  const SamplePlace before = find_sample(times, t0), after = find_sample(times, t1);
  Change change;
  change.drift = (body_pose(body, after) - body_pose(body, before)) / (t1 - t0);
  if (basis.shapes.cols() == 0) return change;
  update_displacement(animation.bodies[b], body, before, memory);
  const Eigen::VectorXf weights = shape_weights(basis, memory.displacement);
  update_displacement(animation.bodies[b], body, after, memory);
  change.rates = (shape_weights(basis, memory.displacement) - weights) / static_cast<float>(t1 - t0);
  return change;
}

// Largest difference between the speeds that the browser makes at picture k and those of the pictures, m/s.
double speed_error(const Animation& animation, const Colors& colors, int b, const ShapeBasis& basis, int k) {
  const BodyModel& model = animation.bodies[b];
  const sim::ResultBody& body = animation.results->bodies[b];
  const double t = picture_time(animation, k);
  BodyMemory memory;
  const Change change = change_at(animation, b, basis, t, memory);
  const SamplePlace place = find_sample(animation.results->times, t);
  const glm::dmat3 turn(body_pose(body, place));
  ScalarMemory work;
  std::vector<float> speeds;
  if (model.flexible) update_displacement(model, body, place, memory);
  update_scalars({model, *animation.results, static_cast<size_t>(b), colors.settings}, t, memory, work, speeds);
  const bool moves = basis.shapes.cols() > 0;
  const Eigen::VectorXf u = moves ? Eigen::VectorXf(basis.shapes * basis.weights.col(k)) : Eigen::VectorXf();
  const Eigen::VectorXf du = moves ? Eigen::VectorXf(basis.shapes * change.rates) : Eigen::VectorXf();
  double worst = 0.0;
  for (size_t i = 0; i < speeds.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(3 * i);
    glm::dvec4 x(model.rest[3 * i], model.rest[3 * i + 1], model.rest[3 * i + 2], 1.0);
    glm::dvec3 rate(0.0);
    if (moves) {
      x += glm::dvec4(u[at], u[at + 1], u[at + 2], 0.0);
      rate = {du[at], du[at + 1], du[at + 2]};
    }
    const double speed = glm::length(glm::dvec3(change.drift * x) + turn * rate);
    worst = std::max(worst, std::abs(speed - static_cast<double>(speeds[i])));
  }
  return worst;
}

// What the browser makes the speed of.
double add_motion_rates(const Animation& animation, const Colors& colors, int b, const ShapeBasis& basis, PageBlock& block, Json& out) {
  constexpr int looked_at = 9;  // pictures whose speeds are compared with those of the program
  std::vector<float> drifts, rates;
  BodyMemory memory;
  for (int k = 0; k < animation.count; ++k) {
    const Change change = change_at(animation, b, basis, picture_time(animation, k), memory);
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 3; ++row) drifts.push_back(static_cast<float>(change.drift[column][row]));
    rates.insert(rates.end(), change.rates.data(), change.rates.data() + change.rates.size());
  }
  out["drift"] = block.add(drifts);
  if (!rates.empty()) out["rates"] = block.add(rates);
  double worst = 0.0;
  for (int i = 0; i < looked_at; ++i)
    worst = std::max(
        worst, speed_error(animation, colors, b, basis, static_cast<int>(static_cast<long>(i) * (animation.count - 1) / (looked_at - 1))));
  return worst;
}

// The largest difference between the lengths of the vectors and the stress that pictures show: where section forces jump, and rounding.
double stress_error(const Animation& animation, const Colors& colors, int b, const VectorBasis& vectors) {
  const BodyModel& model = animation.bodies[b];
  ScalarMemory work;
  std::vector<float> stress;
  double worst = 0.0;
  for (int k = 0; k < animation.count; ++k) {
    update_scalars({model, *animation.results, static_cast<size_t>(b), colors.settings}, picture_time(animation, k), {}, work, stress);
    const Eigen::VectorXf values = vectors.basis.shapes * vectors.basis.weights.col(k);
    for (size_t p = 0; p < model.mesh.point_position.size(); ++p) {
      const float value = values.segment(static_cast<Eigen::Index>(p) * vectors.width, vectors.width).norm();
      worst = std::max(worst, static_cast<double>(std::abs(value - stress[static_cast<size_t>(model.mesh.point_position[p])])));
    }
  }
  return worst;
}

// The numbers of one colour as shapes and weights. Returns what they miss.
double add_values(const Animation& animation, const Colors& colors, int b, PageBlock& block, Json& look) {
  const VectorBasis vectors =
      colors.settings.color_by == ColorBy::stress ? make_stress_basis(animation, colors.settings, b) : VectorBasis();
  const ShapeBasis basis = vectors.width > 0 ? vectors.basis : make_value_basis(animation, colors.settings, b);
  look["shown"] = 0;
  if (basis.largest < 0.0) return 0.0;
  const int count = static_cast<int>(basis.shapes.cols());
  look["shown"] = count > 0 ? 2 : 3;
  if (count == 0) return 0.0;
  std::vector<std::int16_t> shapes;
  std::vector<float> steps, values;
  for (int k = 0; k < count; ++k) {
    values.assign(basis.shapes.col(k).data(), basis.shapes.col(k).data() + basis.shapes.rows());
    steps.push_back(round_to(values, shapes));
  }
  look["values"] = count;
  look["value_data"] = block.add(shapes);
  look["value_step"] = steps;
  look["value_weights"] = block.add(by_picture(basis.weights));
  if (vectors.width == 0) return basis.error;
  look["parts"] = vectors.width / 3;
  return stress_error(animation, colors, b, vectors);
}

bool can_color_by(const Animation& animation, ColorBy by) {
  return by != animation.settings.color_by && (by != ColorBy::velocity || animation.results->times.size() > 1);
}

}  // namespace

PageColors find_page_colors(Animation& animation, const sim::Scene* scene) {
  const ColorBy own = animation.settings.color_by;
  PageColors colors;
  if (animation.scalar_bar) {
    colors.all.push_back({.settings = animation.settings, .map = animation.scalar_map, .bar = *animation.scalar_bar});
    colors.own = true;
  }
  if (can_color_by(animation, ColorBy::displacement))
    if (auto found = colors_by(animation, ColorBy::displacement)) colors.all.push_back(std::move(*found));
  // The error of the map needs the map itself, which models that are to be coloured by stress do not keep.
  const auto& bodies = animation.results->bodies;
  if (own != ColorBy::stress && own != ColorBy::map_error && std::any_of(bodies.begin(), bodies.end(), knows_stress)) {
    RenderSettings settings = animation.settings;
    settings.color_by = ColorBy::stress;
    settings.color_range.reset();
    Animation stressed = make_animation(*animation.results, settings, scene);
    if (stressed.scalar_bar) {
      colors.all.push_back({.settings = stressed.settings, .map = stressed.scalar_map, .bar = *stressed.scalar_bar});
      colors.stressed = std::move(stressed);
    }
  }
  if (can_color_by(animation, ColorBy::velocity))
    if (auto found = colors_by(animation, ColorBy::velocity)) colors.all.push_back(std::move(*found));
  return colors;
}

Json colors_json(const PageColors& colors, PageBlock& block) {
  Json out = Json::array();
  for (const Colors& c : colors.all) {
    std::vector<std::uint8_t> map;
    for (int i = 0; i < 256; ++i) {
      const glm::vec3 color = render::map_color(c.map, i / 255.0);
      for (int k = 0; k < 3; ++k) map.push_back(static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(color[k], 0.0f, 1.0f))));
    }
    out.push_back({{"word", color_by_words()[static_cast<size_t>(c.settings.color_by)]},
                   {"label", c.bar.label},
                   {"unit", c.bar.unit},
                   {"factor", c.bar.factor},
                   {"lower", c.map.lower},
                   {"upper", c.map.upper},
                   {"levels", c.map.levels},
                   {"logarithmic", c.map.logarithmic},
                   {"beyond", {c.map.below.has_value(), c.map.above.has_value()}},
                   {"map", block.add(map)}});
  }
  return out;
}

double add_body_colors(const PageColors& colors, const Animation& animation, int b, const ShapeBasis& basis, PageBlock& block, Json& out) {
  double worst = 0.0;
  out["looks"] = Json::array();
  for (const Colors& c : colors.all) {
    Json look;
    double error = 0.0;
    const ColorBy by = c.settings.color_by;
    if (by == ColorBy::displacement) {
      look["shown"] = !animation.bodies[b].flexible ? 0 : basis.shapes.cols() > 0 ? 1 : 3;
    } else if (by == ColorBy::velocity) {
      look["shown"] = 4;
      error = add_motion_rates(animation, c, b, basis, block, out);
    } else {
      error = add_values(animation, c, b, block, look);
    }
    const double range = c.map.upper - c.map.lower;
    if (range > 0.0) worst = std::max(worst, error / range);
    out["looks"].push_back(std::move(look));
  }
  return worst;
}

}  // namespace flexframe::film
