// What a SID file's numbers say by themselves, and where they contradict each other: for people who look at a file, not for the simulation.
#pragma once

#include "sim/bodies/sid.h"

namespace flexframe::sim {

struct SidJudgement {
  Vec3 centre = Vec3::Zero();             // of mass, m; zero where the file has no first moment
  Vec3 moments = Vec3::Zero();            // principal moments of inertia about the centre of mass, ascending, kg m^2
  VecX frequencies;                       // Hz, of Ke and Me, ascending; empty where these are none of a body
  std::vector<std::string> contradicted;  // a sentence each: what does not fit, by how much, and what to do
};

// Looks at labels against Ke and Me, at definiteness of Me, Ke and of the whole mass matrix, at inertia and at the identities of check_sid.
// Never throws for what a file that was read contains.
SidJudgement judge_sid(const SidFile& sid);

}  // namespace flexframe::sim
