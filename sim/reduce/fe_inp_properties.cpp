// Lines of materials, sections, masses, orientations, ties and supports of an input file.
#include "sim/reduce/fe_inp_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

namespace flexframe::sim {
namespace {

std::vector<int> span_of(int first, int last) {
  std::vector<int> out;
  for (int d = first; d <= std::min(last, 6); ++d) out.push_back(d - 1);
  return out;
}

}  // namespace

Mat3 turned_about(const Vec3& axis, double degrees) {
  return Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis.normalized()).toRotationMatrix();
}

bool InpAxes::at(const Vec3& place, Mat3& axes) const {
  if (cylindrical) {
    const Vec3 z = (b - a).normalized();
    const Vec3 r = (place - a) - z.dot(place - a) * z;
    if (!(r.norm() > 0.0)) return false;
    axes.col(0) = r.normalized();
    axes.col(1) = z.cross(Vec3(axes.col(0)));
    axes.col(2) = z;
  } else {
    const Vec3 z = a.cross(b);
    if (!(a.norm() > 0.0) || !(z.norm() > 1e-9 * a.norm() * b.norm())) return false;
    axes.col(0) = a.normalized();
    axes.col(2) = z.normalized();
    axes.col(1) = axes.col(2).cross(Vec3(axes.col(0)));
  }
  if (about > 0) axes = (turned_about(axes.col(about - 1), angle) * axes).eval();
  return true;
}

size_t InpTableReader::constants(const std::string& kind) {
  if (kind.starts_with("ENG") || kind.starts_with("ORTHO")) return 9;
  if (kind.starts_with("ANISO")) return 21;
  return kind == "LAMINA" ? 6 : 2;
}

void InpTableReader::read_elastic() {
  InpElastic& e = elastics.back();
  const size_t n = constants(e.kind);
  if (e.rows.empty() || e.rows.back().second.size() >= n) e.rows.emplace_back();
  auto& [temperature, row] = e.rows.back();
  // Eight numbers a line; the temperature stands behind the last constant.
  for (size_t i = 0; i < f.size() && i < 8; ++i) {
    const double number = f[i].empty() ? 0.0 : real(f[i], "elastic constant");
    if (row.size() < n) row.push_back(number);
    else {
      temperature = number;
      break;
    }
  }
}

void InpTableReader::finish_elastic() {
  const InpElastic& e = elastics.back();
  const size_t n = constants(e.kind), found = e.rows.empty() ? 0 : e.rows.back().second.size();
  if (found >= n) return;
  if (n == 2) fail("*ELASTIC: 'Young's modulus, Poisson's ratio' is expected");
  fail(fmt::format("*ELASTIC, TYPE={}: {} constants are expected, found {}", e.kind, n, found));
}

void InpTableReader::settle_elastics() {
  double temperature = 0.0;
  for (double t : temperatures) temperature += t / static_cast<double>(temperatures.size());
  const bool even = std::all_of(temperatures.begin(), temperatures.end(), [&](double t) { return t == temperatures[0]; });
  for (InpElastic& e : elastics) {
    std::vector<double> constants = e.rows[0].second;
    if (e.rows.size() > 1) {
      std::stable_sort(e.rows.begin(), e.rows.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
      const auto above = std::find_if(e.rows.begin(), e.rows.end(), [&](const auto& row) { return row.first >= temperature; });
      if (above == e.rows.end()) {
        constants = e.rows.back().second;
      } else if (above == e.rows.begin()) {
        constants = above->second;
      } else {
        const auto below = above - 1;
        const double share = (temperature - below->first) / (above->first - below->first);
        for (size_t i = 0; i < constants.size(); ++i) constants[i] = (1 - share) * below->second[i] + share * above->second[i];
      }
      const std::string text = fmt::format("{}: the elasticity of '{}' depends on temperature: its constants at {:g} count, {}",
                                           where(e.place), deck.materials[e.material].name, temperature,
                                           temperatures.empty() ? "since no *INITIAL CONDITIONS say otherwise"
                                           : even               ? "the initial one"
                                                                : "the mean of the initial ones, which differ");
      (even && !temperatures.empty() ? deck.notes : deck.warnings).push_back(text);
    }
    give_elasticity(e, constants);
  }
}

void InpTableReader::give_elasticity(const InpElastic& given, const std::vector<double>& c) {
  const size_t n = constants(given.kind);
  FeMaterial& m = deck.materials[given.material];
  if (n == 2) {
    m.youngs_modulus = c[0] * units.stress();
    m.poisson = c[1];
    return;
  }
  // In the order xx yy zz xy yz xz of this program.
  Mat6 C = Mat6::Zero();
  if (n == 21) {
    // D1111 D1122 D2222 D1133 D2233 D3333, then the rows 12, 13, 23 of the triangle.
    constexpr int order[6] = {0, 1, 2, 3, 5, 4};
    size_t next = 0;
    for (int b = 0; b < 6; ++b)
      for (int a = 0; a <= b; ++a) C(order[a], order[b]) = C(order[b], order[a]) = c[next++];
  } else if (given.kind.starts_with('O')) {
    C.topLeftCorner<3, 3>() << c[0], c[1], c[3], c[1], c[2], c[4], c[3], c[4], c[5];
    C(3, 3) = c[6];
    C(5, 5) = c[7];
    C(4, 4) = c[8];
  } else {
    // Moduli, Poisson's ratios, shear moduli; a lamina's third direction is like its second, without Poisson's effect.
    const double E1 = c[0], E2 = c[1], E3 = n == 6 ? c[1] : c[2], n12 = n == 6 ? c[2] : c[3], n13 = n == 6 ? 0.0 : c[4],
                 n23 = n == 6 ? 0.0 : c[5], G12 = n == 6 ? c[3] : c[6], G13 = n == 6 ? c[4] : c[7], G23 = n == 6 ? c[5] : c[8];
    Mat6 S = Mat6::Zero();
    for (const double modulus : {E1, E2, E3, G12, G13, G23})
      if (!(modulus > 0.0)) fail_at(given.place, fmt::format("*ELASTIC, TYPE={}: moduli must be > 0, found {:g}", given.kind, modulus));
    S.topLeftCorner<3, 3>() << 1 / E1, -n12 / E1, -n13 / E1, -n12 / E1, 1 / E2, -n23 / E2, -n13 / E1, -n23 / E2, 1 / E3;
    S(3, 3) = 1 / G12;
    S(4, 4) = 1 / G23;
    S(5, 5) = 1 / G13;
    C = S.inverse();
  }
  m.elasticity = C * units.stress();
  m.youngs_modulus = C(0, 0) * units.stress();
}

void InpTableReader::read_hyperelastic() {
  if (lines > 0) return;
  const auto has = [&](const char* word) { return k.has(word); };
  const size_t order = k.has("N") ? static_cast<size_t>(std::clamp(integer(k.get("N"), "N"), 1, 6)) : 1;
  // Twice the sum of the linear coefficients is the initial shear modulus; D1 twice the inverse of the bulk modulus.
  double shear = 0.0;
  size_t bulk_at = 0;
  if (has("OGDEN")) {
    for (size_t i = 0; i < order; ++i) shear += value(2 * i, "coefficient", 0.0);
    bulk_at = 2 * order;
  } else if (has("ARRUDA-BOYCE")) {
    // E. M. Arruda, M. C. Boyce, J. Mech. Phys. Solids 41 (1993): initial slope of the five-term series.
    const double s = 1.0 / std::pow(value(1, "coefficient", 1.0), 2);
    shear = value(0, "coefficient", 0.0) * (1 + s * (3.0 / 5 + s * (99.0 / 175 + s * (513.0 / 875 + s * 42039.0 / 67375))));
    bulk_at = 2;
  } else if (has("NEOHOOKE") || has("YEOH") || has("REDUCEDPOLYNOMIAL")) {
    shear = 2.0 * value(0, "coefficient", 0.0);
    bulk_at = has("YEOH") ? 3 : has("NEOHOOKE") ? 1 : order;
  } else if (has("MOONEY-RIVLIN") || has("POLYNOMIAL") || has("N")) {
    shear = 2.0 * (value(0, "coefficient", 0.0) + value(1, "coefficient", 0.0));
    bulk_at = has("MOONEY-RIVLIN") ? 2 : order * (order + 3) / 2;
  }
  if (!(shear > 0.0) || has("TESTDATAINPUT"))
    return refuse(
        "*HYPERELASTIC: coefficients of NEO HOOKE, MOONEY-RIVLIN, YEOH, POLYNOMIAL, OGDEN or ARRUDA-BOYCE are expected; give "
        "*ELASTIC with the initial moduli instead");
  const double compressible = value(bulk_at, "D1", 0.0), bulk = compressible > 0.0 ? 2.0 / compressible : 0.0;
  // Without a bulk modulus nearly incompressible, as CalculiX has it.
  const double poisson = bulk > 0.0 ? (3 * bulk - 2 * shear) / (2 * (3 * bulk + shear)) : 0.475;
  FeMaterial& m = material();
  m.youngs_modulus = 2.0 * shear * (1.0 + poisson) * units.stress();
  m.poisson = poisson;
  deck.warnings.push_back(fmt::format("{}: material '{}' is hyperelastic; the body has its initial moduli: E = {:.4g} Pa, nu = {:.4g}{}",
                                      where(at), m.name, m.youngs_modulus, poisson, bulk > 0.0 ? "" : " (no bulk modulus is given)"));
}

void InpTableReader::contact_pair() {
  const std::string how = up("INTERACTION");
  const bool tied = k.has("TIED") || tying_interactions.contains(how);
  if (contact == FeContact::refuse && !tied)
    return refuse(
        "*CONTACT PAIR cannot be read: contact is no part of a linear body: --contact tie ties the surfaces as *TIE does, --contact open "
        "leaves them free; or reduce the parts as bodies of their own and join them in the scene");
  if (contact == FeContact::open && !tied) {
    skip = true;
    return deck.warnings.push_back(fmt::format("{}: *CONTACT PAIR stays open: its surfaces move through each other", where(at)));
  }
  InpTie tie;
  tie.place = at;
  tie.kind = InpTie::Kind::surfaces;
  tie.adjust = k.has("ADJUST");
  s().ties.push_back(tie);
  if (!tied) deck.warnings.push_back(fmt::format("{}: *CONTACT PAIR is tied, all over its surfaces and in all directions", where(at)));
}

void InpTableReader::read_thickness() {
  if (f.empty()) return;
  const double first = value(1, "thickness", 0.0) * units.length;
  s().nodal_thickness.push_back({inp_upper(f[0]), first, f.size() > 2 ? value(2, "thickness", 0.0) * units.length : first, at});
}

void InpTableReader::read_section() {
  if (s().sections.empty()) return;
  InpSection& made = s().sections.back();
  if (made.beam) {
    if (lines == 0) {
      for (std::string_view part : f) made.numbers.push_back(part.empty() ? 0.0 : real(part, "section"));
    } else if (lines == 1) {
      made.n1 = Vec3(value(0, "n1", 0), value(1, "n1", 0), value(2, "n1", 0));
    } else if (lines == 2 && made.own_constants) {
      made.young = value(0, "Young's modulus", 0.0) * units.stress();
      made.shear = value(1, "shear modulus", 0.0) * units.stress();
    }
    if (lines == 0) {
      // Lengths; areas and moments of area of a general section.
      for (size_t i = 0; i < made.numbers.size(); ++i)
        made.numbers[i] *= made.shape != "GENERAL" ? units.length : i == 0 ? std::pow(units.length, 2) : std::pow(units.length, 4);
    }
    return;
  }
  if (made.shell && k.has("COMPOSITE")) {
    InpLayer layer;
    layer.thickness = value(0, "thickness of a layer", 0.0) * units.length;
    if (f.size() < 3 || f[2].empty()) fail("*SHELL SECTION, COMPOSITE: 'thickness, , material, orientation' is expected");
    layer.material = std::string(f[2]);
    if (f.size() > 3 && !f[3].empty()) {
      const char head = f[3][0];
      if ((head >= '0' && head <= '9') || head == '-' || head == '+' || head == '.')
        layer.angle = real(f[3], "angle") * std::numbers::pi / 180.0;
      else layer.orientation = inp_upper(f[3]);
    }
    made.layers.push_back(layer);
  } else if (lines == 0) {
    const double factor = made.shell ? units.length : units.length * units.length;
    made.numbers.push_back(value(0, "thickness", 0.0) * factor);
  }
}

void InpTableReader::read_rotary() {
  InpValue& v = s().rotaries.back();
  for (size_t i = 0; i < 6; ++i) v.numbers.push_back(value(i, "moment of inertia", 0.0) * units.mass * units.length * units.length);
}

void InpTableReader::read_spring() {
  std::vector<double>& row = s().springs.back().lines.emplace_back();
  for (std::string_view part : f) row.push_back(part.empty() ? 0.0 : real(part, "spring"));
}

void InpTableReader::read_added_mass() {
  InpValue& v = s().added_masses.back();
  double factor = units.mass;
  if (v.unit == "MASS PER VOLUME") factor = units.density();
  else if (v.unit == "MASS PER AREA") factor = units.mass / (units.length * units.length);
  else if (v.unit == "MASS PER LENGTH") factor = units.mass / units.length;
  v.numbers.push_back(value(0, "mass", 0.0) * factor);
}

void InpTableReader::read_axes(InpAxes& axes) {
  if (f.size() < 6) fail(fmt::format("*{}: two points, six numbers, are expected", k.name));
  for (size_t i = 0; i < 3; ++i) {
    axes.a(static_cast<Eigen::Index>(i)) = real(f[i], "coordinate") * units.length;
    axes.b(static_cast<Eigen::Index>(i)) = real(f[i + 3], "coordinate") * units.length;
  }
  Mat3 test;
  if (!axes.cylindrical && !axes.at(Vec3::Zero(), test)) fail(fmt::format("*{}: the two points give no directions", k.name));
  if (axes.cylindrical && !((axes.b - axes.a).norm() > 0.0)) fail(fmt::format("*{}: the two points give no axis", k.name));
}

void InpTableReader::read_orientation() {
  InpAxes& axes = s().orientations[inp_upper(k.get("NAME"))];
  if (lines == 0) {
    if (!f.empty() && !f[0].empty() && std::isalpha(static_cast<unsigned char>(f[0][0])))
      return refuse("*ORIENTATION from a distribution cannot be read; give one of directions");
    read_axes(axes);
    // A third point, from which the two are seen.
    if (f.size() > 6 && !axes.cylindrical) {
      const Vec3 origin = Vec3(value(6, "coordinate", 0.0), value(7, "coordinate", 0.0), value(8, "coordinate", 0.0)) * units.length;
      axes.a -= origin;
      axes.b -= origin;
      Mat3 test;
      if (!axes.at(Vec3::Zero(), test)) fail("*ORIENTATION: the three points give no directions");
    }
    return;
  }
  if (lines == 1 && !f.empty()) {
    axes.about = integer(f[0], "axis");
    axes.angle = value(1, "angle", 0.0);
    if (axes.about < 1 || axes.about > 3) fail("*ORIENTATION: the axis of the rotation is 1, 2 or 3");
  }
}

void InpTableReader::read_tie() {
  if (s().ties.empty() || f.empty()) return;
  InpTie& tie = s().ties.back();
  if (k.name == "TIE" || k.name == "CONTACT PAIR") {
    if (f.size() < 2) fail(fmt::format("*{}: 'slave surface, master surface' is expected", k.name));
    if (!tie.surface.empty()) s().ties.push_back(tie);
    s().ties.back().surface = inp_upper(f[0]);
    s().ties.back().master = inp_upper(f[1]);
  } else if (k.name == "DISTRIBUTING COUPLING") {
    tie.members.emplace_back(inp_upper(f[0]), value(1, "weight", 1.0));
  } else {
    size_t from = 0;
    if (k.name == "KINEMATIC COUPLING") {
      tie.members.emplace_back(inp_upper(f[0]), 1.0);
      from = 1;
    }
    if (f.size() > from && !f[from].empty()) {
      const int first = integer(f[from], "direction"),
                last = f.size() > from + 1 && !f[from + 1].empty() ? integer(f[from + 1], "direction") : first;
      if (first < 1 || last > 6 || last < first)
        fail(fmt::format("*{}: directions 1 to 6 are allowed, found {} to {}", k.name, first, last));
      tie.dofs.emplace_back(first - 1, last - 1);
    }
  }
}

void InpTableReader::read_boundary() {
  static const std::map<std::string, std::vector<int>> kinds = {{"ENCASTRE", {0, 1, 2, 3, 4, 5}},
                                                                {"PINNED", {0, 1, 2}},
                                                                {"XSYMM", {0, 4, 5}},
                                                                {"YSYMM", {1, 3, 5}},
                                                                {"ZSYMM", {2, 3, 4}},
                                                                {"XASYMM", {1, 2, 3}},
                                                                {"YASYMM", {0, 2, 4}},
                                                                {"ZASYMM", {0, 1, 5}},
                                                                {"NOWARP", {}},
                                                                {"NOOVAL", {}}};
  if (f.empty()) return;
  InpBoundary b;
  b.where = inp_upper(f[0]);
  b.step = step > 0;
  b.place = at;
  if (f.size() < 2) fail("*BOUNDARY: 'node or set, first dof, last dof' is expected");
  if (const auto kind = kinds.find(inp_upper(f[1])); kind != kinds.end()) {
    b.dofs = kind->second;
  } else {
    const int first = integer(f[1], "degree of freedom"), last = f.size() > 2 && !f[2].empty() ? integer(f[2], "degree of freedom") : first;
    if (first < 0 || last < first) fail(fmt::format("*BOUNDARY: degrees of freedom 1 to 6 are allowed, found {} to {}", first, last));
    if (first == 0 || first > 6) note("*BOUNDARY: degrees of freedom 0 and above 6 (temperature, pressure) are passed over");
    if (first > 6 || last == 0) return;
    b.dofs = span_of(std::max(first, 1), last);
    if (f.size() > 3 && value(3, "value", 0.0) != 0.0) note("*BOUNDARY with a value: fixed at zero");
  }
  if (b.step && told.insert("BOUNDARY of the first step").second)
    deck.notes.push_back(fmt::format("{}: *BOUNDARY of the first step holds the model; --hold none leaves it free", where(at)));
  s().boundaries.push_back(b);
}

void InpTableReader::read_equation() {
  if (wanted == 0 || terms.empty()) {
    if (terms.empty() && wanted == 0) {
      wanted = integer(f.empty() ? "" : f[0], "number of terms");
      if (wanted < 1 || wanted > 1000000) fail(fmt::format("*EQUATION: a number of terms is expected, found {}", wanted));
      return;
    }
  }
  for (std::string_view part : f) terms.emplace_back(part);
  const size_t entries = 3 * static_cast<size_t>(wanted);
  if (terms.size() < entries) return;
  InpEquation made;
  made.place = at;
  for (size_t i = 0; i + 2 < entries; i += 3) {
    InpEquation::Term t;
    t.node = inp_upper(terms[i]);
    t.dof = integer(terms[i + 1], "degree of freedom") - 1;
    t.coefficient = real(terms[i + 2], "coefficient");
    if (t.dof > 5 || t.dof < 0) {
      if (t.dof == 10 || t.dof == -1) {
        note("*EQUATION of temperatures is passed over");
        terms.clear();
        wanted = 0;
        return;
      }
      terms.clear();
      wanted = 0;
      return refuse(fmt::format("*EQUATION: degrees of freedom 1 to 6 are allowed, found {}", t.dof + 1));
    }
    made.terms.push_back(t);
  }
  s().equations.push_back(made);
  terms.clear();
  wanted = 0;
}

void InpTableReader::read_mpc() {
  if (f.empty()) return;
  InpMpc m;
  m.type = inp_upper(f[0]);
  m.place = at;
  for (size_t i = 1; i < f.size(); ++i)
    if (!f[i].empty()) m.nodes.push_back(inp_upper(f[i]));
  // More nodes of the one before.
  if (m.type == "0" && !s().mpcs.empty()) {
    InpMpc& last = s().mpcs.back();
    last.nodes.insert(last.nodes.end(), m.nodes.begin(), m.nodes.end());
    return;
  }
  constexpr std::array<std::string_view, 6> known = {"BEAM", "TIE", "PIN", "PLANE", "STRAIGHT", "MEANROT"};
  if (std::find(known.begin(), known.end(), m.type) == known.end())
    return refuse(fmt::format("*MPC of type {}: {} can be read; give others as *EQUATION", m.type, fmt::join(known, ", ")));
  s().mpcs.push_back(m);
}

}  // namespace flexframe::sim
