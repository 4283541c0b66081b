// Frequencies of small motions whose errors are told: against Euler's and Timoshenko's beams in closed form.
#include "mechanism_text.h"
#include "sim/run/frequency_check.h"
#include "sim/start/make_system.h"

#include <gtest/gtest.h>

namespace flexframe::sim::test_frequency_check {
namespace {

// A beam between two hinges, 1 m long: frequencies of shape n are known with shear and rotary inertia too.
std::string hinged_beam(double height, const std::string& more) {
  return fmt::format(
             "[ground]\nframes = {{ far = [1, 0, 0] }}\n{}[[body]]\nname = \"b\"\nkind = \"beam\"\nlength = 1\n"
             "section = {{ shape = \"rectangle\", width = 0.02, height = {} }}\n"
             "material = {{ density = 7850, youngs_modulus = 2.1e11 }}\n{}\n",
             head(1, Vec3::Zero()), height, more) +
         joint("left", "revolute", "ground", "b", "") + joint("right", "pin-slot", "ground.far", "b.tip", "");
}

// rho A rho I/(kGA) w^4 - (rho A + (rho I + rho A EI/kGA) b^2) w^2 + EI b^4 = 0 with b = n pi / L, the smaller root.
double timoshenko(double height, int n) {
  const double E = 2.1e11, rho = 7850, area = 0.02 * height, I = 0.02 * height * height * height / 12.0;
  const double b = n * pi, ei = E * I, kga = 5.0 / 6.0 * E / 2.6 * area, ra = rho * area, ri = rho * I;
  const double A = ra * ri / kga, B = ra + (ri + ra * ei / kga) * b * b, C = ei * b * b * b * b;
  return std::sqrt((B - std::sqrt(B * B - 4.0 * A * C)) / (2.0 * A)) / (2.0 * pi);
}

struct Told {
  double worst = 0.0;  // error of the first six frequencies
  std::vector<std::string> warnings, notes;
};

Told told_of(const std::string& scene, double height) {
  const System system = make_system(parse_scene(scene, "beam.toml"));
  const Linearisation linear = linearise(system);
  Notes notes;
  tell_of_frequencies(system, linear, richer_beams(system, notes), 0.01, sixth_frequency(linear), notes);
  Told out;
  std::vector<double> hertz;
  for (const LinearMode& mode : linear.modes)
    if (mode.kind == LinearMode::vibration) hertz.push_back(mode.frequency);
  for (size_t k = 0; k < std::min<size_t>(hertz.size(), 6); ++k)
    out.worst = std::max(out.worst, std::abs(hertz[k] / timoshenko(height, static_cast<int>(k) + 1) - 1.0));
  out.warnings = notes.texts(Severity::warning);
  out.notes = notes.texts(Severity::note);
  return out;
}

// Whatever the model and however slender: frequencies are right to 1 %, or a warning says that they are not.
TEST(FrequencyCheck, NoFrequencyIsWrongWithoutAWarning) {
  int right = 0, warned = 0;
  for (const double height : {0.004, 0.02, 0.1})
    for (const char* more :
         {"elements = 3", "elements = 24", "elements = 20\nkeep_modes = 3",
          "model = \"modal\"\nboundary = \"supported-supported\"\nmodes = { bending_xy = [1, 2, 3, 4, 5, 6] }",
          "model = \"mixed\"\nvolumes = 3", "model = \"lumped\"\nelements = 12", "elements = 20\neffects = [\"bending_xy\", \"shear\"]"}) {
      const Told told = told_of(hinged_beam(height, more), height);
      (told.warnings.empty() ? right : warned) += 1;
      if (told.worst > 0.012) {
        EXPECT_FALSE(told.warnings.empty()) << height << " m, " << more << ": " << told.worst;
      }
      if (told.worst < 0.005) {
        EXPECT_TRUE(told.warnings.empty()) << height << " m, " << more << ": " << told.worst << told.warnings.front();
      }
    }
  EXPECT_GE(right, 4);
  EXPECT_GE(warned, 8);
}

// What a warning says is the frequency of the richer model.
TEST(FrequencyCheck, WarningsNameTheRightFrequency) {
  const Told told = told_of(hinged_beam(0.1, "elements = 30\neffects = [\"bending_xy\"]"), 0.1);
  ASSERT_EQ(told.warnings.size(), 1u);
  EXPECT_NE(told.warnings[0].find("with shear and rotary inertia"), std::string::npos) << told.warnings[0];
  const size_t to = told.warnings[0].find(" Hz to ");
  ASSERT_NE(to, std::string::npos) << told.warnings[0];
  EXPECT_NEAR(std::stod(told.warnings[0].substr(to + 7)) / timoshenko(0.1, 6), 1.0, 5e-3) << told.warnings[0];
}

// A beam between a hinge and a carriage on a preloaded spring: what lengthens takes only a share of the preload.
TEST(FrequencyCheck, LengtheningSharesThePreloadOfASpring) {
  const double E = 2.1e11, height = 0.004, area = 0.02 * height, preload = 16.0, I = area * height * height / 12.0;
  for (const double stiffer : {0.01, 3.0}) {
    const double stiffness = stiffer * E * area;
    const std::string scene = std::string(head(1, Vec3::Zero())).append("start = \"static\"\n[ground]\nframes = { far = [1, 0, 0] }\n") +
                              "[[body]]\nname = \"b\"\nkind = \"beam\"\nlength = 1\nelements = 20\n"
                              "section = { shape = \"rectangle\", width = 0.02, height = 0.004 }\n"
                              "material = { density = 7850, youngs_modulus = 2.1e11 }\n"
                              "[[body]]\nname = \"car\"\nkind = \"rigid\"\nmass = 0.1\ninertia = [1, 1, 1]\n" +
                              joint("left", "revolute", "ground", "b", "") +
                              joint("slide", "prismatic", "ground.far", "car",
                                    fmt::format("axis = [1, 0, 0]\nspring = {{ stiffness = {}, preload = {} }}", stiffness, -preload)) +
                              joint("right", "revolute", "car", "b.tip", "");
    const Told told = told_of(scene, height);
    const double pull = preload / (1.0 + stiffness / (E * area));
    const double first = 0.5 * std::sqrt((E * I * pi * pi + pull) / (7850 * area));
    ASSERT_EQ(told.warnings.size(), stiffer > 1.0 ? 1u : 0u) << stiffer;
    if (told.warnings.empty()) continue;
    const std::string& warning = told.warnings[0];
    EXPECT_NE(warning.find("with lengthening and twist"), std::string::npos) << warning;
    const size_t to = warning.find(" Hz to ");
    ASSERT_NE(to, std::string::npos) << warning;
    EXPECT_NEAR(std::stod(warning.substr(to + 7)) / first, 1.0, 2e-3) << warning;
  }
}

// A push along the axis of a beam without lengthening: its response is nothing, which a warning says.
TEST(FrequencyCheck, ResponsesAlongTheAxisNeedLengthening) {
  const std::string scene = head(1, Vec3::Zero()) +
                            "[[body]]\nname = \"b\"\nkind = \"beam\"\nlength = 1\n"
                            "section = { shape = \"rectangle\", width = 0.02, height = 0.02 }\n"
                            "material = { density = 7850, youngs_modulus = 2.1e11 }\n" +
                            joint("root", "weld", "ground", "b", "") +
                            "[[force]]\nname = \"push\"\nkind = \"force\"\non = \"b.tip\"\ndirection = [1, 1, 0]\nvalue = \"0*t\"\n" +
                            output("tip", "b.tip", "displacement");
  for (const bool axial : {false, true}) {
    const System system = make_system(parse_scene(
        axial ? std::string(scene).replace(scene.find("material"), 0, "effects = [\"bending_xy\", \"axial\", \"stiffening\"]\n") : scene,
        "beam.toml"));
    const FrequencyResponse r = frequency_response(system, "push", VecX::Constant(1, 1.0));
    // cos 45 degrees L / EA.
    const double along = std::abs(r.values(0, 0)), wanted = std::sqrt(0.5) / (2.1e11 * 4e-4);
    Notes notes;
    tell_of_response(system, linearise(system), r, richer_beams(system, notes), 0.01, notes);
    EXPECT_EQ(std::abs(along - wanted) > 0.01 * wanted, notes.has(Severity::warning)) << axial << " " << along;
    EXPECT_EQ(notes.has(Severity::warning), !axial);
  }
}

// A cantilever of a scene in a plane: its first frequency is across the plane, where the program lets it not bend.
TEST(FrequencyCheck, VibrationsThatAreLeftOffAreNamed) {
  const std::string scene = head(1, Vec3::Zero()) +
                            "[[body]]\nname = \"b\"\nkind = \"beam\"\nlength = 1\nelements = 20\n"
                            "section = { shape = \"rectangle\", width = 0.02, height = 0.03 }\n"
                            "material = { density = 7850, youngs_modulus = 2.1e11 }\n" +
                            joint("root", "weld", "ground", "b", "");
  const auto with = [&](const char* line) { return std::string(scene).replace(scene.find("material"), 0, line); };
  // Euler's, clamped and free, in the direction that is 0.02 m thick.
  const double across = 1.87510407 * 1.87510407 * std::sqrt(2.1e11 / 7850.0 / 12.0) * 0.02 / (2.0 * pi);
  for (const bool all : {false, true}) {
    const System system =
        make_system(parse_scene(with(all ? "effects = [\"bending_xy\", \"bending_xz\", \"axial\", \"torsion\"]\n" : ""), "beam.toml"));
    const Linearisation linear = linearise(system);
    for (const Severity severity : {Severity::note, Severity::warning}) {
      Notes notes;
      tell_of_left_vibrations(system, linear, sixth_frequency(linear), severity, notes);
      EXPECT_EQ(notes.has(severity), !all);
      EXPECT_EQ(notes.size(), all ? 0u : 1u);
      if (notes.size() == 0) continue;
      const std::string text = notes.texts(severity).front();
      const size_t lowest = text.find("the lowest at ");
      ASSERT_NE(lowest, std::string::npos) << text;
      EXPECT_NEAR(std::stod(text.substr(lowest + 14)) / across, 1.0, 1e-3) << text;
    }
  }
}

// More coordinates than are looked at one by one: few shapes of each beam do.
TEST(FrequencyCheck, LargeModelsAreJudgedByFewShapes) {
  const Told told = told_of(hinged_beam(0.1, "elements = 40\neffects = [\"bending_xy\", \"bending_xz\", \"axial\", \"torsion\"]"), 0.1);
  ASSERT_FALSE(told.warnings.empty());
  EXPECT_NE(told.warnings[0].find("with shear and rotary inertia"), std::string::npos) << told.warnings[0];
}

}  // namespace
}  // namespace flexframe::sim::test_frequency_check
