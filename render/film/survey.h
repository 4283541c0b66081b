// A first look at the whole motion: how far bodies deform and where they go, before any picture is drawn.
#pragma once

#include "render/film/body_model.h"
#include "render/film/settings.h"

#include <glm/glm.hpp>

#include <limits>
#include <utility>
#include <vector>

namespace flexframe::film {

// Surveyed at every picture of a short sequence; of a long one at 200 even ones, the 32 with the largest node displacements, and those at
// which what bodies are coloured by is likely to be largest (of speeds the fastest, of strain and stress those of the largest coordinates);
// and at the samples, between pictures too, at which a body reaches farthest in one of 26 directions.
struct Survey {
  struct Moment {
    double t = 0.0;
    double largest_scalar = 0.0;  // of what the visible bodies are coloured by, without its sign
    double lowest_scalar = std::numeric_limits<double>::infinity(), highest_scalar = -lowest_scalar;  // with it; nothing: crossed
    std::vector<glm::dmat4> pose;                                                                     // a body each
    std::vector<std::vector<glm::vec3>> displacement;  // of the support points of each body; empty: rigid
  };
  std::vector<std::vector<glm::dvec3>> support;  // a body each: vertices that bound it, undeformed
  std::vector<Moment> moments;
  double largest_displacement = 0.0;  // m, of any vertex of a visible body
  double largest_scalar = 0.0;        // of what the visible bodies are coloured by
  double lowest_scalar = std::numeric_limits<double>::infinity(), highest_scalar = -lowest_scalar;
  double largest_turn = 0.0;  // rad, of any triangle by the elastic displacement
};

// A body of the results, and what it is coloured by.
struct ColoredBody {
  const BodyModel& model;
  const sim::Results& results;
  size_t body;
  const RenderSettings& settings;
  bool shares = true;  // stress as a share of the yield stress where that is known
};
struct ScalarMemory {
  std::vector<float> before, after;
  std::vector<glm::dvec3> velocity;
  BodyMemory body;
  // What the scalars are the length of (3 a vertex) or the von Mises stress of (6 a vertex, as stress modes have them); else empty.
  bool wanted = false;
  std::vector<float> components;
};
// A number a vertex at time t; memory.displacement must be up to date. Empty: nothing.
void update_scalars(const ColoredBody& of, double t, const BodyMemory& memory, ScalarMemory& work, std::vector<float>& scalars);

// Speed of every vertex in the world, m/s: difference of its places over that many spacings of samples about t. Needs two samples.
void update_speeds(const ColoredBody& of, double t, double spacings, ScalarMemory& work, std::vector<float>& scalars);

// What the stress of a body may be off by, Pa, because its accelerations are differences of samples: by what those of twice the spacing
// differ (a third of it is left, the error going with the square of the spacing). Bodies whose stress counts no inertia: 0.
double doubt_of_inertia(const ColoredBody& of, double t, ScalarMemory& work);

// The stress that colours a vertex as numbers whose length it is, linear in the body's elastic coordinates: 3 a vertex of a beam (normal
// and shear stress), 6 of a body with stress modes (deviator). Returns how many; 0: the stress is no such length.
int update_stress_vectors(const ColoredBody& of, double t, ScalarMemory& work, std::vector<float>& vectors);

// Whether what lies between the corners of faces differs from their mean by more than 0.5 % of `range`: components as of ScalarMemory.
bool is_coarse(const std::vector<glm::ivec3>& triangles, const std::vector<float>& components, double range);

Survey survey_motion(const sim::Results& results, const std::vector<BodyModel>& bodies, const RenderSettings& settings);

// Points that enclose everything drawn at every surveyed moment, with these scales; follow >= 0: relative to that body's way.
// window: only moments in that time, s; null: all.
std::vector<glm::dvec3> motion_points(const Survey& survey, const std::vector<double>& scales, int follow,
                                      const std::pair<double, double>* window = nullptr);

// Diagonal of the box around all bodies' origins, nodes and meshes over the run, m; 1 for a single point that stays. bodies: those whose
// meshes are known by now, parallel to the results', or none.
double machine_size(const sim::Results& results, const std::vector<BodyModel>& bodies);

}  // namespace flexframe::film
