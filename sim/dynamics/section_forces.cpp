#include "sim/dynamics/section_forces.h"

#include "sim/bodies/beam_pieces.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/loads.h"
#include "sim/model/bodies.h"
#include "sim/scene/section.h"

#include <algorithm>

namespace flexframe::sim {
namespace {

// Forces between nodes are integrated by trapezoids: no interval is longer than this share of the part.
constexpr double longest_interval = 0.13;

// Slopes of the axis' deflection along y and z from the rotation of its sections (shear turns them by less than they have of it).
Mat3X slopes(const Mat3X& psi) {
  Mat3X out = Mat3X::Zero(3, psi.cols());
  out.row(1) = psi.row(2);
  out.row(2) = -psi.row(1);
  return out;
}

Vec3 slope_of(const Vec3& turned) { return {0.0, turned.z(), -turned.y()}; }

// Shapes of the axis at x: deflections by the cubic that the neighbouring nodes' sections tell, the rest straight between them.
MatX shapes_at(const Part& part, const std::vector<int>& nodes, double x) {
  const int n = part.body.n;
  MatX phi = MatX::Zero(3, n), psi = phi;
  if (n > 0 && !nodes.empty()) {
    const auto node = [&](size_t k) -> const FlexibleNode& { return part.body.nodes[nodes[k]]; };
    size_t k = 0;
    while (k + 1 < nodes.size() && node(k + 1).origin.x() < x) ++k;
    const size_t next = std::min(k + 1, nodes.size() - 1);
    const double span = node(next).origin.x() - node(k).origin.x(),
                 s = span > 0.0 ? std::clamp((x - node(k).origin.x()) / span, 0.0, 1.0) : 0.0;
    phi = (1.0 - s) * node(k).phi + s * node(next).phi;
    psi = (1.0 - s) * node(k).psi + s * node(next).psi;
    if (s > 0.0 && s < 1.0) {
      Mat3X chord = (node(next).phi - node(k).phi) / span;
      chord.row(0).setZero();
      phi += span * s * (1.0 - s) * ((1.0 - s) * (slopes(node(k).psi) - chord) - s * (slopes(node(next).psi) - chord));
    }
  }
  MatX out(6, n);
  out << phi, psi;
  return out;
}

// What the part's inertia has beyond that of its axis, per length.
void set_rotary(const FlexibleBody& body, double length, CutBeam& beam) {
  const double axis = body.mass * length * length / 3.0;
  const Vec6& J = body.J0;
  beam.rotary << J[0], J[3], J[4], J[3], J[1] - axis, J[5], J[4], J[5], J[2] - axis;
  beam.rotary /= length;
  constexpr double rounding = 1e-13;
  beam.turns = beam.rotary.bottomRightCorner<2, 2>().cwiseAbs().maxCoeff() > rounding * axis / length;
  // Whole sections have iy + iz about x (rotary_inertia of beam_terms.h).
  beam.tilts = beam.turns && beam.rotary(1, 1) + beam.rotary(2, 2) > (1.0 - 1e-9) * beam.rotary(0, 0);
  if (!beam.turns) beam.rotary = Vec3(J[0] / length, 0.0, 0.0).asDiagonal();
}

double place_of(const Model& model, int frame) {
  const FramePoint& f = model.frames[frame];
  return f.node < 0 ? f.offset.p.x() : model.parts[f.part].body.nodes[f.node].origin.x();
}

}  // namespace

SectionForces::SectionForces(const Model& model, const Scene& scene) : at_(model.frames.size(), {-1, -1}) {
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& part = model.parts[i];
    const auto* def = part.scene_body < 0 ? nullptr : std::get_if<BeamDef>(&scene.bodies[part.scene_body].kind);
    if (!def) continue;
    CutBeam beam;
    beam.part = static_cast<int>(i);
    beam.body = part.scene_body;
    const Section section = piece_section(*def, part.piece);
    if (def->axis) beam.longer = piece_length(*def, part.piece) / piece_of(*def, part.piece, 0.0).length;
    beam.mass_per_length = beam.longer * def->material.density * section.area;
    beam.shortens = !part.body.nodes.empty() && part.body.nodes.back().phi2[0].size() > 0;
    const double length = part.body.mass / beam.mass_per_length, same = 1e-9 * def->length;
    if (def->axis) beam.rotary(0, 0) = beam.longer * def->material.density * mass_moments(section).head<2>().sum();
    else set_rotary(part.body, length, beam);
    std::vector<double> x{0.0, length};
    std::vector<int> nodes;
    for (size_t k = 0; k < part.body.nodes.size(); ++k) {
      nodes.push_back(static_cast<int>(k));
      x.push_back(part.body.nodes[k].origin.x());
    }
    std::stable_sort(nodes.begin(), nodes.end(),
                     [&](int a, int b) { return part.body.nodes[a].origin.x() < part.body.nodes[b].origin.x(); });
    for (size_t f = 0; f < model.frames.size(); ++f)
      if (model.frames[f].part == beam.part) x.push_back(place_of(model, static_cast<int>(f)));
    for (double& place : x) place = std::clamp(place, 0.0, length);
    std::sort(x.begin(), x.end());
    x.erase(std::unique(x.begin(), x.end(), [&](double a, double b) { return b - a <= same; }), x.end());
    for (size_t k = 0; k + 1 < x.size(); ++k) {
      const double start = x[k], span = x[k + 1] - x[k];
      const int pieces = std::max(1, static_cast<int>(std::ceil(span / (longest_interval * length))));
      for (int p = 0; p < pieces; ++p) beam.x.push_back(start + span * p / pieces);
    }
    beam.x.push_back(x.back());
    beam.shapes.resize(6 * static_cast<Eigen::Index>(beam.x.size()), part.body.n);
    beam.moved = MatX::Zero(beam.shapes.rows(), 3);
    for (const double place : beam.x) {
      beam.shapes.middleRows<6>(6 * static_cast<Eigen::Index>(beam.beside.size())) = shapes_at(part, nodes, place);
      const double s = def->axis ? (piece_start(*def, part.piece) + place * beam.longer) / def->length : 0.0;
      beam.beside.push_back(beside_piece(*def, part.piece, s));
    }
    for (size_t f = 0; f < model.frames.size(); ++f) {
      if (model.frames[f].part != beam.part) continue;
      const double place = std::clamp(place_of(model, static_cast<int>(f)), 0.0, length);
      const auto nearest =
          std::min_element(beam.x.begin(), beam.x.end(), [&](double a, double b) { return std::abs(a - place) < std::abs(b - place); });
      at_[f] = {static_cast<int>(beams_.size()), static_cast<int>(nearest - beam.x.begin())};
    }
    beam.place.resize(beam.x.size());
    beam.axes.resize(beam.x.size());
    beam.beyond_rate.assign(beam.x.size(), Vec3::Zero());
    beam.beyond_second = beam.beyond_rate;
    beam.left.resize(beam.x.size() - 1);
    beam.right.resize(beam.x.size() - 1);
    acting_.emplace_back(beam.x.size(), Vec6::Zero());
    beams_.push_back(std::move(beam));
  }
}

void SectionForces::collect(const Model& model, Work& work, const Reactions& reactions) {
  for (std::vector<Vec6>& acting : acting_) std::fill(acting.begin(), acting.end(), Vec6::Zero());
  const auto add = [&](int frame, const Vec6& F) {
    const auto [b, k] = at_[frame];
    if (b < 0) return;
    update_frame_pose(model, frame, work);
    const Pose& pose = work.frames[frame].pose;
    const Vec3 f = pose.R * F.head<3>(), m = pose.R * F.tail<3>();
    Vec6& sum = acting_[b][k];
    sum.head<3>() += f;
    sum.tail<3>() += m + (pose.p - beams_[b].place[k]).cross(f);
  };
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& part = model.parts[i];
    add(part.joint.outboard, reactions.part[i]);
    if (part.parent != ground) add(part.joint.inboard, -wrench_to_parent(work.parts[i].joint.pose, reactions.part[i]));
  }
  for (size_t l = 0; l < model.loops.size(); ++l) {
    const LoopJoint& loop = model.loops[l];
    for (const int f : {loop.a, loop.b}) update_frame_pose(model, f, work);
    const Pose relative = compose(inverse(frame_world(model, work, loop.a)), frame_world(model, work, loop.b));
    add(loop.b, reactions.loop[l]);
    add(loop.a, -wrench_to_parent(relative, reactions.loop[l]));
  }
  for (const FrameWrench& w : frame_wrenches(model, work)) add(w.frame, w.F);
}

void SectionForces::cut(const Model& model, const Work& work, size_t beam) {
  CutBeam& b = beams_[beam];
  const PartWork& p = work.parts[b.part];
  const bool elastic = p.qdd.size() > 0;
  const Vec3 w = p.V.tail<3>(), spin = p.A.tail<3>(), applied = b.longer * load_per_length(model, work, b.part);
  // Acceleration at a place that a displacement and its rates bring beyond that of the frame's origin.
  const auto acceleration = [&](const Vec3& place, const Vec3& rate, const Vec3& second) {
    return Vec3(spin.cross(place) + w.cross(Vec3(w.cross(place) + 2.0 * rate)) + second);
  };
  // Per length at a place: applied load less inertia, and the moment of the sections' own inertia.
  const Vec3 origin = p.A.head<3>() + w.cross(Vec3(p.V.head<3>()));
  const auto along = [&](size_t k, Vec3& moment) {
    Vec3 rate = Vec3::Zero(), second = rate, turning = w, turn = spin;
    if (elastic) {
      rate = b.shift(k, 1) + b.beyond_rate[k], second = b.shift(k, 2) + b.beyond_second[k];
      Vec3 turn_rate = b.turn(k, 1), turn_second = b.turn(k, 2);
      if (!b.tilts) turn_rate.tail<2>().setZero(), turn_second.tail<2>().setZero();
      turning += turn_rate;
      turn += turn_second + w.cross(turn_rate);
    }
    if (b.turns) {
      const Mat3 J = b.axes[k] * b.rotary * b.axes[k].transpose();
      moment = -J * turn - turning.cross(Vec3(J * turning));
    } else {
      moment = -b.rotary(0, 0) * (turn.x() * b.axes[k].col(0) + w.cross(Vec3(turning.x(), 0.0, 0.0)));
    }
    return Vec3(applied - b.mass_per_length * (origin + acceleration(b.place[k], rate, second)));
  };
  // How much the slope of the load at place `k` differs from that of the chord over the interval that ends at place `last`.
  const auto bends = [&](size_t k, size_t last) {
    if (!elastic) return Vec3(Vec3::Zero());
    const auto off = [&](int order) {
      Vec3 chord = (b.shift(last, order) - b.shift(last - 1, order)) / (b.x[last] - b.x[last - 1]);
      chord.x() = 0.0;
      return Vec3(slope_of(b.turn(k, order)) - chord);
    };
    return Vec3(-b.mass_per_length * acceleration(off(0), off(1), off(2)));
  };
  const auto in_section = [&](size_t k, const Vec3& f, const Vec3& m) {
    Vec6 out;
    out << b.axes[k].transpose() * f, b.axes[k].transpose() * m;
    return out;
  };
  Vec3 f = Vec3::Zero(), m = Vec3::Zero(), moment_right, moment_left;
  Vec3 right = along(b.x.size() - 1, moment_right);
  for (size_t k = b.x.size() - 1; k > 0; --k) {
    const std::vector<Vec6>& acting = acting_[beam];
    f += acting[k].head<3>();
    m += acting[k].tail<3>();
    b.right[k - 1] = in_section(k, f, m);
    const double dx = b.x[k] - b.x[k - 1];
    const Vec3 arm = b.place[k] - b.place[k - 1], left = along(k - 1, moment_left);
    // Loads by the cubic that their slopes tell: straight between ten nodes they would lack 1 % of what the first mode brings, 3 % of the
    // second's.
    const Vec3 bent_left = dx * bends(k - 1, k), bent_right = dx * bends(k, k);
    m += arm.cross(f) + dx * arm.cross(Vec3(left / 6.0 + right / 3.0 + bent_left / 30.0 - bent_right / 20.0));
    m += 0.5 * dx * (moment_left + moment_right);
    f += dx * (0.5 * (left + right) + (bent_left - bent_right) / 12.0);
    b.left[k - 1] = in_section(k - 1, f, m);
    right = left;
    moment_right = moment_left;
  }
}

namespace {

// The slope of an axis, its rate and its acceleration; and of what they make.
struct Turning {
  Vec3 value = Vec3::Zero(), rate = Vec3::Zero(), second = Vec3::Zero();
};

// Between two places of an axis whose deflection is the cubic of their slopes and of the chord between them, at a share of the way.
Turning between(const Turning& before, const Turning& after, const Turning& chord, double share) {
  const double early = (1.0 - share) * (1.0 - 3.0 * share), late = share * (3.0 * share - 2.0);
  const auto slope = [&](const Vec3& a, const Vec3& b, const Vec3& c) { return Vec3(c + early * (a - c) + late * (b - c)); };
  return {slope(before.value, after.value, chord.value), slope(before.rate, after.rate, chord.rate),
          slope(before.second, after.second, chord.second)};
}

// What a turned axis has beyond first order, along and across, per length: of second order, or exactly (it bends in one plane then).
Turning beyond_linear(const Turning& s, bool exact) {
  const double squared = s.value.squaredNorm();
  Turning out;
  if (!exact) {
    out.value.x() = -0.5 * squared;
    out.rate.x() = -s.value.dot(s.rate);
    out.second.x() = -s.rate.squaredNorm() - s.value.dot(s.second);
    return out;
  }
  const double most = std::max({s.value.norm(), s.rate.norm(), s.second.norm()});
  if (most == 0.0) return out;
  const Vec3& largest = s.value.norm() == most ? s.value : s.rate.norm() == most ? s.rate : s.second;
  const Vec3 across = largest / most;
  const double angle = s.value.dot(across), w = s.rate.dot(across), a = s.second.dot(across);
  const double half = std::sin(0.5 * angle), versed = -2.0 * half * half, sine = std::sin(angle);
  out.value = Vec3(versed, 0.0, 0.0) + (sine - angle) * across;
  out.rate = Vec3(-sine * w, 0.0, 0.0) + versed * w * across;
  out.second = Vec3(-sine * a - std::cos(angle) * w * w, 0.0, 0.0) + (versed * a - sine * w * w) * across;
  return out;
}

// Adds that of an axis between two places (Gauss-Legendre, exact for squares of the cubic's slope: straight between the places it would be
// far off where elements bend by themselves, as in their highest modes).
void add_beyond(double length, const Turning& before, const Turning& after, const Turning& chord, bool exact, Turning& sum) {
  constexpr double out = 0.1127016653792583;  // (1 - sqrt(3/5))/2
  constexpr std::array<std::array<double, 2>, 3> points{{{out, 5.0 / 18.0}, {0.5, 8.0 / 18.0}, {1.0 - out, 5.0 / 18.0}}};
  for (const auto& [share, weight] : points) {
    const Turning one = beyond_linear(between(before, after, chord, share), exact);
    sum.value += length * weight * one.value;
    sum.rate += length * weight * one.rate;
    sum.second += length * weight * one.second;
  }
}

}  // namespace

void SectionForces::evaluate(const Model& model, Work& work, const Reactions& reactions) {
  for (CutBeam& b : beams_) {
    const PartWork& p = work.parts[b.part];
    const VecX& q = p.q;
    const bool exact = model.parts[b.part].body.rod != nullptr, moves = p.qdd.size() > 0;
    if (q.size() > 0) {
      MatX coordinates = MatX::Zero(q.size(), 3);
      coordinates.col(0) = q;
      if (moves) coordinates.col(1) = p.qd, coordinates.col(2) = p.qdd;
      b.moved.noalias() = b.shapes * coordinates;
    }
    Turning beyond, before;  // by the slopes from the root on
    for (size_t k = 0; k < b.x.size(); ++k) {
      b.place[k] = Vec3(b.x[k], 0.0, 0.0);
      b.axes[k].setIdentity();
      if (q.size() > 0) {
        const Vec3 turned = b.turn(k, 0);
        const Turning slope{slope_of(turned), slope_of(b.turn(k, 1)), slope_of(b.turn(k, 2))};
        if ((b.shortens || exact) && k > 0) {
          const double length = b.x[k] - b.x[k - 1];
          const auto chord = [&](int order) {
            const Vec3 rise = (b.shift(k, order) - b.shift(k - 1, order)) / length;
            return Vec3(0.0, rise.y(), rise.z());
          };
          add_beyond(length, before, slope, {chord(0), chord(1), chord(2)}, exact, beyond);
        }
        before = slope;
        b.place[k] += b.shift(k, 0) + beyond.value;
        b.beyond_rate[k] = beyond.rate;
        b.beyond_second[k] = beyond.second;
        b.axes[k] = rotation_exp(turned);
      }
      b.place[k] += b.axes[k] * b.beside[k];
    }
  }
  collect(model, work, reactions);
  for (size_t b = 0; b < beams_.size(); ++b) cut(model, work, b);
}

}  // namespace flexframe::sim
