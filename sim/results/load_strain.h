// Strains of beams by loads that they carry without deforming, for pictures coloured by stress: with the effect axial off a rod under a
// weight has no lengthening, and yet the stress of the weight. From the forces in the sections, which need no stiffness
// (sim/dynamics/section_forces.h).
#pragma once

#include "sim/dynamics/section_forces.h"
#include "sim/results/results.h"

#include <span>
#include <vector>

namespace flexframe::sim {

class LoadStrain {
 public:
  // Of the results' bodies (those of the scene, in its order) that have stations and something unstrained; straight beams of one section.
  LoadStrain(const Model& model, const Scene& scene, std::span<const ResultBody> bodies);

  bool empty() const { return bodies_.empty(); }
  // At the state in `work`: positions, velocities, accelerations, loads and reactions come first. Fills row `row` of load_strain of every
  // body; sizes come before (size()).
  void record(const Model& model, Work& work, const Reactions& reactions, Eigen::Index row, std::span<ResultBody> bodies);
  // nt rows each.
  void size(Eigen::Index nt, std::span<ResultBody> bodies) const;

 private:
  // Where a station lies between the cuts of a part.
  struct Place {
    int beam = 0, interval = 0;
    double share = 0.0;
  };
  struct Way {
    Eigen::Index component = 0;  // of the wrench in a section: 0 force along the beam, 3 torque about it
    double flexibility = 0.0;    // 1/EA (1/N), 1/GJ (1/(N m2))
  };
  struct Body {
    int body = 0;
    std::vector<Place> stations;
    std::vector<Way> ways;
  };

  SectionForces forces_;
  std::vector<Body> bodies_;
};

}  // namespace flexframe::sim
