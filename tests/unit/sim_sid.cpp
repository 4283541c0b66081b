// SID files: reading real ones, writing, layouts, identities, damaged copies.
#include "sim/base/eigen_solvers.h"
#include "sim/base/error.h"
#include "sim/bodies/body_file.h"
#include "sim/bodies/sid.h"
#include "sim/bodies/sid_judge.h"
#include "tests/fuzz/damage.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <random>

namespace flexframe::sim::test_sid {
namespace {

namespace fs = std::filesystem;

const fs::path folder = fs::path(FLEXFRAME_SOURCE_DIR) / "tests/unit/data/sid";

// One file a dialect; data/sid/make_sids.py computes them from the definitions of the blocks and writes the sums to truth.txt.
enum Sample { blocked, lumped, tabs, reduced, stiffened, swapped };
const std::array<std::string, 6> names{"blocked", "lumped", "tabs", "reduced", "stiffened", "swapped"};
std::vector<fs::path> samples() {
  std::vector<fs::path> found;
  for (const std::string& name : names) {
    found.push_back(folder / (name + ".SID_FEM"));
    if (!fs::exists(found.back())) throw std::runtime_error(found.back().string() + " is missing");
  }
  return found;
}

std::string text_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(Sid, SamplesAreReadWrittenAndReadAgainWithoutLoss) {
  for (const fs::path& path : samples()) {
    const SidFile first = read_sid(path).file;
    const SidFile second = read_sid_text(write_sid_text(first), "again").file;
    EXPECT_TRUE(first == second) << path;
    EXPECT_EQ(write_sid_text(first), write_sid_text(second)) << path;
    size_t entries = 0, in_file = 0;
    for (const auto* b :
         {&first.mdCM, &first.J, &first.Ct, &first.Cr, &first.Me, &first.Gr, &first.Ge, &first.Oe, &first.ksigma, &first.Ke, &first.De})
      entries += (*b)->entries.size();
    for (const SidNode& node : first.nodes)
      for (const auto* b : {&node.origin, &node.phi, &node.psi, &node.AP, &node.sigma}) entries += *b ? (*b)->entries.size() : 0;
    for (const SidText& other : first.others)
      entries += static_cast<size_t>(
          std::ranges::count_if(other.lines, [](const std::string& line) { return line.find("m0(") != std::string::npos; }));
    const std::string text = text_of(path);
    for (size_t at = 0; (at = text.find('\n', at)) != std::string::npos; ++at) {
      const size_t word = text.find_first_not_of(" \t", at + 1);
      in_file += word != std::string::npos && (text.compare(word, 3, "m0(") == 0 || text.compare(word, 3, "m1(") == 0);
    }
    // Of a J written 3 x 3 six entries are kept; ItsBlocksAreThoseOfTheDefinition compares what they say.
    if (path != samples()[swapped]) {
      EXPECT_EQ(entries, in_file) << path;
    }
    EXPECT_GT(entries, 20u) << path;
  }
}

TEST(Sid, IdentitiesHoldInTheSamplesAndLayoutsAreFound) {
  const auto files = samples();
  for (const fs::path& path : files)
    for (const SidCheck& check : check_sid(read_sid(path).file)) EXPECT_LT(check.residual, 1e-6) << path << check.identity;
  const std::map<Sample, std::pair<SidLayout, SidLayout>> layouts{
      {blocked, {SidLayout::blocked, SidLayout::interleaved}},       {lumped, {SidLayout::either, SidLayout::either}},
      {tabs, {SidLayout::interleaved, SidLayout::interleaved}},      {reduced, {SidLayout::interleaved, SidLayout::interleaved}},
      {stiffened, {SidLayout::interleaved, SidLayout::interleaved}}, {swapped, {SidLayout::blocked, SidLayout::blocked}}};
  for (const auto& [sample, wanted] : layouts) {
    const SidReading reading = read_sid(files[sample]);
    EXPECT_EQ(reading.Gr, wanted.first) << names[sample];
    EXPECT_EQ(reading.Ge, wanted.second) << names[sample];
  }
}

// A line of truth.txt: file, block, rows, columns, numbers by columns.
std::map<std::string, MatX> truth_of(const std::string& sample) {
  std::ifstream in(folder / "truth.txt");
  std::map<std::string, MatX> blocks;
  std::string file, block;
  Eigen::Index rows = 0, columns = 0;
  while (in >> file >> block >> rows >> columns) {
    MatX m(rows, columns);
    for (double& v : m.reshaped()) in >> v;
    if (file == sample) blocks[block] = m;
  }
  if (blocks.empty()) throw std::runtime_error("truth.txt says nothing of " + sample);
  return blocks;
}

// Blocks that are not there: what identities give is the body's, what they do not is told, and so is where and how nodes lie and turn.
TEST(Sid, BlocksThatAreMissingAreMadeOrTold) {
  for (const Sample sample : {blocked, reduced, stiffened}) {
    const SidFile whole = read_sid(samples()[sample]).file;
    const FlexibleBody body = to_flexible_body(whole, names[sample]);
    const auto lacks_without = [&](const auto& take_out) {
      SidFile file = whole;
      take_out(file);
      SidLacks lacks;
      to_flexible_body(file, names[sample], nullptr, &lacks);
      return lacks;
    };
    EXPECT_TRUE(lacks_without([](SidFile&) {}).all.empty()) << names[sample];
    SidFile without_cr = whole;
    without_cr.Cr.reset();
    const double scale = std::max(body.Cr0.cwiseAbs().maxCoeff(), body.J1.cwiseAbs().maxCoeff());
    EXPECT_LE((to_flexible_body(without_cr, names[sample]).Cr0 - body.Cr0).cwiseAbs().maxCoeff(), 1e-10 * scale) << names[sample];
    const auto told = [&](const SidLacks& lacks, const char* part) {
      EXPECT_EQ(lacks.all.size(), 1u) << names[sample] << part;
      EXPECT_NE(lacks.all.empty() ? std::string::npos : lacks.all.front().find(part), std::string::npos) << names[sample] << part;
    };
    const auto zero_order = [](std::optional<SidTaylor>& block) {
      block->order = 0;
      std::erase_if(block->entries, [](const SidEntry& e) { return e.mode > 0; });
    };
    EXPECT_TRUE(lacks_without([](SidFile& f) { f.Ct.reset(); }).all.empty());
    told(lacks_without([&](SidFile& f) {
           f.Ct.reset();
           zero_order(f.mdCM);
         }),
         "weight do not deform");
    const SidLacks turning = lacks_without([](SidFile& f) {
      f.Cr.reset();
      f.Gr.reset();
    });
    told(turning, "angular accelerations");
    told(lacks_without([&](SidFile& f) {
           f.Oe.reset();
           zero_order(f.J);
         }),
         "centrifugal");
    told(lacks_without([&](SidFile& f) {
           f.Ge.reset();
           zero_order(f.Cr);
         }),
         "Coriolis");
    told(lacks_without([](SidFile& f) { f.nodes.front().origin.reset(); }), "1 of");
    const auto follow = [](std::optional<SidTaylor>& block, double value) {
      block->order = 1;
      block->entries.push_back({1, 1, 1, value});
    };
    told(lacks_without([&](SidFile& f) { follow(f.Ke, 1.0); }), "Ke.M1");
    told(lacks_without([&](SidFile& f) { follow(f.Me, 1.0); }), "Me.M1");
    EXPECT_TRUE(lacks_without([&](SidFile& f) { follow(f.Ke, 0.0); }).all.empty());
    SidFile preloaded = whole;
    preloaded.ksigma = make_sid_block(MatX::Zero(body.n, 1), {}, body.n);
    follow(preloaded.ksigma, 7.0);
    MatX softened = body.Ke;
    softened(0, 0) += 7.0;
    EXPECT_EQ(to_flexible_body(preloaded, names[sample]).Ke, softened) << names[sample];
    const SidLacks unturned = lacks_without([&](SidFile& f) {
      f.nodes.back().psi.reset();
      zero_order(f.nodes.back().AP);
    });
    EXPECT_TRUE(unturned.all.empty());
    EXPECT_EQ(unturned.unturned, std::vector<std::string>{body.nodes.back().name}) << names[sample];
  }
}

// Every block of every dialect against sums over particles that the reader had no part in. Printed digits: 12 (stiffened 15), so 1e-11 of
// the largest entry.
TEST(Sid, ItsBlocksAreThoseOfTheDefinition) {
  for (size_t i = 0; i < names.size(); ++i) {
    const FlexibleBody body = to_flexible_body(read_sid(samples()[i]).file, names[i]);
    const std::map<std::string, MatX> all = truth_of(names[i]);
    std::map<std::string, MatX> blocks = all;
    // What a number is measured against: the largest of its block, all axes of a tensor together.
    const auto scale_of = [&](const std::string& block) {
      const bool tensor = block.starts_with("J2_") || block.starts_with("Cr1_") || block.starts_with("md2_");
      double scale = 0.0;
      for (const auto& [name, m] : all)
        if (name == block || (tensor && name.starts_with(block.substr(0, 3)))) scale = std::max(scale, m.cwiseAbs().maxCoeff());
      return scale;
    };
    const auto same = [&](const std::string& block, const MatX& found) {
      ASSERT_TRUE(blocks.contains(block)) << block;
      const MatX wanted = blocks.at(block);
      blocks.erase(block);
      const double scale = scale_of(block);
      if (found.size() == 0) {
        EXPECT_LE(wanted.cwiseAbs().maxCoeff(), 1e-11 * scale) << names[i] << " " << block;
        return;
      }
      ASSERT_EQ(found.rows(), wanted.rows()) << names[i] << " " << block;
      ASSERT_EQ(found.cols(), wanted.cols()) << names[i] << " " << block;
      EXPECT_LE((found - wanted).cwiseAbs().maxCoeff(), 1e-11 * scale) << names[i] << " " << block;
    };
    same("mass", MatX::Constant(1, 1, body.mass));
    same("md0", body.md0);
    same("md1", body.md1);
    same("J0", body.J0);
    same("J1", body.J1);
    same("Cr0", body.Cr0);
    for (size_t a = 0; a < 6; ++a) same(fmt::format("J2_{}", a), body.J2[a]);
    for (size_t a = 0; a < 3; ++a) {
      same(fmt::format("Cr1_{}", a), body.Cr1[a]);
      if (i == stiffened) same(fmt::format("md2_{}", a), body.md2[a]);
    }
    same("Me", body.Me);
    same("Ke", body.Ke);
    same("De", body.De);
    same("ksigma", body.ksigma);
    VecX squares = GeneralizedEigen(body.Ke, body.Me).eigenvalues();
    same("frequencies", squares.cwiseSqrt() / (2.0 * std::numbers::pi));
    for (size_t k = 0; k < body.nodes.size(); ++k) {
      const FlexibleNode& node = body.nodes[k];
      const std::string name = fmt::format("node{}_", k);
      same(name + "origin", node.origin);
      same(name + "phi", node.phi);
      same(name + "psi", node.psi);
      same(name + "rotation", node.rotation);
      if (i == stiffened) {
        for (size_t a = 0; a < 3; ++a) same(fmt::format("{}phi2_{}", name, a), node.phi2[a]);
        same(name + "sigma", node.sigma);
      }
    }
    EXPECT_TRUE(blocks.empty()) << names[i] << ": nobody compared " << blocks.begin()->first;
  }
}

// Numbers that fit neither layout: what is written is read again as it was, however often.
TEST(Sid, LayoutThatNothingDecidesStays) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  int neither = 0;
  for (const fs::path& path : samples()) {
    SidFile file = read_sid(path).file;
    for (int k = 0; k < 200; ++k) {
      for (SidTaylor* block : {&*file.Gr, &*file.Ge})
        for (SidEntry& e : block->entries) e.value = normal(random);
      const SidReading first = read_sid_text(write_sid_text(file), "first");
      EXPECT_TRUE(first.file == read_sid_text(write_sid_text(first.file), "again").file) << path << " " << k;
      for (const std::string& note : first.notes) neither += note.find("neither fits") != std::string::npos;
    }
  }
  EXPECT_GT(neither, 0);
}

// Masses that are heavier than what the modes weigh contradict a free body; the other samples do not.
TEST(Sid, MassThatNoFreeBodyHasIsNoted) {
  const auto files = samples();
  for (size_t i = 0; i < files.size(); ++i) {
    std::vector<std::string> notes;
    to_flexible_body(read_sid(files[i]).file, files[i].string(), &notes);
    const bool said =
        std::any_of(notes.begin(), notes.end(), [](const std::string& n) { return n.find("contradict") != std::string::npos; });
    EXPECT_EQ(said, i == lumped) << files[i];
  }
}

// Closed theory: a steel beam of 2.5 m x 0.08 m x 0.2 m on supports; Rayleigh's frequency of its first mode, the mass of a box, the last
// node at its root.
TEST(Sid, BodyOfABeamOnSupports) {
  const SidReading reading = read_sid(samples()[blocked]);
  const FlexibleBody body = to_flexible_body(reading.file, "beam");
  EXPECT_EQ(body.n, 4);
  EXPECT_EQ(body.nodes.size(), 21u);
  EXPECT_NEAR(body.mass, 7850.0 * 2.5 * 0.08 * 0.2, 1e-9);
  EXPECT_EQ(body.nodes[0].name, "node[1000]");
  EXPECT_NEAR(body.nodes[0].origin.x(), 2.5, 1e-11);
  const double a = std::numbers::pi / 2.5, I = 0.2 * std::pow(0.08, 3) / 12.0, A = 0.08 * 0.2;
  const double first = std::sqrt(2.1e11 * I * std::pow(a, 4) / (7850.0 * (A + I * a * a))) / (2.0 * std::numbers::pi);
  EXPECT_NEAR(std::sqrt(body.Ke(0, 0) / body.Me(0, 0)) / (2.0 * std::numbers::pi), first, 1e-9 * first);
  EXPECT_NEAR(body.J2[0](0, 0), -2.0 * sid_m1(*reading.file.Oe, 1)(0, 0), 1e-15);
  EXPECT_NEAR(body.Cr1[2](1, 0), sid_m1(*reading.file.Cr, 1)(1, 2), 1e-15);
}

FlexibleBody random_body(int n, bool stiffening) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const auto fill = [&](auto& m) {
    for (int i = 0; i < m.size(); ++i) m.data()[i] = u(random);
  };
  const auto symmetric = [&](MatX& m) {
    m.resize(n, n);
    fill(m);
    m = (m + m.transpose()).eval();
  };
  FlexibleBody b;
  b.n = n;
  b.mass = 2.5;
  fill(b.md0);
  b.md1.resize(3, n);
  fill(b.md1);
  b.J0 << 5, 6, 7, .1, .2, -.3;
  b.J1.resize(6, n);
  fill(b.J1);
  for (MatX& m : b.J2) symmetric(m);
  b.Cr0.resize(3, n);
  fill(b.Cr0);
  for (MatX& m : b.Cr1) {
    m.resize(n, n);
    fill(m);
    if (!stiffening) m = (m - m.transpose()).eval();
  }
  if (stiffening)
    for (MatX& m : b.md2) symmetric(m);
  symmetric(b.Me);
  b.Me += 4.0 * n * MatX::Identity(n, n);
  symmetric(b.Ke);
  b.Ke += 9.0 * n * MatX::Identity(n, n);
  b.De.resize(n, n);
  fill(b.De);
  b.ksigma.resize(n);
  fill(b.ksigma);
  for (int k = 0; k < n; ++k) b.labels.push_back(fmt::format("mode {}", k + 1));
  for (int i = 0; i < 3; ++i) {
    FlexibleNode node;
    node.name = i == 2 ? std::string("tip") : fmt::format("node[{}]", 100 + i);
    fill(node.origin);
    node.rotation = Quat(1.0, 0.2 * i, -0.1, 0.3).normalized().toRotationMatrix();
    node.phi.resize(3, n);
    fill(node.phi);
    node.psi.resize(3, n);
    fill(node.psi);
    if (stiffening) {
      for (MatX& m : node.phi2) symmetric(m);
      for (MatX& m : node.psi2) symmetric(m);
    }
    node.sigma.resize(6, n);
    fill(node.sigma);
    b.nodes.push_back(std::move(node));
  }
  return b;
}

void expect_same(const FlexibleBody& a, const FlexibleBody& b) {
  const auto same = [](const auto& x, const auto& y, const char* what) {
    ASSERT_EQ(x.rows(), y.rows()) << what;
    ASSERT_EQ(x.cols(), y.cols()) << what;
    if (x.size() > 0) {
      EXPECT_LT((x - y).cwiseAbs().maxCoeff(), 1e-14 * (1.0 + x.cwiseAbs().maxCoeff())) << what;
    }
  };
  EXPECT_EQ(a.n, b.n);
  EXPECT_EQ(a.mass, b.mass);
  same(a.md0, b.md0, "md0");
  same(a.md1, b.md1, "md1");
  same(a.J0, b.J0, "J0");
  same(a.J1, b.J1, "J1");
  same(a.Cr0, b.Cr0, "Cr0");
  for (int i = 0; i < 3; ++i) {
    same(a.md2[i], b.md2[i], "md2");
    same(a.Cr1[i], b.Cr1[i], "Cr1");
  }
  for (int i = 0; i < 6; ++i) same(a.J2[i], b.J2[i], "J2");
  same(a.Me, b.Me, "Me");
  same(a.Ke, b.Ke, "Ke");
  same(a.De, b.De, "De");
  same(a.ksigma, b.ksigma, "ksigma");
  EXPECT_EQ(a.labels, b.labels);
  ASSERT_EQ(a.nodes.size(), b.nodes.size());
  for (size_t i = 0; i < a.nodes.size(); ++i) {
    EXPECT_EQ(a.nodes[i].name, b.nodes[i].name);
    same(a.nodes[i].origin, b.nodes[i].origin, "origin");
    same(a.nodes[i].rotation, b.nodes[i].rotation, "rotation");
    same(a.nodes[i].phi, b.nodes[i].phi, "phi");
    same(a.nodes[i].psi, b.nodes[i].psi, "psi");
    same(a.nodes[i].sigma, b.nodes[i].sigma, "sigma");
    for (int k = 0; k < 3; ++k) same(a.nodes[i].phi2[k], b.nodes[i].phi2[k], "phi2");
    for (int k = 0; k < 3; ++k) same(a.nodes[i].psi2[k], b.nodes[i].psi2[k], "psi2");
  }
}

TEST(Sid, BodyToFileAndBackKeepsEveryTerm) {
  for (int n : {2, 3, 5})
    for (bool stiffening : {false, true}) {
      const FlexibleBody body = random_body(n, stiffening);
      const SidFile file = from_flexible_body(body, "random");
      for (const SidCheck& check : check_sid(file)) EXPECT_LT(check.residual, 1e-13) << check.identity;
      const SidReading again = read_sid_text(write_sid_text(file), "random");
      EXPECT_TRUE(again.file == file);
      expect_same(body, to_flexible_body(again.file, "random"));
    }
}

// A foreign dialect of the same body: other index order, blocked Gr and Ge, 3 x 3 J, mCM and mmi, Fortran exponents, no blanks.
TEST(Sid, DialectsGiveTheSameBody) {
  const int n = 3;
  const FlexibleBody body = random_body(n, true);
  SidFile file = from_flexible_body(body, "dialect");
  for (SidTaylor* t : {&*file.Gr, &*file.Ge})
    for (SidEntry& e : t->entries) e.column = 3 * ((e.column - 1) % n) + (e.column - 1) / n + 1;
  {
    SidTaylor J = *file.J;
    static constexpr int place[6][2] = {{1, 1}, {2, 2}, {3, 3}, {1, 2}, {1, 3}, {2, 3}};
    J.rows = J.columns = 3;
    J.entries.clear();
    for (const SidEntry& e : file.J->entries) {
      J.entries.push_back({place[e.row - 1][0], e.mode, place[e.row - 1][1], e.value});
      if (e.row > 3) J.entries.push_back({place[e.row - 1][1], e.mode, place[e.row - 1][0], e.value});
    }
    file.J = J;
  }
  std::string text = write_sid_text(file), out;
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = text.find('\n', begin);
    std::string line = text.substr(begin, end - begin);
    begin = end + 1;
    if (const size_t at = line.find("m1("); at != std::string::npos) {
      int r = 0, k = 0, c = 0;
      ASSERT_EQ(std::sscanf(line.c_str() + at, "m1(%d,%d,%d)", &r, &k, &c), 3);
      std::string value = line.substr(line.find('=') + 1);
      for (char& ch : value)
        if (ch == 'E') ch = 'D';
      line = fmt::format("\tm1({},{},{})={}  ", r, c, k, value);
    }
    if (line.find("mdCM") != std::string::npos) line.replace(line.find("mdCM"), 4, "mCM");
    if (line == "           J" || line == "           end J") line.replace(line.size() - 1, 1, "mmi");
    if (line.find("new modal") != std::string::npos) line = " New Modal";
    out += line + "\r\n";
  }
  const SidReading reading = read_sid_text(out, "dialect");
  EXPECT_EQ(reading.Gr, SidLayout::blocked);
  EXPECT_EQ(reading.Ge, SidLayout::blocked);
  expect_same(body, to_flexible_body(reading.file, "dialect"));
}

TEST(Sid, MissingBlocksAreTakenFromTheIdentities) {
  const FlexibleBody body = random_body(4, false);
  SidFile file = from_flexible_body(body, "");
  file.Ct.reset();
  std::erase_if(file.Cr->entries, [](const SidEntry& e) { return e.mode > 0; });
  std::erase_if(file.J->entries, [](const SidEntry& e) { return e.mode > 0; });
  for (SidNode& node : file.nodes) {
    node.psi.reset();
    node.phi.reset();
  }
  std::vector<std::string> notes;
  expect_same(body, to_flexible_body(read_sid_text(write_sid_text(file), "partial").file, "partial", &notes));
  EXPECT_GE(notes.size(), 4u);
}

TEST(Sid, UnknownBlocksAreKept) {
  std::string text = write_sid_text(from_flexible_body(random_body(2, false), ""));
  text.insert(text.find("      end modal"),
              "           K0omega\n              m0(1,1) = 3.0\n              whatever\n           end K0omega\n");
  text.insert(text.find("           end refmod"), "                author = somebody\n");
  const SidReading reading = read_sid_text(text, "unknown");
  ASSERT_EQ(reading.file.others.size(), 1u);
  EXPECT_EQ(reading.file.others[0].lines.size(), 4u);
  EXPECT_TRUE(read_sid_text(write_sid_text(reading.file), "again").file == reading.file);
}

// Frequencies, centre and inertia of a beam in closed form, and one sentence for each thing that is made wrong.
TEST(Sid, WhatContradictsItselfIsNamed) {
  FlexibleBody body;
  body.n = 2;
  body.mass = 2.0;
  body.md0 = Vec3(1.0, 0.0, 0.0);
  body.J0 << 0.1, 0.9, 0.85, 0.0, 0.0, 0.0;  // about the origin: 0.5 m from the centre
  body.Me = Eigen::Vector2d(1.0, 4.0).asDiagonal();
  body.Ke = Eigen::Vector2d(100.0, 1600.0).asDiagonal();
  body.md1 = body.Cr0 = Mat3X::Zero(3, 2);
  body.J1 = Mat6X::Zero(6, 2);
  for (MatX& m : body.J2) m = MatX::Zero(2, 2);
  for (MatX& m : body.Cr1) m = MatX::Zero(2, 2);
  body.labels = {"Eigen Mode 1 : 1.5915494 Hz", "Eigen Mode 2 : 3.1830989 Hz"};
  const SidFile good = from_flexible_body(body, "beam");
  const SidJudgement right = judge_sid(good);
  EXPECT_TRUE(right.contradicted.empty()) << right.contradicted.front();
  EXPECT_NEAR(right.frequencies(0), 10.0 / (2 * std::numbers::pi), 1e-12);
  EXPECT_NEAR(right.frequencies(1), 20.0 / (2 * std::numbers::pi), 1e-12);
  EXPECT_NEAR((right.centre - Vec3(0.5, 0, 0)).norm(), 0.0, 1e-15);
  EXPECT_NEAR((right.moments - Vec3(0.1, 0.35, 0.4)).norm(), 0.0, 1e-12);
  const auto faults = [&](auto&& change) {
    FlexibleBody other = body;
    change(other);
    std::string all;
    for (const std::string& text : judge_sid(from_flexible_body(other, "beam")).contradicted) all += text + "\n";
    return all;
  };
  EXPECT_NE(faults([](FlexibleBody& b) { b.J0(0) = 0.9; }).find("no mass has these moments"), std::string::npos);
  EXPECT_NE(faults([](FlexibleBody& b) { b.Me(1, 1) = -1.0; }).find("Me is not positive definite"), std::string::npos);
  EXPECT_NE(faults([](FlexibleBody& b) { b.Ke(0, 0) = -5.0; }).find("Ke is not positive"), std::string::npos);
  EXPECT_NE(faults([](FlexibleBody& b) { b.Ke(0, 0) = 0.0; }).find("1 modes have no stiffness"), std::string::npos);
  EXPECT_NE(faults([](FlexibleBody& b) { b.labels[1] = "Eigen Mode 2 : 5 Hz"; }).find("1 of 2 labels"), std::string::npos);
  EXPECT_NE(faults([](FlexibleBody& b) { b.md1(0, 0) = 100.0; }).find("contradict each other"), std::string::npos);
}

std::string message(const std::string& text) {
  try {
    to_flexible_body(read_sid_text(text, "f.sid").file, "f.sid");
  } catch (const InputError& e) {
    return e.what();
  }
  return "accepted";
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

// Rows without columns were read as a matrix of that many rows, and its columns from beyond its end.
TEST(Sid, BlocksWithoutColumnsAreEmpty) {
  for (std::optional<SidTaylor> SidFile::*block : {&SidFile::Me, &SidFile::Ke, &SidFile::mdCM}) {
    SidFile file = from_flexible_body(random_body(2, false), "x");
    (file.*block)->columns = 0;
    (file.*block)->entries.clear();
    const std::string said = message(write_sid_text(file));
    if (block == &SidFile::mdCM) EXPECT_EQ(said, "accepted");
    else EXPECT_NE(said.find(block == &SidFile::Me ? "block Me is empty" : "block Ke is empty"), std::string::npos) << said;
  }
}

// "symmetric" of a column was mirrored into the columns beyond it.
TEST(Sid, ColumnsAreNotSymmetric) {
  const FlexibleBody body = random_body(2, false);
  SidFile file = from_flexible_body(body, "x");
  file.J->structure = 2;
  const SidReading reading = read_sid_text(write_sid_text(file), "symmetric");
  EXPECT_EQ(reading.file.J->structure, 3);
  expect_same(body, to_flexible_body(reading.file, "symmetric"));
}

TEST(Sid, ErrorsNameLineAndReason) {
  const std::string good = write_sid_text(from_flexible_body(random_body(2, false), "x"));
  EXPECT_EQ(message(good), "accepted");
  EXPECT_NE(message("").find("f.sid:1: the file ends"), std::string::npos) << message("");
  EXPECT_NE(message("solid cube").find("f.sid:1: no SID file"), std::string::npos);
  EXPECT_NE(message(good.substr(0, good.size() / 2)).find("cut short"), std::string::npos);
  EXPECT_NE(message(replaced(good, "m0(  1,  1)            =", "m0(  7,  1)            =")).find("outside of block"), std::string::npos);
  EXPECT_NE(message(replaced(good, "m0(  1,  1)            =", "m0(  1,  1)            =nan ")).find("finite number"), std::string::npos);
  EXPECT_NE(message(replaced(good, "nelastq               = 2", "nelastq               = 2000000000")).find("nelastq"), std::string::npos);
  EXPECT_NE(message(replaced(good, "    3    2    :", "    4    2    :")).find("announces 4 nodes"), std::string::npos);
  EXPECT_NE(message(replaced(good, "           end frame", "")).find("f.sid:"), std::string::npos);
  EXPECT_NE(message(replaced(good, "mass                  = ", "mass                  = -")).find("mass"), std::string::npos);
}

std::string replaced_all(std::string text, const std::string& what, const std::string& by) {
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size())) text.replace(at, what.size(), by);
  return text;
}

// First lines without counts or without colon, none at all, and nodes written as 'new frame' give the body of the plain file.
TEST(Sid, WithoutCountsAndWithNewFrame) {
  const FlexibleBody body = random_body(2, true);
  const std::string good = write_sid_text(from_flexible_body(body, "x"));
  const std::string after = good.substr(good.find('\n') + 1);
  const std::string frames = replaced_all(replaced_all(good, "new node", "new frame"), "end node", "end frame");
  std::string bare = replaced(frames, "           frame\n", "");
  bare.erase(bare.rfind("           end frame\n"), std::string("           end frame\n").size());
  const std::map<std::string, std::string> texts = {{"no first line", after},
                                                    {"title", "A crank\nmade by hand\n" + after},
                                                    {"no colon", "3 2 three nodes, two modes\n" + after},
                                                    {"new frame", frames},
                                                    {"new frame without frame", bare}};
  for (const auto& [name, text] : texts) {
    const SidReading reading = read_sid_text(text, name);
    expect_same(body, to_flexible_body(reading.file, name));
    EXPECT_EQ(reading.file.nodes.size(), body.nodes.size()) << name;
    const bool told = std::any_of(reading.dialect.begin(), reading.dialect.end(), [](const auto& d) { return d.starts_with("dialect"); });
    EXPECT_EQ(told, name != "no colon") << name;
    EXPECT_TRUE(read_sid_text(write_sid_text(reading.file), "again").file == reading.file) << name;
  }
  EXPECT_EQ(read_sid_text(texts.at("title"), "title").file.comment, "A crank");
  EXPECT_NE(message("4 2 : x\n" + after).find("announces 4 nodes"), std::string::npos);
  EXPECT_NE(message(replaced(frames, "new frame", "new node")).find("'end node' is expected"), std::string::npos);
}

// Shapes beyond those of a body, of any motion.
FurtherShapes further_of(const FlexibleBody& body, Eigen::Index count) {
  FurtherShapes s;
  s.stiffness = VecX::Random(count).cwiseAbs() + VecX::Ones(count);
  s.coupling = 0.1 * MatX::Random(body.n, count);
  s.md = Mat3X::Random(3, count);
  s.Cr = Mat3X::Random(3, count);
  s.J = Mat6X::Random(6, count);
  s.motion = MatX::Random(6 * std::ssize(body.nodes), count);
  return s;
}

// Further shapes stand behind the end of the part, where other programs stop, and are read bit by bit; files without them stay as they
// were.
TEST(Sid, FurtherShapesBehindTheEnd) {
  const FlexibleBody body = random_body(3, true);
  const std::string without = write_sid_text(from_flexible_body(body, "random"));
  SidFile file = from_flexible_body(body, "random");
  file.further = further_of(body, 4);
  const std::string with = write_sid_text(file);
  EXPECT_TRUE(with.starts_with(without));
  const SidReading reading = read_sid_text(with, "further");
  EXPECT_TRUE(reading.file.further == file.further);
  EXPECT_EQ(read_sid_text(without, "bare").file.further.count(), 0);
  EXPECT_EQ(write_sid_text(reading.file), with);
  EXPECT_NE(message(replaced(with, "further shapes = 4", "further shapes = 5")).find("5 numbers are expected"), std::string::npos);
  EXPECT_NE(message(replaced(with, "mass in common", "mass")).find("'mass in common' is expected"), std::string::npos);
  EXPECT_NE(message(with.substr(0, with.size() - 40)).find("is expected"), std::string::npos);
  // A body takes some of them beside its own.
  FlexibleBody richer = body;
  add_shapes(some_of(file.further, {2, 0}), richer);
  EXPECT_EQ(richer.n, 5);
  EXPECT_TRUE(richer.Ke(3, 3) == file.further.stiffness(2) && richer.Ke.topLeftCorner(3, 3) == body.Ke);
  EXPECT_TRUE(richer.Me.block(0, 4, 3, 1) == file.further.coupling.col(0) &&
              richer.nodes[1].phi.col(3) == file.further.motion.block(6, 2, 3, 1));
  EXPECT_TRUE(richer.nodes[1].phi2[0].rows() == 5 && richer.nodes[1].phi2[0].topLeftCorner(3, 3) == body.nodes[1].phi2[0]);
}

// Random damage. Either an InputError or a body with finite numbers.
TEST(Sid, ThousandDamagedCopies) {
  std::mt19937 random(20061004);
  std::vector<std::string> texts;
  for (const fs::path& path : samples()) texts.push_back(text_of(path));
  texts.push_back(write_sid_text(from_flexible_body(random_body(3, true), "random")));
  SidFile more = from_flexible_body(random_body(3, false), "more");
  more.further = further_of(random_body(3, false), 4);
  texts.push_back(write_sid_text(more));
  int refused = 0;
  for (int copy = 0; copy < 1000; ++copy) {
    const std::string text = damaged(texts[copy % texts.size()], random);
    try {
      const FlexibleBody body = to_flexible_body(read_sid_text(text, "damaged").file, "damaged");
      EXPECT_TRUE(std::isfinite(body.mass) && body.Ke.allFinite() && body.Me.allFinite() && body.md1.allFinite());
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 500);
}

// A folder that goes with the test.
struct Folder {
  fs::path path = fs::temp_directory_path() / fmt::format("flexframe_body_{}", std::random_device{}());
  Folder() { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
};

// Two faces, a triangle with middles on a quadrangle without, with any motion.
BodySurface two_faces(int n) {
  BodySurface s;
  s.ids = {11, 12, 13, 14, 15, 16, 17, 18};
  s.points = Eigen::MatrixX3d::Random(8, 3);
  s.faces = Eigen::MatrixXi::Constant(2, 8, -1);
  s.faces.row(0).head(6) << 0, 1, 2, 3, 4, 5;
  s.faces.row(1).head(4) << 1, 6, 7, 2;
  s.phi = MatX::Random(24, n);
  s.stress = MatX::Random(48, n);
  s.load_stress = MatX::Random(48, 12);
  s.other_points = {0, 3, 3};
  s.other_stress = MatX::Random(18, n);
  s.other_load_stress = MatX::Random(18, 12);
  return s;
}

// HDF5 keeps every bit of a body, of its surface and of where it came from; the other reader takes both kinds of file.
TEST(BodyFile, IsReadAsItWasWritten) {
  const Folder own;
  for (const int n : {2, 4})
    for (const bool stiffening : {false, true}) {
      BodyFile made{random_body(n, stiffening), "made by a test", two_faces(n), {{"model", "part.inp"}, {"model_sha256", "abc"}}, {}};
      made.further = further_of(made.body, 3);
      const fs::path path = own.path / "body.h5";
      write_body(made, path);
      EXPECT_TRUE(read_further_shapes(path) == made.further);
      EXPECT_TRUE(is_body_file(path));
      const BodyFile read = read_body(path, "part");
      expect_same(made.body, read.body);
      EXPECT_TRUE(read.further == made.further);
      EXPECT_TRUE(made.body.Ke == read.body.Ke && made.body.nodes[1].phi == read.body.nodes[1].phi);
      EXPECT_EQ(made.comment, read.comment);
      EXPECT_EQ(made.origin, read.origin);
      for (const BodySurface& surface : {read.surface, read_body_surface(path)}) {
        EXPECT_EQ(surface.ids, made.surface.ids);
        EXPECT_TRUE(surface.points == made.surface.points && surface.faces == made.surface.faces);
        EXPECT_TRUE(surface.phi == made.surface.phi && surface.stress == made.surface.stress &&
                    surface.load_stress == made.surface.load_stress);
        EXPECT_EQ(surface.other_points, made.surface.other_points);
        EXPECT_TRUE(surface.other_stress == made.surface.other_stress && surface.other_load_stress == made.surface.other_load_stress);
      }
      // The same body as text.
      write_sid(from_flexible_body(made.body, made.comment), own.path / "body.sid");
      EXPECT_FALSE(is_body_file(own.path / "body.sid"));
      expect_same(read_body(own.path / "body.sid", "part").body, read.body);
    }
  const Eigen::MatrixX3i triangles = surface_triangles(two_faces(1));
  EXPECT_EQ(triangles.rows(), 6);  // four of the triangle, two of the quadrangle
}

// What is wrong is said with the file and the place; nothing else than a body is taken for one.
TEST(BodyFile, RefusesWhatContradictsItself) {
  const Folder own;
  const fs::path path = own.path / "body.h5";
  const auto refused = [&](const BodyFile& file, const std::string& word) {
    try {
      write_body(file, path);
      read_body(path, "part");
      ADD_FAILURE() << word << " was let through";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("body.h5"), std::string::npos) << error.what();
    }
  };
  const BodyFile whole{random_body(3, true), "", two_faces(3), {}, {}};
  BodyFile wrong = whole;
  wrong.body.Ke(0, 1) = std::nan("");
  refused(wrong, "not finite");
  wrong = whole;
  wrong.surface.phi.conservativeResize(21, 3);
  refused(wrong, "surface/phi");
  wrong = whole;
  wrong.surface.faces(0, 2) = 8;
  refused(wrong, "not among the 8");
  wrong = whole;
  wrong.surface.faces(0, 5) = -1;
  refused(wrong, "3, 4, 6 or 8");
  wrong = whole;
  wrong.body.nodes[2].name = wrong.body.nodes[0].name;
  refused(wrong, "twice");
  wrong = whole;
  wrong.body.nodes[0].rotation(0, 0) += 0.01;
  refused(wrong, "no rotation");
  std::ofstream(path) << "no HDF5 at all";
  EXPECT_FALSE(is_body_file(path));
  EXPECT_THROW(read_body(path, "part"), InputError);
  EXPECT_THROW(read_body_surface(path), InputError);
  EXPECT_THROW(read_body(own.path / "nothing.h5", "part"), InputError);
}

}  // namespace
}  // namespace flexframe::sim::test_sid
