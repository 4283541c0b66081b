// Samples of a run: fills Results, row by row.
#pragma once

#include "sim/outputs.h"
#include "sim/system.h"

#include <algorithm>

namespace flexframe::sim {

class Recorder {
 public:
  // Resolves the scene's outputs (throws InputError) and sizes the series.
  Recorder(System& system, const std::vector<double>& times);
  // Row for the next time.
  void record(System& system, double t, const VecX& y);
  Results finish(const System& system);
  bool outputs_empty() const { return plans_.columns.empty(); }
  const OutputPlans& plans() const { return plans_; }
  const MatX& table() const { return table_; }   // columns x samples
  double energy_scale() const { return std::max({results_.kinetic.maxCoeff(), results_.strain.maxCoeff(), 1e-300}); }  // J

 private:
  struct NodeSource { int body, part, frame; };
  OutputPlans plans_;
  std::vector<NodeSource> nodes_;                // frames behind the nodes of the result bodies, body by body
  std::vector<int> joint_frames_;
  Reactions reactions_;
  Results results_;
  MatX table_;
  Eigen::Index row_ = 0;
};

// Largest difference of a second run's outputs from a recorded one's, relative to each output's range in the recorded run.
class OutputComparison {
 public:
  OutputComparison(const Recorder& recorder, System& second);
  void add(System& system, double t, const VecX& y);
  std::pair<double, std::string> largest() const;

 private:
  const Recorder& recorder_;
  OutputPlans plans_;
  Reactions reactions_;
  VecX worst_, last_;
  Eigen::Index row_ = 0;
};

}  // namespace flexframe::sim
