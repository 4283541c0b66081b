// Words of decks that may be written in several ways: both give the same model, or what is not read is told.
#include "scratch.h"
#include "sim/reduce/reduce.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

namespace flexframe::sim::test_reduce_words {
namespace {

FeModel deck(const std::string& text, const std::string& other = "") {
  const Scratch scratch;
  scratch.put("other.txt", other);
  return read_inp(scratch.put("deck.inp", text));
}

VecX frequencies(const std::string& text, const std::string& other = "") {
  const FeModel m = deck(text, other);
  ReduceOptions o;
  o.method = ReduceMethod::eigenmodes;
  o.modes = 5;
  o.node_count = 2;
  o.held = m.constraints;
  o.stiffening = false;
  return reduce(m, o).report.frequencies;
}

void same(const std::string& a, const std::string& b, const char* what, const std::string& other = "") {
  const VecX found = frequencies(a, other), wanted = frequencies(b);
  EXPECT_LT((found - wanted).cwiseQuotient(wanted).cwiseAbs().maxCoeff(), 1e-7) << what;
}

bool has(const std::vector<std::string>& texts, const std::string& part) {
  return std::any_of(texts.begin(), texts.end(), [&](const std::string& t) { return t.find(part) != std::string::npos; });
}

const std::string steel = "*MATERIAL,NAME=S\n*ELASTIC\n2.1e11,.3\n*DENSITY\n7850\n";

// A beam along x of eight elements and one across at its end.
std::string frame(const std::string& more, const std::string& n1 = "0.,.1,1.", const std::string& hold = "*BOUNDARY\n1,1,6\n") {
  std::string out = "*NODE\n";
  for (int i = 0; i <= 8; ++i) out += fmt::format("{},{},0,0\n", i + 1, 0.125 * i);
  out += "10,1.,.3,0.\n*ELEMENT,TYPE=B31,ELSET=B\n";
  for (int i = 1; i <= 9; ++i) out += fmt::format("{},{},{}\n", i, i, i + 1);
  out += "*ELSET,ELSET=FIRST,GENERATE\n1,8\n";
  return out + steel + "*BEAM SECTION,ELSET=B,MATERIAL=S,SECTION=RECT\n.02,.01\n" + n1 + "\n" + more + hold;
}

// A strip of shells, 6 by 2, its nodes 1 to 21; from row `cut` on, where asked, nodes of their own.
std::string strip(const std::string& section, const std::string& more = "", int cut = 99) {
  std::string out = "*NODE\n";
  for (int i = 0; i <= 6; ++i)
    for (int j = 0; j < 3; ++j) {
      out += fmt::format("{},{},{},0\n", 3 * i + j + 1, 0.1 * i, 0.1 * j);
      if (i == cut) out += fmt::format("{},{},{},0\n", 100 + j, 0.1 * i, 0.1 * j);
    }
  std::string sets[2];
  out += "*ELEMENT,TYPE=S4,ELSET=E\n";
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 2; ++j) {
      const auto node = [&](int row, int at) { return row == cut && i >= cut ? 100 + at : 3 * row + at + 1; };
      out += fmt::format("{},{},{},{},{}\n", 2 * i + j + 1, node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1));
    }
  return out + steel + section + more + "*NSET,NSET=ROOT\n1,2,3\n*BOUNDARY\nROOT,1,6\n";
}

TEST(ReduceWords, BlanksOfDirections) {
  EXPECT_EQ(deck(frame("", "0.,1.")).beam_sections[0].n1, Vec3(0, 1, 0));
  EXPECT_EQ(deck(frame("", "1.,,")).beam_sections[0].n1, Vec3(1, 0, 0));
  // The line of the direction left blank, then the moduli.
  const std::string general =
      "*NODE\n1,0,0,0\n2,1,0,0\n*ELEMENT,TYPE=B31,ELSET=B\n1,1,2\n*BEAM GENERAL SECTION,ELSET=B,DENSITY=7850\n"
      "1e-4,1e-9,0.,2e-9,2e-9\n\n2e11,8e10\n";
  const FeModel m = deck(general);
  EXPECT_EQ(m.beam_sections[0].n1, Vec3(0, 0, -1));
  EXPECT_EQ(m.materials.back().youngs_modulus, 2e11);
}

// A keyword line that ends with a comma goes on in Abaqus, not in CalculiX; comments, blank lines and tabs between words mean nothing.
TEST(ReduceWords, KeywordsOfSeveralLines) {
  const std::string section = "*SHELL SECTION,ELSET=E,MATERIAL=S\n.01\n", plain = strip(section);
  for (const char* between : {"\n", "\n** of steel\n", "\n\n  \n", "\n** a\n\n** b, c\n"})
    same(strip("*SHELL SECTION,ELSET=E," + std::string(between) + "MATERIAL=S\n.01\n"), plain, between);
  same(strip("*SHELL SECTION,\nELSET=E,\n** of steel\nMATERIAL=S\n.01\n"), plain, "three lines");
  same(strip("*SHELL\tSECTION\t,\tELSET\t=\tE,MATERIAL=S\t\n\t.01\n"), plain, "tabs");
  same(strip("*SHELL SECTION,ELSET=E,MATERIAL=S,\n.01\n"), plain, "a comma behind the last parameter, then data");
  const std::string masses = "*ELEMENT,TYPE=MASS,ELSET=P\n100,21\n*MASS,ELSET=P,\n3.\n";
  same(strip(section + masses), strip(section + "*ELEMENT,TYPE=MASS,ELSET=P\n100,21\n*MASS,ELSET=P\n3.\n"), "then a number");
  same(strip(section, "*BOUNDARY,\n** held too\n4,1,6\n"), strip(section, "*BOUNDARY\n4,1,6\n"), "then nodes");
  same(strip(section, "*NSET,NSET=Q,\n19,20\n*BOUNDARY,\nQ,3,3\n"), strip(section, "*BOUNDARY\n19,3,3\n20,3,3\n"), "then a set");
  same(strip(section, "*NSET,NSET=Q,\nGENERATE\n19,21\n*BOUNDARY\nQ,3,3\n"), strip(section, "*BOUNDARY\n19,3,3\n20,3,3\n21,3,3\n"),
       "then a parameter without a value");
  same(strip(section, "*NSET,NSET=Q,\n*NSET,NSET=R\n19\n*BOUNDARY\nR,3,3\n"), strip(section, "*BOUNDARY\n19,3,3\n"), "then a keyword");
}

// Ranges are those of the whole deck, wherever they stand; one that has nothing is told.
TEST(ReduceWords, RangesBeforeWhatTheyName) {
  const std::string section = "*SHELL SECTION,ELSET=E,MATERIAL=S\n.01\n", held = "*BOUNDARY\nQ,3,3\n";
  const std::string plain = strip(section, "*NSET,NSET=Q\n19,20,21\n" + held);
  same("*NSET,NSET=Q,GENERATE\n19,21\n" + strip(section, held), plain, "nodes");
  same("*NSET,NSET=Q,GENERATE\n19,2000000000\n" + strip(section, held), plain, "more than there are");
  same("*ELSET,ELSET=W,GENERATE\n1,12\n" + strip("*SHELL SECTION,ELSET=W,MATERIAL=S\n.01\n"), strip(section), "elements");
  // Of a part that has an instance later, and from outside of it.
  const std::string bar =
      "*PART,NAME=P\n*NSET,NSET=Q,GENERATE\n1,2\n*NODE\n1,0,0,0\n2,0,1,0\n3,1,0,0\n4,1,1,0\n*ELSET,ELSET=E,GENERATE\n1,1\n"
      "*ELEMENT,TYPE=S4\n1,1,3,4,2\n*SHELL SECTION,ELSET=E,MATERIAL=S\n.01\n*END PART\n*ASSEMBLY,NAME=A\n"
      "*NSET,NSET=R,INSTANCE=I,GENERATE\n3,4\n*NSET,NSET=T,GENERATE\n1,4\n*INSTANCE,NAME=I,PART=P\n*END INSTANCE\n*END ASSEMBLY\n" +
      steel;
  const FeModel m = deck(bar + "*BOUNDARY\nI.Q,1,1\n");
  EXPECT_EQ(m.constraints.size(), 2u);
  EXPECT_EQ(deck(bar + "*BOUNDARY\nR,1,1\n").constraints.size(), 2u);
  EXPECT_EQ(deck(bar + "*BOUNDARY\nT,1,1\n").constraints.size(), 4u);
  EXPECT_TRUE(has(deck(strip(section, "*NSET,NSET=Q,GENERATE\n500,510\n" + held)).warnings, "node set 'Q' has no nodes"));
}

TEST(ReduceWords, SetsOfElementsNodes) {
  const std::string hold = "*BOUNDARY\nHELD,3,3\n1,1,6\n", by_numbers = "*NSET,NSET=HELD,GENERATE\n1,9\n";
  same(frame("*NSET,NSET=HELD,ELSET=FIRST\n", "0.,.1,1.", hold), frame(by_numbers, "0.,.1,1.", hold), "ELSET of another name");
  const std::string own = "*BOUNDARY\nFIRST,3,3\n1,1,6\n";
  same(frame("*NSET,NSET=FIRST,ELSET=FIRST\n", "0.,.1,1.", own), frame(by_numbers, "0.,.1,1.", hold), "ELSET of the same name");
}

TEST(ReduceWords, LinesInAnotherFile) {
  same(frame("", "0.,.1,1.", "*BOUNDARY,INPUT=other.txt\n"), frame(""), "*BOUNDARY, INPUT", "1,1,6\n");
  same(frame("*EQUATION,INPUT=other.txt\n"), frame("*EQUATION\n2\n9,3,1.,5,3,-1.\n"), "*EQUATION, INPUT", "2\n9,3,1.,5,3,-1.\n");
  // What is passed over needs no file.
  EXPECT_NO_THROW(deck(frame("*AMPLITUDE,NAME=A,INPUT=nowhere.txt\n")));
}

TEST(ReduceWords, PinnedNodesTurnFreely) {
  const std::string point = "*NODE\n20,.5,.1,.1\n*NSET,NSET=P\n3,6\n*NSET,NSET=T\n9\n";
  const std::string pins = "*KINEMATIC COUPLING,REF NODE=20\n3,1,3\n6,1,3\n";
  same(frame(point + "*RIGID BODY,PIN NSET=P,REF NODE=20\n"), frame(point + pins), "PIN NSET");
  same(frame(point + "*RIGID BODY,PIN NSET=P,TIE NSET=T,REF NODE=20\n"), frame(point + pins + "*RIGID BODY,NSET=T,REF NODE=20\n"),
       "PIN NSET and TIE NSET");
}

TEST(ReduceWords, LayersAndDirections) {
  const std::string cross = "*MATERIAL,NAME=C\n*ELASTIC,TYPE=LAMINA\n1.3e11,1e10,.3,5e9,5e9,3e9\n*DENSITY\n1600\n";
  const std::string head = cross + "*SHELL SECTION,ELSET=E,COMPOSITE";
  same(strip(head + ",SYMMETRIC\n.002,3,C,0.\n.003,3,C,90.\n"), strip(head + "\n.002,3,C,0.\n.003,3,C,90.\n.003,3,C,90.\n.002,3,C,0.\n"),
       "SYMMETRIC");
  const std::string turned = "*SHELL SECTION,ELSET=E,MATERIAL=C,ORIENTATION=O\n.01\n";
  same(strip(cross + "*ORIENTATION,NAME=O\n2.,3.,0.,1.,3.,0.,1.,2.,0.\n" + turned),
       strip(cross + "*ORIENTATION,NAME=O\n1.,1.,0.,0.,1.,0.\n" + turned), "third point");
  const std::string point = "*NODE\n200,.7,.1,0.\n*ORIENTATION,NAME=O\n1.,.5,0.,-.5,1.,0.\n",
                    steel_section = "*SHELL SECTION,ELSET=E,MATERIAL=S\n.01\n";
  const std::string surface = "*SURFACE,NAME=F,TYPE=NODE\nP\n";
  same(strip(steel_section, point + "*KINEMATIC COUPLING,REF NODE=200,ORIENTATION=O\nP,1\n*NSET,NSET=P\n19,20,21\n"),
       strip(steel_section,
             point + surface + "*COUPLING,REF NODE=200,SURFACE=F,ORIENTATION=O,CONSTRAINT NAME=C\n*KINEMATIC\n1\n*NSET,NSET=P\n19,20,21\n"),
       "*KINEMATIC COUPLING, ORIENTATION");
  same(strip(steel_section,
             point + "*SURFACE,NAME=A,TYPE=NODE\nALL\n*NSET,NSET=ALL,GENERATE\n1,21\n*COUPLING,REF NODE=200,SURFACE=A,CONSTRAINT "
                     "NAME=C,INFLUENCE RADIUS=.15\n*KINEMATIC\n1,6\n"),
       strip(steel_section,
             point + "*NSET,NSET=P\n19,20,21\n" + surface + "*COUPLING,REF NODE=200,SURFACE=F,CONSTRAINT NAME=C\n*KINEMATIC\n1,6\n"),
       "INFLUENCE RADIUS");
}

TEST(ReduceWords, TiedShellsTurnTogether) {
  const std::string section = "*SHELL SECTION,ELSET=E,MATERIAL=S\n.01\n";
  const std::string tie =
      "*SURFACE,NAME=SLAVE,TYPE=NODE\nC\n*NSET,NSET=C\n100,101,102\n*SURFACE,NAME=MASTER\n5,SPOS\n6,SPOS\n*TIE,NAME=T{}\nSLAVE,MASTER\n";
  same(strip(section, fmt::format(fmt::runtime(tie), ""), 3), strip(section), "*TIE");
  const std::string edges = "*SURFACE,NAME=SLAVE\n7,E4\n8,E4\n*SURFACE,NAME=MASTER\n5,E2\n6,E2\n*TIE,NAME=T\nSLAVE,MASTER\n";
  same(strip(section, edges, 3), strip(section), "*TIE of edges");
  // On a hinge the second half swings freely: no frequency, though all are held from the first half's root.
  try {
    frequencies(strip(section, fmt::format(fmt::runtime(tie), ",NO ROTATION"), 3));
    ADD_FAILURE() << "a mechanism was reduced";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("mechanism"), std::string::npos) << e.what();
  }
}

TEST(ReduceWords, WhatIsNotReadIsTold) {
  const std::string section = "*SHELL SECTION,ELSET=E,MATERIAL=S{}\n.01\n";
  EXPECT_TRUE(has(deck(strip(fmt::format(fmt::runtime(section), ",DENSITY=80."))).warnings, "*SHELL SECTION, DENSITY is not known"));
  EXPECT_TRUE(has(deck(strip(fmt::format(fmt::runtime(section), ",SHELL THICKNESS=D"))).warnings, "SHELLTHICKNESS"));
  EXPECT_TRUE(has(deck(frame("*TRANSVERSE SHEAR STIFFNESS\n1e7,1e7\n")).warnings, "*TRANSVERSE SHEAR STIFFNESS is not known"));
  EXPECT_TRUE(deck(strip(fmt::format(fmt::runtime(section), ",SECTION INTEGRATION=GAUSS,POISSON=.3"))).warnings.empty());
  const auto refused = [](const std::string& text) {
    try {
      deck(text);
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const std::string mass = "*ELEMENT,TYPE=MASS,ELSET=M\n90,9\n*MASS,ELSET={}\n1.,2.,3.\n";
  EXPECT_NE(refused(frame(fmt::format(fmt::runtime(mass), "M,TYPE=ANISOTROPIC"))).find("*MASS, TYPE=ANISOTROPIC"), std::string::npos);
  EXPECT_NE(refused(frame(fmt::format(fmt::runtime(mass), "B"))).find("*MASS for element 1, a beam"), std::string::npos);
  EXPECT_NE(refused(frame("*ORIENTATION,NAME=O,DEFINITION=NODES\n1,2,3\n")).find("DEFINITION=NODES"), std::string::npos);
}

// A free body takes its springs to the ground along in a scene; between its own nodes they are its own.
TEST(ReduceWords, SpringsToTheGroundAreTold) {
  const auto warned = [](const std::string& spring) {
    ReduceOptions o;
    o.method = ReduceMethod::eigenmodes;
    o.modes = 3;
    o.stiffening = false;
    return has(reduce(deck(frame(spring, "0.,.1,1.", "")), o).report.warnings, "springs to the ground");
  };
  EXPECT_TRUE(warned("*ELEMENT,TYPE=SPRING1,ELSET=K\n90,1\n91,9\n*SPRING,ELSET=K\n3\n1e3\n"));
  EXPECT_FALSE(warned("*ELEMENT,TYPE=SPRINGA,ELSET=K\n90,1,10\n*SPRING,ELSET=K\n\n1e3\n"));
}

// A ratio of the free body's modes is none of the welded one's: 0.0014 of 0.02 is left to the lowest mode of a slender cantilever, as
// `flexframe check` finds it in a scene. Held in the deck it has what was asked for.
TEST(ReduceWords, DampingOfFreeBodiesIsTold) {
  const auto warned = [](const std::string& hold) {
    const FeModel m = deck(frame("", "0.,.1,1.", hold));
    ReduceOptions o;
    o.interfaces = {{8, -1, "corner"}};
    if (hold.empty()) o.interfaces.insert(o.interfaces.begin(), {0, -1, "root"});
    o.modes = 4;
    o.held = m.constraints;
    o.stiffening = false;
    o.damping = 0.02;
    return has(reduce(m, o).report.warnings, "damping: the ratio 0.02 is that of the free body's modes; welded at 'root'");
  };
  EXPECT_TRUE(warned(""));
  EXPECT_FALSE(warned("*BOUNDARY\n1,1,6\n"));
}

}  // namespace
}  // namespace flexframe::sim::test_reduce_words
