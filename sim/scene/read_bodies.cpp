// [[body]] tables: rigid bodies, beams, modal bodies (SID files) and state-space bodies.
#include "sim/base/files_read.h"
#include "sim/base/spatial.h"
#include "sim/base/words.h"
#include "sim/scene/curve.h"
#include "sim/scene/effect_names.h"
#include "sim/scene/meant_units.h"
#include "sim/scene/read_curve.h"
#include "sim/scene/rotation_input.h"
#include "sim/scene/scene_input.h"
#include "sim/scene/section.h"
#include "sim/scene/shape_mass.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <span>

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

namespace flexframe::sim {

namespace {

using Words = std::vector<std::string>;

const Words kinds{"rigid", "beam", "modal", "statespace"};
const Words beam_models{"finite-element", "modal", "mixed", "lumped"};
const Words boundaries{"clamped-free", "supported-supported", "supported-free", "free-free", "clamped-clamped", "clamped-supported"};

constexpr int most_elements = 10000;
// Straight volumes of a beam of changing section or curved axis, where nothing is said. Of a curved axis at least ten, and one for each 12
// degrees that it turns (a console bent by them is 0.6 % off), at most thirty. Of changing sections twenty: with ten the second frequency
// of a cone that ends at a fifth of its diameter is 2.9 % off.
constexpr int volumes_of_pieces = 10, volumes_of_tapers = 20, most_volumes_of_curves = 30;
constexpr double turn_of_volume = std::numbers::pi / 15.0;
constexpr int highest_mode = 60;  // eigenforms are accurate up to there (issue: every beam of the seeds)
constexpr std::size_t most_coordinates = 100000;

constexpr Range poisson_range{.low = -1.0, .high = 0.5, .open_low = true, .what = "a number in (-1, 0.5]"};

// The word of an effect in the array `key`; `not_known` says what a word that is none of `known` is.
void check_effect(const TableReader& reader, const char* key, const std::string& name, std::span<const std::string> known,
                  const char* not_known, std::span<const std::string> before) {
  if (std::find(known.begin(), known.end(), name) == known.end()) {
    const std::string hint = did_you_mean(name, known);
    reader.fail(key, fmt::format("names the effect {}, which {}{}{} allowed: {}", quote(name), not_known, hint, hint.empty() ? ";" : "",
                                 list_words(known)));
  }
  if (std::find(before.begin(), before.end(), name) != before.end()) reader.fail(key, fmt::format("names {} twice", quote(name)));
}

// without = ["stiffening"]: effects to leave out of "auto" or of what is always there.
void read_without(const TableReader& reader, EffectChoice& choice) {
  if (!reader.has("without")) return;
  const auto known = body_effect_names();
  for (const std::string& name : reader.texts("without")) {
    check_effect(reader, "without", name, known, "no body can go without", choice.without);
    if (std::find(choice.names.begin(), choice.names.end(), name) != choice.names.end())
      reader.fail("without", fmt::format("names {}, which 'effects' lists", quote(name)));
    choice.without.push_back(name);
  }
}

void read_effect_names(const TableReader& reader, EffectChoice& choice) {
  const TomlValue* value = reader.find("effects");
  if (!value) return;
  const auto known = effect_names();
  if (value->type == TomlValue::Type::text) {
    if (value->text == "auto") return;
    if (std::find(known.begin(), known.end(), value->text) != known.end())
      reader.fail("effects", fmt::format("must be \"auto\" or an array: write [\"{}\"]", value->text));
  }
  if (value->type != TomlValue::Type::array)
    reader.fail(
        "effects",
        fmt::format(
            "must be \"auto\" or an array of effects (\"auto\" may be one: what the program chooses and these), found {}; allowed: {}",
            describe(*value), list_words(known)));
  const std::vector<std::string> names = reader.texts("effects");
  choice.automatic = std::find(names.begin(), names.end(), "auto") != names.end();
  for (const std::string& name : names) {
    if (name == "auto") continue;
    check_effect(reader, "effects", name, known, "is unknown", choice.names);
    choice.names.push_back(name);
  }
}

EffectChoice read_effects(const TableReader& reader) {
  EffectChoice choice;
  read_effect_names(reader, choice);
  read_without(reader, choice);
  return choice;
}

Damping read_damping(const TableReader& body) {
  Damping damping;
  const auto reader = body.table("damping");
  if (!reader) return damping;
  reader->allow({"ratio", "mass", "stiffness"});
  if (reader->has("ratio") && (reader->has("mass") || reader->has("stiffness")))
    reader->fail("ratio", "excludes 'mass' and 'stiffness': give damping ratios or Rayleigh's factors");
  if (reader->has("ratio")) damping.ratio = reader->number_or_numbers("ratio", 1, most_coordinates, not_negative.in(""));
  for (const double ratio : damping.ratio)
    if (ratio > 1.0 && reader->unitless("ratio"))
      reader->doubt("ratio", fmt::format("is {} times critical damping: for per cent write \"{} %\", for so much \"{} %\"", ratio, ratio,
                                         100.0 * ratio));
  damping.mass = reader->number("mass", 0.0, not_negative.in("1/s"));
  damping.stiffness = reader->number("stiffness", 0.0, not_negative.in("s"));
  return damping;
}

FlexibleInitial read_flexible_initial(const TableReader& body) {
  FlexibleInitial initial;
  const auto reader = body.table("initial");
  if (!reader) return initial;
  reader->allow({"q", "qd", "static"});
  if (reader->has("q")) initial.q = reader->numbers("q", 0, most_coordinates);
  if (reader->has("qd")) initial.qd = reader->numbers("qd", 0, most_coordinates);
  initial.static_start = reader->boolean("static", false);
  if (initial.static_start && reader->has("q")) reader->fail("static", "excludes 'q': the static equilibrium gives the coordinates");
  if (!initial.q.empty() && !initial.qd.empty() && initial.q.size() != initial.qd.size())
    reader->fail("qd", fmt::format("must have as many numbers as 'q': {}, found {}", initial.q.size(), initial.qd.size()));
  return initial;
}

// Refuses a tensor that no mass distribution can have: principal moments >= 0, none larger than the sum of the others.
void check_inertia(const TableReader& reader, const Vec6& inertia) {
  Mat3 tensor;
  tensor << inertia[0], inertia[3], inertia[4], inertia[3], inertia[1], inertia[5], inertia[4], inertia[5], inertia[2];
  const double scale = tensor.cwiseAbs().maxCoeff();
  if (scale == 0.0) return;
  const Vec3 principal = Eigen::SelfAdjointEigenSolver<Mat3>(tensor / scale, Eigen::EigenvaluesOnly).eigenvalues() * scale;
  // numbers given with five digits may miss the limit of a flat body by rounding
  const double rounding = 1e-4 * scale;
  if (principal[0] < -rounding)
    reader.fail("inertia", fmt::format("is not positive semidefinite: its principal moments are {:.6g}, {:.6g}, {:.6g} kg m^2",
                                       principal[0], principal[1], principal[2]));
  if (principal[2] > principal[0] + principal[1] + rounding)
    reader.fail(
        "inertia",
        fmt::format(
            "violates the triangle inequality: the largest principal moment {:.6g} exceeds the sum of the others, {:.6g} + {:.6g} kg m^2",
            principal[2], principal[0], principal[1]));
}

// Mass, centre and inertia of the body's shapes: by their density, or with the mass that the body gives.
void weigh_shapes(const TableReader& reader, const std::vector<ShapeDef>& shapes, RigidDef& rigid) {
  const bool dense = std::any_of(shapes.begin(), shapes.end(), [](const ShapeDef& s) { return s.density > 0.0; });
  MassMoments moments;
  if (dense) {
    for (const char* key : {"mass", "inertia", "centre_of_mass"})
      if (reader.has(key)) reader.fail(key, "excludes 'density', which gives mass, centre and inertia by the shapes");
    moments = sum_of_shapes(shapes);
    rigid.mass = moments.mass;
  } else {
    std::vector<ShapeDef> even = shapes;
    for (ShapeDef& shape : even) shape.density = 1.0;
    moments = sum_of_shapes(even);
    const double density = rigid.mass / moments.mass;
    moments = {rigid.mass, density * moments.first, density * moments.second};
  }
  if (moments.mass > 0.0) rigid.centre_of_mass = moments.first / moments.mass;
  rigid.inertia = central_inertia(moments);
  if (!moments.second.allFinite()) reader.fail("shapes", "are so large or far away that their inertia is beyond double precision");
}

RigidDef read_rigid(const TableReader& reader, bool mass_required, const std::vector<ShapeDef>& shapes = {}) {
  RigidDef rigid;
  const bool dense = std::any_of(shapes.begin(), shapes.end(), [](const ShapeDef& s) { return s.density > 0.0; });
  if (reader.has("density") && shapes.empty()) reader.fail("density", "needs 'shapes', whose volume it weighs");
  if (dense) {
    weigh_shapes(reader, shapes, rigid);
    return rigid;
  }
  rigid.mass = mass_required ? reader.number("mass", not_negative.in("kg")) : reader.number("mass", 0.0, not_negative.in("kg"));
  const TomlValue* inertia = reader.find("inertia");
  if (inertia && inertia->type == TomlValue::Type::text && inertia->text == "shapes") {
    if (shapes.empty()) reader.fail("inertia", "is \"shapes\", and the body has no 'shapes'");
    if (reader.has("centre_of_mass")) reader.fail("centre_of_mass", "excludes inertia = \"shapes\", which gives it");
    weigh_shapes(reader, shapes, rigid);
    return rigid;
  }
  if (inertia) {
    const std::vector<double> given = reader.numbers("inertia", 3, 6, any_number.in("kg m^2"));
    if (given.size() != 3 && given.size() != 6)
      reader.fail("inertia", fmt::format("must have 3 numbers (xx yy zz) or 6 (xx yy zz xy xz yz), found {}", given.size()));
    for (std::size_t i = 0; i < given.size(); ++i) rigid.inertia[static_cast<Eigen::Index>(i)] = given[i];
    check_inertia(reader, rigid.inertia);
  }
  rigid.centre_of_mass = reader.vector3("centre_of_mass", Vec3::Zero(), "m");
  // Else all that moves it would seem to be without inertia.
  if (!std::isfinite(rigid.mass * rigid.centre_of_mass.squaredNorm()))
    reader.fail("centre_of_mass", "is so far from the body's origin that the inertia about that is beyond double precision");
  return rigid;
}

const char* section_unit(const std::string& key) {
  if (key == "area") return "m^2";
  if (key == "iy" || key == "iz" || key == "iyz" || key == "j") return "m^4";
  return key.starts_with("shear") ? "" : "m";
}

Section read_section(const TableReader& body, const TableReader& reader, const char* own_key) {
  const Words shapes(section_shapes().begin(), section_shapes().end());
  const std::string& shape = shapes[reader.word("shape", shapes)];
  Words keys = section_sizes(shape);
  keys.insert(keys.begin(), {"shape", section_angle});
  if (*own_key) keys.emplace_back(own_key);
  reader.allow(keys);
  std::map<std::string, double> sizes;
  if (const double angle = reader.number(section_angle, 0.0, any_number.in("rad")); angle != 0.0) sizes[section_angle] = angle;
  for (const std::string& key : reader.value().keys)
    if (key != "shape" && key != section_angle && key != own_key)
      sizes[key] = reader.number(key, (key == "iyz" ? any_number : positive).in(section_unit(key)));
  try {
    return make_section(shape, sizes);
  } catch (const InputError& error) {
    body.fail(*own_key ? "sections" : "section", error.what());
  }
}

// Sections along a beam: ascending places, two at one place for a step, between two places one shape with the same sizes.
std::vector<SectionStation> read_stations(const TableReader& body) {
  std::vector<SectionStation> out;
  for (const TableReader& reader : body.tables("sections")) {
    SectionStation station;
    station.at = reader.number("at", {.low = 0.0, .high = 1.0, .what = "x/length, a number from 0 to 1"});
    station.section = read_section(body, reader, "at");
    if (out.empty() && station.at != 0.0) reader.fail("at", fmt::format("of the first section must be 0, found {}", station.at));
    if (!out.empty()) {
      const SectionStation& before = out.back();
      if (station.at < before.at) reader.fail("at", fmt::format("must not descend: {} after {}", station.at, before.at));
      if (out.size() > 1 && station.at == before.at && out[out.size() - 2].at == station.at)
        reader.fail("at", fmt::format("is given to three sections: {}", station.at));
      const auto names = [](const Section& s) {
        Words all{s.shape};
        for (const auto& size : s.size) all.push_back(size.first);
        return all;
      };
      if (station.at > before.at && names(station.section) != names(before.section))
        reader.fail("shape",
                    fmt::format("must be that of the section before, with the same sizes ({}), for a taper; found {}. For a step give "
                                "two sections with the same 'at'",
                                list_words(names(before.section)), list_words(names(station.section))));
    }
    out.push_back(std::move(station));
  }
  if (out.size() < 2)
    body.fail("sections", fmt::format("must be at least two, found {}; one that is the same all along is 'section'", out.size()));
  return out;
}

// What a beam of changing section or curved axis needs of the rest of its table.
void check_pieces(const TableReader& reader, const BeamDef& beam) {
  const char* const key = beam.axis ? "axis" : "sections";
  if (beam.model != BeamModel::mixed)
    reader.fail("model", fmt::format("must be 'mixed' with '{}': the beam is made of straight pieces of one section each", key));
  if (!beam.damping.ratio.empty())
    reader.fail("damping",
                fmt::format("'ratio' has no meaning with '{}', whose modes are not known beforehand: give 'stiffness' (s), 2 x ratio / "
                            "angular frequency of the mode that counts",
                            key));
  std::set<double> marks{0.0, 1.0};
  for (const SectionStation& station : beam.stations) marks.insert(station.at);
  if (static_cast<int>(marks.size()) - 1 > beam.volumes)
    reader.fail("volumes",
                fmt::format("must be at least {}, one for each stretch between the 'sections', found {}", marks.size() - 1, beam.volumes));
}

int default_volumes(const BeamDef& beam) {
  if (!beam.axis) return volumes_of_tapers;
  constexpr int places = 400;
  double turned = 0.0;
  Vec3 last = beam.axis->at(0.0).tangent.normalized();
  for (int i = 1; i <= places; ++i) {
    const Vec3 next = beam.axis->at(beam.length * i / places).tangent.normalized();
    turned += std::atan2(last.cross(next).norm(), last.dot(next));
    last = next;
  }
  // Rounding makes no further volume.
  return std::clamp(static_cast<int>(std::ceil(turned / turn_of_volume - 1e-6)), volumes_of_pieces, most_volumes_of_curves);
}

// A curved axis begins in the body's origin, along x; it gives the length.
void read_axis(const TableReader& reader, BeamDef& beam) {
  if (reader.has("length")) reader.fail("length", "excludes 'axis', whose length is the beam's");
  beam.axis = read_curve(reader, "axis");
  if (beam.axis->closed()) reader.fail("axis", "must be open: join root and tip of a ring by a joint");
  const SpaceCurve::Jet root = beam.axis->at(0.0);
  beam.length = beam.axis->length();
  if (root.place.norm() > 1e-9 * beam.length)
    reader.fail("axis", fmt::format("must begin in the body's origin, found [{:.6g}, {:.6g}, {:.6g}]; the joint places the beam",
                                    root.place.x(), root.place.y(), root.place.z()));
  // The spline's own slope at the first of the points: what is meant is within a few thousandths.
  if (root.tangent.normalized().x() < 0.999)
    reader.fail("axis", fmt::format("must begin along x, found the direction [{:.4g}, {:.4g}, {:.4g}]; the joint turns the beam",
                                    root.tangent.x(), root.tangent.y(), root.tangent.z()));
}

Material read_material(const TableReader& body) {
  body.required("material");
  const TableReader reader = *body.table("material");
  reader.allow({"density", "youngs_modulus", "poisson"});
  Material material;
  material.density = reader.number("density", positive.in("kg/m^3"));
  material.youngs_modulus = reader.number("youngs_modulus", positive.in("Pa"));
  material.poisson = reader.number("poisson", material.poisson, poisson_range);
  const bool bare = reader.unitless("density") && reader.unitless("youngs_modulus");
  if (const std::string meant = meant_material_units(material.density, material.youngs_modulus); bare && !meant.empty())
    reader.doubt(
        "density",
        fmt::format("{} and a Young's modulus of {} are read as kg/m^3 and Pa, but sound would run through such a solid at {:.2g} m/s; are "
                    "they meant in {}? Write the units, as in \"7850 kg/m^3\" and \"210 GPa\"",
                    material.density, material.youngs_modulus, std::sqrt(material.youngs_modulus / material.density), meant));
  return material;
}

std::map<std::string, std::vector<int>> read_modes(const TableReader& body) {
  std::map<std::string, std::vector<int>> modes;
  const TableReader reader = *body.table("modes");
  reader.allow(direction_names());
  for (const std::string& direction : reader.value().keys) {
    std::vector<int> numbers = reader.integers(direction, 1, highest_mode);
    if (numbers.empty()) reader.fail(direction, "is empty; give mode numbers such as [1, 2] or leave the direction out");
    std::set<int> seen;
    for (const int number : numbers)
      if (!seen.insert(number).second) reader.fail(direction, fmt::format("names mode {} twice", number));
    modes[direction] = std::move(numbers);
  }
  if (modes.empty()) body.fail("modes", "is empty; give at least one direction, for example { bending_xy = [1, 2] }");
  return modes;
}

// A frame that is a table: place ("position" or "at"; null where its name says it) and rotation, whose axes it adds. None for a plain
// place.
std::optional<TableReader> turned_frame(const TableReader& frames, const std::string& name, const char* place,
                                        std::map<std::string, Mat3>& axes) {
  if (const TomlValue* value = frames.find(name); !value || value->type != TomlValue::Type::table) return std::nullopt;
  const TableReader table = *frames.table(name);
  table.allow(place ? Words{place, "rotation"} : Words{"rotation"});
  const Vec3 rotation = read_rotation(table, "rotation");
  if (!rotation.isZero(0.0)) axes[name] = rotation_exp(rotation);
  return table;
}

BeamDef read_beam(const TableReader& reader, std::map<std::string, Mat3>& axes) {
  BeamDef beam;
  const bool pieces = reader.has("sections") || reader.has("axis");
  if (reader.has("axis")) read_axis(reader, beam);
  else beam.length = reader.number("length", positive.in("m"));
  if (reader.has("sections")) {
    if (reader.has("section")) reader.fail("section", "excludes 'sections', which say it along the beam");
    beam.stations = read_stations(reader);
    beam.section = beam.stations.front().section;
  } else {
    reader.required("section");
    beam.section = read_section(reader, *reader.table("section"), "");
  }
  // Four times as deep as long, no theory of beams holds: sizes in millimetres beside a length in metres.
  const double gyration = std::sqrt(std::max(beam.section.iy, beam.section.iz) / beam.section.area);
  if (gyration > beam.length)
    reader.doubt(beam.stations.empty() ? "section" : "sections",
                 fmt::format("is about {:.2g} m deep, of a beam that is {:.2g} m long: for sizes in millimetres write \"20 mm\", and so on",
                             4.0 * gyration, beam.length));
  beam.material = read_material(reader);
  beam.model = static_cast<BeamModel>(
      reader.word("model", beam_models, static_cast<std::size_t>(pieces ? BeamModel::mixed : BeamModel::finite_element)));
  beam.boundary = static_cast<Boundary>(reader.word("boundary", boundaries, 0));

  const std::string& model = beam_models[static_cast<std::size_t>(beam.model)];
  const bool mixed = beam.model == BeamModel::mixed;
  const bool modal = beam.model == BeamModel::modal;
  // a key that the model does not read would be silently ignored
  if (modal && reader.has("elements")) reader.fail("elements", "does not belong to model 'modal'; that has 'modes'");
  if (!mixed && reader.has("volumes")) reader.fail("volumes", fmt::format("belongs to model 'mixed'; this one is '{}'", model));
  if (!mixed && !modal && reader.has("modes"))
    reader.fail("modes", fmt::format("belongs to the models 'modal' and 'mixed'; this one is '{}'", model));
  if (beam.model != BeamModel::lumped && reader.has("curvature_coupling"))
    reader.fail("curvature_coupling", fmt::format("belongs to model 'lumped'; this one is '{}'", model));
  // the free-ended boundaries only place the body frame; the others would hold every part of the chain
  if ((mixed || beam.model == BeamModel::lumped) &&
      (beam.boundary == Boundary::clamped_clamped || beam.boundary == Boundary::clamped_supported))
    reader.fail(
        "boundary",
        fmt::format("must leave the ends free with model '{}', whose parts are joined one to the next; hold its ends by joints", model));
  if (mixed && reader.has("modes") && reader.has("elements"))
    reader.fail("elements", "excludes 'modes': the volumes have elements or modes");

  if (modal) reader.required("modes");
  if (reader.has("modes")) beam.modes = read_modes(reader);
  beam.elements = reader.integer("elements", mixed ? 2 : 10, 1, most_elements);
  beam.volumes = reader.integer("volumes", pieces ? default_volumes(beam) : 5, 1, most_elements);
  if (reader.has("keep_modes")) {
    if (beam.model != BeamModel::finite_element)
      reader.fail("keep_modes", fmt::format("belongs to model 'finite-element'; this one is '{}'", model));
    if (beam.boundary == Boundary::clamped_clamped || beam.boundary == Boundary::clamped_supported)
      reader.fail("keep_modes", "needs a boundary that leaves the ends free");
    beam.keep_modes = reader.integer("keep_modes", 0, 0, most_elements);
  }
  for (const char* key : {"keep_static", "keep_inertia", "keep_axial", "keep_torsion"})
    if (reader.has(key) && !beam.keep_modes) reader.fail(key, "needs keep_modes");
  if (reader.has("keep_axial")) beam.keep_axial = reader.integer("keep_axial", 0, 0, most_elements);
  if (reader.has("keep_torsion")) beam.keep_torsion = reader.integer("keep_torsion", 0, 0, most_elements);
  beam.keep_static = reader.boolean("keep_static", true);
  beam.keep_inertia = reader.boolean("keep_inertia", false);
  beam.curvature_coupling = reader.boolean("curvature_coupling", false);
  beam.effects = read_effects(reader);
  beam.damping = read_damping(reader);
  beam.initial = read_flexible_initial(reader);

  if (const auto frames = reader.table("frames"))
    for (const std::string& name : frames->value().keys) {
      check_name(*frames, name, name, "frame");
      if (name == "root" || name == "tip" || name.starts_with("node[") || name.starts_with("station["))
        frames->fail(name, "is a name of the beam's own; choose another");
      constexpr Range share{.low = 0.0, .high = 1.0, .what = "x/length, a number from 0 to 1"};
      const auto turned = turned_frame(*frames, name, "at", axes);
      beam.frames[name] = turned ? turned->number("at", share) : frames->number(name, share);
    }
  if (pieces) check_pieces(reader, beam);
  // What bends a curved beam twists and stretches it too.
  if (beam.axis && beam.effects.automatic)
    for (const char* effect : {"axial", "bending_xy", "bending_xz", "torsion"})
      if (const auto& out = beam.effects.without;
          std::find(out.begin(), out.end(), effect) == out.end() &&
          std::find(beam.effects.names.begin(), beam.effects.names.end(), effect) == beam.effects.names.end())
        beam.effects.names.emplace_back(effect);
  return beam;
}

// Axes of the file's nodes where they are not those of the file.
void read_node_axes(const TableReader& body, std::map<std::string, Mat3>& axes) {
  const auto frames = body.table("frames");
  if (!frames) return;
  for (const std::string& name : frames->value().keys) {
    if (!frames->table(name)->has("rotation")) frames->fail(name, "must say the rotation of this node of the file: { rotation = ... }");
    turned_frame(*frames, name, nullptr, axes);
  }
}

ModalDef read_modal(const TableReader& reader, const std::filesystem::path& folder, std::map<std::string, Mat3>& axes) {
  ModalDef modal;
  modal.file = read_file_path(reader, "file", folder);
  note_file_read(modal.file);  // it will be, when the model is made
  read_node_axes(reader, axes);
  modal.effects = read_effects(reader);
  modal.damping = read_damping(reader);
  modal.initial = read_flexible_initial(reader);
  return modal;
}

// The matrices, in the body's table or in a TOML file of their own.
void read_matrices(const TableReader& reader, StateSpaceDef& body) {
  body.omega = reader.matrix("omega");
  const Eigen::Index n = body.omega.rows();
  if (body.omega.cols() != n) reader.fail("omega", fmt::format("must be square, found {} x {}", n, body.omega.cols()));
  body.gamma = reader.has("gamma") ? reader.matrix("gamma") : MatX::Zero(n, n);
  if (body.gamma.rows() != n || body.gamma.cols() != n)
    reader.fail("gamma", fmt::format("must be {} x {} like 'omega', found {} x {}", n, n, body.gamma.rows(), body.gamma.cols()));
  body.sigma = reader.matrix("sigma");
  if (body.sigma.rows() != n) reader.fail("sigma", fmt::format("must have {} rows like 'omega', found {}", n, body.sigma.rows()));
  body.theta = reader.has("theta") ? reader.matrix("theta") : MatX(body.sigma.transpose());
  if (body.theta.cols() != n) reader.fail("theta", fmt::format("must have {} columns like 'omega', found {}", n, body.theta.cols()));
}

StateSpaceDef read_state_space(const TableReader& reader, const std::filesystem::path& folder, std::map<std::string, Mat3>& axes) {
  StateSpaceDef body;
  body.rigid = read_rigid(reader, false);
  FrameTable frames = read_frames(reader);
  body.rigid.frames = std::move(frames.position);
  body.ports = std::move(frames.order);
  axes = std::move(frames.axes);
  body.initial = read_flexible_initial(reader);
  if (reader.has("file")) {
    for (const char* key : {"omega", "gamma", "sigma", "theta"})
      if (reader.has(key)) reader.fail(key, "excludes 'file', which holds the matrices");
    body.file = read_file_path(reader, "file", folder);
    const TomlValue document = read_toml(body.file);
    const TableReader root(document, body.file.string(), "");
    root.allow({"title", "omega", "gamma", "sigma", "theta"});
    read_matrices(root, body);
  } else {
    read_matrices(reader, body);
  }

  if (reader.has("ports")) {
    body.ports = reader.texts("ports");
    std::vector<std::string> known;
    known.reserve(body.rigid.frames.size());
    for (const auto& frame : body.rigid.frames) known.push_back(frame.first);
    for (const std::string& port : body.ports)
      if (!body.rigid.frames.contains(port))
        reader.fail("ports", fmt::format("names {}, which is no frame of the body; it has {}", quote(port), list_words(known)));
  }
  if (body.ports.empty()) reader.fail("frames", "must name at least one frame: the port that forces act on");
  const auto ports = static_cast<Eigen::Index>(body.ports.size());
  if (body.sigma.cols() != 3 * ports && body.sigma.cols() != 6 * ports)
    reader.fail(fmt::format("'sigma' must have 3 or 6 columns (force, torque) for each of the {} ports ({}), found {}", ports,
                            list_words(body.ports), body.sigma.cols()));
  if (body.theta.rows() != body.sigma.cols())
    reader.fail(fmt::format("'theta' must have as many rows as 'sigma' has columns, {}, found {}", body.sigma.cols(), body.theta.rows()));
  return body;
}

Words allowed_keys(std::size_t kind, bool modal_beam) {
  Words keys{"name", "kind", "mesh", "color", "drawing"};
  const auto add = [&](std::initializer_list<const char*> more) { keys.insert(keys.end(), more.begin(), more.end()); };
  switch (kind) {
    case 0:
      add({"mass", "inertia", "centre_of_mass", "frames", "shapes", "density"});
      break;
    case 1:
      add({"length", "section", "sections", "axis", "material", "model"});
      add(modal_beam ? std::initializer_list<const char*>{"modes", "elements"} : std::initializer_list<const char*>{"elements", "modes"});
      add({"volumes", "keep_modes", "keep_axial", "keep_torsion", "keep_static", "keep_inertia", "curvature_coupling", "boundary",
           "effects", "without", "damping", "frames", "initial", "shown"});
      break;
    case 2:
      add({"file", "frames", "effects", "without", "damping", "initial", "shown"});
      break;
    default:
      add({"file", "omega", "gamma", "sigma", "theta", "ports", "mass", "inertia", "centre_of_mass", "frames", "initial", "shown"});
  }
  return keys;
}

// shown = "joints", "frame", "mean", or one or two frames of the body: the word, or "frames" and the names, a line each.
std::string read_shown(const TableReader& reader, const TomlValue& value) {
  const Words words{"joints", "frame", "mean"};
  if (value.type == TomlValue::Type::array) {
    const Words names = reader.texts("shown");
    if (names.empty() || names.size() > 2)
      reader.fail("shown",
                  fmt::format("must name one frame of the body (its deformation is seen from there) or two (from their chord), found {}",
                              names.size()));
    std::string text = "frames";
    for (const std::string& name : names) {
      check_name(reader, "shown", name, "frame");
      text += "\n" + name;
    }
    return text;
  }
  const bool text = value.type == TomlValue::Type::text;
  if (!text || std::find(words.begin(), words.end(), value.text) == words.end())
    reader.fail("shown", fmt::format("is {}{}; allowed: {}, or an array of one or two frames of the body", describe(value),
                                     text ? did_you_mean(value.text, words) : "", list_words(words)));
  return value.text;
}

}  // namespace

std::filesystem::path read_file_path(const TableReader& reader, std::string_view key, const std::filesystem::path& folder) {
  const std::string text = reader.text(key);
  if (text.empty()) reader.fail(key, "is empty; a file name is expected");
  std::filesystem::path path = std::filesystem::path(text);
  if (path.is_relative()) path = folder / path;
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found)
    reader.fail(key, fmt::format("names the file {}, which does not exist (looked for as {})", quote(text), path.string()));
  if (std::filesystem::is_directory(status)) reader.fail(key, fmt::format("names the directory {}; a file is expected", quote(text)));
  const auto absolute = std::filesystem::absolute(path, error);
  return error ? path : absolute.lexically_normal();
}

std::string drawing_text(const TableReader& reader, std::string_view key, const TomlValue& value) {
  switch (value.type) {
    case TomlValue::Type::text:
      return value.text;
    case TomlValue::Type::boolean:
      return value.boolean ? "true" : "false";
    case TomlValue::Type::integer:
      return fmt::format("{}", value.integer);
    case TomlValue::Type::real:
      return fmt::format("{}", value.real);
    case TomlValue::Type::array: {
      std::string list;
      for (const TomlValue& item : value.items) {
        if (item.type == TomlValue::Type::array) reader.fail(key, "must not hold an array in an array");
        list += (list.empty() ? "" : ", ") + drawing_text(reader, key, item);
      }
      return "[" + list + "]";
    }
    default:
      reader.fail(key, fmt::format("must be a string, number, boolean or an array of them, found {}", describe(value)));
  }
}

FrameTable read_frames(const TableReader& body) {
  FrameTable frames;
  const auto reader = body.table("frames");
  if (!reader) return frames;
  for (const std::string& name : reader->value().keys) {
    check_name(*reader, name, name, "frame");
    const auto turned = turned_frame(*reader, name, "position", frames.axes);
    frames.position[name] = turned ? turned->vector3("position", Vec3::Zero(), "m") : reader->vector3(name, "m");
    frames.order.push_back(name);
  }
  return frames;
}

bool is_beam(const BodyDef& body) { return std::holds_alternative<BeamDef>(body.kind); }
bool is_rigid(const BodyDef& body) { return std::holds_alternative<RigidDef>(body.kind); }

BodyDef read_body(TableReader& reader, const std::filesystem::path& folder) {
  BodyDef body;
  body.line = reader.line();
  body.name = reader.text("name");
  check_name(reader, "name", body.name, "body");
  if (body.name == "ground" || body.name == "system")
    reader.fail("name", fmt::format("must not be '{}', which is a word of the scene file", body.name));
  reader.set_label(fmt::format("[[body]] {}", quote(body.name)));

  const std::size_t kind = reader.word("kind", kinds);
  const TomlValue* model = reader.find("model");
  reader.allow(allowed_keys(kind, model && model->text == "modal"));
  if (const TomlValue* shown = reader.find("shown")) body.drawing["shown"] = read_shown(reader, *shown);
  read_mesh(reader, folder, body);
  if (const TomlValue* color = reader.find("color")) body.drawing["color"] = drawing_text(reader, "color", *color);
  if (const auto drawing = reader.table("drawing"))
    for (std::size_t i = 0; i < drawing->value().keys.size(); ++i) {
      const std::string& key = drawing->value().keys[i];
      body.drawing[key] = drawing_text(*drawing, key, drawing->value().items[i]);
    }

  switch (kind) {
    case 0: {
      FrameTable frames = read_frames(reader);
      body.shapes = read_shapes(reader, frames.position);
      if (body.mesh && !body.shapes.empty()) reader.fail("shapes", "excludes 'mesh': the body is drawn with one or the other");
      RigidDef rigid = read_rigid(reader, true, body.shapes);
      rigid.frames = std::move(frames.position);
      body.frame_axes = std::move(frames.axes);
      body.kind = std::move(rigid);
      break;
    }
    case 1:
      body.kind = read_beam(reader, body.frame_axes);
      break;
    case 2:
      body.kind = read_modal(reader, folder, body.frame_axes);
      break;
    default:
      body.kind = read_state_space(reader, folder, body.frame_axes);
  }
  return body;
}

}  // namespace flexframe::sim
