// What preprocessors write into decks beside plain elements: offsets, released ends, defaults, stations of beams, membranes, rods that
// twist, temperatures, rubber, contact pairs. Truths in closed form.
#include "deck_text.h"
#include "sim/reduce/fe_sections.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace flexframe::sim::test_reduce_cards {
namespace {

constexpr double pi = std::numbers::pi;

FeModel inp(const std::string& text, FeContact contact = FeContact::refuse) {
  const Scratch scratch;
  return read_inp(scratch.put("deck.inp", text), {}, contact);
}

VecX frequencies(const FeModel& m, int modes) { return reduced(m, modes).report.frequencies; }

// A mass at a grid e beside the axis of a beam without mass: compliance L^3 / 3EI along the offset, L^3 / 3EI + e^2 L / GJ across it.
TEST(ReduceCards, BeamsBesideTheirGrids) {
  const double E = 2e11, G = E / 2.6, I = 1e-8, J = 2e-8, L = 0.5, e = 0.1, m = 3.0;
  const std::string text =
      "GRID,1,,0.,0.,0.\nGRID,2,,.5,0.,0.\nSPC1,1,123456,1\nMAT1,1,2.+11,,.3\nPBAR,1,1,1.-3,1.-8,1.-8,2.-8\nCONM2,9,2,,3.\n"
      "CBAR,1,1,1,2,0.,1.,0.\n,,,0.,.1,0.,0.,.1,0.\n";
  const FeModel model = bulk(text);
  EXPECT_TRUE(says(model.warnings, "material 1 has no density"));
  const VecX f = frequencies(model, 2);
  const double bend = L * L * L / (3 * E * I), twist = e * e * L / (G * J);
  EXPECT_NEAR(f(0), std::sqrt(1 / (m * (bend + twist))) / (2 * pi), 1e-6 * f(0));
  // Along the offset bending turns the end, and the mass goes along the beam with it.
  Eigen::Matrix2d along;
  along << L / (E * 1e-3) + e * e * L / (E * I), e * L * L / (2 * E * I), e * L * L / (2 * E * I), bend;
  const double softest = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(along).eigenvalues()(1);
  EXPECT_NEAR(f(1), std::sqrt(1 / (m * softest)) / (2 * pi), 1e-6 * f(1));
}

// A beam clamped at both grids, the last element's end released to turn: a propped cantilever, beta L = 3.926602. Defaults of BAROR and
// GRDSET, and the section by PBEAM with its stations, are what the fields themselves would be.
TEST(ReduceCards, ReleasedEndsAndDefaults) {
  std::string grids, bars, full;
  for (int i = 0; i <= 12; ++i) grids += "GRID," + std::to_string(i + 1) + ",," + std::to_string(i / 12.0) + ",0.,0.\n";
  for (int i = 1; i <= 12; ++i) {
    const std::string ends = std::to_string(i) + "," + std::to_string(i + 1);
    bars += "CBAR," + std::to_string(i) + ",," + ends + (i == 12 ? "\n,,56" : "") + "\n";
    full += "CBEAM," + std::to_string(i) + ",1," + ends + ",0.,1.,0." + (i == 12 ? "\n,,56" : "") + "\n";
  }
  const std::string rest = "MAT1,1,2.1+11,,.3,7850.\nSPC1,1,123456,1,13\n";
  const FeModel by_default = bulk("BAROR,,1,,,0.,1.,0.\nGRDSET,,,,,,,4\nPBAR,1,1,1.-4,8.3333-10,8.3333-10,1.4-9\n" + grids + bars + rest);
  const FeModel written = bulk(
      "PBEAM,1,1,1.-4,8.3333-10,8.3333-10,,1.4-9\n,.005,.005,-.005,.005,.005,-.005,-.005,-.005\n,yes,1.,1.-4,8.3333-10,8.3333-10,,1.4-9\n"
      ",.005,.005,-.005,.005,.005,-.005,-.005,-.005\n,0.,0.\n" +
      grids + full + rest);
  const double wanted = std::pow(3.926602, 2) / (2 * pi) * std::sqrt(2.1e11 * 8.3333e-10 / (7850 * 1e-4));
  for (const FeModel* m : {&by_default, &written}) EXPECT_NEAR(frequencies(*m, 2)(0), wanted, 1e-3 * wanted);
  EXPECT_TRUE(written.warnings.empty());
}

// Membranes, plates that bend otherwise, shells that are folded around middle grids which are left out. Poisson's ratio zero: a strip is a
// rod, f = sqrt(E / rho) / 4 L, and a cantilever, f = 1.8751^2 / 2 pi sqrt(E I / rho A L^4).
TEST(ReduceCards, MembranesAndFactorsOfBending) {
  std::string grids, quads, six;
  for (int i = 0; i <= 20; ++i)
    for (int j = 0; j < 2; ++j)
      grids += "GRID," + std::to_string(1 + 2 * i + j) + ",," + std::to_string(i / 20.0) + "," + std::to_string(0.05 * j) + ",0.\n";
  for (int i = 0; i < 20; ++i) {
    const int a = 1 + 2 * i;
    const std::string corners = std::to_string(a) + "," + std::to_string(a + 2) + "," + std::to_string(a + 3) + "," + std::to_string(a + 1);
    quads += "CQUAD4," + std::to_string(i + 1) + ",1," + corners + "\n";
    six += "CQUAD8," + std::to_string(i + 1) + ",1," + corners + ",,\n";
  }
  const std::string rest = "MAT1,1,2.1+11,,0.,7850.\nSPC1,1,123456,1,2\n";
  const double stretch = std::sqrt(2.1e11 / 7850) / 4, bend = std::pow(1.875104, 2) / (2 * pi) * std::sqrt(2.1e11 * 1e-4 / 12 / 7850);
  const FeModel membrane = bulk(grids + quads + rest + "PSHELL,1,1,.01\nSPC1,1,3,1,THRU,42\nSPC1,1,2,1,THRU,42\n");
  EXPECT_NEAR(frequencies(membrane, 1)(0), stretch, 2e-3 * stretch);
  EXPECT_NEAR(frequencies(bulk(grids + quads + rest + "PSHELL,1,1,.01,1,4.\n"), 1)(0), 2 * bend, 5e-3 * bend);
  EXPECT_NEAR(frequencies(bulk(grids + quads + rest + "MAT1,2,8.4+11,,0.\nPSHELL,1,1,.01,2\n"), 1)(0), 2 * bend, 5e-3 * bend);
  EXPECT_NEAR(frequencies(bulk(grids + quads + rest + "MAT2,2,2.1+11,0.,0.,2.1+11,0.,1.05+11,7850.\nPSHELL,1,2,.01,2\n"), 1)(0), bend,
              5e-3 * bend);
  EXPECT_NEAR(frequencies(bulk(grids + quads + rest + "PCOMPG,1,-.005\n,1,1,.005,0.\n,2,1,.005,90.\n"), 1)(0), bend, 5e-3 * bend);
  // Edges without a middle stay straight: too stiff against bending, right in stretching.
  const FeModel left_out = bulk(grids + six + rest + "PSHELL,1,1,.01,1\nSPC1,1,3,1,THRU,42\nSPC1,1,2,1,THRU,42\n");
  EXPECT_NEAR(frequencies(left_out, 1)(0), stretch, 2e-3 * stretch);
}

// Rods that twist: sqrt(G J / L / inertia). What nothing acts on (turning across the axis, moving across it where it is held) is told of.
TEST(ReduceCards, RodsThatTwist) {
  const double J = pi / 32 * (std::pow(0.05, 4) - std::pow(0.03, 4));
  for (const std::string& rod :
       {"PROD,1,1,1.-3," + std::to_string(J * 1e7) + "-7\nCROD,1,1,1,2\n", std::string("PTUBE,1,1,.05,.01\nCTUBE,1,1,1,2\n")}) {
    const FeModel m = bulk("GRID,1,,0.,0.,0.\nGRID,2,,.3,.4,0.\nMAT1,1,2.+11,8.+10\nCONM2,9,2,,1.,,,,\n,.02,,.02,,,.02\nSPC1,1,123456,1\n" +
                           rod + "CELAS2,5,1.+12,2,1\nCELAS2,6,1.+12,2,2\nCELAS2,7,1.+12,2,3\nCELAS2,8,1.+12,2,6\nCELAS2,10,1.+12,2,4\n");
    // The springs hold all but the turning about y, where the rod's twist acts with the square of its direction's part.
    const double wanted = std::sqrt(8e10 * J / 0.5 * 0.64 / 0.02) / (2 * pi);
    EXPECT_NEAR(frequencies(m, 1)(0), wanted, 1e-3 * wanted) << rod;
  }
}

// An I section's moments of area against those of its three walls by hand (m: flanges 100 x 10, web 180 x 6).
TEST(ReduceCards, OpenSections) {
  const auto s = open_section("I", {0.2, 0.1, 0.1, 0.006, 0.01, 0.01});
  ASSERT_TRUE(s);
  EXPECT_NEAR(s->area, 2 * 0.1 * 0.01 + 0.18 * 0.006, 1e-12);
  EXPECT_NEAR(s->I22, 0.1 * std::pow(0.2, 3) / 12 - 0.094 * std::pow(0.18, 3) / 12, 1e-12);
  EXPECT_NEAR(s->I11, 2 * 0.01 * std::pow(0.1, 3) / 12 + 0.18 * std::pow(0.006, 3) / 12, 1e-12);
  EXPECT_NEAR(s->torsion, (2 * 0.1 * 1e-6 + 0.18 * 2.16e-7) / 3, 0.06 * s->torsion);
  // L of equal legs b, thickness t: the product of area about the centroid, by hand for 100 x 100 x 10.
  const auto l = open_section("L", {0.1, 0.1, 0.01, 0.01});
  ASSERT_TRUE(l);
  const double c = (0.1 * 0.01 * 0.005 + 0.09 * 0.01 * 0.055) / 0.0019;
  EXPECT_NEAR(l->I12, 0.001 * (0.005 - c) * (0.05 - c) + 0.0009 * (0.055 - c) * (0.005 - c), 1e-12);
  EXPECT_FALSE(open_section("I", {0.01, 0.1, 0.1, 0.006, 0.01, 0.01}));
}

const std::string beam =
    "*NODE\n1,0,0,0\n2,.5,0,0\n3,1,0,0\n*ELEMENT,TYPE=B31,ELSET=B\n1,1,2\n2,2,3\n*NSET,NSET=ALL\n1,2,3\n*BOUNDARY\n1,1,6\n";

// Elasticity at the initial temperature, by a straight line between the rows; without initial temperatures at zero, with a warning.
TEST(ReduceCards, ElasticityAtTheInitialTemperature) {
  const std::string text =
      beam + "*MATERIAL,NAME=S\n*ELASTIC\n2e11,.3,20.\n1e11,.2,120.\n*DENSITY\n7850\n*BEAM SECTION,ELSET=B,MATERIAL=S,SECTION=CIRC\n.01\n";
  EXPECT_NEAR(inp(text + "*INITIAL CONDITIONS,TYPE=TEMPERATURE\nALL,70.\n").materials[0].youngs_modulus, 1.5e11, 1.0);
  EXPECT_NEAR(inp(text + "*INITIAL CONDITIONS,TYPE=TEMPERATURE\nALL,500.\n").materials[0].poisson, 0.2, 1e-12);
  const FeModel cold = inp(text);
  EXPECT_NEAR(cold.materials[0].youngs_modulus, 2e11, 1.0);
  EXPECT_TRUE(says(cold.warnings, "depends on temperature"));
}

// Rubber has its initial moduli: G = 2 (C10 + C01), K = 2 / D1.
TEST(ReduceCards, HyperelasticMaterials) {
  const std::string head = beam + "*BEAM SECTION,ELSET=B,MATERIAL=R,SECTION=CIRC\n.01\n*MATERIAL,NAME=R\n*DENSITY\n1100\n*HYPERELASTIC,";
  const auto moduli = [&](const std::string& tail) {
    const FeMaterial m = inp(head + tail).materials[0];
    const double G = m.youngs_modulus / (2 * (1 + m.poisson)), K = m.youngs_modulus / (3 * (1 - 2 * m.poisson));
    return std::pair(G, K);
  };
  for (const std::string& tail :
       std::vector<std::string>{"NEO HOOKE\n4e5,2e-8\n", "MOONEY-RIVLIN\n3e5,1e5,2e-8\n", "YEOH\n4e5,1.,2.,2e-8\n",
                                "POLYNOMIAL,N=2\n3e5,1e5,1.,1.,1.,2e-8,0.\n", "OGDEN,N=1\n8e5,2.,2e-8\n"}) {
    const auto [G, K] = moduli(tail);
    EXPECT_NEAR(G, 8e5, 1.0) << tail;
    EXPECT_NEAR(K, 1e8, 1e3) << tail;
  }
  EXPECT_THROW(moduli("OGDEN,TEST DATA INPUT\n1.,2.\n"), InputError);
}

// Thicknesses at nodes are those of the beams between them, by sets too: a square of 0.02 instead of 0.01 doubles the frequency.
TEST(ReduceCards, NodalThicknessOfBeams) {
  const std::string text = beam +
                           "*MATERIAL,NAME=S\n*ELASTIC\n2e11,.3\n*DENSITY\n7850\n*BEAM SECTION,ELSET=B,MATERIAL=S,SECTION=RECT\n"
                           ".01,.01\n";
  // CalculiX' first frequency is twice as high with the section's parameter, and the same without it.
  const std::string given = "*NODAL THICKNESS\nALL,.02,.02\n", word = "SECTION=RECT";
  std::string asked = text;
  asked.insert(asked.find(word) + word.size(), ",NODAL THICKNESS");
  const double thin = frequencies(inp(text), 1)(0);
  EXPECT_NEAR(frequencies(inp(asked + given), 1)(0) / thin, 2.0, 2e-3);
  EXPECT_NEAR(frequencies(inp(text + given), 1)(0) / thin, 1.0, 1e-9);
}

// A cube whose four upper corners are held in the radial direction of a cylinder about z, by a reference point that is held: they may go
// round and up together, which a point mass and a spring to the ground show: sqrt(k r^2 / J) about the axis.
TEST(ReduceCards, CouplingsInDirectionsOfACylinder) {
  std::string text = "*NODE\n";
  for (int i = 0; i < 8; ++i)
    text += std::to_string(i + 1) + "," + std::to_string(((i & 1) ^ ((i >> 1) & 1)) - 0.5) + "," + std::to_string(((i >> 1) & 1) - 0.5) +
            "," + std::to_string(i >> 2) + "\n";
  const double stiff = 4e3;
  text +=
      "20,0,0,0.5\n*ELEMENT,TYPE=C3D8,ELSET=E\n1,1,2,3,4,5,6,7,8\n*MATERIAL,NAME=S\n*ELASTIC\n2.1e11,.3\n*DENSITY\n7850\n*SOLID SECTION,"
      "ELSET=E,MATERIAL=S\n*NSET,NSET=RIM\n1,2,3,4,5,6,7,8\n*SURFACE,NAME=R,TYPE=NODE\nRIM,\n*ORIENTATION,NAME=C,SYSTEM=CYLINDRICAL\n"
      "0,0,0,0,0,1\n*COUPLING,REF NODE=20,SURFACE=R,CONSTRAINT NAME=K,ORIENTATION=C\n*KINEMATIC\n1,1\n3,3\n*BOUNDARY\n20,1,6\n"
      "*ELEMENT,TYPE=SPRING1,ELSET=G\n9,1\n*SPRING,ELSET=G\n1\n" +
      std::to_string(stiff) + "\n";
  // The spring along x at (-1/2, -1/2) turns the cube with the lever 1/2; its mass 7850 kg has J = m / 6 (mass of its corners is
  // consistent).
  const double wanted = std::sqrt(stiff * 0.25 / (7850.0 / 6)) / (2 * pi);
  EXPECT_NEAR(frequencies(inp(text), 1)(0), wanted, 1e-3 * wanted);
}

// A cantilever plate 500 x 100 x 20 mm of every kind of shell, flat in space and inclined, against CalculiX 2.20 with 160 C3D20R: what
// turns about the normal has no frequencies of its own among them.
TEST(ReduceCards, ShellsHaveNoModesOfTheirNormals) {
  const int nx = 10, ny = 2;
  const double length = 0.5, width = 0.1;
  for (const char* type : {"S3", "S4", "S6", "S8R"})
    for (const double lean : {0.0, 0.6}) {
      std::string nodes = "*NODE\n", elements, root;
      const auto id = [&](int i, int j) { return std::to_string(1 + i * (2 * ny + 1) + j); };
      for (int i = 0; i <= 2 * nx; ++i)
        for (int j = 0; j <= 2 * ny; ++j) {
          const double x = length * i / (2 * nx), y = width * j / (2 * ny);
          nodes += id(i, j) + "," + std::to_string(x) + "," + std::to_string(y * std::cos(lean)) + "," +
                   std::to_string(y * std::sin(lean)) + "\n";
          if (i == 0) root += id(i, j) + ",1,6\n";
        }
      int count = 0;
      const bool quadratic = type[1] == '6' || type[1] == '8', triangle = type[1] == '3' || type[1] == '6';
      const int step = quadratic ? 2 : 1;
      const auto add = [&](std::vector<std::pair<int, int>> corners) {
        elements += std::to_string(++count);
        for (const auto& [i, j] : corners) elements += "," + id(i, j);
        for (size_t k = 0; k < corners.size() && quadratic; ++k) {
          const auto& [i, j] = corners[k];
          const auto& [p, q] = corners[(k + 1) % corners.size()];
          elements += "," + id((i + p) / 2, (j + q) / 2);
        }
        elements += "\n";
      };
      for (int i = 0; i < 2 * nx; i += step)
        for (int j = 0; j < 2 * ny; j += step) {
          if (triangle) {
            add({{i, j}, {i + step, j}, {i + step, j + step}});
            add({{i, j}, {i + step, j + step}, {i, j + step}});
          } else {
            add({{i, j}, {i + step, j}, {i + step, j + step}, {i, j + step}});
          }
        }
      const VecX f = frequencies(
          inp(nodes + "*ELEMENT,TYPE=" + type + ",ELSET=E\n" + elements +
              "*MATERIAL,NAME=S\n*ELASTIC\n2.1e11,.3\n*DENSITY\n7850\n*SHELL SECTION,ELSET=E,MATERIAL=S\n.02\n*BOUNDARY\n" + root),
          9);
      const double wanted[9] = {67.559, 325.73, 420.06, 616.59, 1164.4, 1759.2, 1877.8, 2250.4, 2594.7};
      // Triangles of three nodes have constant membrane strains: edgewise bending is a tenth too stiff on this mesh.
      const double share = std::string(type) == "S3" ? 0.11 : 0.05;
      for (int k = 0; k < 9; ++k) EXPECT_NEAR(f(k), wanted[k], share * wanted[k]) << type << ", inclined by " << lean;
    }
}

// Two cubes on each other: refused with the options that help, tied as *TIE ties them, open they are two parts.
TEST(ReduceCards, ContactPairs) {
  std::string text = "*NODE\n";
  for (int k = 0; k < 2; ++k)
    for (int i = 0; i < 8; ++i)
      text += std::to_string(8 * k + i + 1) + "," + std::to_string((i & 1) ^ ((i >> 1) & 1)) + "," + std::to_string((i >> 1) & 1) + "," +
              std::to_string(k + (i >> 2)) + "\n";
  text +=
      "*ELEMENT,TYPE=C3D8,ELSET=E\n1,1,2,3,4,5,6,7,8\n2,9,10,11,12,13,14,15,16\n*MATERIAL,NAME=S\n*ELASTIC\n2.1e11,.3\n*DENSITY\n7850\n"
      "*SOLID SECTION,ELSET=E,MATERIAL=S\n*SURFACE,NAME=LOW\n1,S2\n*SURFACE,NAME=UP\n2,S1\n";
  const std::string pair = "*SURFACE INTERACTION,NAME=I\n*CONTACT PAIR,INTERACTION=I,TYPE=SURFACE TO SURFACE\nUP,LOW\n";
  try {
    inp(text + pair);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("--contact tie"), std::string::npos);
  }
  const VecX tied = frequencies(inp(text + pair, FeContact::tie), 4), wanted = frequencies(inp(text + "*TIE,NAME=T\nUP,LOW\n"), 4);
  EXPECT_LT((tied - wanted).cwiseAbs().maxCoeff(), 1e-6 * wanted(0));
  EXPECT_TRUE(inp(text + pair, FeContact::open).spiders.empty());
  EXPECT_THROW(frequencies(inp(text + pair, FeContact::open), 4), InputError);
  // Surfaces that never part are tied without being asked.
  EXPECT_FALSE(inp(text + "*SURFACE INTERACTION,NAME=I\n*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=TIED\n*CONTACT PAIR,INTERACTION=I\nUP,LOW\n")
                   .equations.empty());
}

}  // namespace
}  // namespace flexframe::sim::test_reduce_cards
