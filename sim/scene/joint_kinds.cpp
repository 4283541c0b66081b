#include "sim/scene/joint_kinds.h"

#include <array>
#include <cmath>

namespace flexframe::sim {
namespace {

Quat quaternion(const double* q) { return Quat(q[0], q[1], q[2], q[3]).normalized(); }

// The motions of the kinds.

void fixed(const Vec3&, double, const double*, Pose&, Mat6&) {}

// As update_joint_pose turns it, to the bit: what is placed by either stands at one place.
void turning(const Vec3& axis, double, const double* q, Pose& pose, Mat6& S) {
  pose.R = Eigen::AngleAxisd(q[0], axis).toRotationMatrix();
  S.col(0).tail<3>() = axis;
}

void sliding(const Vec3& axis, double, const double* q, Pose& pose, Mat6& S) {
  pose.p = axis * q[0];
  S.col(0).head<3>() = axis;
}

void screwing(const Vec3& axis, double pitch, const double* q, Pose& pose, Mat6& S) {
  pose.R = rotation_exp(axis * q[0]);
  pose.p = axis * (pitch * q[0]);
  S.col(0).head<3>() = pitch * axis;
  S.col(0).tail<3>() = axis;
}

void sliding_and_turning(const Vec3& axis, double, const double* q, Pose& pose, Mat6& S) {
  pose.R = rotation_exp(axis * q[1]);
  pose.p = axis * q[0];
  S.col(0).head<3>() = axis;
  S.col(1).tail<3>() = axis;
}

// About the axis, then about the turned x.
void turning_twice(const Vec3& axis, double, const double* q, Pose& pose, Mat6& S) {
  const Vec3 b = axis_normals(axis)[0];
  const Mat3 R2 = rotation_exp(b * q[1]);
  pose.R = rotation_exp(axis * q[0]) * R2;
  S.col(0).tail<3>() = R2.transpose() * axis;
  S.col(1).tail<3>() = b;
}

void turning_twice_bias(const Vec3& axis, const double* q, const double* w, Vec6& out) {
  const Vec3 b = axis_normals(axis)[0];
  out.tail<3>() = -w[1] * w[0] * b.cross(Vec3(rotation_exp(b * -q[1]) * axis));
}

void in_plane(const Vec3& axis, double, const double* q, Pose& pose, Mat6& S) {
  const auto [x, y] = axis_normals(axis);
  pose.R = rotation_exp(axis * q[2]);
  pose.p = x * q[0] + y * q[1];
  S.col(0).head<3>() = pose.R.transpose() * x;
  S.col(1).head<3>() = pose.R.transpose() * y;
  S.col(2).tail<3>() = axis;
}

void in_plane_bias(const Vec3& axis, const double* q, const double* w, Vec6& out) {
  const auto [x, y] = axis_normals(axis);
  out.head<3>() = -w[2] * axis.cross(Vec3(rotation_exp(axis * -q[2]) * (x * w[0] + y * w[1])));
}

// A pin that slides along x of the joint and turns in its slot.
void in_slot(const Vec3& axis, double, const double* q, Pose& pose, Mat6& S) {
  const Vec3 x = axis_normals(axis)[0];
  pose.R = rotation_exp(axis * q[1]);
  pose.p = x * q[0];
  S.col(0).head<3>() = pose.R.transpose() * x;
  S.col(1).tail<3>() = axis;
}

void in_slot_bias(const Vec3& axis, const double* q, const double* w, Vec6& out) {
  const Vec3 x = axis_normals(axis)[0];
  out.head<3>() = -w[1] * w[0] * axis.cross(Vec3(rotation_exp(axis * -q[1]) * x));
}

void ball(const Vec3&, double, const double* q, Pose& pose, Mat6& S) {
  pose.R = quaternion(q).toRotationMatrix();
  S.block<3, 3>(3, 0).setIdentity();
}

void flying(const Vec3&, double, const double* q, Pose& pose, Mat6& S) {
  pose.p = Vec3(q[0], q[1], q[2]);
  pose.R = quaternion(q + 3).toRotationMatrix();
  S.setIdentity();
}

// A rotation vector: all components, or those that are not along the axis, a coordinate axis.
bool bends_about(bool pair, const Vec3& axis, int k) { return !pair || axis[k] == 0.0; }

template <bool pair>
Vec3 flexure_vector(const Vec3& axis, const double* q) {
  Vec3 out = Vec3::Zero();
  for (int a = 0, at = 0; a < 3; ++a)
    if (bends_about(pair, axis, a)) out[a] = q[at++];
  return out;
}

template <bool pair>
void bending(const Vec3& axis, double, const double* q, Pose& pose, Mat6& S) {
  const Vec3 theta = flexure_vector<pair>(axis, q);
  const RotationSeries k(theta.squaredNorm());
  pose.R = rotation_exp(theta);
  const Mat3 J = right_jacobian(theta, k);
  for (int i = 0, at = 0; i < 3; ++i)
    if (bends_about(pair, axis, i)) S.col(at++).tail<3>() = J.col(i);
}

template <bool pair>
void bending_bias(const Vec3& axis, const double* q, const double* w, Vec6& out) {
  const Vec3 theta = flexure_vector<pair>(axis, q);
  out.tail<3>() = right_jacobian_rate(theta, flexure_vector<pair>(axis, w), RotationSeries(theta.squaredNorm()));
}

// A bend about a line normal to the axis, without twist: whatever the bend, shafts along both axes turn alike.
Vec3 bend(const Vec3& axis, const double* q) {
  const auto [x, y] = axis_normals(axis);
  return x * q[0] + y * q[1];
}

void bending_without_twist(const Vec3& axis, double, const double* q, Pose& pose, Mat6& S) {
  const auto [x, y] = axis_normals(axis);
  const Vec3 theta = bend(axis, q);
  const Mat3 J = right_jacobian(theta, RotationSeries(theta.squaredNorm()));
  pose.R = rotation_exp(theta);
  S.col(0).tail<3>() = J * x;
  S.col(1).tail<3>() = J * y;
}

void bending_without_twist_bias(const Vec3& axis, const double* q, const double* w, Vec6& out) {
  const Vec3 theta = bend(axis, q);
  out.tail<3>() = right_jacobian_rate(theta, bend(axis, w), RotationSeries(theta.squaredNorm()));
}

constexpr std::string_view one_number = "one number", no_coordinates = "no coordinate";
constexpr ClosureFacts nothing{"", ""};

constexpr std::array table{
    JointTraits{.kind = JointKind::weld,
                .word = "weld",
                .coordinates = no_coordinates,
                .rates = "",
                .quaternion = -1,
                .surfaces = "",
                .pressing = Pressing::all,
                .in_plane = InPlane::any_axis,
                .closure = ClosureFacts{"xyz", "xzyzxy"},
                .place = fixed,
                .bias = nullptr},
    JointTraits{.kind = JointKind::revolute,
                .word = "revolute",
                .coordinates = one_number,
                .rates = "r",
                .quaternion = -1,
                .surfaces = "a",
                .pressing = Pressing::all,
                .in_plane = InPlane::axis_normal,
                .closure = ClosureFacts{"xyz", "xzyz"},
                .place = turning,
                .bias = nullptr,
                .read_off = true,
                .symbol = JointSymbol::pin},
    JointTraits{.kind = JointKind::prismatic,
                .word = "prismatic",
                .coordinates = one_number,
                .rates = "m",
                .quaternion = -1,
                .surfaces = "a",
                .pressing = Pressing::across_axis,
                .in_plane = InPlane::axis_within,
                .closure = ClosureFacts{"xy", "xzyzxy"},
                .place = sliding,
                .bias = nullptr,
                .read_off = true,
                .symbol = JointSymbol::rail},
    JointTraits{.kind = JointKind::cylindrical,
                .word = "cylindrical",
                .coordinates = "[distance, angle]",
                .rates = "mr",
                .quaternion = -1,
                .surfaces = "aa",
                .pressing = Pressing::across_axis,
                .in_plane = InPlane::never,
                .closure = ClosureFacts{"xy", "xzyz"},
                .place = sliding_and_turning,
                .bias = nullptr,
                .symbol = JointSymbol::pin},
    JointTraits{.kind = JointKind::universal,
                .word = "universal",
                .coordinates = "[angle about the axis, angle about the second axis]",
                .rates = "rr",
                .quaternion = -1,
                .surfaces = "ab",
                .pressing = Pressing::all,
                .in_plane = InPlane::never,
                .closure = ClosureFacts{"xyz", "zx"},
                .place = turning_twice,
                .bias = turning_twice_bias,
                .symbol = JointSymbol::ball},
    JointTraits{.kind = JointKind::spherical,
                .word = "spherical",
                .coordinates = "[rotation x, y, z]",
                .rates = "rrr",
                .quaternion = 0,
                .surfaces = "aaa",
                .pressing = Pressing::all,
                .in_plane = InPlane::never,
                .closure = ClosureFacts{"xyz", ""},
                .place = ball,
                .bias = nullptr,
                .symbol = JointSymbol::ball},
    JointTraits{.kind = JointKind::planar,
                .word = "planar",
                .coordinates = "[x, y, angle]",
                .rates = "mmr",
                .quaternion = -1,
                .surfaces = "aab",
                .pressing = Pressing::along_axis,
                .in_plane = InPlane::axis_normal,
                .closure = ClosureFacts{"z", "xzyz"},
                .place = in_plane,
                .bias = in_plane_bias},
    JointTraits{.kind = JointKind::free,
                .word = "free",
                .coordinates = "[x, y, z, rotation x, y, z]",
                .rates = "mmmrrr",
                .quaternion = 3,
                .surfaces = "aaabbb",
                .pressing = Pressing::all,
                .in_plane = InPlane::never,
                .closure = nothing,
                .place = flying,
                .bias = nullptr},
    JointTraits{.kind = JointKind::screw,
                .word = "screw",
                .coordinates = one_number,
                .rates = "r",
                .quaternion = -1,
                .surfaces = "a",
                .pressing = Pressing::all,
                .in_plane = InPlane::never,
                .closure = std::nullopt,
                .place = screwing,
                .bias = nullptr,
                .pitch = true,
                .symbol = JointSymbol::pin},
    JointTraits{.kind = JointKind::point_on_line,
                .word = "point-on-line",
                .coordinates = no_coordinates,
                .rates = "",
                .quaternion = -1,
                .surfaces = "",
                .pressing = Pressing::across_axis,
                .in_plane = InPlane::axis_within,
                .closure = ClosureFacts{"xy", ""},
                .place = nullptr,
                .bias = nullptr,
                .split = std::pair{JointKind::prismatic, JointKind::spherical},
                .symbol = JointSymbol::rail},
    JointTraits{.kind = JointKind::point_on_plane,
                .word = "point-on-plane",
                .coordinates = no_coordinates,
                .rates = "",
                .quaternion = -1,
                .surfaces = "",
                .pressing = Pressing::along_axis,
                .in_plane = InPlane::axis_within,
                .closure = ClosureFacts{"z", ""},
                .place = nullptr,
                .bias = nullptr},
    JointTraits{.kind = JointKind::distance,
                .word = "distance",
                .coordinates = no_coordinates,
                .rates = "",
                .quaternion = -1,
                .surfaces = "",
                .pressing = Pressing::all,
                .in_plane = InPlane::any_axis,
                .closure = ClosureFacts{"", "", true},
                .place = nullptr,
                .bias = nullptr,
                .length = true},
    JointTraits{.kind = JointKind::constant_velocity,
                .word = "constant-velocity",
                .coordinates = "[bend about x, bend about y]",
                .rates = "rr",
                .quaternion = -1,
                .surfaces = "aa",
                .pressing = Pressing::all,
                .in_plane = InPlane::never,
                .closure = std::nullopt,
                .place = bending_without_twist,
                .bias = bending_without_twist_bias,
                .symbol = JointSymbol::ball},
    JointTraits{.kind = JointKind::point_on_curve,
                .word = "point-on-curve",
                .coordinates = one_number,
                .rates = "m",
                .quaternion = -1,
                .surfaces = "a",
                .pressing = Pressing::all,
                .in_plane = InPlane::never,
                .closure = std::nullopt,
                .place = nullptr,
                .bias = nullptr,
                .curve = true,
                .split = std::pair{JointKind::curve_slide, JointKind::spherical}},
    JointTraits{.kind = JointKind::pin_slot,
                .word = "pin-slot",
                .coordinates = "[distance along x, angle]",
                .rates = "mr",
                .quaternion = -1,
                .surfaces = "ab",
                .pressing = Pressing::across_slide,
                .in_plane = InPlane::axis_normal,
                .closure = ClosureFacts{"yz", "xzyz"},
                .place = in_slot,
                .bias = in_slot_bias,
                .symbol = JointSymbol::pin},
    JointTraits{.kind = JointKind::flexure,
                .word = "",
                .coordinates = "[rotation x, y, z]",
                .rates = "rrr",
                .quaternion = -1,
                .surfaces = "abc",
                .pressing = Pressing::all,
                .in_plane = InPlane::never,
                .closure = std::nullopt,
                .place = bending<false>,
                .bias = bending_bias<false>},
    JointTraits{.kind = JointKind::flexure_pair,
                .word = "",
                .coordinates = "[rotation, rotation]",
                .rates = "rr",
                .quaternion = -1,
                .surfaces = "ab",
                .pressing = Pressing::all,
                .in_plane = InPlane::never,
                .closure = std::nullopt,
                .place = bending<true>,
                .bias = bending_bias<true>},
    // Its motion is its curve's: sim/model/joint_motion.cpp.
    JointTraits{.kind = JointKind::curve_slide,
                .word = "",
                .coordinates = one_number,
                .rates = "m",
                .quaternion = -1,
                .surfaces = "a",
                .pressing = Pressing::all,
                .in_plane = InPlane::never,
                .closure = std::nullopt,
                .place = fixed,
                .bias = nullptr,
                .curve = true},
};

constexpr bool sound(const JointTraits& t, std::size_t at) {
  if (static_cast<std::size_t>(t.kind) != at || t.surfaces.size() != t.rates.size()) return false;
  if (!t.place && !t.rates.empty() && !t.split) return false;  // coordinates need a motion
  if (t.quaternion >= 0 && t.rates.substr(t.quaternion) != "rrr") return false;
  if (t.read_off && t.rates.size() != 1) return false;
  if (t.closure && t.closure->turns.size() % 2 != 0) return false;
  return t.rates.find_first_not_of("mr") == std::string_view::npos;
}

constexpr bool all_sound() {
  for (std::size_t i = 0; i < table.size(); ++i)
    if (!sound(table[i], i) || (i > 0 && table[i - 1].word.empty() && !table[i].word.empty())) return false;
  return true;
}
static_assert(all_sound(), "a row of the table of joints contradicts itself or stands in another place than in JointKind");

}  // namespace

std::span<const JointTraits> joint_kinds() { return table; }

std::pair<int, int> shared_slip(JointKind kind, int k) {
  const std::string_view surfaces = traits(kind).surfaces;
  const char on = surfaces[k];
  const std::size_t first = surfaces.find(on);
  return {static_cast<int>(first), static_cast<int>(surfaces.find_last_of(on) - first + 1)};
}

bool passes_no_moment(JointKind kind) {
  const auto& closure = traits(kind).closure;
  return closure && closure->turns.empty() && (closure->distance || !closure->places.empty());
}

bool holds_along_parent(JointKind kind) {
  const auto& closure = traits(kind).closure;
  if (!closure || closure->places.empty() || closure->places.size() == 3) return false;
  const auto in = [](std::string_view all, std::string_view what) { return all.find(what) != std::string_view::npos; };
  // The child may be tilted against the axis, or turned about it where x and y differ.
  const bool tilts = !in(closure->turns, "xz"), turns = !in(closure->turns, "xy");
  return tilts || (turns && in(closure->places, "x") != in(closure->places, "y"));
}

std::string joint_words(bool (*holds)(const JointTraits&)) {
  std::string out;
  for (const JointTraits& t : table)
    if (!t.word.empty() && holds(t)) out += (out.empty() ? "" : ", ") + std::string(t.word);
  return out;
}

std::array<Vec3, 2> axis_normals(const Vec3& axis) {
  // The coordinate axis that is least along the joint's gives the first normal; for a joint about z: x, y.
  int least = 0;
  for (int i = 1; i < 3; ++i)
    if (std::abs(axis[i]) < std::abs(axis[least])) least = i;
  const Vec3 x = (Vec3::Unit(least) - axis[least] * axis).normalized();
  return {x, axis.cross(x)};
}

Mat3 orientation_of(JointKind kind, const double* q) { return quaternion(q + traits(kind).quaternion).toRotationMatrix(); }

double pose_coordinate(JointKind kind, const Vec3& axis, const Pose& relative) {
  if (is_length(kind, 0)) return axis.dot(relative.p);
  const auto [x, y] = axis_normals(axis);
  const Vec3 turned = relative.R * x;
  return std::atan2(y.dot(turned), x.dot(turned));
}

double pose_rate(JointKind kind, const Vec3& axis, const Pose& relative, const Vec6& Va, const Vec6& Vb) {
  const Vec3 wa = Va.tail<3>();
  if (is_length(kind, 0)) return axis.dot(relative.R * Vb.head<3>() - Va.head<3>() - wa.cross(relative.p));
  return axis.dot(relative.R * Vb.tail<3>() - wa);
}

}  // namespace flexframe::sim
