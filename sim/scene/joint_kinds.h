// Everything that tells one kind of joint from another, in one table (joint_kinds.cpp): its word, its coordinates and their units, its
// motion, what closes a loop by it, what its friction slips on. No other file asks for a kind by name to find one of these facts out. A
// new kind is a name in JointKind, a row of the table with its motion, its test in tests/unit/sim_joints.cpp and its line in
// SCENE.md.
//
// The joint's frame A is on the parent's side, B on the child's; `axis` is a unit vector in A, x and y are its `axis_normals`. Twists
// [v; w] are in B's axes.
#pragma once

#include "sim/base/spatial.h"
#include "sim/scene/scene.h"

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace flexframe::sim {

// What presses the surfaces together on which a joint's friction acts: of the joint's force all, what is normal to the axis, what is along
// it, or all but what is along the way of the coordinate that slides.
enum class Pressing { all, across_axis, along_axis, across_slide };

// A mechanism that moves in a plane may have the joint with any axis, with one normal to the plane, with one in the plane, or not at all.
enum class InPlane { any_axis, axis_normal, axis_within, never };

enum class JointSymbol { none, pin, ball, rail };

// Conditions by which a joint closes a loop, between A and B: one letter a coordinate axis of the joint (z: its axis).
// places: the origin of B has no distance along these; turns: pairs "uv", of which u in A stays normal to v in B.
struct ClosureFacts {
  std::string_view places;
  std::string_view turns;
  bool distance = false;  // the origin of B stays `length` away instead
};

struct JointTraits {
  JointKind kind;
  std::string_view word;         // in scene and results files
  std::string_view coordinates;  // what a list of them holds, for messages
  std::string_view rates;        // one letter a rate: m a length (rate m/s), r an angle (rad/s)
  int quaternion;                // coordinate at which an orientation begins, w x y z, else -1. Its rates are the angular velocity, the
                                 // rates before it the velocity, both in B's axes
  std::string_view surfaces;     // one letter a rate: those of one letter slip on one surface
  Pressing pressing;
  InPlane in_plane;
  std::optional<ClosureFacts> closure;  // none: closes a loop only by way of a massless link
  // Pose of B in A and twist of B per rate, a column each (they come as identity and zero); null: no coordinates describe the joint, it can
  // only close a loop.
  void (*place)(const Vec3& axis, double pitch, const double* q, Pose& pose, Mat6& S);
  // dS/dt w; null: zero.
  void (*bias)(const Vec3& axis, const double* q, const double* w, Vec6& out);

  // What few kinds have.
  bool read_off = false;               // its one coordinate follows from the relative pose: an angle about or a distance along the axis
  bool pitch = false, length = false;  // keys of the scene
  bool curve = false;                  // runs along the joint's curve
  // Spring, friction and stop act on the first of these, which stands in its place, and the second closes the loop.
  std::optional<std::pair<JointKind, JointKind>> split = std::nullopt;
  JointSymbol symbol = JointSymbol::none;
};

// All kinds, in the enumeration's order: those with a word first.
std::span<const JointTraits> joint_kinds();
inline const JointTraits& traits(JointKind kind) { return joint_kinds()[static_cast<std::size_t>(kind)]; }

inline int rates_of(JointKind kind) { return static_cast<int>(traits(kind).rates.size()); }
inline bool has_orientation(JointKind kind) { return traits(kind).quaternion >= 0; }
// Whether rate k, or coordinate k, is a length; else an angle or part of a quaternion.
inline bool is_length(JointKind kind, int k) { return k < rates_of(kind) && traits(kind).rates[k] == 'm'; }
// First rate of the surface on which rate k slips, and how many rates slip there.
std::pair<int, int> shared_slip(JointKind kind, int k);
// Whether the joint passes on forces but no moment about any axis.
bool passes_no_moment(JointKind kind);
// Whether the directions in which the joint holds the child's place are the parent's, which the child may be turned against: those of a
// line, a plane or a slot, not those of a guide.
bool holds_along_parent(JointKind kind);
// "revolute, prismatic, screw": the words of the scene's kinds for which this holds.
std::string joint_words(bool (*holds)(const JointTraits&));
inline bool has_one_coordinate(const JointTraits& t) { return t.rates.size() == 1; }
// Coordinates that are numbers, none of them an orientation.
inline bool has_plain_coordinates(const JointTraits& t) { return !t.rates.empty() && t.quaternion < 0; }

// x and y: two unit vectors normal to the axis and to each other, right-handed with it.
std::array<Vec3, 2> axis_normals(const Vec3& axis);

// The orientation among the coordinates of a kind that has one.
Mat3 orientation_of(JointKind kind, const double* q);

// The coordinate that a relative pose tells (`read_off`), rad within half a turn or m, and its rate, from the twists of A and B.
double pose_coordinate(JointKind kind, const Vec3& axis, const Pose& relative);
double pose_rate(JointKind kind, const Vec3& axis, const Pose& relative, const Vec6& Va, const Vec6& Vb);

}  // namespace flexframe::sim
