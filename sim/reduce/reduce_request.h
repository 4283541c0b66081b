// A reduction as its user asks for it: the model's files and words for materials, supports, interfaces and kept nodes. `flexframe reduce`
// and the Python module ask here, so that both make the same bits.
#pragma once

#include "sim/reduce/fe_model.h"
#include "sim/reduce/reduce.h"

#include <functional>
#include <string>
#include <vector>

namespace flexframe::sim {

struct ReduceRequest {
  // .inp (Abaqus, CalculiX), .bdf .nas .dat (Nastran), .msh (gmsh), .sti (CalculiX matrices with .mas .dof .inp beside them unless named
  // here) or .mtx (Matrix Market; needs `mass` and `node_table`).
  std::filesystem::path model, mass, node_table, dofs;
  std::string units = "m";              // see units_named(), or factors "LENGTH,MASS,TIME" to SI
  std::string method = "auto";          // auto, eigen, guyan, craig-bampton, response
  std::string hold = "auto";            // "auto" or "model": the model's supports; "none"; or the name of a node set, clamped
  std::vector<std::string> interfaces;  // "[NAME=]NODE", "[NAME=]SPIDER", "[NAME=]rigid:SET[@x,y,z]" or "[NAME=]average:SET[@x,y,z]", m
  std::vector<std::string> materials;   // "[SET=]YOUNGS_MODULUS,POISSON,DENSITY" for elements without one, SI
  std::vector<std::string> densities;   // "[MATERIAL=]DENSITY" for materials without one, kg/m^3
  std::vector<std::string> elastics;    // "[MATERIAL=]YOUNGS_MODULUS,POISSON" for materials without elasticity, Pa
  std::vector<int> nodes;               // numbers of nodes to keep
  std::vector<std::string> node_sets;   // sets of nodes to keep
  std::string contact = "refuse";       // contact pairs of .inp: refuse, tie (their surfaces), open (left out)
  double thickness = 0.0;               // of shells that have none, m
  // Reads a model of the files whose endings stand in further_endings (lower case, with the dot); the program's are MED and .vtu.
  std::function<FeModel(const std::filesystem::path&, const FeUnits&)> further_reader = {};
  std::vector<std::string> further_endings = {};
  ReduceOptions options;  // but for method, held, interfaces and nodes, which the words above say
};

struct RequestedReduction {
  FeModel model;
  Reduction reduction;
};

// Reads the model, completes it, reduces it. SI units. progress: called with what is done now; ask: called often; both may throw to stop.
// Throws InputError for words that say nothing and for what is wrong with the model, SimulationError for what cannot be computed.
RequestedReduction reduce(const ReduceRequest& request, const std::function<void(const std::string&)>& progress = {},
                          const std::function<void()>& ask = {});

}  // namespace flexframe::sim
