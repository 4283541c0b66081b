// Samples of a run: fills Results, row by row.
#pragma once

#include "sim/dynamics/four_places.h"
#include "sim/results/histories.h"
#include "sim/results/load_strain.h"
#include "sim/results/node_motion.h"
#include "sim/results/outputs.h"
#include "sim/time/system.h"

#include <memory>
#include <optional>
#include <utility>

namespace flexframe::sim {

// After frames were added to the model (plan_outputs): the work space grows with them, the coordinates and partitions stay.
void grow_work(System& system);

// What a sample takes beside coordinates, poses and twists, and whether these are had from the scene's plane.
struct SampleNeeds {
  bool in_plane = false, accelerations = false, reactions = false, moving = true;
  std::vector<int> frames;  // OutputPlans::frames
  SampleNeeds() = default;
  // forces: section forces are wanted.
  SampleNeeds(const System& system, const OutputPlans& plans, bool forces = false);
};

class Recorder {
 public:
  // Resolves the scene's outputs (throws InputError) and sizes the series.
  Recorder(System& system, const std::vector<double>& times);
  // Row for the next time.
  void record(System& system, double t, const VecX& y);
  // Whether the sample was placed in the scene's plane: what else looks at it in space has to bring it there (set_state).
  bool in_plane() const { return needs_.in_plane; }
  Results finish(const System& system);

 private:
  struct Piece {
    int body, part;
    Eigen::Index first;  // column of its first node
    NodePaths nodes;
  };
  OutputPlans plans_;
  SampleNeeds needs_;
  std::vector<Piece> pieces_;                    // behind the nodes of the result bodies
  std::vector<int> first_parts_;                 // first part of every result body
  std::vector<double*> translation_, rotation_;  // rows of the sample, of every body
  std::vector<Pose> shown_, world_;              // shown frame of every body, in its first part and in the world; of the sample
  std::vector<int> joint_frames_;
  std::optional<LoadStrain> loads_;  // of scenes whose pictures show stress
  Reactions reactions_;
  Results results_;
  MatX table_;
  Eigen::Index row_ = 0;
};

// Samples of a run's outputs only, for runs that are compared and thrown away.
class HistoryRecorder {
 public:
  // read: as plan_outputs has it.
  HistoryRecorder(System& system, const std::vector<double>& times, const std::vector<bool>& read = {});
  void record(System& system, double t, const VecX& y);
  bool in_plane() const { return needs_.in_plane; }
  // Whether samples may be handed over four at a time: place_four brings rows of `states` there, or returns false where they have to be
  // recorded one by one, and record_lane records one of them.
  bool takes_four() const { return places_ != nullptr; }
  bool place_four(System& system, const double* times, const MatX& states);
  void record_lane(System& system, double t, int lane);
  Histories finish() { return std::move(histories_); }

 private:
  OutputPlans plans_;
  SampleNeeds needs_;
  Reactions reactions_;
  Histories histories_;
  std::unique_ptr<FourPlaces> places_;
  Eigen::Index row_ = 0;
  void write_row(System& system, const Energy& energy);
};

// The outputs of one instant after another, none of them kept.
class CurrentOutputs {
 public:
  explicit CurrentOutputs(System& system);
  const std::vector<std::string>& columns() const { return plans_.columns; }
  const std::vector<std::string>& units() const { return plans_.units; }
  // All columns at (t, y) into `row`, which holds those of the instant before (angles go on through full turns) or is empty.
  void evaluate(System& system, double t, const VecX& y, VecX& row);

 private:
  OutputPlans plans_;
  SampleNeeds needs_;
  Reactions reactions_;
};

}  // namespace flexframe::sim
