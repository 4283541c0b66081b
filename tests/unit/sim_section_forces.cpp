// Section forces of beams that move, against what holds them.
#include "mechanism_text.h"

#include <gtest/gtest.h>

namespace flexframe::sim::test_section_forces {
namespace {

// Right beside the joint that alone holds a beam the section carries the joint's reaction, whatever the motion. Along the axis that is of
// second order: the beam shortens as it bends, and that has inertia.
TEST(SectionForces, BesideTheOnlyJointTheyAreItsReaction) {
  for (const char* kind : {"weld", "revolute"})
    for (const double g : {0.3, 9.81})
      for (const char* model : {"elements = 12\neffects = [\"bending_xy\", \"stiffening\"]",
                                "elements = 12\neffects = [\"bending_xy\", \"stiffening\", \"large_bending\"]",
                                "model = \"mixed\"\nvolumes = 4\nelements = 3\neffects = [\"bending_xy\", \"stiffening\"]"}) {
        const std::string scene =
            head(0.3, Vec3(0.0, -g, 0.0)) +
            "[[body]]\nname = \"b\"\nkind = \"beam\"\nlength = 1\nsection = { shape = \"rectangle\", width = 0.02, height = 0.003 }\n"
            "material = { density = 7850, youngs_modulus = 2.1e11 }\ndamping = { stiffness = 2e-3 }\n" +
            std::string(model) + "\n" + joint("j", kind, "ground", "b", "") + output("r", "j", "reaction") +
            "[[output]]\nname = \"s\"\nof = \"b\"\nat = 0\nquantity = \"section_force\"\n" + output("turn", "b", "rotation");
        const Results r = run(scene, 1e-7);
        // On the side towards the root: the reaction with the other sign, in axes that turn with the section.
        const VecX &turn = column(r, "turn.z"), &x = column(r, "r.x"), &y = column(r, "r.y");
        const VecX c = turn.array().cos(), s = turn.array().sin();
        const VecX along = -(c.cwiseProduct(x) + s.cwiseProduct(y)), across = -(c.cwiseProduct(y) - s.cwiseProduct(x));
        const auto expect_near = [&](const std::string& what, const VecX& wanted, double of) {
          const double range = wanted.maxCoeff() - wanted.minCoeff();
          EXPECT_LT((column(r, what) - wanted).cwiseAbs().maxCoeff(), of * range) << what << ", " << kind << ", " << g << ", " << model;
        };
        expect_near("s.N", along, 5e-3);
        expect_near("s.Vy", across, 1e-3);
        if (std::string(kind) == "weld") expect_near("s.Mz", -column(r, "r.mz"), 1e-3);
      }
}

// A clamp that starts to move at once shakes all modes, those too in which elements bend by themselves: nothing damps them.
TEST(SectionForces, AlongTheAxisOfABeamThatVibratesInAllItsModes) {
  const std::string scene =
      head(0.3, Vec3::Zero()) +
      "[[body]]\nname = \"b\"\nkind = \"beam\"\nlength = 1.6\nsection = { shape = \"rectangle\", width = 0.016, height = 0.016 }\n"
      "material = { density = 2700, youngs_modulus = 7e10 }\nelements = 12\neffects = [\"bending_xy\", \"stiffening\"]\n" +
      joint("j", "prismatic", "ground", "b", "axis = [0, 1, 0]\nmotion = \"0.02*sin(5*t)^2\"") + output("r", "j", "reaction") +
      "[[output]]\nname = \"s\"\nof = \"b\"\nat = 0\nquantity = \"section_force\"\n";
  const Results r = run(scene, 1e-7, Method::exponential);
  const VecX along = -column(r, "r.x");
  EXPECT_LT((column(r, "s.N") - along).cwiseAbs().maxCoeff(), 5e-3 * (along.maxCoeff() - along.minCoeff()));
}

}  // namespace
}  // namespace flexframe::sim::test_section_forces
