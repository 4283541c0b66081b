// Contacts among the [[force]] tables.
#include "sim/scene/read_curve.h"
#include "sim/scene/read_states.h"

#include <fmt/format.h>

#include <cmath>

namespace flexframe::sim {
namespace {

const std::vector<std::string> shapes{"point", "sphere", "cylinder", "curve"};
constexpr std::size_t own_curve = 3;
const std::vector<std::string> partners{"plane", "sphere", "curve"};
enum Partner : std::size_t { against_plane, against_sphere, against_curve };

// The profile of a cam or a road. A body that is rounder than a hollow would touch it in two places, of which only one is found.
void read_profile(const TableReader& reader, ContactDef& out) {
  if (out.cylinder && out.width > 0.0)
    reader.fail("width", "has no meaning against a curve, whose profile is the same along z: leave it out");
  out.curve = read_curve(reader, "curve");
  const SpaceCurve& curve = *out.curve;
  const double side = curve.closed() && curve.area_xy() > 0.0 ? -1.0 : 1.0;
  for (std::size_t k = 0; k < curve.samples().size(); ++k) {
    const SpaceCurve::Jet at = curve.at(curve.length() * static_cast<double>(k) / static_cast<double>(curve.samples().size()));
    if (at.place.z() != 0.0 || at.tangent.z() != 0.0) reader.fail("curve", "must lie in the xy plane of 'from': z = 0 for all its points");
    const double hollow = side * (at.tangent.x() * at.bend.y() - at.tangent.y() * at.bend.x());
    if (hollow * out.radius > 1.0)
      reader.fail("radius", fmt::format("is larger than the curve's radius of curvature in a hollow at [{:.4g}, {:.4g}], {:.4g} m, where "
                                        "the body would touch it twice; found {}",
                                        at.place.x(), at.place.y(), 1.0 / hollow, out.radius));
  }
}

// A cam under a flat: its outline is the body's own. Round outwards everywhere, so that it touches in one place.
void read_own_curve(const TableReader& reader, ContactDef& out) {
  if (reader.word("against", partners, against_plane) != against_plane)
    reader.fail("against", "must be \"plane\" for shape = \"curve\": a curve meets a flat; what rolls on a curve is the other body");
  out.own_curve = true;
  out.curve = read_curve(reader, "curve");
  const SpaceCurve& curve = *out.curve;
  if (!curve.closed()) reader.fail("curve", "must be closed for shape = \"curve\": the outline of the body");
  const double side = curve.area_xy() > 0.0 ? 1.0 : -1.0;
  for (std::size_t k = 0; k < curve.samples().size(); ++k) {
    const SpaceCurve::Jet at = curve.at(curve.length() * static_cast<double>(k) / static_cast<double>(curve.samples().size()));
    if (at.place.z() != 0.0 || at.tangent.z() != 0.0) reader.fail("curve", "must lie in the xy plane of 'on': z = 0 for all its points");
    if (!(side * (at.tangent.x() * at.bend.y() - at.tangent.y() * at.bend.x()) > 0.0))
      reader.fail("curve", fmt::format("must be round outwards everywhere for shape = \"curve\"; at [{:.4g}, {:.4g}] it is straight or "
                                       "hollow, where a flat would touch it twice",
                                       at.place.x(), at.place.y()));
  }
}

void read_shapes(const TableReader& reader, ContactDef& out) {
  const std::size_t shape = reader.word("shape", shapes);
  if ((shape == 0 || shape == own_curve) && reader.has("radius"))
    reader.fail("radius", fmt::format("belongs to spheres and cylinders; this is a {}", shapes[shape]));
  if (shape > 0 && shape != own_curve) out.radius = reader.number("radius", positive.in("m"));
  out.cylinder = shape == 2;
  for (const char* key : {"axis", "width"})
    if (!out.cylinder && reader.has(key)) reader.fail(key, "belongs to cylinders");
  out.axis = reader.direction("axis", Vec3::UnitZ());
  out.width = reader.number("width", 0.0, not_negative.in("m"));
  const std::size_t partner = reader.word("against", partners, against_plane);
  if (partner != against_plane && reader.has("normal"))
    reader.fail("normal", fmt::format("belongs to a plane; this is against a {}", partners[partner]));
  if (partner != against_sphere && reader.has("from_radius"))
    reader.fail("from_radius", fmt::format("belongs to against = \"sphere\"; this is against a {}", partners[partner]));
  if (partner != against_curve && shape != own_curve && reader.has("curve"))
    reader.fail("curve", fmt::format("belongs to against = \"curve\" or shape = \"curve\"; this is a {} against a {}", shapes[shape],
                                     partners[partner]));
  if (partner == against_plane) out.normal = reader.direction("normal", Vec3::UnitZ());
  if (partner == against_sphere) out.from_radius = reader.number("from_radius", positive.in("m"));
  if (shape == own_curve) read_own_curve(reader, out);
  else if (partner == against_curve) read_profile(reader, out);
}

// c of a normal force k d^n (1 + c d' / v) after an impact at speed v (dynamics/contacts.h): from (1 + e) c = ln((1 + c) / (1 - c e)).
double restitution_damping(double e) {
  if (e >= 1.0) return 0.0;
  // (1 + e) c - ln((1 + c) / (1 - c e)) is positive between zero and the root, negative beyond.
  double low = 0.0, high = 1.0 / e;
  for (int halved = 0; halved < 200 && high - low > 1e-15 * high; ++halved) {
    const double c = 0.5 * (low + high);
    (c > 0.0 && (1.0 + e) * c - std::log1p(c) + std::log1p(-c * e) > 0.0 ? low : high) = c;
  }
  return low;
}

void read_normal_force(const TableReader& reader, ContactDef& out) {
  out.exponent = reader.number("exponent", 1.0, {.low = 1.0, .high = 3.0, .what = "a number from 1 (linear) to 3; Hertz: 1.5"});
  out.stiffness = reader.number("stiffness", out.exponent == 1.0 ? positive.in("N/m") : positive);
  if (reader.has("damping") && reader.has("restitution"))
    reader.fail("damping", "excludes 'restitution': give the damping (s/m) or the share of the speed that comes back");
  out.damping = reader.number("damping", 0.0, not_negative.in("s/m"));
  out.restitution = reader.number("restitution", 1.0, {.low = 0.01, .high = 1.0, .what = "a number from 0.01 to 1"});
  if (out.restitution < 1.0) out.damping = restitution_damping(out.restitution);
}

void read_contact_friction(const TableReader& reader, ContactDef& out) {
  const auto friction = reader.table("friction");
  if (!friction) return;
  friction->allow({"coefficient", "static_coefficient", "stiffness", "damping"});
  out.friction = friction->number("coefficient", not_negative);
  out.static_friction = friction->number("static_coefficient", out.friction, not_negative);
  if (out.static_friction < out.friction)
    friction->fail("static_coefficient",
                   fmt::format("must not be smaller than the coefficient {}, found {}", out.friction, out.static_friction));
  if (out.exponent != 1.0 && out.static_friction > 0.0 && !friction->has("stiffness"))
    friction->fail("stiffness", "is needed with an exponent other than 1: N/m, along the plane of contact, of surfaces that stick");
  // As stiff as the normal contact where nothing is said; a tenth of critical for a kilogram.
  out.tangential_stiffness = friction->number("stiffness", out.stiffness, positive.in("N/m"));
  out.tangential_damping = friction->number("damping", 0.2 * std::sqrt(out.tangential_stiffness), not_negative.in("N s/m"));
}

}  // namespace

void allow_contact_keys(const TableReader& reader) {
  reader.allow({"name", "kind", "on", "from", "shape", "radius", "axis", "width", "against", "normal", "from_radius", "curve", "stiffness",
                "exponent", "damping", "restitution", "friction"});
}

ContactDef read_contact(const TableReader& reader) {
  ContactDef out;
  read_shapes(reader, out);
  read_normal_force(reader, out);
  read_contact_friction(reader, out);
  return out;
}

}  // namespace flexframe::sim
