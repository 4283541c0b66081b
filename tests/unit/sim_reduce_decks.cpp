// What decks bring beside solids: arms of rigid spiders in second order, equations, laminates, beams, units. Truths in closed form.
#include "scratch.h"
#include "sim/base/eigen_solvers.h"
#include "sim/reduce/fe_sections.h"
#include "sim/reduce/reduce.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace flexframe::sim::test_reduce_decks {
namespace {

FeModel deck(const std::string& text, const char* name = "deck.inp") {
  const Scratch scratch;
  const auto path = scratch.put(name, text);
  return path.extension() == ".inp" ? read_inp(path) : read_nastran(path);
}

const std::string steel = "*MATERIAL,NAME=S\n*ELASTIC\n2.1e11,.3\n*DENSITY\n7850\n";

// A bar with a dumbbell at its tip: as it twists by phi the masses keep their distance r from the axis, y = r cos phi, and the inertia
// about z loses 2 m r^2 phi^2. Both ways to the second order.
TEST(ReduceDecks, ArmsOfRigidSpidersKeepTheirLength) {
  const FeModel m = deck(
      "*NODE\n1,0,0,0\n2,1,0,0\n3,1,.3,0\n4,1,-.3,0\n*ELEMENT,TYPE=B31,ELSET=B\n1,1,2\n*ELEMENT,TYPE=MASS,ELSET=M\n2,3\n3,4\n*MASS,ELSET="
      "M\n"
      "5.\n*MATERIAL,NAME=S\n*ELASTIC\n2.1e11,.3\n*DENSITY\n1e-3\n*BEAM SECTION,ELSET=B,MATERIAL=S,SECTION=CIRC\n.01\n*NSET,NSET=T\n3,4\n"
      "*RIGID BODY,NSET=T,REF NODE=2\n*BOUNDARY\n1,1,6\n");
  for (const int limit : {120, 0}) {
    ReduceOptions o;
    o.method = ReduceMethod::eigenmodes;
    o.held = m.constraints;
    o.modes = 5;
    o.interfaces = {{-1, 0, "tip"}};
    o.stiffening_limit = limit;
    const Reduction r = reduce(m, o);
    int twist = -1;
    for (int k = 0; k < r.body.n; ++k)
      if (r.body.nodes[0].psi.col(k).cwiseAbs().maxCoeff() == std::abs(r.body.nodes[0].psi(0, k)) &&
          std::abs(r.body.nodes[0].psi(0, k)) > 0.1)
        twist = k;
    ASSERT_GE(twist, 0);
    const double angle = r.body.nodes[0].psi(0, twist), inertia = 2 * 5.0 * 0.3 * 0.3;
    EXPECT_NEAR(angle * angle * inertia, 1.0, 1e-6);
    // The bar that spins about z at Omega is pulled by the masses' 10 kg at 1 m: its fibres, longer as it twists, resist by N r^2 / 2.
    EXPECT_NEAR(r.body.J2[2](twist, twist), -2.0 * (inertia + 10.0 * 1e-4 / 2) * angle * angle, 1e-5);
    EXPECT_NEAR(r.report.frequencies(twist), std::sqrt(2.1e11 / 2.6 * 0.5 * std::numbers::pi * 1e-8 / inertia) / (2 * std::numbers::pi),
                1e-3);
  }
}

// A narrow cantilever of beams that is pushed across its stiff way tips over sideways at 4.013 sqrt(EI GJ) / L^2 (Prandtl), and pulling it
// makes it stiffer against twist by N Ip / A, its fibres being longer: of the second-order displacement of its end, both ways to it.
TEST(ReduceDecks, BeamsTipOverAndTwistStifferWhenPulled) {
  constexpr double length = 1.0, height = 0.05, thick = 0.002, E = 2.1e11;
  std::string text = "*NODE\n";
  for (int i = 0; i <= 20; ++i) text += fmt::format("{},{},0,0\n", i + 1, 0.05 * length * i);
  text += "*ELEMENT,TYPE=B31,ELSET=B\n";
  for (int i = 1; i <= 20; ++i) text += fmt::format("{},{},{}\n", i, i, i + 1);
  const FeModel m = deck(text + steel + fmt::format("*BEAM SECTION,ELSET=B,MATERIAL=S,SECTION=RECT\n{},{}\n0,1,0\n", height, thick));
  const double J = m.beam_sections[0].torsion, G = E / 2.6, weak = height * std::pow(thick, 3) / 12;
  for (const int limit : {500, 0}) {
    ReduceOptions o;
    o.modes = 14;
    for (int d = 0; d < 6; ++d) o.held.push_back({0, d});
    o.interfaces = {{20, -1, "tip"}};
    o.stiffening_limit = limit;
    const FlexibleBody body = reduce(m, o).body;
    const FlexibleNode& tip = body.nodes[0];
    const double load = 1.0 / GeneralizedEigen(tip.phi2[1], body.Ke).eigenvalues().maxCoeff(),
                 wanted = 4.013 * std::sqrt(E * weak * G * J) / (length * length);
    EXPECT_NEAR(load, wanted, 5e-3 * wanted) << limit;
    // All the body's coordinates in the twist that a moment at the end makes.
    const VecX q = body.Ke.ldlt().solve(VecX(tip.psi.row(0).transpose()));
    const double twist = tip.psi.row(0).dot(q), polar = (height * height + thick * thick) / 12;
    EXPECT_NEAR(twist, length / (G * J), 1e-6 * twist) << limit;
    EXPECT_NEAR(q.dot(tip.phi2[0] * q), -polar * twist * twist / length, 1e-3 * polar * twist * twist) << limit;
  }
}

// An averaging interface of the end of a strip of shells: nodes on a line see no turn about it, but have turns of their own. A moment there
// bends a cantilever by M L / EI, and the point beside the line moves with it. Poisson's ratio zero.
TEST(ReduceDecks, AveragedEdgesOfShellsTurn) {
  std::string text = "*NODE\n";
  for (int i = 0; i <= 10; ++i) text += fmt::format("{},{},0,0\n{},{},0.1,0\n", 2 * i + 1, 0.1 * i, 2 * i + 2, 0.1 * i);
  text += "200,1.2,0.05,0\n*ELEMENT,TYPE=S4,ELSET=E\n";
  for (int i = 0; i < 10; ++i) text += fmt::format("{},{},{},{},{}\n", i + 1, 2 * i + 1, 2 * i + 3, 2 * i + 4, 2 * i + 2);
  const FeModel m = deck(text +
                         "*MATERIAL,NAME=S\n*ELASTIC\n2e11,0.\n*DENSITY\n7850\n*SHELL SECTION,ELSET=E,MATERIAL=S\n.01\n"
                         "*SURFACE,NAME=TIP,TYPE=NODE\n21\n22\n*COUPLING,REF NODE=200,SURFACE=TIP,CONSTRAINT NAME=END\n*DISTRIBUTING\n");
  ReduceOptions o;
  for (int node : {0, 1})
    for (int d = 0; d < 6; ++d) o.held.push_back({node, d});
  o.interfaces = {{-1, 0, "end"}};
  o.modes = 2;
  const FlexibleBody body = reduce(m, o).body;
  const FlexibleNode& end = body.nodes[0];
  const VecX q = body.Ke.ldlt().solve(VecX(end.psi.row(1).transpose()));
  const double turn = 1.0 / (2e11 * 0.1 * 1e-6 / 12);
  EXPECT_NEAR(end.psi.row(1).dot(q), turn, 1e-6 * turn);
  EXPECT_NEAR(end.phi.row(2).dot(q), -turn * (0.5 + 0.2), 1e-6 * turn);
}

// Two springs in a row by an equation and by a common node are the same; a spring to the ground leaves no rigid motion along it.
TEST(ReduceDecks, EquationsAndSpringsToTheGround) {
  const std::string cube =
      "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n*ELEMENT,TYPE=C3D8,ELSET=E\n1,1,2,3,4,5,6,7,8\n" +
      steel + "*SOLID SECTION,ELSET=E,MATERIAL=S\n";
  // One mass on a soft spring: sqrt(k / m) of a rigid cube that can only go along x.
  const FeModel m = deck(cube +
                         "*NSET,NSET=ALL,GENERATE\n1,8\n*BOUNDARY\nALL,2,3\n*ELEMENT,TYPE=SPRING1,ELSET=K\n9,1\n10,4\n11,5\n12,8\n*SPRING,"
                         "ELSET=K\n1\n2.5e3\n");
  ReduceOptions o;
  o.modes = 1;
  o.held = m.constraints;
  o.stiffening = false;
  const Reduction r = reduce(m, o);
  EXPECT_EQ(r.report.rigid_motions, 0);
  EXPECT_NEAR(r.report.frequencies(0), std::sqrt(1e4 / 7850.0) / (2 * std::numbers::pi), 1e-5);
  // The same held by an equation to a node that the spring holds.
  const FeModel tied =
      deck(cube +
           "*NSET,NSET=ALL,GENERATE\n1,8\n*BOUNDARY\nALL,2,3\n*NODE\n20,-1,0,0\n*ELEMENT,TYPE=SPRING1,ELSET=K\n9,20\n*SPRING,"
           "ELSET=K\n1\n1e4\n*BOUNDARY\n20,2,3\n*EQUATION\n2\n20,1,1.,1,1,-1.\n");
  o.held = tied.constraints;
  EXPECT_NEAR(reduce(tied, o).report.frequencies(0), r.report.frequencies(0), 1e-4);
}

// A cantilever of beams: Euler-Bernoulli's 1.8751^2 sqrt(EI / rho A L^4) / 2 pi where it is slender; as CBAR it is the same.
TEST(ReduceDecks, Beams) {
  std::string text = "*NODE\n", bulk = "MAT1,1,2.1+11,,.3,7850.\nPBAR,1,1,1.-4,8.3333-10,8.3333-10,1.4-9\n";
  for (int i = 0; i <= 10; ++i) {
    text += std::to_string(i + 1) + "," + std::to_string(0.1 * i) + ",0,0\n";
    bulk += "GRID," + std::to_string(i + 1) + ",," + std::to_string(0.1 * i) + ",0.,0.\n";
    if (i > 0) bulk += "CBAR," + std::to_string(i) + ",1," + std::to_string(i) + "," + std::to_string(i + 1) + ",0.,1.,0.\n";
  }
  text += "*ELEMENT,TYPE=B31,ELSET=B\n";
  for (int i = 1; i <= 10; ++i) text += std::to_string(i) + "," + std::to_string(i) + "," + std::to_string(i + 1) + "\n";
  text += steel + "*BEAM SECTION,ELSET=B,MATERIAL=S,SECTION=RECT\n.01,.01\n*BOUNDARY\n1,1,6\n";
  bulk += "SPC1,1,123456,1\n";
  const double wanted = 1.875104 * 1.875104 * std::sqrt(2.1e11 * 8.3333e-10 / (7850.0 * 1e-4)) / (2 * std::numbers::pi);
  for (const FeModel& m : {deck(text), deck(bulk, "beam.bdf")}) {
    ReduceOptions o;
    o.modes = 2;
    o.held = m.constraints;
    const Reduction r = reduce(m, o);
    EXPECT_NEAR(r.report.frequencies(0), wanted, 1e-3 * wanted);
    EXPECT_NEAR(r.body.mass, 0.785, 1e-9);
  }
}

// Torsion of square tubes, in fourths of the width: Saint-Venant's equation by finite volumes (400 across).
TEST(ReduceDecks, TorsionOfBoxes) {
  for (const auto& [wall, wanted] : {std::pair(0.05, 0.04396), std::pair(0.1, 0.07711), std::pair(0.2, 0.11814), std::pair(0.3, 0.13566)}) {
    const double J = beam_shape("BOX", {1.0, 1.0, wall, wall, wall, wall})->torsion;
    EXPECT_NEAR(J, wanted, 0.005 * wanted) << wall;
  }
  // A wall that is a slit leaves an open section: thirds of length by thickness cubed, less at its ends.
  EXPECT_NEAR(beam_shape("BOX", {0.025, 0.05, 1e-7, 0.003, 0.003, 0.003})->torsion, 0.003 * 0.003 * 0.003 / 3 * 0.0955, 0.05 * 8.6e-10);
}

// What changes the structure and is not read is a warning; what a linear body has no use for a note.
TEST(ReduceDecks, WordsThatAreNotReadAreWarnedOf) {
  const std::string shell = "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n*ELEMENT,TYPE=S4,ELSET=E\n1,1,2,3,4\n" + steel +
                            "*PLASTIC\n1e6,0.\n*SHELL SECTION,ELSET=E,MATERIAL=S\n.01\n*NORMAL\n1,1,0,0,1\n*STIFFENER\n1\n";
  const FeModel m = deck(shell);
  const auto has = [](const std::vector<std::string>& texts, const char* part) {
    return std::any_of(texts.begin(), texts.end(), [&](const std::string& t) { return t.find(part) != std::string::npos; });
  };
  EXPECT_TRUE(has(m.warnings, "*NORMAL is not read"));
  EXPECT_TRUE(has(m.warnings, "*STIFFENER is not known"));
  EXPECT_TRUE(has(m.notes, "*PLASTIC is ignored"));
  EXPECT_FALSE(has(m.warnings, "*PLASTIC"));
  EXPECT_TRUE(has(m.notes, "CalculiX makes bricks"));
  // Solids have no rotations: a rigid bar between their nodes holds one motion.
  const FeModel tied = deck(
      "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n*ELEMENT,TYPE=C3D8,ELSET=E\n1,1,2,3,4,5,6,7,8\n" +
      steel + "*SOLID SECTION,ELSET=E,MATERIAL=S\n*MPC\nBEAM,1,7\n");
  EXPECT_TRUE(has(tied.warnings, "keep their distance and nothing else"));
}

// *MPC, PLANE and STRAIGHT: rigid motions and motions within the plane or along the line keep them, others do not; a node beside is told
// of. Frequencies of beamplane.inp and beamstraight.inp (CalculiX' tests) agree to 2.5e-4 with CalculiX where the same stands as *EQUATION.
TEST(ReduceDecks, NodesThatStayInAPlaneOrOnALine) {
  const std::string cube =
      "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1.5\n7,1,1,2.1\n8,0,1,1.6\n9,2,0,2\n10,2,1,2.6\n11,2,1,0\n12,2,0,0\n"
      "*ELEMENT,TYPE=C3D8,ELSET=E\n1,1,2,3,4,5,6,7,8\n2,2,12,11,3,6,9,10,7\n*SOLID SECTION,ELSET=E,MATERIAL=S\n*MATERIAL,NAME=S\n"
      "*ELASTIC\n2e11,.3\n*DENSITY\n7800\n";
  const auto held = [](const FeModel& m, auto motion) {
    double worst = 0.0;
    for (const FeEquation& e : m.equations) {
      double sum = 0.0;
      for (const auto& t : e.terms) sum += t.coefficient * motion(m.nodes[t.node])(t.dof);
      worst = std::max(worst, std::abs(sum));
    }
    return worst;
  };
  const auto rigid = [](const Vec3& x) { return Vec3(Vec3(0.1, -0.2, 0.3) + Vec3(0.4, 0.5, -0.6).cross(x)); };
  const FeModel plane = deck(cube + "*MPC\nPLANE,5,6,7\n0,8,9,10\n"), line = deck(cube + "*MPC\nSTRAIGHT,5,6,9\n");
  EXPECT_EQ(plane.equations.size(), 3u);
  EXPECT_EQ(line.equations.size(), 2u);
  const auto in_plane = [](const Vec3& x) { return Vec3(x.x() * x.y(), 0.0, 0.5 * x.x() * x.y()); };
  const auto on_line = [](const Vec3& x) { return Vec3(Vec3(1.0, 0.0, 0.5) * x.x() * x.x()); };
  const auto bent = [](const Vec3& x) { return Vec3(0.0, 0.0, x.x() * (x.x() + x.y())); };
  for (const auto& [m, within] : {std::pair<const FeModel&, std::function<Vec3(const Vec3&)>>(plane, in_plane), {line, on_line}}) {
    EXPECT_LT(held(m, rigid), 1e-12);
    EXPECT_LT(held(m, within), 1e-12);
    EXPECT_GT(held(m, bent), 0.1);
  }
  EXPECT_THROW(deck(cube + "*MPC\nPLANE,5,6,7,4\n"), InputError);
  EXPECT_THROW(deck(cube + "*MPC\nSTRAIGHT,5,6,8\n"), InputError);
}

// The factor in a folder gives the same frequencies, leaves nothing there, and is refused where there is none.
TEST(ReduceDecks, FactorsInAFolder) {
  std::string text = "*NODE\n", elements = "*ELEMENT,TYPE=C3D8,ELSET=E\n";
  for (int i = 0; i <= 12; ++i)
    for (int j = 0; j < 9; ++j)
      text += std::to_string(9 * i + j + 1) + "," + std::to_string(0.1 * i) + "," + std::to_string(0.1 * (j % 3)) + "," +
              std::to_string(0.1 * (j / 3)) + "\n";
  int id = 0;
  for (int i = 0; i < 12; ++i)
    for (const int j : {0, 1, 3, 4}) {
      elements += std::to_string(++id);
      for (const int k : {0, 9, 10, 1, 3, 12, 13, 4}) elements += "," + std::to_string(9 * i + j + k + 1);
      elements += "\n";
    }
  const FeModel m = deck(text + elements + "*SOLID SECTION,ELSET=E,MATERIAL=S\n" + steel);
  const Scratch scratch;
  ReduceOptions o;
  o.method = ReduceMethod::eigenmodes;
  o.modes = 6;
  o.stiffening = false;
  const VecX in_memory = reduce(m, o).report.frequencies;
  o.scratch = scratch.path();
  const VecX in_folder = reduce(m, o).report.frequencies;
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(in_folder(k), in_memory(k), 1e-9 * in_memory(k));
  EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
  o.scratch = scratch.path() / "none";
  EXPECT_THROW(reduce(m, o), InputError);
}

// All that is wrong with a deck is told at once, each with its line: types and words that cannot be read, numbers that are none, names
// that are not there; and not what follows from one of them alone.
TEST(ReduceDecks, AllFaultsAreNamed) {
  std::string text;
  try {
    deck(
        "*NODE\n1,0,0,0\n2,1,0,x\n3,1,1,0\n4,0,1,0\n5,0,0,1\n*ELEMENT,TYPE=CPS4,ELSET=E\n1,1,2,3,4\n*ELEMENT,TYPE=C3D4,ELSET=F\n2,1,3,4,5\n"
        "3,1,3,4,77\n*SOLID SECTION,ELSET=E,MATERIAL=S\n*SOLID SECTION,ELSET=F,MATERIAL=NONE\n*MATERIAL,NAME=S\n*ELASTIC,TYPE=SHORT\n"
        "2e11,.3\n*SURFACE,NAME=A\nE,S1\n*COUPLING,REF NODE=1,SURFACE=A,CONSTRAINT NAME=C\n*KINEMATIC\n1,3\n*CONTACT\n"
        "*EQUATION\n2\n1,1,1.,99,1,-1.\n*BOUNDARY\nMISSING,1,3\n");
  } catch (const InputError& e) {
    text = e.what();
  }
  for (const char* part : {":3: ", ":7: element type 'CPS4'", ":11: element 3: node 77 is not there", ":13: section: material 'NONE'",
                           ":15: *ELASTIC, TYPE=SHORT", ":22: *CONTACT", ":25: node 99 is not there", ":27: node set 'MISSING'"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  EXPECT_EQ(text.find("surface 'A'"), std::string::npos) << text;
  // Behind a fault: constants that are not there.
  EXPECT_THROW(deck("*NODE\n1,0,0,x\n*MATERIAL,NAME=S\n*ELASTIC\n*DENSITY\n7850\n"), InputError);
  // A beam whose node of direction is not there.
  EXPECT_THROW(deck("*NODE\n1,0,0,0\n2,1,0,0\n*ELEMENT,TYPE=B31,ELSET=F\n1,1,2,77\n*BEAM SECTION,ELSET=F,MATERIAL=S,SECTION=RECT\n.1,.1\n"
                    "0,1,0\n*MATERIAL,NAME=S\n*ELASTIC\n2e11,.3\n*DENSITY\n7850\n"),
               InputError);
  // Ties of elements without nodes.
  for (const char* tie : {"*RIGID BODY,ELSET=F\n", "*DISTRIBUTING COUPLING,ELSET=F\n1,1.\n"})
    EXPECT_THROW(deck("*ELEMENT,TYPE=C3D4,ELSET=F\n1,1,2,3,4\n*SOLID SECTION,ELSET=F,MATERIAL=S\n" + std::string(tie)), InputError);
}

// The mean turn of four nodes about the axis that the last one's coordinates are: a rigid motion's own turn, and that of a twist.
TEST(ReduceDecks, MeanRotations) {
  const FeModel m = deck(
      "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,2\n7,1,1,2.6\n8,0,1,1\n9,3,0,0\n*ELEMENT,TYPE=C3D8,ELSET=E\n"
      "1,1,2,3,4,5,6,7,8\n*SOLID SECTION,ELSET=E,MATERIAL=S\n*MATERIAL,NAME=S\n*ELASTIC\n2e11,.3\n*DENSITY\n7800\n*MPC\n"
      "MEANROT,2,2,2,3,3,3,6,6,6,7,7,7,9\n*BOUNDARY\n9,1,1\n");
  ASSERT_EQ(m.equations.size(), 1u);
  const auto sum = [&](auto motion, const Vec3& pilot) {
    double out = 0.0;
    for (const auto& t : m.equations[0].terms)
      out += t.coefficient * (t.dof >= 3 ? pilot(t.dof - 3) : Vec3(motion(m.nodes[t.node]))(t.dof));
    return out;
  };
  const Vec3 w(0.4, 0.5, -0.6), middle(1.0, 0.5, 1.15);
  EXPECT_NEAR(sum([&](const Vec3& x) { return Vec3(Vec3(0.1, -0.2, 0.3) + w.cross(x)); }, w), 0.0, 1e-12);
  EXPECT_NEAR(sum([&](const Vec3& x) { return Vec3(x.x() * Vec3::UnitX().cross(x - middle)); }, Vec3::Zero()), 1.0, 1e-12);
  // The support of its first motion holds the turn.
  ASSERT_EQ(m.constraints.size(), 1u);
  EXPECT_EQ(m.constraints[0].dof, 3);
  EXPECT_EQ(m.constraints[0].direction, Vec3::UnitX());
}

// A motion with stiffness and without mass has no frequency: it was given 1e149 Hz.
TEST(ReduceDecks, MotionsWithoutMassHaveNoFrequency) {
  const FeModel m = deck(
      "*NODE\n1,0,0,0\n2,0,0,-30\n3,0,0,-30\n4,0,0,-330\n*ELEMENT,TYPE=B31,ELSET=E\n1,1,2\n2,3,4\n*BEAM SECTION,MATERIAL=S,ELSET=E,"
      "SECTION=RECT\n10,10\n0,1,0\n*EQUATION\n2\n2,1,-1.,3,1,1.\n2\n2,3,-1.,3,3,1.\n*NSET,NSET=ALL\n1,2,3,4\n*BOUNDARY\nALL,2,2\n"
      "ALL,4,4\nALL,6,6\n1,1,5\n*MATERIAL,NAME=S\n*ELASTIC\n2e5,.3\n*DENSITY\n7.8e-9\n");
  ReduceOptions o;
  o.held = m.constraints;
  for (int modes = 1; modes <= 8; ++modes) {
    o.modes = modes;
    try {
      const Reduction r = reduce(m, o);
      EXPECT_LT(r.report.frequencies.maxCoeff(), 1e8) << modes;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find("the model has"), std::string::npos) << e.what();
    } catch (const SimulationError& e) {
      EXPECT_NE(std::string(e.what()).find("stand out"), std::string::npos) << e.what();
    }
  }
}

// A laminate of two equal isotropic layers is the shell of one; its offset moves the mass beside the nodes.
TEST(ReduceDecks, LaminatesAndOffsets) {
  const FeMaterial m{"S", 2.1e11, 0.3, 7850.0};
  FeModel model;
  model.materials = {m};
  model.layups.push_back({{{0.01, 0, -1, 0.3}, {0.03, 0, -1, 1.0}}, 0.0});
  FeElement e;
  e.shape = FeShape::quadrangle4;
  e.material = 0;
  e.section = 0;
  const FeShellLaw one = shell_law(m, 0.04), two = shell_law(model, e, Mat3::Identity());
  EXPECT_TRUE(two.A.isApprox(one.A, 1e-12));
  EXPECT_TRUE(two.D.isApprox(one.D, 1e-12));
  EXPECT_LT(two.B.cwiseAbs().maxCoeff(), 1e-9 * one.A.maxCoeff());
  model.layups[0].offset = 0.5;
  const FeShellLaw beside = shell_law(model, e, Mat3::Identity());
  EXPECT_NEAR(beside.m1, -7850.0 * 0.04 * 0.02, 1e-9);
  EXPECT_TRUE(beside.B.isApprox(-0.02 * one.A, 1e-12));
  // Turned by a right angle an orthotropic layer has its directions exchanged.
  Mat6 S = Mat6::Zero();
  S.diagonal() << 1e-11, 1e-10, 1e-10, 2e-10, 2e-10, 3e-10;
  model.materials[0].elasticity = S.inverse();
  model.layups[0] = {{{0.01, 0, -1, 0.5 * std::numbers::pi}}, 0.0};
  const FeShellLaw turned = shell_law(model, e, Mat3::Identity());
  EXPECT_NEAR(turned.A(1, 1), 0.01 * 1e11, 1.0);
  EXPECT_NEAR(turned.A(0, 0), 0.01 * 1e10, 1.0);
  EXPECT_NEAR(turned.S(0, 0), 5.0 / 6.0 * 0.01 / 2e-10, 1e-3);
}

// Steel in millimetres and tonnes read as SI is told of with the units that make steel of it; rubber, foam and tungsten are not.
TEST(ReduceDecks, ContradictingUnits) {
  FeModel m;
  m.file = "deck.inp";
  m.nodes = {{0, 0, 0}, {74, 0, 0}};
  FeElement e;
  e.material = 0;
  m.elements = {e};
  const auto warned = [&](double density, double young) {
    m.materials = {{"A", young, 0.3, density}};
    const auto w = unit_warnings(m, {});
    return w.empty() ? std::string() : w[0];
  };
  EXPECT_NE(warned(7.85e-9, 2.1e5).find("--units mm "), std::string::npos);
  EXPECT_NE(warned(7.85e-6, 210.0).find("--units mm-kg-ms "), std::string::npos);
  EXPECT_NE(warned(7.85e-6, 2.1e8).find("--units mm-kg-s "), std::string::npos);
  EXPECT_NE(warned(7850.0, 2.1e5).find("contradict"), std::string::npos);
  EXPECT_NE(warned(7.85e-6, 2.1e5), "");
  for (const auto& [density, young] :
       {std::pair(7850.0, 2.1e11), std::pair(1100.0, 2e6), std::pair(30.0, 5e6), std::pair(19300.0, 4e11), std::pair(1000.0, 1e4)})
    EXPECT_EQ(warned(density, young), "");
}

}  // namespace
}  // namespace flexframe::sim::test_reduce_decks
