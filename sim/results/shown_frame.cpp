#include "sim/results/shown_frame.h"

#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/plane_frames.h"
#include "sim/model/bodies.h"
#include "sim/model/supports.h"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// Undeformed pose of a frame in its body.
Pose rest_in_body(const Model& model, int frame) {
  return compose(model.parts[model.frames[frame].part].rest_in_body, rest_pose(model, frame));
}

int add_body_frame(Model& model, const Scene& scene, int body, const std::string& frame, const Pose& offset, const std::string& where) {
  FramePoint f = find_frame(model, scene, body, frame, where);
  f.offset = compose(f.offset, offset);
  model.frames.push_back(f);
  const int index = static_cast<int>(model.frames.size()) - 1;
  resolve_node(model, where, index);
  return index;
}

ShownFrom from_tangent(const Model& model, int frame) {
  ShownFrom shown;
  shown.kind = ShownFrom::tangent;
  shown.a = frame;
  shown.rest_a = rest_in_body(model, frame);
  return shown;
}

// Of beams from the end nearer to the root.
ShownFrom from_chord(const Model& model, int a, int b, bool beam) {
  ShownFrom shown = from_tangent(model, a);
  shown.kind = ShownFrom::chord;
  shown.b = b;
  shown.rest_b = rest_in_body(model, b);
  if (beam && shown.rest_b.p.x() < shown.rest_a.p.x()) {
    std::swap(shown.a, shown.b);
    std::swap(shown.rest_a, shown.rest_b);
  }
  return shown;
}

// Mean axes to first order: md1 / m, and J^-1 of the angular momentum about the centre of mass.
Mat6X mean_motion(const FlexibleBody& body) {
  Mat6X out = Mat6X::Zero(6, body.n);
  if (!(body.mass > 0.0)) return out;
  const Vec3 c = body.md0 / body.mass;
  Mat3 J;
  J << body.J0[0], body.J0[3], body.J0[4], body.J0[3], body.J0[1], body.J0[5], body.J0[4], body.J0[5], body.J0[2];
  J -= body.mass * (c.squaredNorm() * Mat3::Identity() - c * c.transpose());
  // An axis without inertia (points on a line) is not turned.
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(J);
  Mat3 inverted = Mat3::Zero();
  for (int k = 0; k < 3; ++k)
    if (axes.eigenvalues()[k] > 1e-12 * axes.eigenvalues()[2])
      inverted += axes.eigenvectors().col(k) * axes.eigenvectors().col(k).transpose() / axes.eigenvalues()[k];
  const Mat3X translation = body.md1 / body.mass;
  const Mat3X rotation = inverted * (body.Cr0 - skew(c) * body.md1);
  out.topRows<3>() = translation + skew(c) * rotation;  // of the frame's origin
  out.bottomRows<3>() = rotation;
  return out;
}

ShownFrom from_mean(const Model& model, int first, bool chain, bool on_mean_axes) {
  ShownFrom shown;
  if (on_mean_axes) return shown;
  shown.kind = ShownFrom::mean;
  if (!chain) shown.mean_motion = mean_motion(model.parts[first].body);
  return shown;
}

bool is_chain(const BeamDef& beam) { return beam.model == BeamModel::mixed || beam.model == BeamModel::lumped; }
bool held_twice(const BeamDef& beam) { return beam.boundary == Boundary::clamped_clamped || beam.boundary == Boundary::clamped_supported; }

// Whether the frame of the beam's boundary is the one that was found.
bool is_boundary(const BeamDef& beam, const ShownFrom& shown) {
  if (is_chain(beam)) return false;
  const bool from_root = shown.rest_a.p.x() == 0.0, to_tip = shown.rest_b.p.x() == beam.length;
  if (shown.kind == ShownFrom::tangent) return from_root && (beam.boundary == Boundary::clamped_free || held_twice(beam));
  return from_root && to_tip && (beam.boundary == Boundary::supported_supported || held_twice(beam));
}

// The words of `shown`: a word, or "frames" and the names of one or two, a line each (read_bodies.cpp).
std::vector<std::string> shown_words(const BodyDef& def) {
  const auto found = def.drawing.find("shown");
  std::vector<std::string> words;
  std::string rest = found == def.drawing.end() ? "joints" : found->second;
  while (!rest.empty()) {
    const size_t end = rest.find('\n');
    words.push_back(rest.substr(0, end));
    rest = end == std::string::npos ? "" : rest.substr(end + 1);
  }
  return words;
}

}  // namespace

ShownFrom shown_from_frames(Model& model, const Scene& scene, int body, const std::vector<std::string>& names, const std::string& where) {
  std::vector<int> frames;
  frames.reserve(names.size());
  for (const std::string& name : names) frames.push_back(add_body_frame(model, scene, body, name, {}, where));
  if (coordinate_count(model, body) == 0) return {};
  if (frames.size() < 2) return from_tangent(model, frames.front());
  const auto* beam = std::get_if<BeamDef>(&scene.bodies[body].kind);
  ShownFrom chord = from_chord(model, frames[0], frames[1], beam != nullptr);
  const double size = std::max(beam ? beam->length : 0.0, part_size(model, model.pieces[body].front()));
  if (!((chord.rest_b.p - chord.rest_a.p).norm() > 1e-9 * size))
    throw InputError(fmt::format("{} names two frames at one place, which have no chord; name one of them", where));
  return chord;
}

ShownFrom find_shown_frame(Model& model, const Scene& scene, int body) {
  const BodyDef& def = scene.bodies[body];
  const std::string where = fmt::format("{}:{}: body '{}': key 'shown'", scene.file.string(), def.line, def.name);
  const auto* beam = std::get_if<BeamDef>(&def.kind);
  const bool chain = beam && is_chain(*beam);
  const int first = model.pieces[body].front();
  const std::vector<std::string> words = shown_words(def);
  std::vector<int> frames;
  for (size_t k = 1; k < words.size(); ++k) frames.push_back(add_body_frame(model, scene, body, words[k], {}, where));
  if (coordinate_count(model, body) == 0) return {};

  ShownFrom given;
  given.kind = ShownFrom::boundary;
  if (words.front() == "frame" && (!chain || beam->boundary == Boundary::clamped_free)) return given;
  if (words.front() == "frame" && beam->boundary == Boundary::free_free) return from_mean(model, first, true, false);
  if (words.front() == "frame")
    frames = {add_body_frame(model, scene, body, "root", {}, where), add_body_frame(model, scene, body, "tip", {}, where)};
  const bool on_mean_axes =
      beam && !chain && (beam->boundary == Boundary::free_free || (beam->model == BeamModel::finite_element && !held_twice(*beam)));
  if (words.front() == "mean") return from_mean(model, first, chain, on_mean_axes);

  int clamp = -1;
  if (words.front() == "joints") {
    for (const Support& s : supports_of(scene, def.name)) {
      Pose offset;
      if (s.parent && !s.clamp) offset = {rotation_exp(s.joint->rotation), s.joint->position};
      frames.push_back(add_body_frame(model, scene, body, s.frame.frame, offset, where));
      if (s.clamp && clamp < 0) clamp = frames.back();
    }
    if (frames.empty()) return from_mean(model, first, chain, on_mean_axes);
  }
  const double size = std::max(beam ? beam->length : 0.0, part_size(model, first));
  int other = -1;
  for (const int f : frames)
    if (other < 0 && (rest_in_body(model, f).p - rest_in_body(model, frames.front()).p).norm() > 1e-9 * size) other = f;
  if (words.size() > 2 && other < 0)
    throw InputError(fmt::format("{} names two frames at one place, which have no chord; name one of them", where));
  const ShownFrom shown = clamp >= 0   ? from_tangent(model, clamp)
                          : other >= 0 ? from_chord(model, frames.front(), other, beam != nullptr)
                                       : from_tangent(model, frames.front());
  return beam && is_boundary(*beam, shown) ? given : shown;
}

namespace {

// Pose of a frame in the first part of its body.
Pose in_first_part(const Model& model, int first, int frame, const Work& work) {
  const int part = model.frames[frame].part;
  const Pose& pose = work.frames[frame].pose;
  // Without a chain everything stays in the part, so that small displacements keep their digits far from the origin.
  return part == first ? pose : compose(compose(inverse(work.parts[first].world), work.parts[part].world), pose);
}

// Best rigid motion of the masses of a chain from where they lie undeformed, seen from its first part.
Pose mean_of_chain(const Model& model, int first, const Work& work) {
  const std::vector<int>& pieces = model.pieces[model.parts[first].scene_body];
  std::vector<Pose> poses;
  std::vector<Vec3> now, rest;
  Vec3 centre = Vec3::Zero(), rest_centre = Vec3::Zero();
  double mass = 0.0;
  for (const int i : pieces) {
    const Part& p = model.parts[i];
    poses.push_back(i == first ? Pose{} : compose(inverse(work.parts[first].world), work.parts[i].world));
    const Vec3 c = p.body.md0 / p.body.mass;
    Vec3 moved = c;
    if (p.body.n > 0) moved += p.body.md1 * work.parts[i].q / p.body.mass;
    now.push_back(poses.back().R * moved + poses.back().p);
    rest.push_back(p.rest_in_body.R * c + p.rest_in_body.p);
    centre += p.body.mass * now.back();
    rest_centre += p.body.mass * rest.back();
    mass += p.body.mass;
  }
  centre /= mass;
  rest_centre /= mass;
  Mat3 H = Mat3::Zero();
  for (size_t k = 0; k < pieces.size(); ++k) {
    const Part& p = model.parts[pieces[k]];
    const Vec3 c = p.body.md0 / p.body.mass;
    Mat3 J;
    J << p.body.J0[0], p.body.J0[3], p.body.J0[4], p.body.J0[3], p.body.J0[1], p.body.J0[5], p.body.J0[4], p.body.J0[5], p.body.J0[2];
    J -= p.body.mass * (c.squaredNorm() * Mat3::Identity() - c * c.transpose());
    const Mat3 second = 0.5 * J.trace() * Mat3::Identity() - J;  // int s s^T dm about the piece's centre
    H += p.body.mass * (now[k] - centre) * (rest[k] - rest_centre).transpose();
    H += poses[k].R * second * p.rest_in_body.R.transpose();
  }
  const Eigen::JacobiSVD<Mat3> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Mat3 U = svd.matrixU();
  if ((U * svd.matrixV().transpose()).determinant() < 0.0) U.col(2) = -U.col(2);
  Pose out;
  out.R = U * svd.matrixV().transpose();
  out.p = centre - out.R * rest_centre;
  return out;
}

// A unit vector normal to e: of the y axis, or of z where that is nearer to e.
Vec3 across(const Vec3& e) {
  const Vec3 y = std::abs(e.y()) < 0.9 ? Vec3(Vec3::UnitY()) : Vec3(Vec3::UnitZ());
  return (y - e.dot(y) * e).normalized();
}

}  // namespace

std::vector<int> frames_of(const Model& model, int body, const ShownFrom& shown) {
  if (shown.kind == ShownFrom::tangent) return {shown.a};
  if (shown.kind == ShownFrom::chord) return {shown.a, shown.b};
  const ShownFrame& own = model.parts[model.pieces[body].front()].shown;
  if (shown.kind != ShownFrom::boundary || !own.differs) return {};
  if (own.boundary == Boundary::clamped_free) return {own.root};
  return {own.root, own.tip};
}

Pose shown_pose(const Model& model, int body, const ShownFrom& shown, Work& work, bool placed) {
  const int first = model.pieces[body].front();
  // The first piece of a curved beam lies along its chord, the body's frame along the curve.
  const Pose& piece = model.parts[first].rest_in_body;
  if (shown.kind == ShownFrom::body) return inverse(piece);
  if (shown.kind == ShownFrom::boundary)
    return compose(placed ? shown_pose_at(model, first, work) : shown_pose(model, first, work), inverse(piece));
  if (shown.kind == ShownFrom::mean) {
    if (shown.mean_motion.size() == 0) return mean_of_chain(model, first, work);
    const Vec6 m = shown.mean_motion * work.parts[first].q;
    return {rotation_exp(m.tail<3>()), m.head<3>()};
  }
  if (!placed) update_frame_pose(model, shown.a, work);
  if (!placed && shown.kind == ShownFrom::chord) update_frame_pose(model, shown.b, work);
  const Pose a = in_first_part(model, first, shown.a, work);
  if (shown.kind == ShownFrom::tangent) return compose(a, inverse(shown.rest_a));
  const Vec3 chord = in_first_part(model, first, shown.b, work).p - a.p;
  // The triad of the chord and a direction across it that frame a carries along, undeformed and deformed.
  const Vec3 e = (shown.rest_b.p - shown.rest_a.p).normalized(), n = across(e);
  const Vec3 carried = a.R * (shown.rest_a.R.transpose() * n);
  const Vec3 x = chord.normalized();
  const Vec3 y = (carried - x.dot(carried) * x).normalized();
  Pose out;
  Mat3 rest, now;
  rest << e, n, e.cross(n);
  now << x, y, x.cross(y);
  out.R = now * rest.transpose();
  out.p = a.p - out.R * shown.rest_a.p;
  return out;
}

Mat6X shown_columns(const Model& model, int body, const ShownFrom& shown) {
  const Part& p = model.parts[model.pieces[body].front()];
  Mat6X out = Mat6X::Zero(6, p.body.n);
  if (shown.kind == ShownFrom::mean) return shown.mean_motion;
  if (shown.kind != ShownFrom::tangent && shown.kind != ShownFrom::chord) return out;
  // Motion of a frame of the body: of its node, carried to the frame's place.
  const auto motion = [&](int frame, const Pose& rest) {
    Mat6X m = Mat6X::Zero(6, p.body.n);
    if (model.frames[frame].node < 0) return m;
    const FlexibleNode& node = p.body.nodes[model.frames[frame].node];
    m.bottomRows<3>() = node.psi;
    m.topRows<3>() = node.phi - skew(rest.p - node.origin) * node.psi;
    return m;
  };
  const Mat6X a = motion(shown.a, shown.rest_a);
  Mat3X turn = a.bottomRows<3>();
  if (shown.kind == ShownFrom::chord) {
    const Vec3 d = shown.rest_b.p - shown.rest_a.p, e = d.normalized();
    const Mat6X b = motion(shown.b, shown.rest_b);
    turn = Mat3X(skew(e) * (b.topRows<3>() - a.topRows<3>()) / d.norm() + e * (e.transpose() * turn));
  }
  out.topRows<3>() = a.topRows<3>() + skew(shown.rest_a.p) * turn;
  out.bottomRows<3>() = turn;
  return out;
}

}  // namespace flexframe::sim
