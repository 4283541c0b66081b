// From a finite element model to a flexible body: the chain of Heckmann et al. 2006 section 4 in one call.
//
//   model -> matrices -> displacement fields (modes, constraint modes, response modes) -> orthonormal, sorted -> integrals -> FlexibleBody
//
// The body frame is the model's frame: its origin and axes. Without held points the elastic coordinates are orthogonal to the rigid
// motions (mean axes: md1 = 0 and Cr0 = 0), with held points the frame is the one clamped there. Me = 1, Ke = diag(omega^2).
// Theory and measurements: REDUCE.md.
#pragma once

#include "sim/bodies/body_file.h"
#include "sim/bodies/flexible_body.h"
#include "sim/bodies/further_shapes.h"
#include "sim/bodies/sid_lack.h"
#include "sim/reduce/fe_model.h"

#include <filesystem>
#include <functional>

namespace flexframe::sim {

enum class ReduceMethod {
  automatic,      // craig_bampton where there are interfaces, else eigenmodes
  eigenmodes,     // the lowest modes
  guyan,          // static: one field per motion of the interfaces (R. J. Guyan 1965)
  craig_bampton,  // those and `modes` modes with the interfaces held (R. R. Craig, M. C. C. Bampton 1968)
  response        // modes up to `highest`, and responses to unit loads at the interfaces at half of `lowest` (Heckmann et al. 2006 eq. 11)
};

// A place where the multibody system takes hold of the body.
struct ReduceInterface {
  int node = -1;     // index, or
  int spider = -1;   // index of model.spiders
  std::string name;  // of the body's node; empty: node[ID]
};

struct ReduceOptions {
  ReduceMethod method = ReduceMethod::automatic;
  int modes = 10;        // eigenmodes, or modes with interfaces held
  double highest = 0.0;  // Hz: > 0: all modes up to it instead of `modes`
  double lowest = 0.0;   // Hz, response: lowest frequency of interest; 0: the first elastic one
  double cut_off =
      5.0;  // modes of the reduced model above this many times `highest` are dropped (guyan, craig_bampton, response; 0: none) ...
  double static_error =
      0.005;  // ... but those that the static deflection at the interfaces needs to be this exact (0: the cut-off alone decides)
  std::vector<FeConstraint> held;  // empty: free body
  std::vector<ReduceInterface> interfaces;
  std::vector<int> nodes;  // kept besides the interfaces; empty: spread automatically
  int node_count = 97;     // of all kept nodes when spread automatically
  bool stiffening = true;  // geometric stiffness of forces at nodes, accelerations, angular velocity products, ...
  int stiffening_limit =
      120;  // ... at all nodes up to this many pairs of elastic coordinates, each of which costs a static solution (15 coordinates);
            // beyond, at the interfaces only (three static solutions each), and without interfaces not at all ...
  bool stiffening_forced = false;  // ... unless this asks for all nodes
  bool stress = false;             // stress per mode at the kept nodes
  bool surface = false;            // the displacement (and stress, if that is asked for) at all nodes of the surface: Reduction::surface
  double damping = 0.0;            // ratio of critical damping of every mode
  int threads = 1;                 // of the dense kernels in the factorisation; more take less time but more CPU
  std::filesystem::path scratch;   // folder for the factor of the stiffness matrix, out of core; empty: it is kept in memory
  double memory_limit = 0.0;       // bytes; 0: what the machine has free. Refused before the work when the estimate exceeds it
};

struct ReduceReport {
  int degrees_of_freedom = 0, elements = 0, nodes = 0, rigid_motions = 0;
  double factor_entries = 0.0, estimated_bytes = 0.0;
  VecX frequencies;       // Hz, of the elastic coordinates
  VecX full_frequencies;  // Hz, of the full model's modes that were computed
  VecX mesh_errors;       // of the lowest of `frequencies`: share by which the mesh is estimated to miss them; empty: no estimate
  double compliance_error =
      0.0;  // largest relative error of the static deflection at the interfaces under unit forces there; -1: no interfaces
  std::vector<InterfaceLack> lacks;  // of each interface
  double right_up_to = 0.0;          // Hz: so far the free modes of the reduced model are the model's (0: not known)
  std::vector<std::string> notes, warnings;
  struct Stage {
    std::string name;
    double cpu = 0.0;
  };
  std::vector<Stage> stages;  // CPU seconds
};

struct Reduction {
  FlexibleBody body;
  FurtherShapes further;  // beside interfaces and but for eigenmodes
  BodySurface surface;    // where ReduceOptions::surface asks for it and the model has faces
  ReduceReport report;
};

// Throws InputError for what is wrong with the model or the options, SimulationError for what cannot be computed (memory, convergence).
// ask: called in the calling thread between the steps, some fifty times a second in the longest, the factorisation; may throw whatever
// shall end the call. A factorisation then goes on in a thread beside until it is done or the process ends; the next one waits for it.
Reduction reduce(const FeModel& model, const ReduceOptions& options, const std::function<void(const std::string&)>& progress = {},
                 const std::function<void()>& ask = {});

// Undeformed outer surface as Wavefront text; faces of quadratic elements are divided at their mid-edge nodes.
std::string surface_obj(const FeModel& model);

}  // namespace flexframe::sim
