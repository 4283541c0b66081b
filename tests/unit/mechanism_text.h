// Scenes of mechanisms as text, and what tests ask of their results.
#pragma once

#include "sim/base/spatial.h"
#include "sim/scene/scene_reader.h"
#include "sim/simulate.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

namespace flexframe::sim {

inline constexpr double pi = std::numbers::pi;

inline Results run(const std::string& text, double tolerance = 1e-6, std::optional<Method> method = {}) {
  SimulateOptions options;
  options.tolerance = tolerance;
  options.method = method;
  options.estimate_error = false;
  return simulate(parse_scene(text, "mechanism.toml"), options);
}

inline const VecX& column(const Results& r, const std::string& name) {
  for (const ResultOutput& o : r.outputs)
    if (o.column == name) return o.values;
  throw std::runtime_error("no column " + name);
}

inline double last(const Results& r, const std::string& name) { return column(r, name)[r.times.size() - 1]; }

inline Eigen::MatrixX3d positions(const Results& r, const std::string& name) {
  Eigen::MatrixX3d out(r.times.size(), 3);
  out << column(r, name + ".x"), column(r, name + ".y"), column(r, name + ".z");
  return out;
}

inline std::string list(const Vec3& v) { return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v.x(), v.y(), v.z()); }

inline std::string head(double duration, const Vec3& gravity, double rate = 100) {
  return fmt::format("[simulation]\nduration = {:.17g}\noutput_rate = {}\ngravity = {}\n", duration, rate, list(gravity));
}

inline std::string output(const std::string& name, const std::string& of, const std::string& quantity) {
  return fmt::format("[[output]]\nname = \"{}\"\nof = \"{}\"\nquantity = \"{}\"\n", name, of, quantity);
}

inline std::string joint(const std::string& name, const std::string& kind, const std::string& parent, const std::string& child,
                         const std::string& more) {
  return fmt::format("[[joint]]\nname = \"{}\"\nkind = \"{}\"\nparent = \"{}\"\nchild = \"{}\"\n{}\n", name, kind, parent, child, more);
}

// A rod of 1 m and 1 kg along x.
inline std::string rod(const std::string& name) {
  return fmt::format(
      "[[body]]\nname = \"{}\"\nkind = \"rigid\"\nmass = 1\ninertia = [0.001, 0.083333333333333333, 0.083333333333333333]\n"
      "centre_of_mass = [0.5, 0, 0]\nframes = {{ tip = [1, 0, 0] }}\n",
      name);
}

// Largest change of kinetic + strain + potential - supplied + dissipated, J.
inline double energy_gap(const Results& r) {
  const VecX gap = r.kinetic + r.strain + r.potential - r.supplied + r.dissipated;
  return (gap.array() - gap[0]).abs().maxCoeff();
}

// Times of the events whose sentence ends so ("sticks", "slips").
inline std::vector<double> events(const Results& r, const std::string& what) {
  std::vector<double> out;
  for (const std::string& note : r.statistics.notes.texts(Severity::note)) {
    double t = 0.0;
    if (std::sscanf(note.c_str(), "event at t = %lf", &t) == 1 && note.size() > what.size() &&
        note.compare(note.size() - what.size(), what.size(), what) == 0)
      out.push_back(t);
  }
  return out;
}

}  // namespace flexframe::sim
