// Nastran bulk data beyond plain elements: masses in some directions and as matrices, rigid elements whose independent motions lie at
// several grids, sections by shape, thicknesses at grids, continuations out of order; of a deck with several faults all are named.
#include "deck_text.h"
#include "sim/reduce/fe_sections.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace flexframe::sim::test_reduce_nastran {
namespace {

constexpr double pi = std::numbers::pi;

const std::string cantilever =
    "GRID,1,,0.,0.,0.,,123456\nGRID,2,,.5,0.,0.\nMAT1,1,2.+11,,.3\nPBAR,1,1,1.-3,1.-8,4.-8,2.-8\n"
    "CBAR,1,1,1,2,0.,1.,0.\n";

// A massless beam with m at its end: along x sqrt(E A / L m), across by 3 E I / L^3. The second number of a PMASS, and of a PELAS, is read.
TEST(ReduceNastran, MassesOfDirections) {
  const double E = 2e11, L = 0.5, m = 3.0;
  const FeModel plain = bulk(cantilever + "PMASS,7,1.,8,3.\nCMASS1,11,8,2,1\nCMASS1,12,8,2,2\nCMASS2,13,3.,2,3\n");
  const VecX f = reduced(plain, 3).report.frequencies;
  EXPECT_NEAR(f(0), std::sqrt(3 * E * 1e-8 / (L * L * L) / m) / (2 * pi), 1e-6 * f(0));
  EXPECT_NEAR(f(1), std::sqrt(3 * E * 4e-8 / (L * L * L) / m) / (2 * pi), 1e-6 * f(1));
  EXPECT_NEAR(f(2), std::sqrt(E * 1e-3 / L / m) / (2 * pi), 1e-6 * f(2));
  EXPECT_FALSE(says(reduced(plain, 3).report.warnings, "the mass is"));
  // In one direction only: told, since no free body has it.
  const FeModel one = bulk(cantilever + "PELAS,1,5.,,,2,1.+5\nCELAS1,20,2,2,2\nCMASS2,11,3.,2,2\n");
  const auto found = reduced(one, 1);
  EXPECT_NEAR(found.report.frequencies(0), std::sqrt((3 * E * 1e-8 / (L * L * L) + 1e5) / m) / (2 * pi),
              1e-5 * found.report.frequencies(0));
  EXPECT_TRUE(says(found.report.warnings, "no body that moves freely has that"));
}

// CONM1 in turned directions is the CONM2 of the same mass beside its grid.
TEST(ReduceNastran, MassMatrices) {
  const std::string turned = "CORD2R,5,,0.,0.,0.,0.,0.,1.,\n,0.,1.,0.\n";
  const VecX with_2 = reduced(bulk(cantilever + turned + "CONM2,9,2,5,3.,.1,.02,0.\n,.01,,.02,,,.03\n"), 4).report.frequencies;
  // About the grid: moments 0.01 + m (y^2 + z^2), 0.02 + m (x^2 + z^2), 0.03 + m (x^2 + y^2), product -m x y; m times the lever.
  const VecX with_1 =
      reduced(bulk(cantilever + turned + "CONM1,9,2,5,3.,0.,3.,0.,0.\n,3.,0.,0.,.06,.0112,0.,0.,-.3\n,-.006,.05,-.06,.3,0.,0.,0.,.0612\n"),
              4)
          .report.frequencies;
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(with_1(k), with_2(k), 1e-6 * with_2(k));
}

// The same rigid piece by RBE2, RBE1 with its independent motions at three grids, RTRPLT, and RBAR with them at both ends.
TEST(ReduceNastran, RigidElementsOfSeveralGrids) {
  std::string text = "MAT1,1,2.+11,,.3,7850.\nPBAR,1,1,1.-4,8.-10,8.-10,1.4-9\n";
  const char* places[] = {"0.,0.,0.", "0.,.3,0.", ".2,.1,.1"};
  for (int i = 0; i < 3; ++i) {
    text += "GRID," + std::to_string(i + 1) + ",," + places[i] + "\n";
    text += "GRID," + std::to_string(i + 11) + ",,.8,." + std::to_string(i + 1) + ",." + std::to_string(2 * i + 1) + ",,123456\n";
    text += "CBAR," + std::to_string(i + 1) + ",1," + std::to_string(i + 1) + "," + std::to_string(i + 11) + ",0.,0.,1.\n";
  }
  const VecX wanted = reduced(bulk(text + "RBE2,50,1,123456,2,3\n"), 6).report.frequencies;
  for (const char* other : {"RBE1,50,1,123,2,13,3,3\n,UM,1,456,2,2456\n,3,12456\n", "RTRPLT,50,1,2,3,123,13,3\n",
                            "RBAR,50,1,2,123456\nRBAR,51,2,3,1235,46,46,1235\n"}) {
    const VecX f = reduced(bulk(text + other), 6).report.frequencies;
    for (int k = 0; k < 6; ++k) EXPECT_NEAR(f(k), wanted(k), 1e-6 * wanted(k)) << other;
  }
  // RROD keeps a distance, which a stiff rod does too.
  const VecX rod = reduced(bulk(text + "RROD,50,1,2\nRROD,51,2,3,,1\n"), 6).report.frequencies;
  const VecX stiff = reduced(bulk(text + "MAT1,2,2.+15,,.3,1.-9\nCONROD,60,1,2,2,1.-2\nCONROD,61,2,3,2,1.-2\n"), 6).report.frequencies;
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(rod(k), stiff(k), 1e-3 * stiff(k));
  EXPECT_NE(bulk_refusal(text + "RBAR,50,1,2,123,123\n").find("do not fix a rigid body"), std::string::npos);
}

// Sections against what counting small squares of the drawn shape gives (y up, z to the right).
TEST(ReduceNastran, SectionsByShape) {
  using Inside = std::function<bool(double, double)>;
  const auto between = [](double x, double a, double b) { return x >= a && x < b; };
  struct Shape {
    const char* name;
    std::vector<double> d;
    Inside inside;
  };
  const std::vector<Shape> shapes = {
      {"I1", {10, 2, 20, 26}, [&](double y, double z) { return std::abs(y) > 10 ? std::abs(z) < 6 : std::abs(z) < 1; }},
      {"CHAN1", {8, 2, 20, 26}, [&](double y, double z) { return std::abs(y) > 10 ? between(z, -5, 5) : between(z, -5, -3); }},
      {"Z", {8, 2, 20, 26}, [&](double y, double z) { return y > 10    ? between(z, -9, 1)
                                                             : y < -10 ? between(z, -1, 9)
                                                                       : std::abs(z) < 1; }},
      {"CHAN2", {2, 3, 20, 26}, [&](double y, double z) { return (y < -7 || std::abs(z) > 11) && between(y, -10, 10); }},
      {"T1", {20, 16, 3, 2}, [&](double y, double z) { return between(z, -9, -6) ? true : std::abs(y) < 1 && between(z, -6, 10); }},
      {"T2", {20, 24, 3, 2}, [&](double y, double z) { return y < -9 ? true : std::abs(z) < 1; }},
      {"CROSS", {14, 4, 24, 2}, [&](double y, double z) { return std::abs(z) < 2 || (std::abs(y) < 1 && std::abs(z) < 9); }},
      {"H", {12, 6, 20, 2}, [&](double y, double z) { return std::abs(z) < 6 ? std::abs(y) < 1 : std::abs(z) < 9; }},
      {"HAT", {20, 2, 16, 5}, [&](double y, double z) {
         return y > 8 ? std::abs(z) < 8 : y < -8 ? between(std::abs(z), 6, 13) : between(std::abs(z), 6, 8);
       }}};
  const double high[] = {13, 13, 13, 10, 10, 12, 12, 10, 10}, wide[] = {6, 5, 9, 13, 10, 10, 9, 9, 13};
  for (size_t k = 0; k < shapes.size(); ++k) {
    const auto& [name, d, inside] = shapes[k];
    double A = 0, y1 = 0, z1 = 0, yy = 0, zz = 0, yz = 0;
    constexpr double h = 0.05;
    for (double y = -high[k] + h / 2; y < high[k]; y += h)
      for (double z = -wide[k] + h / 2; z < wide[k]; z += h) {
        if (!inside(y, z)) continue;
        A += h * h;
        y1 += h * h * y;
        z1 += h * h * z;
        yy += h * h * y * y;
        zz += h * h * z * z;
        yz += h * h * y * z;
      }
    const auto made = open_section(name, d);
    ASSERT_TRUE(made) << name;
    EXPECT_NEAR(made->area, A, 1e-3 * A) << name;
    EXPECT_NEAR(made->I22, yy - y1 * y1 / A, 1e-3 * yy) << name;
    EXPECT_NEAR(made->I11, zz - z1 * z1 / A, 1e-3 * zz) << name;
    EXPECT_NEAR(made->I12, yz - y1 * z1 / A, 1e-3 * std::sqrt(yy * zz)) << name;
  }
  // A box whose walls differ: 20 x 12 outside, walls 3 (end of the first direction), 1, 1, 2.
  const auto box = beam_shape("BOX", {20, 12, 3, 1, 1, 2});
  double A = 0, y1 = 0, z1 = 0, yy = 0, zz = 0, yz = 0;
  for (double y = 0.05; y < 20; y += 0.1)
    for (double z = 0.05; z < 12; z += 0.1) {
      if (y > 1 && y < 17 && z > 2 && z < 11) continue;
      A += 0.01;
      y1 += 0.01 * y;
      z1 += 0.01 * z;
      yy += 0.01 * y * y;
      zz += 0.01 * z * z;
      yz += 0.01 * y * z;
    }
  EXPECT_NEAR(box->area, A, 1e-3 * A);
  EXPECT_NEAR(box->I22, yy - y1 * y1 / A, 1e-3 * box->I22);
  EXPECT_NEAR(box->I11, zz - z1 * z1 / A, 1e-3 * box->I11);
  EXPECT_NEAR(box->I12, yz - y1 * z1 / A, 1e-3 * box->I11);
  // Without a wall there is no box; its torsion was looked for without end.
  EXPECT_TRUE(beam_shape("BOX", {0.1, 0.2, 0.01, 0.01, 0.01, 0.01}));
  for (double wall : {0.0, -0.01}) EXPECT_FALSE(beam_shape("BOX", {0.1, 0.2, wall, 0.01, 0.01, 0.01})) << wall;
}

// Thicknesses at the grids come before the property's: with Poisson's ratio zero a cantilever strip's frequency is proportional to them.
TEST(ReduceNastran, ThicknessesAtGrids) {
  const auto strip = [](const std::string& more) {
    std::string text = "MAT1,1,2.+11,,0.,8000.\nPSHELL,1,1,.001,1,,1\n";
    for (int i = 0; i <= 10; ++i)
      for (int j = 0; j < 2; ++j)
        text += fmt::format("GRID,{},,{:.1f},{:.2f},0.,,{}\n", 10 * i + j + 1, 0.1 * i, 0.02 * j, i == 0 ? "123456" : "");
    for (int i = 0; i < 10; ++i) {
      const int n = 10 * i + 1;
      text += fmt::format("CQUAD4,{},1,{},{},{},{}\n{}", i + 1, n, n + 10, n + 11, n + 1, more);
    }
    return bulk(text);
  };
  const double thin = reduced(strip(""), 1).report.frequencies(0),
               thick = reduced(strip(",,,.002,.002,.002,.002\n"), 1).report.frequencies(0),
               relative = reduced(strip(",,1,1.5,1.5,1.5,1.5\n"), 1).report.frequencies(0);
  EXPECT_NEAR(thick, 2.0 * thin, 2e-3 * thick);
  EXPECT_NEAR(relative, 1.5 * thin, 2e-3 * relative);
  EXPECT_TRUE(says(strip(",,,.001,.002,.002,.001\n").warnings, "thicknesses at the grids differ"));
}

// Continuations by name, out of order and in large fields; a line that goes on from none is complained of.
TEST(ReduceNastran, ContinuationsByName) {
  const std::string grids =
      "GRID           1              0.      0.      0.          123456\n"
      "GRID*                  2                              .5              0.*G2\n*G2                   0.\n"
      "MAT1           1  2.0+11              .3\n";
  const std::string bar = "CBAR           1       1       1       2      0.      1.      0.        +C1\n";
  const std::string property = "PBAR           1       1    1.-3    1.-8    4.-8    2.-8                +P1\n";
  const std::string mass = "CONM2          9       2              3.                                +M1\n";
  const std::string text = grids + property + bar + mass + "+M1          .01             .02                     .03\n" +
                           "+C1                          .0      .1      0.      .0      .1      0.\n" + "+P1          0.      0.\n";
  const FeModel model = bulk(text);
  const FeModel wanted = bulk(cantilever + "CONM2,9,2,,3.\n,.01,,.02,,,.03\n");
  EXPECT_NEAR(reduced(model, 1).body.mass, 3.0, 1e-12);
  EXPECT_EQ(model.spiders.size(), 2u);  // the bar beside its grids: its continuation was found
  EXPECT_EQ(wanted.spiders.size(), 0u);
  EXPECT_NE(bulk_refusal(grids + property + bar + "+XX          .1\n").find("goes on from no line before it"), std::string::npos);
}

// Cards that nobody knows here may be of the structure: a warning, once a name; those of heat, optimisation and plasticity are notes.
TEST(ReduceNastran, UnknownCardsAreWarnedOf) {
  const FeModel m = bulk(cantilever + "CMASS2,11,3.,2,2\nMFLUID,1,0\nMFLUID,2,0\nSNORM,2,,0.,0.,1.\nMATS1,1,,PLASTIC\nDVGRID,1,2\n");
  EXPECT_EQ(std::count_if(m.warnings.begin(), m.warnings.end(),
                          [](const std::string& w) { return w.find("MFLUID is not known and passed over") != std::string::npos; }),
            1);
  EXPECT_TRUE(says(m.warnings, "SNORM is not known"));
  EXPECT_TRUE(says(m.notes, "MATS1 is ignored") && says(m.notes, "DVGRID is ignored"));
  EXPECT_FALSE(says(m.warnings, "MATS1") || says(m.warnings, "DVGRID"));
}

// All that is wrong, each with its line.
TEST(ReduceNastran, AllFaultsAreNamed) {
  const std::string text = bulk_refusal(
      "GRID,1,,0.,0.,0.\nGRID,2,,1.,x,0.\nGRID,3,9,1.,0.,0.\nCSHEAR,1,1,1,2,3,4\nCSHEAR,2,1,1,2,3,4\n=,*1,=\n"
      "SPOINT,77\nMAT1,1,2.+11,,.3,7850.\nMAT1,1,2.+11,,.2,7850.\nPBAR,1,1,1.-3,1.-8,4.-8,2.-8\n"
      "CBAR,5,1,1,2,0.,1.,0.\nCBAR,6,9,1,4,0.,1.,0.\nPBARL,2,1,,HEXA\nSPC1,1,123456,8\n");
  for (const char* part :
       {":2: GRID: field 5: a number is expected, found 'X'", ":3: GRID: coordinate system 9 is not there",
        ":4: CSHEAR: shear panels cannot be read", "also in line 5", ":6: =: cards that repeat", ":7: SPOINT: scalar points",
        ":9: MAT1: number 1 is there twice", ":12: CBAR: property 9 is not there", ":14: SPC1: grid 8 is not there"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  EXPECT_EQ(text.find("grid 2 is not there"), std::string::npos) << text;  // its own card is what is wrong
  // Nor is anything else said where a range has it, which ended the program.
  const std::string range = bulk_refusal(cantilever + "GRID,3,,1.,x,0.\nGRID,4,,1.,0.,0.\nSPC1,1,123456,1,THRU,4\n");
  EXPECT_NE(range.find(":6: GRID: field 5: a number is expected, found 'X'"), std::string::npos) << range;
  EXPECT_EQ(range.find("SPC1"), std::string::npos) << range;
  const std::string without = bulk_refusal(cantilever + "INCLUDE 'nowhere.bdf'\n");
  EXPECT_TRUE(without.find("INCLUDE: '") != std::string::npos && without.find(".bdf:6: ") != std::string::npos) << without;
  // The axes of a layered shell whose first two grids are one.
  const std::string flat = bulk_refusal(
      "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,1.,1.,0.\nGRID,4,,0.,1.,0.\nCQUAD4,1,1,2,2,3,4,30.\n"
      "PCOMP,1,,,,,,,SYM\n,8,.005,0.,YES\nMAT8,8,1.3+11,9.+9,.3,5.+9,5.+9,3.+9,1600.\n");
  EXPECT_NE(flat.find(":5: CQUAD4: element 1 (4-node shell) is degenerate"), std::string::npos) << flat;
}

}  // namespace
}  // namespace flexframe::sim::test_reduce_nastran
