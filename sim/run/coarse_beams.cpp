#include "sim/run/coarse_beams.h"

#include "sim/base/spatial.h"
#include "sim/bodies/beam_pieces.h"
#include "sim/results/histories.h"
#include "sim/results/sampling.h"
#include "sim/results/series.h"
#include "sim/scene/curve.h"
#include "sim/scene/section.h"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

// How a beam's largest deflection goes to and fro, or its twist.
struct Swing {
  double range = 0.0, cycles = 0.0, omega = 0.0;  // m (twist: rad), at rest the largest deflection; cycles in the run; rad/s
  bool along = false;                             // the beam's axis
  bool about = false;                             // it: a twist
  double jerk = 0.0;                              // m/s^3 (rad/s^3), amplitude of the third derivative
  double step = 0.0;                              // s, between samples
  double share = 1.0;                             // of the range, what goes to and fro so: no more is lost with its phase
};

// sqrt(2) times the root of the mean square, from central differences.
double third_derivative(const Eigen::Ref<const VecX>& values, double step) {
  const Eigen::Index n = values.size() - 4;
  if (n < 1) return 0.0;
  const VecX d = values.tail(n) - 2.0 * values.segment(3, n) + 2.0 * values.segment(1, n) - values.head(n);
  return std::sqrt(2.0 * d.squaredNorm() / static_cast<double>(n)) / (2.0 * step * step * step);
}

// Less than this share of a deflection is rounding.
constexpr double rest = 1e-9;

Swing swing_of(const ResultBody& body, double duration) {
  Swing out;
  Eigen::Index most = -1;
  const VecX ranges = column_ranges(body.displacement);
  for (Eigen::Index c = 0; c < ranges.size(); ++c)
    if (ranges[c] > out.range) out.range = ranges[c], most = c;
  if (body.displacement.size() == 0 || !(duration > 0.0)) return out;
  if (const double deflection = body.displacement.cwiseAbs().maxCoeff(); most < 0 || out.range <= rest * deflection) {
    out.range = deflection;
    return out;
  }
  const auto column = body.displacement.col(most);
  out.along = most % 3 == 0;
  out.jerk = third_derivative(column, duration / static_cast<double>(column.size() - 1));
  out.cycles = 0.5 * (column.tail(column.size() - 1) - column.head(column.size() - 1)).cwiseAbs().sum() / out.range;
  out.omega = 2.0 * std::numbers::pi * out.cycles / duration;
  return out;
}

// The twist of the node that twists most.
Swing twist_of(const ResultBody& body, double duration) {
  Swing out;
  out.about = true;
  Eigen::Index most = -1;
  const VecX ranges = column_ranges(body.rotation);
  for (Eigen::Index c = 0; c < ranges.size(); c += 3)
    if (ranges[c] > out.range) out.range = ranges[c], most = c;
  if (most < 0 || !(duration > 0.0) || out.range <= rest * body.rotation.cwiseAbs().maxCoeff()) return {};
  const auto column = body.rotation.col(most);
  out.step = duration / static_cast<double>(column.size() - 1);
  out.jerk = third_derivative(column, out.step);
  out.cycles = 0.5 * (column.tail(column.size() - 1) - column.head(column.size() - 1)).cwiseAbs().sum() / out.range;
  out.omega = 2.0 * std::numbers::pi * out.cycles / duration;
  return out;
}

// The plane in which a beam bends most easily.
struct Bending {
  double ei = 0.0;  // N m^2; 0: it does not bend
  // With shear: the elements' shear wave, square of its speed, m^2/s^2, and the share (EI / kGA + I / A) / L^2 by which shear and rotary
  // inertia slow short waves. 0 without.
  double wave_speed_2 = 0.0, slowed = 0.0;
};

bool is_on(const std::vector<EffectState>& effects, const std::string& owner, std::string_view effect) {
  return std::any_of(effects.begin(), effects.end(), [&](const EffectState& s) { return s.owner == owner && s.effect == effect && s.on; });
}

double shear_modulus(const Material& m) { return m.youngs_modulus / (2.0 * (1.0 + m.poisson)); }

Bending bending_of(const BeamDef& beam, const std::string& owner, const std::vector<EffectState>& effects) {
  Bending least;
  const double E = beam.material.youngs_modulus, A = beam.section.area;
  for (const bool xy : {true, false}) {
    if (!is_on(effects, owner, xy ? "bending_xy" : "bending_xz")) continue;
    const double I = xy ? beam.section.iz : beam.section.iy, k = xy ? beam.section.shear_y : beam.section.shear_z;
    if (least.ei > 0.0 && E * I >= least.ei) continue;
    least = {E * I, 0.0, 0.0};
    if (k <= 0.0 || !is_on(effects, owner, "shear")) continue;
    least.wave_speed_2 = k * shear_modulus(beam.material) / beam.material.density;
    least.slowed = (E * I / (k * shear_modulus(beam.material) * A) + I / A) / (beam.length * beam.length);
  }
  return least;
}

// Share of a mode's part of the deflection, relative to its range, that is lost with the phase of a vibration whose frequency is off by
// `slip` over `passed` radians.
double lost_share(double part, double slip, double passed) { return part * std::min(1.0, 0.5 * slip * passed); }

// A damped vibration has died before it has lost more.
double until_damped(const BeamDef& beam, std::size_t mode, double passed) {
  const std::vector<double>& ratio = beam.damping.ratio;
  const double zeta = ratio.empty() ? 0.0 : ratio[std::min(mode, ratio.size() - 1)];
  return zeta > 0.0 ? std::min(passed, 1.0 / zeta) : passed;
}

// What the lost phase of its vibrations moves the deflection by, relative to its range: of a cantilever let go at its tip, whose mode k has
// the share 12 / lambda_k^4 of the deflection. With shear the elements' static forms make a frequency w too high by (w h / c)^2 / 24
// besides, c the speed of shear waves (frequencies of Timoshenko's cantilevers of 2 to 20 heights, 5 to 20 elements: within a quarter).
double lost_phase(const BeamDef& beam, double elements, double wave, const Swing& swing, const Bending& bending) {
  constexpr double lambda[] = {1.8751, 4.6941, 7.8548, 10.9955};
  double sum = 0.0;
  for (std::size_t k = 0; k < std::size(lambda); ++k) {
    const double faster = lambda[k] / lambda[0], kh = wave * faster / elements, h = beam.length / elements;
    const double slowed = (1.0 + bending.slowed * lambda[0] * lambda[0]) / (1.0 + bending.slowed * lambda[k] * lambda[k]);
    const double times = faster * faster * std::sqrt(slowed);  // the first frequency
    const double passed = until_damped(beam, k, 2.0 * std::numbers::pi * swing.cycles * times);
    double slip =
        beam.model == BeamModel::lumped ? kh * kh / (beam.curvature_coupling ? 45.0 : 15.0) : std::min(0.1, std::pow(kh, 4) / 2880.0);
    if (bending.wave_speed_2 > 0.0) slip += std::pow(swing.omega * times * h, 2) / (24.0 * bending.wave_speed_2);
    sum += lost_share(12.0 / std::pow(lambda[k], 4), slip, passed);
  }
  return sum;
}

// The same of a twist: linear elements (and rigid pieces) whose mode k = 1, 3, 5 .. has the share 8 / (k pi)^2 of a shaft let go at its end
// and a frequency off by (k h)^2 / 24. All modes are in step where such a shaft turns round, so that their shares add up.
double lost_phase_about(const BeamDef& beam, double elements, double wave, double cycles) {
  constexpr std::size_t modes = 20;
  double sum = 0.0;
  for (std::size_t mode = 0; mode < modes; ++mode) {
    const double times = 2.0 * static_cast<double>(mode) + 1.0, kh = wave * times / elements;
    sum += lost_share(8.0 / std::pow(times * std::numbers::pi, 2), kh * kh / 24.0,
                      until_damped(beam, mode, 2.0 * std::numbers::pi * cycles * times));
  }
  return sum;
}

// The same of a deflection along the axis or a twist: a vibration a cos(w t) in linear elements is ahead by w (k h)^2 / 24 t, k = w / c, so
// it is off by h^2 / (24 c^2) t times a w^3, its third derivative; so is any sum of them. speed: c, m/s.
double lost_phase_along(const BeamDef& beam, double elements, const Swing& swing, double duration, double speed) {
  const double h = beam.length / elements;
  return std::min(1.0, h * h / (24.0 * speed * speed) * duration * swing.jerk / swing.range);
}

// Whether a joint holds this end of a beam.
bool is_held(const Scene& scene, const std::string& body, std::string_view end) {
  const auto here = [&](const FrameRef& f) { return f.body == body && (f.frame == end || (f.frame.empty() && end == "root")); };
  return std::any_of(scene.joints.begin(), scene.joints.end(), [&](const JointDef& j) { return here(j.parent) || here(j.child); });
}

// By how much of the deflection the pieces of a beam whose section changes are off, at rest under a force at an end, the other one held.
double missed_by_pieces(const Scene& scene, const BeamDef& beam, const std::string& owner, const std::vector<EffectState>& effects) {
  constexpr int places = 400;
  // Deflections: tip and root under bending in both planes, then stretch and twist.
  using Deflections = Eigen::Array<double, 6, 1>;
  Deflections pieces = Deflections::Zero(), changing = Deflections::Zero(), counts;
  const auto add = [](Deflections& sum, const Section& s, double x) {
    const double near = x * x, far = (1.0 - x) * (1.0 - x);
    sum += Deflections(far / s.iz, near / s.iz, far / s.iy, near / s.iy, 1.0 / s.area, 1.0 / s.j);
  };
  for (int i = 0; i < places; ++i) {
    const double x = (i + 0.5) / places;
    add(changing, section_at(beam, x), x);
    add(pieces, piece_section(beam, locate_piece(beam, x).first), x);
  }
  const bool xy = is_on(effects, owner, "bending_xy"), xz = is_on(effects, owner, "bending_xz");
  const bool root = is_held(scene, owner, "root"), tip = is_held(scene, owner, "tip");
  const bool at_tip = root || !tip, at_root = tip || !root;
  counts << (xy && at_tip), (xy && at_root), (xz && at_tip), (xz && at_root), is_on(effects, owner, "axial"),
      is_on(effects, owner, "torsion");
  return (counts * (pieces / changing - 1.0).abs()).maxCoeff();
}

// Displacements of an end by forces there, m/N (3 x 3), the other end held: sums of what sections along the axis give way.
class EndFlexibility {
 public:
  EndFlexibility(const BeamDef& beam, const Vec3& end, const std::vector<EffectState>& effects, const std::string& owner)
      : beam_(beam), end_(end) {
    const double E = beam.material.youngs_modulus, G = E / (2.0 * (1.0 + beam.material.poisson));
    moduli_ << (is_on(effects, owner, "torsion") ? G : 0.0), (is_on(effects, owner, "bending_xz") ? E : 0.0),
        (is_on(effects, owner, "bending_xy") ? E : 0.0);
  }

  // A stretch of the axis, m, at x/L = s: its middle and its axes.
  void add(double stretch, double s, const Vec3& place, const Mat3& axes) {
    const Section section = section_at(beam_, s);
    const Vec3 stiffness = moduli_.cwiseProduct(Vec3(section.j, section.iy, section.iz));
    const Mat3 moments = axes.transpose() * cross_matrix(end_ - place);
    for (int i = 0; i < 3; ++i)
      if (stiffness[i] > 0.0) sum_ += stretch / stiffness[i] * moments.row(i).transpose() * moments.row(i);
  }

  const Mat3& value() const { return sum_; }

 private:
  static Mat3 cross_matrix(const Vec3& v) { return (Mat3() << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0).finished(); }

  const BeamDef& beam_;
  Vec3 end_, moduli_;
  Mat3 sum_ = Mat3::Zero();
};

// The largest deflection of a run, m, in the axes of the shown frame.
Vec3 largest_deflection(const ResultBody& body) {
  Vec3 out = Vec3::Zero();
  for (Eigen::Index i = 0; i < body.displacement.rows(); ++i)
    for (Eigen::Index c = 0; c + 2 < body.displacement.cols(); c += 3)
      if (const Vec3 u = body.displacement.row(i).segment<3>(c); u.squaredNorm() > out.squaredNorm()) out = u;
  return out;
}

// By how much of the deflection the straight pieces of a curved axis are off, at rest under that force at one end which
// bends it there as the run did. Directions in which the end gives way twenty times less than in others are left to the effects that
// count there.
double missed_by_chords(const BeamDef& beam, const std::string& owner, const std::vector<EffectState>& effects, bool held_at_root,
                        const Vec3& deflection) {
  constexpr int places = 200;
  const SpaceCurve& curve = *beam.axis;
  EndFlexibility curved(beam, curve.at(held_at_root ? beam.length : 0.0).place, effects, owner), pieces = curved;
  const auto turned = [](const Mat3& axes, const Vec3& x) { return Mat3(shortest_turn(axes.col(0), x) * axes); };
  Mat3 axes = Mat3::Identity();
  int done = 0;
  // Sections of both stand in axes that are carried along the curve without twist.
  for (int i = 0; i < places; ++i) {
    const double s = (i + 0.5) / places;
    const SpaceCurve::Jet at = curve.at(s * beam.length);
    axes = turned(axes, at.tangent.normalized());
    curved.add(beam.length / places, s, at.place, axes);
    while (done < piece_count(beam) && piece_start(beam, done) + 0.5 * piece_length(beam, done) <= (i + 1.0) / places * beam.length) {
      const double length = piece_length(beam, done), middle = (piece_start(beam, done) + 0.5 * length) / beam.length;
      const Pose pose = chord_pose(beam, done);
      const Vec3 chord = piece_of(beam, done, 0.0).length * pose.R.col(0);
      for (const double share : {0.5 - 0.5 / std::numbers::sqrt3, 0.5 + 0.5 / std::numbers::sqrt3})  // Gauss: exact for straight pieces
        pieces.add(0.5 * length, middle, pose.p + share * chord, turned(axes, pose.R.col(0)));
      ++done;
    }
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> principal(curved.value());
  constexpr double stiff = 0.05;
  Vec3 force = Vec3::Zero(), moved = Vec3::Zero();
  for (int i = 0; i < 3; ++i) {
    const Vec3 direction = principal.eigenvectors().col(i);
    if (!(principal.eigenvalues()[i] > stiff * principal.eigenvalues()[2])) continue;
    moved += direction.dot(deflection) * direction;
    force += direction.dot(deflection) / principal.eigenvalues()[i] * direction;
  }
  return moved.norm() > 0.0 ? ((pieces.value() - curved.value()) * force).norm() / moved.norm() : 0.0;
}

// Whether an output is of this body, or of a joint or force on it.
bool belongs_to(const Scene& scene, const OutputDef& output, const std::string& body) {
  if (output.of.body == body) return true;
  for (const JointDef& j : scene.joints)
    if (j.name == output.of.body) return j.parent.body == body || j.child.body == body;
  return false;
}

const OutputDef* output_of(const Scene& scene, const std::string& column) {
  const OutputDef* found = nullptr;
  for (const OutputDef& output : scene.outputs)
    if ((column == output.name || column.starts_with(output.name + ".")) && (!found || output.name.size() > found->name.size()))
      found = &output;
  return found;
}

// By how much of its range a column moves where the deflection (m), or the twist (rad), errs by `error`.
double moved_share(const std::string& unit, const Swing& swing, const BeamDef& beam, double error, double range) {
  double size = error;
  if (swing.about) {
    // The torque at the end that holds it, and its stress in a round section of the same area.
    const Section& s = beam.section;
    const double torque = shear_modulus(beam.material) * s.j * 0.5 * std::numbers::pi / beam.length * error;
    if (unit == "N m") return std::min(1.0, torque / range);
    if (unit == "Pa") return std::min(1.0, std::sqrt(3.0 * s.area / std::numbers::pi) * torque / s.j / range);
    if (!unit.starts_with("rad")) return 0.0;
    size = std::min(size, swing.share * swing.range);
  } else {
    if (unit.starts_with("N") || unit == "Pa") return error / swing.range;
    size = std::min(size, swing.share * swing.range);
    if (unit.starts_with("rad")) size /= beam.length;
    else if (!unit.starts_with("m")) return 0.0;
  }
  if (unit.ends_with("/s")) size *= swing.omega;
  if (unit.ends_with("/s^2") || unit.ends_with("/s2")) size *= swing.omega * swing.omega;
  return std::min(1.0, size / range);
}

}  // namespace

namespace {

// What an error of the deflection, m, does to the outputs on the body; none: share 0.
CoarseBeam worst_output(const Scene& scene, const Histories& run, const VecX& ranges, const BodyDef& body, const Swing& swing,
                        double error) {
  CoarseBeam worst{body.name, "", 0.0, swing.omega / (2.0 * std::numbers::pi), 0, 0};
  for (size_t c = 0; c < run.columns.size(); ++c) {
    const OutputDef* output = output_of(scene, run.columns[c]);
    double range = ranges[static_cast<Eigen::Index>(c)];
    // What stands still counts against the deflection.
    if (range == 0.0 && run.units[c] == "m" && !swing.about) range = swing.range;
    if (!output || !(range > 0.0) || !belongs_to(scene, *output, body.name)) continue;
    const double share = moved_share(run.units[c], swing, std::get<BeamDef>(body.kind), error, range);
    if (share > worst.share) worst.share = share, worst.column = run.columns[c];
  }
  return worst;
}

// Slower than the lowest vibration of a cantilever with a heavy tip: the deflection follows its loads and keeps their phase.
constexpr double slowest = 0.9;

// Relative to the range of the deflection (or twist), or to its size where it rests.
double missed_by_elements(const BeamDef& beam, const Swing& swing, const Bending& bending, double duration) {
  const bool lumped = beam.model == BeamModel::lumped;
  const double n = beam.elements * (beam.model == BeamModel::mixed ? beam.volumes : 1);
  if (swing.about) {
    const Section& s = beam.section;
    const double speed = std::sqrt(shear_modulus(beam.material) * s.j / (beam.material.density * (s.iy + s.iz)));
    const double wave = beam.length * swing.omega / speed;
    if (wave < slowest) return 0.0;
    const double let_go = lost_phase_about(beam, n, wave, swing.cycles);
    // What sways smoothly loses less, as its third derivative tells where samples show the fifth of a shaft's modes.
    const bool shown = 9.0 * swing.omega * swing.step < 2.0;
    return shown ? std::min(let_go, lost_phase_along(beam, n, swing, duration, speed)) : let_go;
  }
  const double wave = beam.length * std::pow(beam.material.density * beam.section.area * swing.omega * swing.omega / bending.ei, 0.25);
  const double still = lumped && !beam.curvature_coupling ? 0.5 / (n * n) : 0.0;
  if (swing.along && !lumped)
    return lost_phase_along(beam, n, swing, duration, std::sqrt(beam.material.youngs_modulus / beam.material.density));
  return still + (wave >= slowest ? lost_phase(beam, n, wave, swing, bending) : 0.0);
}

// Half a per cent.
constexpr double enough = 0.005;
constexpr int most_volumes = 100;

// Beams whose elements the formulas judge.
const BeamDef* judged_beam(const BodyDef& def) {
  const auto* beam = std::get_if<BeamDef>(&def.kind);
  return beam && beam->model != BeamModel::modal && !beam->keep_modes && beam->modes.empty() ? beam : nullptr;
}

}  // namespace

std::vector<size_t> beams_between_samples(const Scene& scene, const Model& model, const std::vector<EffectState>& effects,
                                          const Results& results, double asked) {
  std::vector<size_t> out;
  constexpr Eigen::Index fewest_samples = 3;
  // Waves along a rod have fronts: rates and forces err by up to five times what the deflection tells (rods that strike each other: 1.8e-2,
  // 5.5e-2, 8e-2 told by it where 5.3e-2, 1.1e-1, 1.6e-1 are true; below a hundredth nothing was told where 2.3e-2 was true).
  constexpr double of_waves = 0.2;
  const auto is_place = [](const Histories& h, const std::string& column) {
    const auto at = std::find(h.columns.begin(), h.columns.end(), column) - h.columns.begin();
    return static_cast<size_t>(at) < h.units.size() && (h.units[at] == "m" || h.units[at] == "rad");
  };
  if (results.times.size() < fewest_samples) return out;
  const Histories run = to_histories(results);
  const VecX ranges = output_ranges(run);
  const double duration = results.times[results.times.size() - 1];
  for (size_t b = 0; b < scene.bodies.size() && b < results.bodies.size(); ++b) {
    const BodyDef& def = scene.bodies[b];
    const BeamDef* beam = judged_beam(def);
    if (!beam) continue;
    // A guess from few samples does: the run with more elements decides.
    const std::optional<UnseenSwing> unseen = unseen_swing(model, static_cast<int>(b), results, fewest_samples);
    const Bending bending = bending_of(*beam, def.name, effects);
    Swing swing = swing_of(results.bodies[b], duration);
    if (!(bending.ei > 0.0) || !(swing.range > 0.0)) continue;
    const auto worst = [&] {
      return worst_output(scene, run, ranges, def, swing, missed_by_elements(*beam, swing, bending, duration) * swing.range);
    };
    const CoarseBeam told = worst();
    if (told.share > asked) continue;  // told of already
    if (swing.along && told.share > of_waves * asked && !is_place(run, told.column)) {
      out.push_back(b);
      continue;
    }
    if (!unseen) continue;
    swing.cycles = std::max(swing.cycles, unseen->share * unseen->radians / (2.0 * std::numbers::pi));
    swing.omega = std::max(swing.omega, unseen->radians / duration);
    swing.share = unseen->share;
    if (worst().share > asked) out.push_back(b);
  }
  return out;
}

std::vector<CoarseBeam> coarse_beams(const Scene& scene, const std::vector<EffectState>& effects, const Results& results) {
  std::vector<CoarseBeam> out;
  if (results.times.size() < 3) return out;
  const Histories run = to_histories(results);
  const VecX ranges = output_ranges(run);
  for (const BodyDef& def : scene.bodies) {
    const BeamDef* beam = judged_beam(def);
    if (!beam) continue;
    const auto body = std::find_if(results.bodies.begin(), results.bodies.end(), [&](const ResultBody& b) { return b.name == def.name; });
    const Bending bending = bending_of(*beam, def.name, effects);
    if (body == results.bodies.end()) continue;
    const double duration = results.times[results.times.size() - 1];
    const Swing swing = swing_of(*body, duration);
    CoarseBeam worst;
    const auto judge = [&](const Swing& one) {
      worst = worst_output(scene, run, ranges, def, one, missed_by_elements(*beam, one, bending, duration) * one.range);
      if (!(worst.share > 0.0)) return;
      const bool second_order = beam->model == BeamModel::lumped || one.along || one.about || bending.wave_speed_2 > 0.0;
      worst.elements = beam->elements * (beam->model == BeamModel::mixed ? beam->volumes : 1);
      worst.wanted = static_cast<int>(std::ceil(worst.elements * std::pow(worst.share / enough, second_order ? 0.5 : 0.25)));
      out.push_back(worst);
    };
    if (is_on(effects, def.name, "torsion"))
      if (const Swing twist = twist_of(*body, duration); twist.range > 0.0) judge(twist);
    if (!(bending.ei > 0.0) || !(swing.range > 0.0)) continue;
    judge(swing);
    if (beam->axis) {
      const double missed = missed_by_chords(*beam, def.name, effects, is_held(scene, def.name, "root"), largest_deflection(*body));
      worst = worst_output(scene, run, ranges, def, swing, missed * swing.range);
      if (!(worst.share > enough)) continue;
      worst.cause = CoarseBeam::Cause::axis;
      worst.elements = beam->volumes;
      worst.wanted = static_cast<int>(std::ceil(beam->volumes * std::sqrt(worst.share / enough)));
      out.push_back(worst);
      continue;
    }
    if (beam->stations.empty()) continue;
    worst = worst_output(scene, run, ranges, def, swing, missed_by_pieces(scene, *beam, def.name, effects) * swing.range);
    if (!(worst.share > enough)) continue;
    BeamDef finer = *beam;
    while (finer.volumes < most_volumes && missed_by_pieces(scene, finer, def.name, effects) > enough) ++finer.volumes;
    worst.cause = CoarseBeam::Cause::section;
    worst.elements = beam->volumes;
    worst.wanted = finer.volumes;
    out.push_back(worst);
  }
  return out;
}

std::vector<size_t> coarse_bodies(const std::vector<CoarseBeam>& beams, const Scene& scene, double asked) {
  std::vector<size_t> out;
  for (size_t b = 0; b < scene.bodies.size(); ++b)
    if (std::any_of(beams.begin(), beams.end(), [&](const CoarseBeam& beam) {
          return beam.body == scene.bodies[b].name && beam.cause == CoarseBeam::Cause::vibration && beam.share > asked;
        }))
      out.push_back(b);
  return out;
}

std::vector<CoarseBeam> unmeasured_beams(std::vector<CoarseBeam> beams, const Scene& scene, const std::vector<size_t>& measured) {
  std::erase_if(beams, [&](const CoarseBeam& beam) {
    return beam.cause == CoarseBeam::Cause::vibration &&
           std::any_of(measured.begin(), measured.end(), [&](size_t b) { return scene.bodies[b].name == beam.body; });
  });
  return beams;
}

namespace {

// Of the largest bending moment M, by the turns of neighbouring nodes: M L / sqrt(EI GJ) with the EI across it. A cantilever tips over at
// 4.01 (force at its tip), at pi / 2 under an even moment; linear twist in ten elements makes the load 0.3 % too large, so that a
// deflection aside at 0.6 of it is 0.3 % off, at 0.8 1.1 %.
double moment_for_tipping(const BeamDef& beam, const ResultBody& body) {
  const Section& s = beam.section;
  const double E = beam.material.youngs_modulus, GJ = shear_modulus(beam.material) * s.j;
  const double weak_y = std::sqrt(E * s.iy * GJ), weak_z = std::sqrt(E * s.iz * GJ);
  double most = 0.0;
  for (size_t k = 0; k + 1 < body.nodes.size(); ++k) {
    const double dx = std::abs(body.nodes[k + 1].origin.x() - body.nodes[k].origin.x());
    const auto at = static_cast<Eigen::Index>(3 * k);
    if (!(dx > 0.0) || at + 5 >= body.rotation.cols()) continue;
    const MatX turned = body.rotation.middleCols(at + 3, 3) - body.rotation.middleCols(at, 3);
    const double about_y = turned.col(1).cwiseAbs().maxCoeff() / dx, about_z = turned.col(2).cwiseAbs().maxCoeff() / dx;
    most = std::max({most, E * s.iy * about_y * beam.length / weak_z, E * s.iz * about_z * beam.length / weak_y});
  }
  return most;
}

// Of the even moment under which a cantilever tips over, a half.
constexpr double may_tip = 0.25 * std::numbers::pi;

}  // namespace

std::vector<size_t> beams_that_may_tip(const Scene& scene, const std::vector<EffectState>& effects, const Results& results) {
  std::vector<size_t> out;
  for (size_t b = 0; b < scene.bodies.size() && b < results.bodies.size(); ++b) {
    const BodyDef& def = scene.bodies[b];
    const auto* beam = std::get_if<BeamDef>(&def.kind);
    if (!beam || beam->model == BeamModel::modal || beam->model == BeamModel::lumped || beam->axis) continue;
    const bool couples = is_on(effects, def.name, "torsion") && is_on(effects, def.name, "bending_xy") &&
                         is_on(effects, def.name, "bending_xz") && is_on(effects, def.name, "stiffening");
    if (couples && moment_for_tipping(*beam, results.bodies[b]) > may_tip) out.push_back(b);
  }
  return out;
}

void warn_of_tipping(const Scene& scene, const std::vector<EffectState>& effects, const Results& results, Notes& notes) {
  for (size_t b = 0; b < scene.bodies.size() && b < results.bodies.size(); ++b) {
    const std::string& name = scene.bodies[b].name;
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind);
    if (!beam || !is_on(effects, name, "large_bending") || results.bodies[b].nodes.size() < 2) continue;
    const double bent = is_on(effects, name, "bending_xy") ? beam->section.iz : beam->section.iy;
    const double across = is_on(effects, name, "bending_xy") ? beam->section.iy : beam->section.iz;
    const double moment = moment_for_tipping(*beam, results.bodies[b]);
    // A section as stiff in both planes does not tip, however far it bends: of an even moment 1 - EI_across / EI counts (Timoshenko, Gere
    // 1961, 6.3).
    if (!(bent > across) || moment * std::sqrt(1.0 - across / bent) <= 2.0 * may_tip) continue;
    notes.warn(fmt::format("body '{}'", name),
               fmt::format("bends across its stiff way so far that it may tip over sideways, which this scene does not show: M L / sqrt(EI "
                           "GJ) reaches {:.2g}, and a cantilever tips at 1.6 under an even moment, at 4.0 under a force at its tip; take "
                           "model = \"mixed\" with the effects bending_xz, bending_xy and torsion",
                           moment));
  }
}

namespace {

// The longest stretch between ends of elements, relative to the beam's length: frames are such ends too.
double longest_span(const BeamDef& beam) {
  const int n = beam.elements * (beam.model == BeamModel::mixed ? beam.volumes : 1);
  std::vector<double> ends;
  for (int i = 0; i <= n; ++i) ends.push_back(i / static_cast<double>(n));
  for (const auto& [name, share] : beam.frames) ends.push_back(share);
  std::sort(ends.begin(), ends.end());
  double out = 0.0;
  for (size_t i = 0; i + 1 < ends.size(); ++i) out = std::max(out, ends[i + 1] - ends[i]);
  return out;
}

// N/m, of the weight and of constant loads along the beam.
double load_along(const Scene& scene, const BodyDef& def, const BeamDef& beam) {
  double out = beam.material.density * beam.section.area * scene.simulation.gravity.norm();
  for (const ForceDef& f : scene.forces) {
    double value = 0.0;
    const char* end = f.value.data() + f.value.size();
    if (f.kind == ForceKind::distributed && f.on.body == def.name && std::from_chars(f.value.data(), end, value).ptr == end)
      out += std::abs(value);
  }
  return out;
}

}  // namespace

void tell_of_bare_spans(const Scene& scene, const std::vector<EffectState>& effects, const Results& results, bool pictures, double asked,
                        Notes& notes) {
  for (const BodyDef& def : scene.bodies) {
    const BeamDef* beam = judged_beam(def);
    const auto body = std::find_if(results.bodies.begin(), results.bodies.end(), [&](const ResultBody& b) { return b.name == def.name; });
    if (!beam || beam->model == BeamModel::lumped || body == results.bodies.end() || body->displacement.size() == 0) continue;
    const Vec3 bent = largest_deflection(*body);
    const bool xy = is_on(effects, def.name, "bending_xy"), xz = is_on(effects, def.name, "bending_xz");
    const double iy = beam->section.iy, iz = beam->section.iz;
    const bool in_xy = xy && (!xz || (bent.norm() > 0.0 ? std::abs(bent.y()) > std::abs(bent.z()) : iz < iy));
    if (!xy && !xz) continue;
    const double span = longest_span(*beam) * beam->length, stiffness = beam->material.youngs_modulus * (in_xy ? iz : iy);
    const double missed = load_along(scene, def, *beam) * std::pow(span, 4) / (384.0 * stiffness);
    // Ends that turn alone bend what lies between them too.
    const double turned = body->rotation.size() > 0 ? 0.25 * span * body->rotation.cwiseAbs().maxCoeff() : 0.0;
    const double share = missed / (missed + std::max(turned, bent.norm()));
    if (!(share > asked)) continue;
    const int elements = beam->elements * (beam->model == BeamModel::mixed ? beam->volumes : 1);
    const std::string owner = fmt::format("body '{}'", def.name);
    const std::string text = fmt::format(
        "between the ends of its {} element{} pictures lack up to {:.2g} of its largest displacement, by which loads along "
        "it bend it there; the ends are right; take elements = {}{}",
        elements, elements == 1 ? "" : "s", share, static_cast<int>(std::ceil(elements * std::pow(share / enough, 0.25))),
        beam->model == BeamModel::mixed ? " in all volumes together" : "");
    if (pictures) notes.warn(owner, text);
    else notes.tell(owner, text);
  }
}

void warn_of_coarse_beams(const std::vector<CoarseBeam>& beams, double asked, Notes& notes) {
  for (const CoarseBeam& b : beams)
    if (b.share > asked && b.cause == CoarseBeam::Cause::axis)
      notes.warn(fmt::format("body '{}'", b.body),
                 fmt::format("its {} straight volumes are too few for its curved axis: about {:.2g} of the range of {}; take volumes = {}",
                             b.elements, b.share, b.column, b.wanted));
    else if (b.share > asked && b.cause == CoarseBeam::Cause::section)
      notes.warn(
          fmt::format("body '{}'", b.body),
          fmt::format("its {} volumes, each of one section, are too few for how the section changes: about {:.2g} of the range of {}; "
                      "take volumes = {}",
                      b.elements, b.share, b.column, b.wanted));
    else if (b.share > asked)
      notes.warn(fmt::format("body '{}'", b.body),
                 fmt::format("its {} element{} too few for how it moves ({:.3g} cycles a second): about {:.2g} of the range of {}; take "
                             "{} or more (of a mixed beam in all volumes together)",
                             b.elements, b.elements == 1 ? " is" : "s are", b.frequency, b.share, b.column, b.wanted));
}

}  // namespace flexframe::sim
