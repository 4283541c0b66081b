#include "sim/run/linear_limit.h"

#include "sim/run/linear_growth.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::sim {

LinearGrowth error_growth(const Scene& scene, const Model& model, int body) {
  const auto* beam = std::get_if<BeamDef>(&scene.bodies[body].kind);
  if (beam && model.parts[model.pieces[body].front()].body.rod) return {0.0, 0.0, true};
  if (!beam || beam->model == BeamModel::modal) return {};
  for (const FlexibleNode& node : model.parts[model.pieces[body].front()].body.nodes)
    for (const MatX& h : node.phi2)
      if (h.size() > 0) return {0.025, 0.11, true};
  return {0.15, 0.18};
}

double tangent_turn(const Vec3& rotation) {
  const double angle = rotation.norm();
  if (angle == 0.0 || (rotation.x() == 0.0 && angle <= std::numbers::pi)) return angle;  // about an axis across: all of it
  const double across2 = rotation.tail<2>().squaredNorm() / (angle * angle), half = std::sin(0.5 * angle);
  return 2.0 * std::asin(std::min(1.0, std::sqrt(across2) * std::abs(half)));
}

namespace {

// Nodes of each volume of a beam, of a whole body otherwise.
std::vector<std::vector<Eigen::Index>> nodes_by_piece(const ResultBody& body, int pieces) {
  std::vector<std::vector<Eigen::Index>> out(pieces);
  const double l = body.length / pieces;
  for (size_t k = 0; k < body.nodes.size(); ++k)
    for (int i = 0; i < pieces; ++i) {
      const double x = body.nodes[k].origin.x();
      if (pieces == 1 || (x >= (i - 1e-9) * l && x <= (i + 1 + 1e-9) * l)) out[i].push_back(static_cast<Eigen::Index>(k));
    }
  return out;
}

// Radians swung by a history that goes to and fro: half a turn from one end of its range to the other. What moves by less than a millionth
// stands still.
double radians_swung(const VecX& history) {
  const double range = history.maxCoeff() - history.minCoeff();
  if (!(range > 1e-6 * history.cwiseAbs().maxCoeff())) return 0.0;
  return std::numbers::pi * (history.tail(history.size() - 1) - history.head(history.size() - 1)).cwiseAbs().sum() / range;
}

// Turn of the node that turns farthest at some time, signed by its larger component, so that a swing through zero counts once.
VecX signed_turn(const ResultBody& body) {
  Eigen::Index node = 0;
  double largest = 0.0;
  for (Eigen::Index row = 0; row < body.rotation.rows(); ++row)
    for (Eigen::Index k = 0; k + 2 < body.rotation.cols(); k += 3)
      if (const double turn = body.rotation.block<1, 3>(row, k).squaredNorm(); turn > largest) largest = turn, node = k;
  VecX out = body.rotation.middleCols<3>(node).rowwise().norm();
  Eigen::Index axis = 0;
  body.rotation.middleCols<3>(node).cwiseAbs().colwise().maxCoeff().maxCoeff(&axis);
  for (Eigen::Index i = 0; i < out.size(); ++i) out[i] = std::copysign(out[i], body.rotation(i, node + axis));
  return out;
}

// Nodes of a straight beam along x, no two at one place, thinned: more tell nothing of how it bends.
std::vector<Eigen::Index> nodes_along(const ResultBody& body) {
  constexpr size_t most = 48;
  std::vector<Eigen::Index> out(body.nodes.size());
  for (size_t k = 0; k < out.size(); ++k) out[k] = static_cast<Eigen::Index>(k);
  const auto x = [&](Eigen::Index k) { return body.nodes[static_cast<size_t>(k)].origin.x(); };
  std::sort(out.begin(), out.end(), [&](Eigen::Index a, Eigen::Index b) { return x(a) < x(b); });
  const double least = 1e-6 * body.length;
  out.erase(std::unique(out.begin(), out.end(), [&](Eigen::Index a, Eigen::Index b) { return x(b) - x(a) < least; }), out.end());
  if (out.size() <= most) return out;
  std::vector<Eigen::Index> few;
  for (size_t k = 0; k < most; ++k) few.push_back(out[k * (out.size() - 1) / (most - 1)]);
  return few;
}

// How a beam bends on mean axes at one time: terms of its energies, J, and how far its shortening moves the middles between its nodes
// towards its root, m.
struct Bent {
  double strain = 0.0, fourth = 0.0;  // 1/2 int EI theta'^2 dx, 1/2 int EI (theta' theta)^2 dx
  VecX shortening;
};

// theta: rotations about y and z at places x.
Bent bent(const VecX& x, const Eigen::MatrixX2d& theta, double stiff_y, double stiff_z) {
  const Eigen::Index n = x.size() - 1;
  const double length = x[n] - x[0];
  const VecX dx = x.tail(n) - x.head(n), middle = 0.5 * (x.tail(n) + x.head(n)).array() - x[0];
  // The slope of mean axes is that of the straight line through the deflection: int theta 6 x (L - x) / L^3 dx.
  const VecX weights = middle.array() * (length - middle.array()) * dx.array();
  const Eigen::MatrixX2d here = 0.5 * (theta.topRows(n) + theta.bottomRows(n));
  const Eigen::RowVector2d mean = (weights.transpose() * here) / weights.sum();
  Bent out;
  out.shortening.resize(n);
  double u = 0.0;
  for (Eigen::Index k = 0; k < n; ++k) {
    const double square = (here.row(k) - mean).squaredNorm();
    const Eigen::RowVector2d bend = (theta.row(k + 1) - theta.row(k)) / dx[k];
    const double energy = 0.5 * dx[k] * (stiff_y * bend[0] * bend[0] + stiff_z * bend[1] * bend[1]);
    out.strain += energy, out.fourth += energy * square;
    out.shortening[k] = u - 0.25 * square * dx[k];
    u -= 0.5 * square * dx[k];
  }
  return out;
}

// Whether what holds the beam lets its ends turn, so far as it bends: hinges across the one direction in which it does.
bool ends_turn(const Scene& scene, const std::string& body, bool in_one_direction) {
  return std::all_of(scene.joints.begin(), scene.joints.end(), [&](const JointDef& j) {
    if (j.parent.body != body && j.child.body != body) return true;
    return j.kind == JointKind::spherical || j.kind == JointKind::free ||
           (in_one_direction && (j.kind == JointKind::revolute || j.kind == JointKind::planar));
  });
}

// What a beam's second-order displacement field leaves out of its vibration's frequency, relative. The field shortens by u = 1/2 int
// theta^2 dx from the root, but the kinetic energy of that, K = 1/2 int m (du/dt)^2 dx, is of fourth order, and so is what the tangent,
// asin(v'), adds to the strain energy V, S = 1/2 int EI (theta' theta)^2 dx, where the ends are free to turn with it. Averaged over a
// period (quartic terms of an oscillator, Lindstedt) the frequency lacks (S - K) / V, of what varies of S and V; theta on mean axes.
// Measured beside four volumes, a strip of twelve elements, radians after 1.2 s and by this: on a hinge 3.2e-3 and 2.6e-3, free 0.196 and
// 0.19, supported at both ends 4.9e-3 and 8.6e-3.
double frequency_error(const Scene& scene, const BeamDef& beam, const ResultBody& body, const VecX& times) {
  const std::vector<Eigen::Index> nodes = nodes_along(body);
  const auto n = static_cast<Eigen::Index>(nodes.size()), rows = body.rotation.rows();
  if (n < 4 || rows < 3 || !beam.stations.empty() || beam.axis) return 0.0;
  VecX x(n);
  for (Eigen::Index k = 0; k < n; ++k) x[k] = body.nodes[static_cast<size_t>(nodes[static_cast<size_t>(k)])].origin.x();
  const double mass = beam.material.density * beam.section.area;
  const double stiff_y = beam.material.youngs_modulus * beam.section.iy, stiff_z = beam.material.youngs_modulus * beam.section.iz;
  const VecX dx = x.tail(n - 1) - x.head(n - 1);
  Eigen::MatrixX2d theta(n, 2), mean = Eigen::MatrixX2d::Zero(n, 2);
  double strain = 0.0, fourth = 0.0, kinetic = 0.0;
  VecX before;
  for (Eigen::Index row = 0; row < rows; ++row) {
    for (Eigen::Index k = 0; k < n; ++k) theta.row(k) = body.rotation.block<1, 2>(row, 3 * nodes[static_cast<size_t>(k)] + 1);
    mean += theta / static_cast<double>(rows);
    Bent now = bent(x, theta, stiff_y, stiff_z);
    strain += now.strain / static_cast<double>(rows), fourth += now.fourth / static_cast<double>(rows);
    if (const double step = row > 0 ? times[row] - times[row - 1] : 0.0; step > 0.0)
      kinetic += 0.5 * mass * ((now.shortening - before).cwiseAbs2().dot(dx)) / (step * step * static_cast<double>(rows));
    before = std::move(now.shortening);
  }
  const Bent at_rest = bent(x, mean, stiff_y, stiff_z);
  const double varies = strain - at_rest.strain;
  if (!(varies > 1e-9 * strain)) return 0.0;
  kinetic /= varies;
  Eigen::Vector2d turned = Eigen::Vector2d::Zero();
  for (const Eigen::Index k : nodes)
    for (Eigen::Index i = 0; i < 2; ++i) turned[i] = std::max(turned[i], body.rotation.col(3 * k + 1 + i).cwiseAbs().maxCoeff());
  if (!ends_turn(scene, body.name, turned.minCoeff() <= 1e-6 * turned.maxCoeff())) return kinetic;
  // They nearly cancel where both ends are supported, which averages over several modes do not tell exactly: a tenth of them stays.
  const double adds = std::abs(fourth - at_rest.fourth) / varies;
  return std::abs(adds - kinetic) + 0.1 * std::min(adds, kinetic);
}

// Radians of what varies of a history, by its rates.
double radians_by_rates(const VecX& history) {
  const VecX varies = history.array() - history.mean();
  const double steps = (history.tail(history.size() - 1) - history.head(history.size() - 1)).norm(), size = varies.norm();
  return size > 0.0 ? steps / size * static_cast<double>(history.size() - 1) : 0.0;
}

}  // namespace

// An evaluation of a rod takes as many products as the cube of its coordinates, several for each: beyond this volumes are the better way.
constexpr int most_coordinates_of_rod = 64;

std::vector<LinearLimit> linear_limits(const Scene& scene, const Model& model, const Results& results) {
  std::vector<LinearLimit> out;
  for (size_t b = 0; b < results.bodies.size(); ++b) {
    const ResultBody& body = results.bodies[b];
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind);
    if ((beam && beam->model == BeamModel::lumped) || model.parts[model.pieces[b].front()].body.n == 0 || body.rotation.cols() == 0)
      continue;
    const int pieces = static_cast<int>(model.pieces[b].size());
    const bool rod = model.parts[model.pieces[b].front()].body.rod != nullptr;
    const LinearGrowth growth = error_growth(scene, model, static_cast<int>(b));
    LinearLimit limit;
    limit.body = static_cast<int>(b);
    limit.pieces = pieces;
    limit.may_go_on = !rod && model.parts[model.pieces[b].front()].body.n <= most_coordinates_of_rod &&
                      std::any_of(model.effects.begin(), model.effects.end(),
                                  [&](const EffectState& s) { return s.body == limit.body && s.effect == "large_bending" && s.possible; });
    // A volume's share in the error of the frequency goes with its share in the deformation, whose energy goes with the square of the turn
    // as well.
    double squares = 0.0, fourths = 0.0;
    const Eigen::Index rows = body.rotation.rows();
    for (const std::vector<Eigen::Index>& nodes : nodes_by_piece(body, pieces)) {
      if (nodes.empty()) continue;
      VecX turn = VecX::Zero(rows);
      const auto rotation = [&](Eigen::Index row, Eigen::Index node) -> Vec3 {
        return body.rotation.block<1, 3>(row, 3 * node).transpose();
      };
      // A volume's frame turns with it: what counts is how far it bends.
      VecX from = VecX::Zero(rows);
      for (Eigen::Index row = 0; row < rows && pieces > 1; ++row) from[row] = tangent_turn(rotation(row, nodes.front()));
      for (Eigen::Index row = 0; row < rows; ++row)
        for (const Eigen::Index k : nodes)
          turn[row] = std::max(turn[row], beam ? std::abs(tangent_turn(rotation(row, k)) - from[row]) : rotation(row, k).norm());
      Eigen::Index at = 0;
      const double largest = turn.maxCoeff(&at), mean_square = turn.squaredNorm() / static_cast<double>(rows);
      if (largest > limit.turn) limit.turn = largest, limit.when = results.times[at];
      squares += mean_square, fourths += mean_square * mean_square;
    }
    limit.at_rest = growth.at_rest * limit.turn * limit.turn;
    if (squares > 0.0) {
      const VecX turn = signed_turn(body);
      const double swung = radians_swung(turn);
      limit.swung = swung;
      limit.phase = growth.frequency * fourths / squares * swung;
      if (beam && pieces == 1 && growth.second_order && !rod && swung > 0.0)
        limit.phase = std::max(limit.phase, frequency_error(scene, *beam, body, results.times) * std::max(swung, radians_by_rates(turn)));
    }
    out.push_back(limit);
  }
  return out;
}

std::string far_words(const LinearLimit& limit, const char* frame, bool when) {
  constexpr double near_buckling = 0.5;  // errors at rest count twice
  std::string out = fmt::format("bends by up to {:.2g} degrees within {}", limit.turn * 180.0 / std::numbers::pi, frame);
  if (limit.pressed > near_buckling) out += fmt::format(", pressed by {:.2g} of what buckles it", limit.pressed);
  if (limit.lacks_stretched() > 0.5 * limit.error())
    out += fmt::format(", strained along its axis by up to {:.2g} %", 100.0 * limit.stretched);
  return when ? out + fmt::format(" (t = {:.4g} s)", limit.when) : out;
}

bool call_large_bending(const std::vector<LinearLimit>& limits, double tolerated, Scene& scene, Notes& notes) {
  const std::string name = "large_bending";
  bool called = false;
  for (const LinearLimit& limit : limits) {
    if (!limit.may_go_on || limit.counts() <= tolerated) continue;
    BodyDef& body = scene.bodies[static_cast<size_t>(limit.body)];
    auto& beam = std::get<BeamDef>(body.kind);
    EffectChoice& choice = beam.effects;
    const auto listed = [&](const std::vector<std::string>& names) { return std::find(names.begin(), names.end(), name) != names.end(); };
    if (!choice.automatic || listed(choice.without) || listed(choice.names)) continue;
    choice.names.push_back(name);
    beam.chosen.effects = called = true;
    notes.tell(
        fmt::format("body '{}'", body.name),
        fmt::format("large_bending switched on: it {}, where displacements of second order are off by about {:.2g} of the deflection",
                    far_words(limit, "its own frame", false), limit.error()));
  }
  return called;
}

void warn_of_linear_limits(const Scene& scene, const std::vector<LinearLimit>& limits, double tolerated, Notes& into) {
  for (const LinearLimit& limit : limits) {
    if (limit.counts() <= tolerated) continue;
    const double error = limit.error();
    const BodyDef& body = scene.bodies[limit.body];
    const bool beam = std::holds_alternative<BeamDef>(body.kind);
    into.warn(fmt::format("body '{}'", body.name),
              fmt::format("{}, where linear displacements are {}: {}", far_words(limit, "its own frame"),
                          error < 0.5 ? fmt::format("wrong by about {:.2g} % of the deflection", 100.0 * error) : "wrong",
                          !beam              ? "divide it into several bodies"
                          : limit.pieces > 1 ? "take more volumes"
                          : limit.may_go_on  ? "add \"large_bending\" to 'effects', or take model = \"mixed\" with several volumes"
                                             : "take model = \"mixed\" with several volumes"));
  }
}

}  // namespace flexframe::sim
