// What the deformations that beams go without are worth, told from the computed motion by the defect of the richer model; no second run.
//
// At samples of the run every beam is cut (section_forces.h). The strains that its section forces make and its model lacks, N/EA, T/GJ,
// V/kGA and M/EI, or, without stiffening and gyroscopic terms, those that forces along the deflected axis and the inertia of the
// deformation would make and what the deflection shortens, displace the frames on it; the mechanism is assembled anew with its frames so
// displaced and its independent coordinates kept, and what the outputs change by is the effect's quasi-static worth s(t). From it follows
// what the effect does in time:
//   z'' + omega^2 z = omega^2 s,   omega^2 = 2 U / sum m d^2   (Rayleigh's quotient of that displacement d, U the energy of the strains)
// from rest, or from z = s where the run starts from equilibrium: what starts or changes at once vibrates about s. Velocities and
// accelerations take z' and z'', reactions the share by which z passes s of the section forces. Vibrations that the model has are slowed
// down by the effect: their phase runs off by U / (2 V) of what it has gone through, V the strain energy of the motion. All of it is
// compared with the ranges of the outputs (histories.h). After a static start it grows as the deflection does
// (StaticSolution::softened).
#pragma once

#include "sim/dynamics/section_forces.h"
#include "sim/results/outputs.h"
#include "sim/results/sampling.h"
#include "sim/time/system.h"

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::sim {

// Effects that act on the deflection, where the others add a deformation of their own.
inline bool is_of_second_order(std::string_view effect) { return effect == "stiffening" || effect == "gyroscopic"; }

// One effect that a beam, or several, go without.
struct LeftOutWorth {
  std::string effect;
  std::vector<std::string> owners;
  bool possible = true;  // the beam's model can have it
  double share = 0.0;    // of the output it changes most, relative to its range
  std::string column;
  // Where an output is a force, a stress or the like, which the look does not judge: U / (U + V), about what the effect shifts of the
  // forces from one support or spring to another. 0 elsewhere.
  double inside = 0.0;
  // Of a deformation: the largest displacement within a beam by it, m, and its share of the largest deformation, itself counted in. Where
  // pictures are what the run is made for, what is a third of the deformation or more counts by that share.
  double reach = 0.0, shown = 0.0;
  // The share of every column of the outputs; empty: not known. What no look judges has the largest.
  VecX columns = {};
  // Of a deformation where a contact or a joint's stop is touched and left: what it would take up of a blow, U / (U + V), V what the
  // contact stores. It lets the blow last longer and keeps part of it as vibration, also where it moves no output along the motion as it
  // is.
  double blow = 0.0;
  // Of bending that nothing excites (idle_bending.h): how near the beam comes to bending by itself, by the square of its rate over
  // the lowest frequency at which it bends, by what presses it over what buckles a column as long as the mechanism, clamped at one end, and
  // by what twists it over such a shaft's load. 1: it may.
  double critical = 0.0;
  // Of shear: what the sections' rotary inertia, which comes with it, does to the mechanism as it turns, roughly.
  double turning = 0.0;
};

class LeftOut {
 public:
  // states: of the system's model. The recorder's frames are in the model already. pictures: see LeftOutWorth::shown.
  LeftOut(const System& system, const std::vector<EffectState>& states, bool pictures);

  // Nothing is left out: nothing is done.
  bool empty() const { return items_.empty(); }
  // Times among the samples at which to look: evenly spread, and where loads and motions are largest. Ascending indices.
  std::vector<size_t> looks(const System& system, const std::vector<double>& times);
  // At a sample of the run (system.work is at t, y).
  void look(System& system, double t, const VecX& y);

  // The worth of each, the largest first. results: of the run.
  std::vector<LeftOutWorth> worth(const Results& results, bool from_rest) const;

 private:
  struct Item {
    std::string effect;
    std::vector<int> bodies;
    bool possible = true, failed = false;
    bool only_turning = false;         // shear of beams that do not bend: rotary inertia is all that comes with it
    std::vector<VecX> change;          // a look: of the followed columns
    std::vector<double> energy, mass;  // a look: U, J; sum m d^2, kg m^2
    std::vector<double> slowing;       // a look: 1/2 of the work of what is of second order on the deflection, its size, J
    std::vector<double> pull;          // a look: integral of the section force that makes the strain, with its sign
    std::vector<double> turning;       // a look, of shear: kinetic energy of the sections that turn with their beam about y and z, J
    std::vector<double> spinning;      // a look, of shear: the same of their turning about x, J
    double force = 0.0, moment = 0.0;  // the largest that makes it, N and Nm
    double reach = 0.0;                // largest displacement within a beam, m
    double critical = 0.0;             // LeftOutWorth::critical
  };
  // A strain that a beam lacks and the section force that goes with it.
  struct Strained {
    Vec6 strain = Vec6::Zero(), force = Vec6::Zero();
  };
  // A column of the outputs: the row of the evaluated ones that it derives from (-1: none), how many times it is differentiated.
  struct Column {
    Quantity quantity = Quantity::position;
    int row = -1, order = 0, body = -1;
  };
  // Sections' displacements and rotations relative to the part's root, in its axes: a beam part of sections_, a place.
  using Moved = std::vector<std::vector<Vec6>>;

  // Of a beam's section forces (CutBeam::left, right).
  using BothEnds = std::array<std::vector<Vec6>, 2>;

  // What the mechanism vibrates in at a look: its modes, by the stiffness of its bodies.
  struct Vibrations {
    VecX frequencies;               // rad/s, ascending
    VecX decays;                    // 1/s, of their amplitudes by the bodies' damping
    VecX by_rate, by_acceleration;  // amounts that their rates and their accelerations tell of
    MatX reach;                     // of the followed columns, per amount
    MatX slowed;                    // an item a row: share of its frequency that a mode loses; negative: the mode hardly moves anything
  };

  Moved strained(const System& system, Item& item) const;
  static double energy_between(const Strained& left, const Strained& right, double dx);
  void strains_of_first_order(int body, const BothEnds& forces, const Item& item, std::vector<Strained>& out) const;
  void strains_of_second_order(const System& system, const CutBeam& beam, Item& item, std::vector<Strained>& out) const;
  void set_offset(int frame, const Pose& offset);
  void displace_frames(const Moved& moved);
  void restore_frames();
  double moved_mass(const System& system, const Item* item, const Moved& moved) const;
  bool assemble(const System& system);
  VecX outputs(const double* previous);
  void follow(const System& system, Item& item, const VecX& rest);
  void follow_deformation(const System& system);
  void look_at_vibrations(System& system, double t, const VecX& y, const VecX& rest);
  void follow_turning(const System& system, Item& item) const;
  void follow_axis(const System& system, Item& item) const;
  // Adds to the strains of a beam that twists what its sections' tensor, turned by the twist, does where it turns about y and z.
  // Adds what forces along the axis do to the twist; 1/2 of their work on it, J.
  double untwist(const CutBeam& beam, std::vector<Strained>& out) const;
  // Share of an output that the sections' rotary inertia moves, as the mechanism turns with its beams.
  double turned_share(const Item& item, const Results& results) const;
  double taken_of_blows(const Item& item) const;
  double energy_without(const Item& item, const std::vector<BothEnds>& changes) const;
  // What an item moves the columns of the outputs by, in their units, as it slows the mechanism's vibrations down over so many seconds.
  VecX slowed_vibrations(size_t item, double duration) const;
  // Whether the run has outputs that a look does not judge.
  bool has_unjudged_forces() const;
  // Whether outputs are forces, what they do, or energies.
  bool has_forces() const;
  // found.reach and shown. deformed: the largest displacement of nodes, m.
  void compare_shown(const Item& item, double deformed, LeftOutWorth& found) const;
  // What the vibrations of a run lose in phase by its end, rad; of the one that this moves farthest its range, m, and frequency, rad/s.
  struct Drift {
    double phase = 0.0, deflection = 0.0, frequency = 0.0;
  };
  // As places see it, rates, and accelerations and forces: the faster a vibration, the more of them is its own.
  using Drifts = std::array<Drift, 3>;
  // The phase, rad, in which the least damped vibration that was looked at falls to 1/e.
  double lasting_phase() const;
  // What samples do not show of bodies' deformations, by their index: the same for every item, made for those that are asked for.
  using Unseen = std::map<size_t, std::optional<UnseenSwing>>;
  Drifts drifts(const Item& item, const Results& results, Unseen& unseen) const;
  // By how much more all vibrations of a struck beam are moved by shear than the first one, which loses so much phase.
  double with_higher_forms(const Item& item, double phase) const;
  // Share of its range by which a column of the outputs is moved by that.
  double out_of_phase(const Drifts& drifts, const Column& column, const std::string& unit, double range) const;
  // Largest |z|, |z'|, |z''| of a row of `change`, and of z - s relative to the largest |s|.
  struct Response {
    double size = 0.0, rate = 0.0, acceleration = 0.0, over = 0.0;
  };
  Response response(const Item& item, const std::vector<double>& s, bool from_rest) const;

  bool pictures_;
  double softened_ = 1.0;  // System::softened
  Scene scene_;            // with the outputs that are evaluated: places instead of velocities and accelerations
  Model model_;
  Work work_;
  OutputPlans plans_;
  SectionForces sections_;
  std::vector<Column> columns_;  // of the run's outputs
  std::vector<Item> items_;
  std::vector<Pose> offset_, pose_;  // of the frames on beams, as they are
  Reactions reactions_;
  std::vector<double> switches_;  // of loads and motions, s
  bool struck_ = false;           // a load comes or goes at once
  bool free_ = false;             // something can move without deforming, and no motion is prescribed
  std::vector<char> sudden_;      // a look: loads switched since the one before
  std::vector<Vibrations> vibrations_;
  VecX farthest_ = VecX::Zero(3);                   // m, m/s, m/s^2: of what the vibrations move, at any look so far
  std::vector<double> times_, strain_, bent_mass_;  // a look: s; strain energy, J; sum m d^2 of the deformation, kg m^2
  std::vector<double> pressed_;                     // a look: what contacts and stops store, J
  std::vector<double> kinetic_;                     // a look: J
};

}  // namespace flexframe::sim
