// Materials in space, layered shells, beams. See fe_sections.h.
#include "sim/reduce/fe_sections.h"

#include "sim/reduce/fe_elements.h"

#include <fmt/format.h>

#include <Eigen/SparseCholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

constexpr int first_of[6] = {0, 1, 2, 0, 1, 0}, second_of[6] = {0, 1, 2, 1, 2, 2};

// Axes of a shell's layer: the first is the material's first axis laid on the surface (its second where the first is normal to it), turned
// by the angle.
Mat3 ply_axes(const Mat3* axes, double angle, const Vec3& normal) {
  Mat3 out;
  out.col(2) = normal;
  const Mat3 given = axes ? *axes : Mat3::Identity();
  Vec3 along = given.col(0) - normal.dot(given.col(0)) * normal;
  // Within a tenth of a degree of the normal the direction left over is rounding of the mesh: then the third axis, as Abaqus has it.
  if (along.norm() < 1.7e-3) along = given.col(2) - normal.dot(given.col(2)) * normal;
  along.normalize();
  const Vec3 across = normal.cross(along);
  out.col(0) = std::cos(angle) * along + std::sin(angle) * across;
  out.col(1) = normal.cross(Vec3(out.col(0)));
  return out;
}

FePly ply(const FeMaterial& m, const Mat3& turn) {
  FePly out;
  out.density = m.density;
  if (!m.elasticity) {
    const double c = m.youngs_modulus / (1 - m.poisson * m.poisson);
    out.membrane << c, c * m.poisson, 0, c * m.poisson, c, 0, 0, 0, 0.5 * c * (1 - m.poisson);
    out.shear = out.alone = m.youngs_modulus / (2 * (1 + m.poisson)) * Eigen::Matrix2d::Identity();
    return out;
  }
  // No stress along the normal: the compliance's part of the surface, turned into the shell's axes.
  const Mat6 T = stress_turn(turn);
  const Mat6 compliance = (T * *m.elasticity * T.transpose()).inverse();
  constexpr std::array<int, 3> plane = {0, 1, 3};
  constexpr std::array<int, 2> across = {5, 4};
  out.membrane = Mat3(compliance(plane, plane)).inverse();
  out.shear = out.alone = Eigen::Matrix2d(compliance(across, across)).inverse();
  return out;
}

void sum_up(FeShellLaw& law) {
  for (const FePly& p : law.plies) {
    const double t = p.upper - p.lower, square = 0.5 * (p.upper * p.upper - p.lower * p.lower),
                 cube = (p.upper * p.upper * p.upper - p.lower * p.lower * p.lower) / 3.0;
    law.A += t * p.membrane;
    law.B += square * p.membrane;
    law.D += cube * p.membrane;
    law.S += 5.0 / 6.0 * t * p.shear;
    law.twist += t * p.membrane(2, 2);
    law.m0 += t * p.density;
    law.m1 += square * p.density;
    law.m2 += cube * p.density;
  }
  const FePly &top = law.plies.back(), &bottom = law.plies.front();
  law.upper = {top.membrane, top.upper * top.membrane, top.upper};
  law.lower = {bottom.membrane, bottom.lower * bottom.membrane, bottom.lower};
}

// Stress that balances what moments' change makes of the stress in the layers, grown from the bottom: at three places of each layer
// use(layer, height, weight in m, xx yy xy (N/m) of unit Mx My Mxy without force in the plane). Returns the bending stiffness without such
// force.
template <class Use>
Mat3 grow_shear(const FeShellLaw& law, const Use& use) {
  Mat6 stiffness;
  stiffness << law.A, law.B, law.B, law.D;
  const Mat6 compliance = stiffness.inverse();
  const Mat3 stretch = compliance.topRightCorner<3, 3>(), bend = compliance.bottomRightCorner<3, 3>();
  Mat3 below = Mat3::Zero();
  constexpr std::array<double, 3> place = {-0.774596669241483377, 0.0, 0.774596669241483377}, weight = {5.0 / 9, 8.0 / 9, 5.0 / 9};
  const auto grown = [&](const FePly& p, double z) {
    return Mat3(below + p.membrane * ((z - p.lower) * stretch + 0.5 * (z * z - p.lower * p.lower) * bend));
  };
  for (const FePly& p : law.plies) {
    for (size_t i = 0; i < 3; ++i) {
      const double z = 0.5 * (p.lower + p.upper) + 0.5 * place[i] * (p.upper - p.lower);
      use(p, z, 0.5 * weight[i] * (p.upper - p.lower), grown(p, z));
    }
    below = grown(p, p.upper);
  }
  return bend.inverse();
}

// Transverse shear of several layers. Where a bending wave runs along a direction, its curvature, and so all stress in the layers, changes
// along that direction alone, and shear stress balances this change (R. Rolfes, K. Rohwer, Improved transverse shear stresses in composite
// finite elements, IJNME 40 (1997), who take one moment of the element's axes each instead: with them the stiffness of laminates depended
// on the way their elements lie). The stiffness S of the plate is the one whose energy is nearest that of these waves in all directions.
// Five sixths of the layers' sum are a single layer's: a soft core between stiff faces would be as stiff as these. Layers get the mean of
// it, which those of curved shells sum up.
void balance_shear(FeShellLaw& law) {
  Mat6 energy = Mat6::Zero();  // twice that of moments that change, along x (three) and along y
  const Mat3 bending = grow_shear(law, [&](const FePly& p, double, double weight, const Mat3& f) {
    Eigen::Matrix<double, 2, 6> flow;  // xz and yz
    flow << f.row(0), f.row(2), f.row(2), f.row(1);
    energy += weight * flow.transpose() * p.alone.inverse() * flow;
  });
  Mat3 normal = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  constexpr int directions = 36;  // 5 degrees
  for (int k = 0; k < directions; ++k) {
    const double angle = std::numbers::pi * k / directions, c = std::cos(angle), s = std::sin(angle);
    const Vec3 moments = bending * Vec3(c * c, s * s, 2 * c * s);
    Vec6 change;
    change << c * moments, s * moments;
    const double x = change(0) + change(5), y = change(2) + change(4);  // transverse forces
    const Vec3 form = Vec3(x * x, y * y, 2 * x * y) / change.dot(energy * change);
    normal += form * form.transpose();
    right += form;
  }
  const Vec3 fitted = normal.ldlt().solve(right);
  Eigen::Matrix2d flexibility;
  flexibility << fitted(0), fitted(2), fitted(2), fitted(1);
  if (!flexibility.allFinite() || !(flexibility(0, 0) > 0.0) || !(flexibility.determinant() > 0.0)) return;
  law.S = flexibility.inverse();
  const double total = law.plies.back().upper - law.plies.front().lower;
  for (FePly& p : law.plies) p.shear = 6.0 / 5.0 / total * law.S;
}

// One layer whose bending and shear are not those of a solid plate of its material. Its stress from bending is that of what bends, at the
// heights that are given: faces on a core stand further out than the layer that stretches.
void change_bending(const FeModel& model, const FeLayup& layup, const FeElement& element, const Mat3& Q, FeShellLaw& law) {
  const FePly& own = law.plies[0];
  const double t = own.upper - own.lower, plate = t * t * t / 12.0;
  Mat3 bends = own.membrane;
  const auto of_another = [&](int material) {
    const Mat3 axes = ply_axes(element.axes >= 0 ? &model.axes[element.axes] : nullptr, 0.0, Q.col(2));
    return ply(model.materials[material], Q.transpose() * axes);
  };
  if (layup.bending_material >= 0) bends = of_another(layup.bending_material).membrane;
  law.D += plate * (layup.bending * bends - own.membrane);
  const double middle = 0.5 * (own.lower + own.upper);
  for (FeFace* face : {&law.lower, &law.upper}) {
    const double height = (face == &law.lower ? layup.lower_face : layup.upper_face).value_or(face->height - middle);
    *face = {own.membrane, middle * own.membrane + (layup.bending > 0.0 ? height : 0.0) * bends, middle + height};
  }
  if (layup.shear_material >= 0) {
    law.plies[0].shear = law.plies[0].alone = of_another(layup.shear_material).alone;
    law.S = 5.0 / 6.0 * t * law.plies[0].shear;
  }
  law.S *= layup.shear;
  law.plies[0].shear *= layup.shear;
  // A membrane has no stiffness against turning, so no inertia either.
  if (layup.bending == 0.0) law.m1 = law.m2 = 0.0;
}

}  // namespace

Mat6 stress_turn(const Mat3& Q) {
  Mat6 T;
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) {
      const int i = first_of[a], j = second_of[a], k = first_of[b], l = second_of[b];
      T(a, b) = Q(i, k) * Q(j, l) + (k == l ? 0.0 : Q(i, l) * Q(j, k));
    }
  return T;
}

FeMaterial material_in_space(const FeModel& model, const FeElement& element) {
  FeMaterial m = model.materials[element.material];
  if (m.elasticity && element.axes >= 0) {
    const Mat6 T = stress_turn(model.axes[element.axes]);
    m.elasticity = T * *m.elasticity * T.transpose();
  }
  return m;
}

FeShellLaw shell_law(const FeMaterial& material, double thickness) {
  FeShellLaw law;
  law.plies.push_back(ply(material, Mat3::Identity()));
  law.plies[0].lower = -0.5 * thickness;
  law.plies[0].upper = 0.5 * thickness;
  sum_up(law);
  law.B.setZero();
  law.m1 = 0.0;
  return law;
}

FeShellLaw shell_law(const FeModel& model, const FeElement& element, const Mat3& Q) {
  std::vector<FeLayer> layers;
  double offset = 0.0;
  if (element.section >= 0) {
    layers = model.layups[element.section].layers;
    offset = model.layups[element.section].offset;
  }
  if (layers.empty()) {
    const FeMaterial& m = model.materials[element.material];
    if (offset == 0.0 && !m.elasticity && element.section < 0) return shell_law(m, element.thickness);
    layers.push_back({element.thickness, element.material, -1, 0.0});
  }
  double total = 0.0;
  for (const FeLayer& l : layers) total += l.thickness;
  // Where the whole has another thickness (*NODAL THICKNESS) all layers change alike.
  if (element.thickness > 0.0 && std::abs(element.thickness - total) > 1e-12 * total) {
    for (FeLayer& l : layers) l.thickness *= element.thickness / total;
    total = element.thickness;
  }
  FeShellLaw law;
  double at = -(0.5 + offset) * total;
  for (const FeLayer& l : layers) {
    const int axes = l.axes >= 0 ? l.axes : element.axes;
    const Mat3 own = ply_axes(axes >= 0 ? &model.axes[axes] : nullptr, l.angle, Q.col(2));
    law.plies.push_back(ply(model.materials[l.material], Q.transpose() * own));
    law.plies.back().lower = at;
    law.plies.back().upper = at += l.thickness;
  }
  sum_up(law);
  if (law.plies.size() > 1) balance_shear(law);
  if (element.section >= 0 && law.plies.size() == 1) change_bending(model, model.layups[element.section], element, Q, law);
  return law;
}

double layer_warping(const FeShellLaw& law) {
  if (law.plies.size() < 2) return 0.0;
  struct Place {
    const FePly* ply;
    double z, weight;
    Mat3 stress;
  };
  std::vector<Place> places;
  const Mat3 bending = grow_shear(law, [&](const FePly& p, double z, double weight, const Mat3& f) {
    places.push_back({&p, z, weight, f});
  });
  double largest = 0.0;
  constexpr int directions = 6;
  for (int k = 0; k < directions; ++k) {
    const double angle = std::numbers::pi * k / directions, c = std::cos(angle), s = std::sin(angle);
    const Vec3 moments = bending * Vec3(c * c, s * s, 2 * c * s), stretch(c * c, s * s, c * s);
    Eigen::Matrix<double, 2, 3> across;  // from xx yy xy to xz yz of the wave
    across << c, 0, s, 0, s, c;
    const Eigen::Vector2d along(c, s);
    const double mean = along.dot(law.S.inverse() * (across * moments));
    // Displacement beside the straight normal: where a layer's shear angle is not the mean one. What a stretched and bent plate has of it
    // is taken out, weighed by stiffness.
    double beside = 0.0;
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    double square = 0.0;
    for (const Place& p : places) {
      const double sheared = along.dot(p.ply->alone.inverse() * (across * (p.stress * moments)));
      const double step = p.weight * (sheared / mean - 1.0);
      const double u = beside + 0.5 * step, stiff = p.weight * stretch.dot(p.ply->membrane * stretch);
      beside += step;
      normal += stiff * Eigen::Vector2d(1, p.z) * Eigen::RowVector2d(1, p.z);
      right += stiff * u * Eigen::Vector2d(1, p.z);
      square += stiff * u * u;
    }
    const double left = square - right.dot(normal.inverse() * right);
    largest = std::max(largest, left / moments.dot(Vec3(c * c, s * s, 2 * c * s)));
  }
  return largest;
}

FeShellLaw shell_law_at(const FeModel& model, const FeElement& element, const Mat3& Q, const VecX& N) {
  if (model.node_thickness.empty()) return shell_law(model, element, Q);
  const auto at = model.node_thickness.find(static_cast<int>(&element - model.elements.data()));
  if (at == model.node_thickness.end()) return shell_law(model, element, Q);
  FeElement here = element;
  here.thickness = N.dot(at->second);
  return shell_law(model, here, Q);
}

namespace {

// Of a beam in one plane: N m^2, shear stiffness G As in N (0: rigid), kg/m, kg m.
struct PlaneBeam {
  double EI = 0.0, GA = 0.0, mass = 0.0, rotary = 0.0;
};

// 12 EI / G A L^2, by which shear softens bending.
double shear_share(double EI, double GA, double L) { return GA > 0.0 ? 12.0 * EI / (GA * L * L) : 0.0; }

// Bending in one plane: motions v1 theta1 v2 theta2 with theta = v' in the absence of shear.
void bending(const PlaneBeam& beam, double L, Eigen::Matrix4d& K, Eigen::Matrix4d& M) {
  const auto [EI, GA, mass, rotary] = beam;
  const double phi = shear_share(EI, GA, L), c = EI / (L * L * L * (1.0 + phi));
  K << 12, 6 * L, -12, 6 * L, 6 * L, (4 + phi) * L * L, -6 * L, (2 - phi) * L * L, -12, -6 * L, 12, -6 * L, 6 * L, (2 - phi) * L * L,
      -6 * L, (4 + phi) * L * L;
  K *= c;
  M.setZero();
  // The integrand is of degree six: four points.
  constexpr std::array<double, 4> place = {-0.861136311594052575, -0.339981043584856265, 0.339981043584856265, 0.861136311594052575};
  constexpr std::array<double, 4> weight = {0.347854845137453857, 0.652145154862546143, 0.652145154862546143, 0.347854845137453857};
  for (size_t i = 0; i < 4; ++i) {
    const double s = 0.5 * (1.0 + place[i]), w = 0.5 * weight[i] * L;
    Eigen::RowVector4d v, turn;
    v << 1 - 3 * s * s + 2 * s * s * s + phi * (1 - s), L * (s - 2 * s * s + s * s * s + 0.5 * phi * (s - s * s)),
        3 * s * s - 2 * s * s * s + phi * s, L * (-s * s + s * s * s + 0.5 * phi * (s * s - s));
    turn << 6.0 / L * (s * s - s), 1 - 4 * s + 3 * s * s + phi * (1 - s), 6.0 / L * (s - s * s), 3 * s * s - 2 * s + phi * s;
    M += w / ((1.0 + phi) * (1.0 + phi)) * (mass * v.transpose() * v + rotary * turn.transpose() * turn);
  }
}

// Lines across a box: `cells` in each wall, in the hole finer towards the walls, where the stress turns round its corners.
std::vector<double> lines_across(const std::array<double, 3>& parts, int cells) {
  std::vector<double> steps(cells, parts[0] / cells), half;
  const double finest = std::min(std::min(parts[0], parts[2]), parts[1] / 4.0) / cells, middle = 0.5 * parts[1];
  double sum = 0.0;
  for (double step = finest; sum < middle; step = std::min(1.4 * step, parts[1] / cells)) {
    half.push_back(step);
    sum += step;
  }
  for (double& step : half) step *= middle / sum;
  steps.insert(steps.end(), half.begin(), half.end());
  steps.insert(steps.end(), half.rbegin(), half.rend());
  steps.insert(steps.end(), cells, parts[2] / cells);
  std::vector<double> lines{0.0};
  for (const double step : steps) lines.push_back(lines.back() + step);
  return lines;
}

// Saint-Venant's constant of a box from Prandtl's stress function: zero at the outer edge, the same all round the hole; bilinear elements,
// the energy stationary (Timoshenko and Goodier, Theory of elasticity, 1970, ch. 10). across, up: wall, hole, wall (m).
double box_torsion_with(const std::array<double, 3>& across, const std::array<double, 3>& up, int cells) {
  const std::vector<double> x = lines_across(across, cells), y = lines_across(up, cells);
  const int nx = static_cast<int>(x.size()), ny = static_cast<int>(y.size());
  const auto beside = [cells](int i, int n) { return i < cells || i > n - 1 - cells; };  // a line outside of the hole
  // Unknown of a place: -1 at the outer edge, 0 in the hole and round it.
  std::vector<int> unknown(static_cast<size_t>(nx) * ny, -1);
  int count = 1;
  for (int i = 1; i + 1 < nx; ++i)
    for (int j = 1; j + 1 < ny; ++j) unknown[static_cast<size_t>(i) * ny + j] = beside(i, nx) || beside(j, ny) ? count++ : 0;
  std::vector<Eigen::Triplet<double>> entries;
  VecX volume = VecX::Zero(count);
  for (int i = 0; i + 1 < nx; ++i)
    for (int j = 0; j + 1 < ny; ++j) {
      const double h = x[i + 1] - x[i], k = y[j + 1] - y[j];
      int at[4];
      for (int c = 0; c < 4; ++c) {
        at[c] = unknown[static_cast<size_t>(i + c / 2) * ny + j + c % 2];
        if (at[c] >= 0) volume[at[c]] += 0.25 * h * k;
      }
      if (!beside(i, nx - 1) && !beside(j, ny - 1)) continue;
      for (int c = 0; c < 4; ++c)
        for (int d = 0; d < 4; ++d) {
          if (at[c] < 0 || at[d] < 0) continue;
          const bool same_x = c / 2 == d / 2, same_y = c % 2 == d % 2;
          entries.emplace_back(at[c], at[d],
                               (same_x ? 1 : -1) * k / h * (same_y ? 2 : 1) / 6 + (same_y ? 1 : -1) * h / k * (same_x ? 2 : 1) / 6);
        }
    }
  Eigen::SparseMatrix<double> slopes(count, count);
  slopes.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(slopes);
  const VecX stress = solver.solve(2.0 * volume);
  return 2.0 * volume.dot(stress);
}

// Two meshes, extrapolated: the corners of the hole leave an error that falls as the power 4/3 of the cells.
double box_torsion(const std::array<double, 3>& across, const std::array<double, 3>& up) {
  const double coarse = box_torsion_with(across, up, 6), fine = box_torsion_with(across, up, 12);
  return fine + (fine - coarse) / (std::pow(2.0, 4.0 / 3.0) - 1.0);
}

}  // namespace

std::optional<FeBeamSection> beam_shape(const std::string& shape, std::vector<double> d) {
  constexpr double pi = std::numbers::pi;
  d.resize(std::max<size_t>(d.size(), 7), 0.0);
  FeBeamSection s;
  if (shape == "RECT") {
    const double a = d[0], b = d[1], longer = std::max(a, b), shorter = std::min(a, b), ratio = shorter / longer;
    s.area = a * b;
    s.I11 = a * b * b * b / 12.0;
    s.I22 = b * a * a * a / 12.0;
    // W. C. Young, R. G. Budynas, Roark's Formulas for Stress and Strain, 2002, table 10.1.
    s.torsion = longer * std::pow(shorter, 3) * (1.0 / 3.0 - 0.21 * ratio * (1.0 - std::pow(ratio, 4) / 12.0));
    s.shear1 = s.shear2 = 5.0 / 6.0 * s.area;
  } else if (shape == "ELLIPSE") {
    s.area = 0.25 * pi * d[0] * d[1];
    s.I11 = pi * d[0] * std::pow(d[1], 3) / 64.0;
    s.I22 = pi * d[1] * std::pow(d[0], 3) / 64.0;
    s.torsion = pi * std::pow(d[0] * d[1], 3) / (16.0 * (d[0] * d[0] + d[1] * d[1]));
    s.shear1 = s.shear2 = 0.9 * s.area;
  } else if (shape == "CIRC" || shape == "PIPE") {
    const double outer = d[0], inner = shape == "PIPE" ? d[0] - d[1] : 0.0, m = inner / outer;
    s.area = pi * (outer * outer - inner * inner);
    s.I11 = s.I22 = 0.25 * pi * (std::pow(outer, 4) - std::pow(inner, 4));
    s.torsion = 2.0 * s.I11;
    // G. R. Cowper, The shear coefficient in Timoshenko's beam theory, J. Appl. Mech. 33 (1966), at Poisson's ratio 0.3.
    const double q = (1 + m * m) * (1 + m * m);
    s.shear1 = s.shear2 = s.area * 6 * 1.3 * q / ((7 + 6 * 0.3) * q + (20 + 12 * 0.3) * m * m);
  } else if (shape == "BOX") {
    const double a = d[0], b = d[1], right = d[2], top = d[3] > 0 ? d[3] : d[2], left = d[4] > 0 ? d[4] : d[2],
                 bottom = d[5] > 0 ? d[5] : d[3];
    const double hole_a = a - right - left, hole_b = b - top - bottom;
    const double thinnest = std::min({right, top, left, bottom});
    if (!(hole_a > 0.0 && hole_b > 0.0 && thinnest > 0.0 && std::isfinite(a + b))) return std::nullopt;
    s.area = a * b - hole_a * hole_b;
    // The hole lies beside the middle where opposite walls differ; about the centroid.
    const double hole = hole_a * hole_b, beside_a = 0.5 * (left - right), beside_b = 0.5 * (bottom - top),
                 centre_a = -hole * beside_a / s.area, centre_b = -hole * beside_b / s.area;
    s.I11 = (a * b * b * b - hole_a * hole_b * hole_b * hole_b) / 12.0 - hole * beside_b * beside_b - s.area * centre_b * centre_b;
    s.I22 = (b * a * a * a - hole_b * hole_a * hole_a * hole_a) / 12.0 - hole * beside_a * beside_a - s.area * centre_a * centre_a;
    s.I12 = -hole * beside_a * beside_b - s.area * centre_a * centre_b;
    const double am = a - 0.5 * (right + left), bm = b - 0.5 * (top + bottom);
    s.torsion = box_torsion({left, hole_a, right}, {bottom, hole_b, top});
    s.shear1 = am * (top + bottom);
    s.shear2 = bm * (right + left);
  } else if (shape == "GENERAL") {
    s.area = d[0];
    s.I11 = d[1];
    s.I12 = d[2];
    s.I22 = d[3];
    s.torsion = d[4];
  } else {
    return std::nullopt;
  }
  const bool good = s.area > 0.0 && s.I11 > 0.0 && s.I22 > 0.0 && s.torsion > 0.0 && s.I11 * s.I22 > s.I12 * s.I12;
  return good ? std::optional(s) : std::nullopt;
}

namespace {

// A wall of an open section: middle, height along n1, width along n2.
struct Wall {
  double y = 0.0, z = 0.0, height = 0.0, width = 0.0;
};

std::optional<FeBeamSection> section_of_walls(const std::vector<Wall>& walls) {
  FeBeamSection s;
  double y = 0.0, z = 0.0;
  for (const Wall& w : walls) {
    if (!(w.height > 0.0 && w.width > 0.0)) return std::nullopt;
    const double area = w.height * w.width;
    s.area += area;
    y += area * w.y;
    z += area * w.z;
  }
  y /= s.area;
  z /= s.area;
  for (const Wall& w : walls) {
    const double area = w.height * w.width, dy = w.y - y, dz = w.z - z;
    s.I22 += area * (w.height * w.height / 12.0 + dy * dy);
    s.I11 += area * (w.width * w.width / 12.0 + dz * dz);
    s.I12 += area * dy * dz;
    s.torsion += beam_shape("RECT", {w.height, w.width})->torsion;
    (w.height > w.width ? s.shear1 : s.shear2) += area;
  }
  for (double* shear : {&s.shear1, &s.shear2})
    if (*shear == 0.0) *shear = 5.0 / 6.0 * s.area;
  return s;
}

}  // namespace

std::optional<FeBeamSection> open_section(const std::string& kind, const std::vector<double>& d) {
  const size_t wants = kind == "I" ? 6 : 4;
  if (d.size() < wants) return std::nullopt;
  const double flange = 0.5 * (d[3] - d[2]), whole = d[0] + d[1];  // of I1, CHAN1, Z
  if (kind == "I1") return open_section("I", {d[3], whole, whole, d[1], flange, flange});
  if (kind == "CHAN1")
    return section_of_walls({{0.5 * flange, 0.5 * whole, flange, whole},
                             {0.5 * d[3], 0.5 * d[1], d[2], d[1]},
                             {d[3] - 0.5 * flange, 0.5 * whole, flange, whole}});
  if (kind == "Z")
    return section_of_walls(
        {{0.5 * flange, 0.5 * d[0], flange, whole}, {0.5 * d[3], 0, d[2], d[1]}, {d[3] - 0.5 * flange, -0.5 * d[0], flange, whole}});
  if (kind == "CHAN2")
    return section_of_walls({{0.5 * d[1], 0, d[1], d[3]},
                             {0.5 * (d[1] + d[2]), 0.5 * (d[3] - d[0]), d[2] - d[1], d[0]},
                             {0.5 * (d[1] + d[2]), -0.5 * (d[3] - d[0]), d[2] - d[1], d[0]}});
  if (kind == "T1") return section_of_walls({{0, 0.5 * d[2], d[0], d[2]}, {0, d[2] + 0.5 * d[1], d[3], d[1]}});
  if (kind == "T2") return section_of_walls({{0.5 * d[2], 0, d[2], d[0]}, {0.5 * (d[1] + d[2]), 0, d[1] - d[2], d[3]}});
  if (kind == "CROSS")
    return section_of_walls(
        {{0, 0, d[2], d[1]}, {0, 0.5 * d[1] + 0.25 * d[0], d[3], 0.5 * d[0]}, {0, -0.5 * d[1] - 0.25 * d[0], d[3], 0.5 * d[0]}});
  if (kind == "H")
    return section_of_walls(
        {{0, 0, d[3], d[0]}, {0, 0.5 * d[0] + 0.25 * d[1], d[2], 0.5 * d[1]}, {0, -0.5 * d[0] - 0.25 * d[1], d[2], 0.5 * d[1]}});
  if (kind == "HAT") {
    const double t = d[1], brim = d[3] + t, at = 0.5 * (d[2] + d[3] - t);
    return section_of_walls({{0.5 * t, at, t, brim},
                             {0.5 * t, -at, t, brim},
                             {0.5 * d[0], 0.5 * (d[2] - t), d[0] - 2 * t, t},
                             {0.5 * d[0], -0.5 * (d[2] - t), d[0] - 2 * t, t},
                             {d[0] - 0.5 * t, 0, t, d[2]}});
  }
  if (kind == "I")
    return section_of_walls(
        {{0.5 * d[4], 0, d[4], d[1]}, {0.5 * (d[4] + d[0] - d[5]), 0, d[0] - d[4] - d[5], d[3]}, {d[0] - 0.5 * d[5], 0, d[5], d[2]}});
  if (kind == "T") return section_of_walls({{0.5 * (d[1] - d[2]), 0, d[1] - d[2], d[3]}, {d[1] - 0.5 * d[2], 0, d[2], d[0]}});
  if (kind == "L") return section_of_walls({{0.5 * d[2], 0.5 * d[0], d[2], d[0]}, {0.5 * (d[1] + d[2]), 0.5 * d[3], d[1] - d[2], d[3]}});
  if (kind == "CHAN")
    return section_of_walls({{0.5 * d[3], 0.5 * d[0], d[3], d[0]},
                             {0.5 * d[1], 0.5 * d[2], d[1] - 2 * d[3], d[2]},
                             {d[1] - 0.5 * d[3], 0.5 * d[0], d[3], d[0]}});
  return std::nullopt;
}

namespace {

// A beam in its principal axes, in which its bending planes do not couple: the first along it, then as n1 and n2 turned.
struct BeamFrame {
  Mat3 Q;
  double L = 0.0, E = 0.0, G = 0.0;     // m, Pa
  double Iy = 0.0, Iz = 0.0;            // m^4, about the second and third axis
  double shear_y = 0.0, shear_z = 0.0;  // m^2, areas that carry shear along them; 0: rigid
};

BeamFrame beam_frame(const FeBeamSection& s, const FeMaterial& material, const Mat3X& X, int id) {
  BeamFrame out;
  const Vec3 axis = X.col(1) - X.col(0);
  out.L = axis.norm();
  if (!(out.L > 0.0)) throw InputError(fmt::format("element {} (beam) has no length", id));
  out.E = material.youngs_modulus;
  out.G = material.shear_modulus > 0.0 ? material.shear_modulus : out.E / (2 * (1 + material.poisson));
  out.Q.col(0) = axis / out.L;
  if (s.truss) return out;
  const Vec3 across = s.n1 - out.Q.col(0).dot(s.n1) * out.Q.col(0);
  if (!(across.norm() > 1e-6 * s.n1.norm()))
    throw InputError(fmt::format("element {} (beam): the section's direction n1 ({:g}, {:g}, {:g}) lies along the beam; give another one",
                                 id, s.n1.x(), s.n1.y(), s.n1.z()));
  const double twist = 0.5 * std::atan2(-2.0 * s.I12, s.I11 - s.I22);
  const double c = std::cos(twist), d = std::sin(twist);
  out.Iy = s.I11 * c * c + s.I22 * d * d - 2.0 * s.I12 * c * d;
  out.Iz = s.I11 * d * d + s.I22 * c * c + 2.0 * s.I12 * c * d;
  const Vec3 n1 = across.normalized(), n2 = out.Q.col(0).cross(n1);
  out.Q.col(1) = c * n1 + d * n2;
  out.Q.col(2) = out.Q.col(0).cross(out.Q.col(1));
  // Areas of shear turned with the axes.
  out.shear_y = s.shear1 * c * c + s.shear2 * d * d;
  out.shear_z = s.shear1 * d * d + s.shear2 * c * c;
  return out;
}

}  // namespace

void beam_matrices(const FeBeamSection& s, const FeMaterial& material, const Mat3X& X, int id, MatX& K, MatX& M) {
  const BeamFrame frame = beam_frame(s, material, X, id);
  const auto [Q, L, E, G, Iy, Iz, A1, A2] = frame;
  const double rho = material.density, mass = rho * s.area + s.mass_per_length;
  K.setZero(12, 12);
  M.setZero(12, 12);
  Eigen::Matrix2d both;
  both << 1, -1, -1, 1;
  Eigen::Matrix2d lengthwise;
  lengthwise << 2, 1, 1, 2;
  if (s.truss) {
    for (Eigen::Index i = 0; i < 2; ++i)
      for (Eigen::Index j = 0; j < 2; ++j) {
        K.block<3, 3>(6 * i, 6 * j) = E * s.area / L * both(i, j) * Q.col(0) * Q.col(0).transpose();
        M.block<3, 3>(6 * i, 6 * j) = mass * L / 6.0 * lengthwise(i, j) * Mat3::Identity();
        K.block<3, 3>(6 * i + 3, 6 * j + 3) = G * s.torsion / L * both(i, j) * Q.col(0) * Q.col(0).transpose();
      }
    return;
  }
  for (Eigen::Index i = 0; i < 2; ++i)
    for (Eigen::Index j = 0; j < 2; ++j) {
      K(6 * i, 6 * j) = E * s.area / L * both(i, j);
      M(6 * i, 6 * j) = mass * L / 6.0 * lengthwise(i, j);
      K(6 * i + 3, 6 * j + 3) = G * s.torsion / L * both(i, j);
      // Without stiffness against twisting the beam has no inertia against it: the motion is no part of the model.
      M(6 * i + 3, 6 * j + 3) = s.torsion > 0.0 ? rho * (Iy + Iz) * L / 6.0 * lengthwise(i, j) : 0.0;
    }
  // Bending along the second axis turns about the third; along the third it turns against the second.
  Eigen::Matrix4d k, m;
  for (int plane = 0; plane < 2; ++plane) {
    const double I = plane == 0 ? Iz : Iy;
    bending({E * I, G * (plane == 0 ? A1 : A2), mass, rho * I}, L, k, m);
    const std::array<int, 4> at = plane == 0 ? std::array<int, 4>{1, 5, 7, 11} : std::array<int, 4>{2, 4, 8, 10};
    const double sign = plane == 0 ? 1.0 : -1.0;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) {
        const double factor = (i % 2 == 1 ? sign : 1.0) * (j % 2 == 1 ? sign : 1.0);
        K(at[i], at[j]) += factor * k(i, j);
        M(at[i], at[j]) += factor * m(i, j);
      }
  }
  MatX turn = MatX::Zero(12, 12);
  for (Eigen::Index i = 0; i < 4; ++i) turn.block<3, 3>(3 * i, 3 * i) = Q.transpose();
  K = (turn.transpose() * K * turn).eval();
  M = (turn.transpose() * M * turn).eval();
}

std::vector<FeBeamPoint> beam_points(const FeBeamSection& section, const FeMaterial& material, const Mat3X& X, int id) {
  const BeamFrame f = beam_frame(section, material, X, id);
  MatX turn = MatX::Zero(12, 12);
  for (Eigen::Index i = 0; i < 4; ++i) turn.block<3, 3>(3 * i, 3 * i) = f.Q.transpose();
  // The integrand is of degree four.
  constexpr std::array<double, 3> place = {-0.774596669241483377, 0.0, 0.774596669241483377}, weight = {5.0 / 9, 8.0 / 9, 5.0 / 9};
  std::vector<FeBeamPoint> out;
  const double L = f.L;
  for (size_t i = 0; i < place.size(); ++i) {
    const double s = 0.5 * (1.0 + place[i]);
    FeBeamPoint p;
    p.weight = 0.5 * weight[i] * L;
    p.fields.setZero();
    p.forces.setZero();
    for (const int d : {0, 3}) {
      p.fields(d == 0 ? 0 : 6, d) = -1.0 / L;
      p.fields(d == 0 ? 0 : 6, d + 6) = 1.0 / L;
    }
    p.fields(3, 3) = 1.0 - s;
    p.fields(3, 9) = s;
    p.forces.row(0) = f.E * section.area * p.fields.row(0);
    p.forces.row(3) = f.G * section.torsion * p.fields.row(6);
    for (int plane = 0; plane < 2; ++plane) {
      const double EI = f.E * (plane == 0 ? f.Iz : f.Iy), phi = shear_share(EI, f.G * (plane == 0 ? f.shear_y : f.shear_z), L);
      Eigen::RowVector4d slope, angle, bend, change;
      slope << (6 * s * s - 6 * s - phi) / L, 1 - 4 * s + 3 * s * s + 0.5 * phi * (1 - 2 * s), (6 * s - 6 * s * s + phi) / L,
          3 * s * s - 2 * s - 0.5 * phi * (1 - 2 * s);
      angle << 6 * (s * s - s) / L, 1 - 4 * s + 3 * s * s + phi * (1 - s), 6 * (s - s * s) / L, 3 * s * s - 2 * s + phi * s;
      bend << 6 * (2 * s - 1) / (L * L), (6 * s - 4 - phi) / L, 6 * (1 - 2 * s) / (L * L), (6 * s - 2 + phi) / L;
      change << 12 / (L * L * L), 6 / (L * L), -12 / (L * L * L), 6 / (L * L);
      // Deflection along the third axis turns against the second.
      const std::array<int, 4> at = plane == 0 ? std::array<int, 4>{1, 5, 7, 11} : std::array<int, 4>{2, 4, 8, 10};
      const double sign = plane == 0 ? 1.0 : -1.0;
      for (int k = 0; k < 4; ++k) {
        const double own = (k % 2 == 1 ? sign : 1.0) / (1.0 + phi);
        p.fields(1 + plane, at[k]) = own * slope(k);
        p.fields(plane == 0 ? 5 : 4, at[k]) = sign * own * angle(k);
        p.fields(plane == 0 ? 8 : 7, at[k]) = sign * own * bend(k);
        // Shear is the moment's slope, whether the section yields to it or not.
        p.forces(plane == 0 ? 5 : 4, at[k]) = EI * sign * own * bend(k);
        p.forces(1 + plane, at[k]) = -EI * own * change(k);
      }
    }
    p.fields = (p.fields * turn).eval();
    p.forces = (p.forces * turn).eval();
    p.spread = section.area > 0.0 ? (f.Iy + f.Iz) / section.area : 0.0;
    out.push_back(p);
  }
  return out;
}

}  // namespace flexframe::sim
