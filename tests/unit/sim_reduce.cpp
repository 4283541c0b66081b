// The reducer: elements, modes, static deflection, geometric stiffening, SID of the result.
#include "scratch.h"
#include "sim/base/eigen_solvers.h"
#include "sim/bodies/sid.h"
#include "sim/reduce/fe_elements.h"
#include "sim/reduce/fe_integrals.h"
#include "sim/reduce/fe_solver.h"
#include "sim/reduce/reduce.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

namespace flexframe::sim::test_reduce {
namespace {

namespace fs = std::filesystem;
constexpr FeShape solids[] = {FeShape::tetrahedron4, FeShape::tetrahedron10, FeShape::hexahedron8,
                              FeShape::hexahedron20, FeShape::wedge6,        FeShape::wedge15};

fs::path conrod() {
  const fs::path file = fs::path(FLEXFRAME_SOURCE_DIR) / "tests/unit/data/kernel_map/conrod.inp";
  if (!fs::exists(file)) throw std::runtime_error(file.string() + " is missing");
  return file;
}

// A distorted element: an affine image of the parent element (what a patch test allows for quadratic elements too).
Mat3X distorted(FeShape shape) {
  Mat3 A;
  A << 1.3, 0.2, -0.1, 0.15, 0.9, 0.25, -0.2, 0.1, 1.1;
  return 0.1 * A * parent_nodes(shape);
}

TEST(FeElements, ShapeFunctionsInterpolateAndDifferentiate) {
  for (FeShape shape : solids) {
    const Mat3X nodes = parent_nodes(shape);
    VecX N, lower, upper;
    MatX dN, unused;
    for (int i = 0; i < nodes.cols(); ++i) {
      shape_functions(shape, nodes.col(i), N, dN);
      EXPECT_LT((N - VecX::Unit(N.size(), i)).norm(), 1e-14) << fe_name(shape) << i;
    }
    const Vec3 x(0.21, 0.17, 0.33);
    shape_functions(shape, x, N, dN);
    EXPECT_NEAR(N.sum(), 1.0, 1e-14);
    for (int d = 0; d < 3; ++d) {
      shape_functions(shape, x - 1e-6 * Vec3::Unit(d), lower, unused);
      shape_functions(shape, x + 1e-6 * Vec3::Unit(d), upper, unused);
      EXPECT_LT(((upper - lower) / 2e-6 - dN.col(d)).norm(), 1e-9) << fe_name(shape) << d;
    }
  }
}

// Rigid motions cost nothing, uniform strain gives the exact energy and stress, mass is exact.
TEST(FeElements, PatchTest) {
  const FeMaterial steel{"steel", 2.1e11, 0.3, 7850.0};
  Mat3 H;
  H << 1e-3, 2e-4, -3e-4, 5e-4, -2e-4, 1e-4, 3e-4, -4e-4, 6e-4;
  for (FeShape shape : solids)
    for (FeFormulation f : {FeFormulation::full, FeFormulation::reduced, FeFormulation::incompatible}) {
      const Mat3X X = distorted(shape);
      MatX K, M;
      solid_stiffness(shape, f, X, steel, 1, K);
      solid_mass(shape, f, X, steel, 1, M);
      double volume = 0.0;
      for (const FePoint& p : solid_points(shape, f, FeRule::mass, X, 1)) volume += p.volume;
      EXPECT_NEAR(M.sum(), 7850.0 * volume, 1e-9 * 7850.0 * volume);
      const Vec3 moment = X * M.rowwise().sum();
      EXPECT_LT((moment / M.sum() - X * M.rowwise().sum() / (7850.0 * volume)).norm(), 1e-12);
      const double scale = K.cwiseAbs().maxCoeff();
      const auto field = [&](const Mat3& gradient) {
        const Mat3X u = gradient * X;
        return VecX(Eigen::Map<const VecX>(u.data(), u.size()));
      };
      for (int d = 0; d < 3; ++d) {
        Mat3 spin = Mat3::Zero();
        spin((d + 1) % 3, d) = 1.0;
        spin(d, (d + 1) % 3) = -1.0;
        EXPECT_LT((K * field(spin)).cwiseAbs().maxCoeff(), 1e-12 * scale) << fe_name(shape);
      }
      Vec6 strain;
      strain << H(0, 0), H(1, 1), H(2, 2), H(0, 1) + H(1, 0), H(1, 2) + H(2, 1), H(0, 2) + H(2, 0);
      const Vec6 stress = elasticity(steel) * strain;
      const VecX u = field(H);
      EXPECT_NEAR(u.dot(K * u), volume * strain.dot(stress), 1e-9 * volume * strain.dot(stress)) << fe_name(shape) << static_cast<int>(f);
      const MatX nodal = solid_nodal_stress(shape, f, X, steel, H * X, 1);
      for (int i = 0; i < nodal.cols(); ++i) EXPECT_LT((nodal.col(i) - stress).norm(), 1e-9 * stress.norm()) << fe_name(shape);
      // Six motions without stiffness, no more: no hourglass modes. One integration point holds a 20-node brick of eight points only
      // together with its neighbours.
      if (shape == FeShape::hexahedron20 && f == FeFormulation::reduced) continue;
      const VecX eigenvalues = SymmetricEigen(K).eigenvalues();
      EXPECT_LT(eigenvalues(5), 1e-11 * eigenvalues.tail(1)(0));
      EXPECT_GT(eigenvalues(6), 1e-6 * eigenvalues.tail(1)(0)) << fe_name(shape);
    }
}

// Shells anywhere in space: a constant strain and a constant curvature, on a distorted element, give the exact stress on the face of the
// normal.
TEST(FeElements, ShellStressOfStretchAndBending) {
  const FeMaterial steel{"steel", 2.1e11, 0.3, 7850.0};
  const double t = 0.004, exx = 3e-4, eyy = -2e-4, exy = 1e-4, kxx = 0.4, kyy = -0.15,
               kxy = 0.2;  // w = kxx x^2 / 2 + kyy y^2 / 2 + kxy x y
  const Mat3 turn = (Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized())).toRotationMatrix();
  for (FeShape shape : {FeShape::quadrangle4, FeShape::triangle3}) {
    Mat3X flat(3, fe_node_count(shape));
    if (flat.cols() == 4) flat << 0.0, 0.11, 0.13, 0.01, 0.0, 0.01, 0.09, 0.12, 0, 0, 0, 0;
    else flat << 0.0, 0.11, 0.02, 0.0, 0.015, 0.1, 0, 0, 0;
    const Mat3X X = (turn * flat).colwise() + Vec3(1, 2, 3);
    MatX u(6, flat.cols());
    for (int i = 0; i < flat.cols(); ++i) {
      const double x = flat(0, i), y = flat(1, i);
      u.col(i) << turn * Vec3(exx * x + exy * y, exy * x + eyy * y, kxx * x * x / 2 + kyy * y * y / 2 + kxy * x * y),
          turn * Vec3(kxy * x + kyy * y, -kxx * x - kxy * y, 0);
    }
    const MatX stress = shell_nodal_stress(shape, X, shell_law(steel, t), u, 1);
    const double c = 2.1e11 / (1 - 0.09), ex = exx - t / 2 * kxx, ey = eyy - t / 2 * kyy, gamma = 2 * exy - t * kxy;
    Mat3 S = Mat3::Zero();
    S(0, 0) = c * (ex + 0.3 * ey);
    S(1, 1) = c * (ey + 0.3 * ex);
    S(0, 1) = S(1, 0) = c * 0.35 * gamma;
    S = turn * S * turn.transpose();
    Vec6 wanted;
    wanted << S(0, 0), S(1, 1), S(2, 2), S(0, 1), S(1, 2), S(0, 2);
    for (int i = 0; i < flat.cols(); ++i) EXPECT_LT((stress.col(i) - wanted).norm(), 1e-9 * wanted.norm()) << fe_name(shape) << i;
  }
}

// Pure bending of a brick, u as Saint-Venant has it: E kappa z along the axis and nothing else, at every corner. Without the inner
// displacements of its incompatible modes the brick showed shear and twice the stress across.
TEST(FeElements, StressOfIncompatibleModesInPureBending) {
  const FeMaterial steel{"steel", 2.1e11, 0.3, 7850.0};
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  const Mat3X local = Vec3(0.03, 0.02, 0.01).asDiagonal() * parent_nodes(FeShape::hexahedron8);
  const double kappa = 0.2, nu = 0.3;
  Mat3X u(3, 8);
  for (int i = 0; i < 8; ++i) {
    const double x = local(0, i), y = local(1, i), z = local(2, i);
    u.col(i) = turn * Vec3(kappa * x * z, -nu * kappa * y * z, -0.5 * kappa * (x * x + nu * (z * z - y * y)));
  }
  const MatX stress = solid_nodal_stress(FeShape::hexahedron8, FeFormulation::incompatible, turn * local, steel, u, 1);
  const double largest = 2.1e11 * kappa * 0.01;
  for (int i = 0; i < 8; ++i) {
    const Vec6 s = stress.col(i);
    Mat3 S;
    S << s(0), s(3), s(5), s(3), s(1), s(4), s(5), s(4), s(2);
    S = (turn.transpose() * S * turn).eval();
    Mat3 wanted = Mat3::Zero();
    wanted(0, 0) = 2.1e11 * kappa * local(2, i);
    EXPECT_LT((S - wanted).cwiseAbs().maxCoeff(), 1e-9 * largest) << i;
  }
}

// A bar of bricks along x, nx by 1 by 1 or finer, of hexahedra or what they are cut into.
FeModel bar(FeShape shape, int nx, int ny, int nz, double L, double b, double h, const FeMaterial& material) {
  FeModel m;
  m.file = "bar";
  m.materials = {material};
  std::map<std::tuple<long, long, long>, int> index;
  const auto node = [&](const Vec3& x) {
    const auto key = std::tuple(std::lround(x.x() / L * 1e6), std::lround(x.y() / b * 1e6), std::lround(x.z() / h * 1e6));
    const auto [at, fresh] = index.try_emplace(key, static_cast<int>(m.nodes.size()));
    if (fresh) {
      m.nodes.push_back(x);
      m.node_ids.push_back(static_cast<int>(m.nodes.size()));
    }
    return at->second;
  };
  const bool quadratic = fe_node_count(shape) >= 10;
  const auto corner_shape = shape == FeShape::tetrahedron10  ? FeShape::tetrahedron4
                            : shape == FeShape::hexahedron20 ? FeShape::hexahedron8
                            : shape == FeShape::wedge15      ? FeShape::wedge6
                                                             : shape;
  const auto add = [&](std::vector<Vec3> corners) {
    FeElement e;
    e.id = static_cast<int>(m.elements.size()) + 1;
    e.shape = shape;
    e.formulation = shape == FeShape::hexahedron8 ? FeFormulation::incompatible : FeFormulation::full;
    e.material = 0;
    e.first = static_cast<int>(m.connectivity.size());
    e.count = fe_node_count(shape);
    const Mat3X parent = parent_nodes(shape);
    VecX N;
    MatX dN;
    for (int i = 0; i < e.count; ++i) {
      shape_functions(corner_shape, parent.col(i), N, dN);
      Vec3 x = Vec3::Zero();
      for (size_t k = 0; k < corners.size(); ++k) x += N(static_cast<int>(k)) * corners[k];
      m.connectivity.push_back(node(x));
    }
    (void)quadratic;
    m.elements.push_back(e);
  };
  for (int i = 0; i < nx; ++i)
    for (int j = 0; j < ny; ++j)
      for (int k = 0; k < nz; ++k) {
        const auto at = [&](int a, int c, int d) {
          return Vec3(L * (i + a) / nx, b * ((j + c) / static_cast<double>(ny) - 0.5), h * ((k + d) / static_cast<double>(nz) - 0.5));
        };
        const Vec3 p[8] = {at(0, 0, 0), at(1, 0, 0), at(1, 1, 0), at(0, 1, 0), at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)};
        if (corner_shape == FeShape::hexahedron8) add({p, p + 8});
        else if (corner_shape == FeShape::wedge6) {
          add({p[0], p[1], p[2], p[4], p[5], p[6]});
          add({p[0], p[2], p[3], p[4], p[6], p[7]});
        } else
          for (const auto& t : {std::array{0, 1, 2, 6}, std::array{0, 2, 3, 6}, std::array{0, 3, 7, 6}, std::array{0, 7, 4, 6},
                                std::array{0, 4, 5, 6}, std::array{0, 5, 1, 6}})
            add({p[t[0]], p[t[1]], p[t[2]], p[t[3]]});
      }
  return m;
}

FeMaterial soft() { return {"soft", 1e9, 0.0, 1000.0}; }

// Bending of a slender free bar against Timoshenko's beam, for every quadratic element and the brick with incompatible modes.
TEST(Reduce, FreeBarFrequencies) {
  const double L = 1.0, h = 0.02;
  const double euler = std::pow(4.730040745, 2) / (2 * std::numbers::pi) * std::sqrt(1e9 * h * h / 12 / 1000.0) / (L * L);
  for (FeShape shape : {FeShape::hexahedron20, FeShape::hexahedron8, FeShape::wedge15, FeShape::tetrahedron10}) {
    ReduceOptions o;
    o.modes = 4;
    o.node_count = 20;
    const Reduction r = reduce(bar(shape, 40, 1, 1, L, h, h, soft()), o);
    EXPECT_EQ(r.report.rigid_motions, 6);
    EXPECT_NEAR(r.report.frequencies(0), euler, 5e-3 * euler) << fe_name(shape);
    EXPECT_NEAR(r.body.mass, 1000.0 * L * h * h, 1e-12);
    EXPECT_NEAR(r.body.md0.x(), 0.5 * r.body.mass * L, 1e-12);
    EXPECT_NEAR(r.body.J0(1), r.body.mass * (L * L / 3 + h * h / 12), 1e-9);
  }
}

// The estimated error of the mesh against the true one, from Bernoulli's beam: within a factor of two where it is more than a per cent, and
// told; quiet where it is less than half a per cent. First and second bending of a free slender bar, axial and lateral motion of rods.
TEST(Reduce, ErrorOfTheMeshIsTold) {
  const double L = 1.0, h = 0.05;
  const double unit = std::sqrt(1e9 * h * h / 12 / 1000.0) / (L * L) / (2 * std::numbers::pi);
  const std::pair<FeShape, std::vector<int>> cases[] = {
      {FeShape::hexahedron8, {4, 6, 40}}, {FeShape::tetrahedron4, {20, 40}}, {FeShape::hexahedron20, {4, 20}}};
  int coarse = 0, fine = 0;
  for (const auto& [shape, counts] : cases)
    for (int nx : counts) {
      ReduceOptions o;
      o.modes = 4;  // bending twice in both directions
      o.node_count = 2;
      o.stiffening = false;
      const Reduction r = reduce(bar(shape, nx, 1, 1, L, h, h, soft()), o);
      ASSERT_EQ(r.report.mesh_errors.size(), 4);
      const bool told = std::any_of(r.report.warnings.begin(), r.report.warnings.end(),
                                    [](const std::string& w) { return w.find("the mesh is coarse") != std::string::npos; });
      double largest = 0.0;
      for (int k = 0; k < 2; ++k) {
        // Timoshenko's beam is lower by about this at this slenderness, which is no error of the mesh.
        const double shear = 1.0 - 0.5 * std::pow(4.730040745, 2) * h * h / 12 * (1.0 + 2.0 * 6 / 5) / (L * L);
        const double truth = std::pow(4.730040745, 2) * unit * shear, wrong = r.report.frequencies(k) / truth - 1.0;
        largest = std::max(largest, wrong);
        if (wrong < 0.01) continue;
        ++coarse;
        EXPECT_GT(r.report.mesh_errors(k), 0.5 * wrong) << fe_name(shape) << ' ' << nx << ' ' << wrong;
        EXPECT_LT(r.report.mesh_errors(k), 3.0 * wrong) << fe_name(shape) << ' ' << nx << ' ' << wrong;
        EXPECT_TRUE(told);
      }
      if (largest > 0.005) continue;
      ++fine;
      EXPECT_LT(r.report.mesh_errors.head(2).maxCoeff(), 0.01) << fe_name(shape) << ' ' << nx;
    }
  EXPECT_GE(coarse, 4);
  EXPECT_GE(fine, 2);
}

// The same of meshes too large to be divided and factorised: against the frequencies of a fine mesh of quadratic elements, which the factor
// of that gives. Bricks and tetrahedra become quadratic, bricks with incompatible modes are divided.
TEST(Reduce, ErrorOfALargerMeshIsTold) {
  const double L = 1.0, b = 0.1, h = 0.05;
  constexpr int alone = 3;  // bending; those above lie close together, and coarse elements change their order
  ReduceOptions o;
  o.modes = 6;
  o.node_count = 2;
  o.stiffening = false;
  const Reduction fine = reduce(bar(FeShape::hexahedron20, 24, 3, 3, L, b, h, soft()), o);
  const std::pair<FeShape, FeFormulation> cases[] = {{FeShape::hexahedron8, FeFormulation::full},
                                                     {FeShape::hexahedron8, FeFormulation::incompatible},
                                                     {FeShape::tetrahedron4, FeFormulation::full}};
  int coarse = 0;
  for (const auto& [shape, formulation] : cases) {
    FeModel m = bar(shape, 24, 10, 8, L, b, h, soft());
    for (FeElement& e : m.elements) e.formulation = formulation;
    bool iterated = false;
    const Reduction r = reduce(m, o, [&](const std::string& text) { iterated = iterated || text == "a finer mesh, by iteration"; });
    EXPECT_TRUE(iterated);
    ASSERT_EQ(r.report.mesh_errors.size(), 6);
    for (int k = 0; k < alone; ++k) {
      const double wrong = r.report.frequencies(k) / fine.report.frequencies(k) - 1.0;
      coarse += wrong > 0.01;
      EXPECT_NEAR(r.report.mesh_errors(k), wrong, 0.3 * std::abs(wrong) + 0.001) << fe_name(shape) << ' ' << static_cast<int>(formulation);
    }
  }
  EXPECT_GE(coarse, 4);
}

// Clamped plate strip of shells: first bending frequency and tip deflection of the beam (Poisson's ratio zero).
TEST(Reduce, ShellStrip) {
  const double L = 1.0, b = 0.1, t = 0.01;
  for (FeShape shape : {FeShape::quadrangle4, FeShape::triangle3}) {
    FeModel m;
    m.file = "strip";
    m.materials = {soft()};
    const int nx = 24, ny = 3;
    for (int i = 0; i <= nx; ++i)
      for (int j = 0; j <= ny; ++j) {
        m.nodes.emplace_back(L * i / nx, 0.3 * b * j / ny, std::sqrt(1 - 0.09) * b * j / ny);  // tilted about x
        m.node_ids.push_back(static_cast<int>(m.nodes.size()));
      }
    const auto add = [&](std::vector<int> nodes) {
      FeElement e;
      e.id = static_cast<int>(m.elements.size()) + 1;
      e.shape = shape;
      e.material = 0;
      e.thickness = t;
      e.first = static_cast<int>(m.connectivity.size());
      e.count = static_cast<int>(nodes.size());
      m.connectivity.insert(m.connectivity.end(), nodes.begin(), nodes.end());
      m.elements.push_back(e);
    };
    for (int i = 0; i < nx; ++i)
      for (int j = 0; j < ny; ++j) {
        const int a = i * (ny + 1) + j, c = a + ny + 1;
        if (shape == FeShape::quadrangle4) add({a, c, c + 1, a + 1});
        else add({a, c, c + 1}), add({a, c + 1, a + 1});
      }
    ReduceOptions o;
    o.modes = 3;
    o.stress = true;
    o.nodes = {6 * (ny + 1) + 1, 12 * (ny + 1) + 1, nx * (ny + 1) + 1};  // at a quarter, the half and the tip
    for (int j = 0; j <= ny; ++j)
      for (int d = 0; d < 6; ++d) o.held.push_back({j, d});
    const Reduction r = reduce(m, o);
    const double euler = std::pow(1.875104069, 2) / (2 * std::numbers::pi) * std::sqrt(1e9 * t * t / 12 / 1000.0) / (L * L);
    EXPECT_EQ(r.report.rigid_motions, 0);
    EXPECT_NEAR(r.report.frequencies(0), euler, 1e-2 * euler) << fe_name(shape);
    // Stress of the first mode on the face of the normal: -E t / 2 times the curvature of the clamped beam's form, scaled by the tip.
    const Vec3 normal(0, -std::sqrt(1 - 0.09), 0.3);
    const double k = 1.875104069 / L, share = 0.734095514;
    const auto form = [&](double x) { return std::cosh(k * x) - std::cos(k * x) - share * (std::sinh(k * x) - std::sin(k * x)); };
    const auto curvature = [&](double x) {
      return k * k * (std::cosh(k * x) + std::cos(k * x) - share * (std::sinh(k * x) + std::sin(k * x)));
    };
    const double scale = normal.dot(r.body.nodes[2].phi.col(0)) / form(L);
    for (int i = 0; i < 2; ++i) {
      const double x = r.body.nodes[i].origin.x(), wanted = -1e9 * t / 2 * scale * curvature(x);
      const Vec6 stress = r.body.nodes[i].sigma.col(0);
      EXPECT_NEAR(stress(0), wanted, 2e-2 * std::abs(wanted)) << fe_name(shape) << " at " << x;
      EXPECT_LT(stress.tail(5).cwiseAbs().maxCoeff(), 3e-2 * std::abs(wanted)) << fe_name(shape);
    }
  }
}

// Stress modes of a slender free bar: E h / 2 times the curvature of the first bending form, at the middle of its upper face.
TEST(Reduce, StressModesOfBending) {
  const double L = 1.0, b = 0.02, h = 0.04;  // stiffer in z: the first mode bends in y
  for (FeShape shape : {FeShape::hexahedron20, FeShape::tetrahedron10}) {
    const FeModel m = bar(shape, 30, 1, 2, L, b, h, soft());
    ReduceOptions o;
    o.modes = 1;
    o.stress = true;
    for (size_t i = 0; i < m.nodes.size(); ++i)
      if (std::abs(m.nodes[i].z()) < 1e-9 && m.nodes[i].y() > 0.49 * b) o.nodes.push_back(static_cast<int>(i));
    const Reduction r = reduce(m, o);
    const double k = 4.730040745 / L, share = 0.982502215;
    const auto form = [&](double x) { return std::cosh(k * x) + std::cos(k * x) - share * (std::sinh(k * x) + std::sin(k * x)); };
    const auto curvature = [&](double x) {
      return k * k * (std::cosh(k * x) - std::cos(k * x) - share * (std::sinh(k * x) - std::sin(k * x)));
    };
    const auto end = std::min_element(r.body.nodes.begin(), r.body.nodes.end(),
                                      [](const FlexibleNode& p, const FlexibleNode& q) { return p.origin.x() < q.origin.x(); });
    const double scale = end->phi(1, 0) / form(0), largest = std::abs(1e9 * b / 2 * scale * curvature(L / 2));
    int checked = 0;
    for (const FlexibleNode& node : r.body.nodes) {
      const double x = node.origin.x();
      if (x < 0.2 * L || x > 0.8 * L) continue;
      EXPECT_NEAR(node.sigma(0, 0), -1e9 * b / 2 * scale * curvature(x), 2e-2 * largest) << fe_name(shape) << " at " << x;
      EXPECT_LT(node.sigma.col(0).tail(5).cwiseAbs().maxCoeff(), 3e-2 * largest) << fe_name(shape) << " at " << x;
      ++checked;
    }
    EXPECT_GT(checked, 15);
  }
}

TEST(Reduce, ConRodAsCalculixGivesIt) {
  ReduceOptions o;
  o.modes = 3;
  const Reduction r = reduce(read_inp(conrod()), o);
  EXPECT_EQ(r.report.rigid_motions, 6);
  EXPECT_EQ(r.report.degrees_of_freedom, 15252);
  EXPECT_EQ(r.body.nodes.size(), 97u);
  const double calculix[3] = {1336.59, 1734.37, 2163.67};  // last line of conrod.inp; data/kernel_map/make_bodies.py runs CalculiX
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(r.report.frequencies(k), calculix[k], 1e-4 * calculix[k]);
  // What is written keeps the identities and comes back.
  const SidFile sid = from_flexible_body(r.body, "con rod");
  for (const SidCheck& check : check_sid(sid)) EXPECT_LT(check.residual, 1e-10) << check.identity;
  std::vector<std::string> notes;
  const FlexibleBody again = to_flexible_body(read_sid_text(write_sid_text(sid), "con rod").file, "con rod", &notes);
  EXPECT_TRUE(notes.empty()) << (notes.empty() ? "" : notes[0]);
  EXPECT_EQ(again.Ke, r.body.Ke);
  EXPECT_EQ(again.nodes[50].phi, r.body.nodes[50].phi);
}

// Interfaces as averaging spiders on both eyes: static deflection of the reduced body against the full model (Heckmann, Otter, Dietz, Diaz
// Lopez 2006: within 1 %).
TEST(Reduce, StaticDeflectionUnderInterfaceLoads) {
  FeModel model = read_inp(conrod());
  ReduceOptions o;
  for (const auto& [x, radius, name] : {std::tuple(0.0, 0.029, "big"), std::tuple(0.15, 0.013, "small")}) {
    FeSpider s;
    s.name = name;
    s.rigid = false;
    s.node = static_cast<int>(model.nodes.size());
    for (size_t i = 0; i < model.nodes.size(); ++i)
      if (std::abs(std::hypot(model.nodes[i].x() - x, model.nodes[i].y()) - radius) < 1e-4) s.slaves.push_back(static_cast<int>(i));
    ASSERT_GT(s.slaves.size(), 20u);
    model.nodes.emplace_back(x, 0, 0);
    model.node_ids.push_back(100000 + s.node);
    o.interfaces.push_back({-1, static_cast<int>(model.spiders.size()), name});
    model.spiders.push_back(s);
  }
  for (ReduceMethod method : {ReduceMethod::guyan, ReduceMethod::craig_bampton, ReduceMethod::response}) {
    o.method = method;
    o.modes = 8;
    o.highest = method == ReduceMethod::response ? 3000.0 : 0.0;
    o.cut_off = 0.0;  // five times 3 kHz would drop the stiff local modes that static loads need
    const Reduction r = reduce(model, o);
    EXPECT_LT(r.report.compliance_error, 1e-2) << static_cast<int>(method);
    EXPECT_NEAR(r.report.frequencies(0), 1336.6, method == ReduceMethod::guyan ? 30.0 : 1.5);
    EXPECT_EQ(r.body.nodes[0].name, "big");
    EXPECT_TRUE(r.body.Me.isIdentity(1e-12));
  }
}

// The second-order displacements are the geometric stiffness of any load: -f . u2_jk = int sigma(u_f) : grad u_j^T grad u_k dV, here of a
// unit force at the tip of a clamped bar, where the column buckles: K + P Kg singular at Euler's load.
TEST(Reduce, StiffeningGivesEulersBucklingLoad) {
  const double L = 1.0, h = 0.02;
  const FeModel m = bar(FeShape::hexahedron20, 20, 1, 1, L, h, h, soft());
  ReduceOptions o;
  o.modes = 6;
  std::vector<int> tip;
  for (size_t i = 0; i < m.nodes.size(); ++i) {
    if (m.nodes[i].x() == 0.0)
      for (int d = 0; d < 3; ++d) o.held.push_back({static_cast<int>(i), d});
    if (m.nodes[i].x() == L) tip.push_back(static_cast<int>(i));
  }
  o.nodes = tip;
  const Reduction r = reduce(m, o);
  MatX phi2 = MatX::Zero(r.body.n, r.body.n);
  for (const FlexibleNode& node : r.body.nodes) phi2 += node.phi2[0] / static_cast<double>(r.body.nodes.size());
  // Compression -P e_x at the end: force -P phi2 q on the right, so Ke + P phi2 becomes singular.
  const VecX inverse = GeneralizedEigen(-phi2, r.body.Ke).eigenvalues();
  const double load = 1.0 / inverse.maxCoeff();
  const double euler = std::pow(std::numbers::pi / (2 * L), 2) * 1e9 * std::pow(h, 4) / 12;
  EXPECT_NEAR(load, euler, 1e-2 * euler);
}

// Inertia and coupling terms against the displaced mass points they stand for.
TEST(Reduce, FirstOrderTermsMatchDisplacedMesh) {
  FeModel m = bar(FeShape::hexahedron20, 6, 2, 1, 0.6, 0.2, 0.1, soft());
  for (Vec3& x : m.nodes) x += Vec3(0.1, -0.2, 0.3);
  const FeSystem s = assemble(m);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  MatX U(s.size, 2);
  for (double& v : U.reshaped()) v = u(random);
  const LinearMass linear = linear_mass(m, s, U);
  const QuadraticMass quadratic = quadratic_mass(m, s, U);
  const auto moved = [&](double a, double b) {
    FeModel copy = m;
    for (size_t i = 0; i < m.nodes.size(); ++i)
      for (int d = 0; d < 3; ++d) copy.nodes[i](d) += a * U(s.dof[i][d], 0) + b * U(s.dof[i][d], 1);
    // The mass stays with the material: the undeformed mass matrix with the deformed positions.
    return rigid_mass(copy, s);
  };
  EXPECT_LT((moved(1, 0).md - moved(0, 0).md - linear.md.col(0)).norm(), 1e-10);
  EXPECT_LT((0.5 * (moved(1, 0).J - moved(-1, 0).J) - linear.J.col(0)).norm(), 1e-9);
  const Vec6 mixed = 0.25 * (moved(1, 1).J - moved(1, -1).J - moved(-1, 1).J + moved(-1, -1).J);
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(quadratic.J2[k](0, 1), mixed(k), 1e-9);
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(quadratic.Cr1[a](0, 1), -quadratic.Cr1[a](1, 0), 1e-10);
}

// What turns with nodes, against the particles it stands for, which turn exactly: inertia, first moment and angular momentum in second
// order (central differences of 1e-3: 1e-6 of the terms).
TEST(Reduce, MassesThatTurnWithNodes) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  const auto vector = [&] { return Vec3(any(random), any(random), any(random)); };
  const auto cross = [](const Vec3& a) {
    Mat3 out;
    out << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
    return out;
  };
  FeModel m;
  std::vector<std::vector<std::pair<double, Vec3>>> particles(2);
  for (int i = 0; i < 2; ++i) {
    m.nodes.push_back(vector());
    m.node_ids.push_back(i + 1);
    FeLump lump;
    lump.turns = true;
    lump.K = lump.M = MatX::Zero(6, 6);
    for (int k = 0; k < 4; ++k) {
      const auto& [weight, at] = particles[i].emplace_back(2.0 + any(random), vector());
      MatX B(3, 6);
      B << Mat3::Identity(), -cross(at);
      lump.M += weight * B.transpose() * B;
    }
    m.lumps.push_back(lump);
    m.connectivity.push_back(i);
    FeElement e;
    e.shape = FeShape::lumped;
    e.section = e.first = i;
    e.count = 1;
    m.elements.push_back(e);
  }
  const FeSystem s = assemble(m);
  MatX U(s.size, 2);
  for (double& v : U.reshaped()) v = any(random);
  const auto place = [&](int i, const Vec3& at, const Eigen::Vector2d& q) {
    const Vec3 theta = U.middleRows<3>(s.dof[i][3]) * q;
    return Vec3(m.nodes[i] + U.middleRows<3>(s.dof[i][0]) * q + Eigen::AngleAxisd(theta.norm(), theta.normalized()) * at);
  };
  constexpr double h = 1e-3;
  const auto sum = [&](const Eigen::Vector2d& given) {
    const Eigen::Vector2d q = given + Eigen::Vector2d::Constant(1e-9);  // off zero, where the rotation has no axis
    VecX out = VecX::Zero(15);                                          // md, J, angular momentum of both rates
    for (int i = 0; i < 2; ++i)
      for (const auto& [weight, at] : particles[i]) {
        const Vec3 r = place(i, at, q);
        const Mat3 J = weight * (r.squaredNorm() * Mat3::Identity() - r * r.transpose());
        out.head<3>() += weight * r;
        out.segment<6>(3) += (Vec6() << J(0, 0), J(1, 1), J(2, 2), J(0, 1), J(0, 2), J(1, 2)).finished();
        for (int j = 0; j < 2; ++j) {
          const Eigen::Vector2d d = h * Eigen::Vector2d::Unit(j);
          out.segment<3>(9 + 3 * Eigen::Index{j}) += weight * r.cross(Vec3((place(i, at, q + d) - place(i, at, q - d)) / (2 * h)));
        }
      }
    return out;
  };
  const LinearMass linear = linear_mass(m, s, U);
  const QuadraticMass quadratic = quadratic_mass(m, s, U);
  for (int j = 0; j < 2; ++j) {
    const Eigen::Vector2d a = h * Eigen::Vector2d::Unit(j);
    const VecX once = (sum(a) - sum(-a)) / (2 * h);
    EXPECT_LT((once.segment<6>(3) - linear.J.col(j)).norm(), 1e-5 * linear.J.norm());
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector2d b = h * Eigen::Vector2d::Unit(k);
      const VecX twice = (sum(a + b) - sum(a - b) - sum(b - a) + sum(-a - b)) / (4 * h * h);
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(quadratic.md2[c](j, k), twice(c), 1e-4);
        const VecX other = (sum(b) - sum(-b)) / (2 * h);
        EXPECT_NEAR(quadratic.Cr1[c](j, k), other(9 + 3 * Eigen::Index{j} + c), 1e-4);
      }
      for (int c = 0; c < 6; ++c) EXPECT_NEAR(quadratic.J2[c](j, k), twice(3 + c), 1e-3);
    }
  }
}

// A gmsh mesh of one quadratic element of each kind, both formats, has the same volume as Abaqus' order gives.
TEST(Reduce, GmshOrderOfNodes) {
  const Scratch scratch;
  static constexpr int hex[12][2] = {{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 5}, {2, 3}, {2, 6}, {3, 7}, {4, 5}, {4, 7}, {5, 6}, {6, 7}};
  static constexpr double corner[8][3] = {{0, 0, 0}, {2, 0, 0}, {2, 3, 0}, {0, 3, 0}, {0, 0, 1}, {2, 0, 1}, {2, 3, 1}, {0, 3, 1}};
  std::string nodes, list;
  for (int i = 0; i < 8; ++i) nodes += fmt::format("{} {} {} {}\n", i + 1, corner[i][0], corner[i][1], corner[i][2]);
  for (int i = 0; i < 12; ++i) {
    nodes += fmt::format("{}", i + 9);
    for (int d = 0; d < 3; ++d) nodes += fmt::format(" {}", 0.5 * (corner[hex[i][0]][d] + corner[hex[i][1]][d]));
    nodes += "\n";
  }
  for (int i = 1; i <= 20; ++i) list += fmt::format(" {}", i);
  const fs::path file =
      scratch.put("order.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 7 \"Block\"\n$EndPhysicalNames\n$Nodes\n20\n" +
                                   nodes + "$EndNodes\n$Elements\n1\n1 17 2 7 1" + list + "\n$EndElements\n");
  FeModel m = read_msh(file);
  ASSERT_EQ(m.elements.size(), 1u);
  EXPECT_EQ(m.element_sets.at("BLOCK").size(), 1u);
  set_material(m, soft());
  Mat3X X(3, 20);
  for (int i = 0; i < 20; ++i) X.col(i) = m.nodes[m.connectivity[i]];
  double volume = 0.0;
  for (const FePoint& p : solid_points(FeShape::hexahedron20, FeFormulation::full, FeRule::mass, X, 1)) volume += p.volume;
  EXPECT_NEAR(volume, 6.0, 1e-12);
  // Straight edges: the quadratic map is linear, every Jacobian the same.
  const auto points = solid_points(FeShape::hexahedron20, FeFormulation::reduced, FeRule::stiffness, X, 1);
  for (const FePoint& p : points) EXPECT_NEAR(p.volume, 6.0 / 8.0, 1e-12);
}

std::string refusal(const std::string& text) {
  const Scratch scratch;
  std::string message = "accepted";
  try {
    const FeModel m = read_inp(scratch.put("refused.inp", text));
    ReduceOptions o;
    o.modes = 1;
    reduce(m, o);
  } catch (const InputError& e) {
    message = e.what();
  }
  return message;
}

TEST(Reduce, RefusalsSayWhy) {
  const std::string tet = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n";
  EXPECT_NE(refusal("").find("is no deck"), std::string::npos);
  EXPECT_NE(refusal(tet).find("no elements"), std::string::npos);
  EXPECT_NE(refusal(tet + "*ELEMENT,TYPE=C3D99\n1,1,2,3,4\n").find(":6: element type 'C3D99'"), std::string::npos);
  EXPECT_NE(refusal(tet + "*ELEMENT,TYPE=C3D4\n1,1,2,3,9\n").find(":7: element 1: node 9"), std::string::npos);
  EXPECT_NE(refusal(tet + "*ELEMENT,TYPE=C3D4\n1,1,2,3,4\n").find("no material"), std::string::npos);
  const std::string steel = "*MATERIAL,NAME=S\n*ELASTIC\n2e11,0.3\n*DENSITY\n7800\n*SOLID SECTION,ELSET=E,MATERIAL=S\n";
  EXPECT_NE(refusal(tet + "*ELEMENT,TYPE=C3D4,ELSET=E\n1,1,3,2,4\n" + steel).find("inside out"), std::string::npos);
  EXPECT_NE(refusal(tet + "*NODE\n5,5,0,0\n6,6,0,0\n7,5,1,0\n8,5,0,1\n*ELEMENT,TYPE=C3D4,ELSET=E\n1,1,2,3,4\n2,5,6,7,8\n" + steel)
                .find("2 unconnected parts"),
            std::string::npos);
  EXPECT_NE(refusal(tet + "*EQUATION\n2\n1,1,1.0,7,1,-1.0\n").find(":8: node 7 is not there"), std::string::npos);
  EXPECT_NE(refusal(tet + "*CONTACT PAIR,INTERACTION=I\nA,B\n").find("*TIE"), std::string::npos);
  EXPECT_EQ(refusal(tet + "*ELEMENT,TYPE=C3D4,ELSET=E\n1,1,2,3,4\n" + steel), "accepted");
}

}  // namespace
}  // namespace flexframe::sim::test_reduce
