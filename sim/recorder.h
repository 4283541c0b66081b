// Samples of a run: fills Results, row by row.
#pragma once

#include "sim/histories.h"
#include "sim/outputs.h"
#include "sim/system.h"

#include <utility>

namespace flexframe::sim {

class Recorder {
 public:
  // Resolves the scene's outputs (throws InputError) and sizes the series.
  Recorder(System& system, const std::vector<double>& times);
  // Row for the next time.
  void record(System& system, double t, const VecX& y);
  Results finish(const System& system);
  bool outputs_empty() const { return plans_.columns.empty(); }

 private:
  struct NodeSource { int body, part, frame; };
  OutputPlans plans_;
  std::vector<NodeSource> nodes_;                // frames behind the nodes of the result bodies, body by body
  std::vector<int> first_parts_;                 // first part of every result body
  std::vector<Pose> shown_, world_;              // shown frame of every body, in its first part and in the world; of the sample
  std::vector<int> joint_frames_;
  Reactions reactions_;
  Results results_;
  MatX table_;
  Eigen::Index row_ = 0;
};

// Samples of a run's outputs only, for runs that are compared and thrown away.
class HistoryRecorder {
 public:
  HistoryRecorder(System& system, const std::vector<double>& times);
  void record(System& system, double t, const VecX& y);
  Histories finish() { return std::move(histories_); }

 private:
  OutputPlans plans_;
  Reactions reactions_;
  Histories histories_;
  Eigen::Index row_ = 0;
};

}  // namespace flexframe::sim
