// The columns of the history: what a scene's [[output]] tables ask for, evaluated at the current state of the work space.
#pragma once

#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/reactions.h"
#include "sim/dynamics/section_forces.h"
#include "sim/dynamics/work.h"
#include "sim/results/results.h"
#include "sim/results/shown_frame.h"
#include "sim/results/turn_path.h"
#include "sim/scene/expression.h"
#include "sim/scene/section_peak.h"

#include <memory>
#include <optional>

namespace flexframe::sim {

// One output, resolved. Columns: NAME.x NAME.y NAME.z for vectors, NAME for scalars, NAME.1 NAME.2 ... for coordinates;
// reactions NAME.x NAME.y NAME.z (force) NAME.mx NAME.my NAME.mz (moment), of the parent on the child at the joint, in world axes or those
// of the joint's parent or child frame; section forces NAME.N NAME.Vy NAME.Vz NAME.T NAME.My NAME.Mz.
struct OutputPlan {
  OutputDef def;
  int frame = -1;                  // frame outputs
  int relative_to = -1;            // frame from which they are seen, -1: the world
  bool stands = false;             // an output before it has made the pose of its frame
  int joint_part = -1, loop = -1;  // joint outputs
  int body = -1;                   // body outputs (scene index)
  bool system = false;
  int first = 0, count = 1;         // columns
  std::shared_ptr<TurnPath> turns;  // angles of loop joints and rotations: whole turns between samples, where the joints know them
  std::vector<int> loads;           // force outputs: of the model, those of one force of the scene
  int coupling = -1;                // or of this coupling
  int z0 = -1;                      // work: among the further states
  int block = -1;                   // block outputs
  Expression combination;           // of other columns, below, in the order of its variables
  std::vector<int> reads;
  std::optional<ShownFrom> shown;  // displacements that say themselves from where they are measured
  Vec3 rest = Vec3::Zero();        // displacements: their frame's place in the undeformed body
  // stress: what it is made of
  Section section;
  Material material;
  SectionPeak peak;
};

struct OutputPlans {
  std::vector<OutputPlan> outputs;
  std::vector<std::string> columns, units, descriptions;
  std::vector<double> sizes;                      // of the columns (OutputDef::size)
  std::vector<ShownFrom> shown;                   // of every body of the scene, where its deformation is asked for
  bool accelerations = false, reactions = false;  // what they need
  bool in_plane = true;                           // none of them needs more than place_plane_sample brings (sample_state.h)
  std::shared_ptr<SectionForces> sections;        // where section forces or stresses are asked for
  std::vector<int> frames;                        // of what deforms whose poses they read, but for joints' own
  std::vector<int> places;                        // all frames whose poses they read where only places are read
  bool moving = true;                             // rates or energies are among what they need, or what their errors are measured against
};

// What an output is of.
enum class OutputFamily { frame, joint, force, section, elastic, energy, block, combination };
OutputFamily family_of(Quantity quantity);

// all_shown: the deformation of every body is wanted, not only of those with an output `displacement`. read: of the columns, those that
// anybody reads; empty: all. The others are there, but nothing evaluates an output none of whose columns is read.
// Throws InputError with file, line, what was found and what there is.
OutputPlans plan_outputs(Model& model, const Scene& scene, bool all_shown = false, const std::vector<bool>& read = {});

// Where the columns of a state go. previous: those one sample before (rotations are continued through full turns), or null. energy: of the
// whole system. placed: OutputPlans::frames stand where they are.
struct OutputRow {
  const double* previous = nullptr;
  double* columns = nullptr;
  const Energy* energy = nullptr;
  bool placed = false;
};

// Writes all columns for the current state.
void evaluate_outputs(const Model& model, const OutputPlans& plans, Work& work, const Reactions& reactions, const OutputRow& row);

// Coordinate and rate of a cut joint with one coordinate (revolute, prismatic).
double loop_value(const Model& model, const Work& work, int loop);
double loop_rate(const Model& model, Work& work, int loop);

// The rotation vector nearest to `previous` of those that describe the same rotation as `a`; nearest to what `turned` (rad) about `axis`
// makes of it, where both lie along that.
Vec3 continue_rotation(const Vec3& a, const Vec3& previous, const Vec3& axis = Vec3::Zero(), double turned = 0.0);

}  // namespace flexframe::sim
