// A steel cantilever under a force at its tip, and what tests ask of its results.
#pragma once

#include "sim/run/run_scene.h"
#include "tests/unit/mechanism_text.h"

#include <algorithm>

namespace flexframe::sim {

// simulation: lines of its table; model: of the beam's; force: N, of t.
inline Scene cantilever(const std::string& simulation, const std::string& model, const std::string& force) {
  const std::string text = fmt::format(R"([simulation]
{}
[[body]]
name = "beam"
kind = "beam"
length = 1.0
section = {{ shape = "rectangle", width = 0.02, height = 0.02 }}
material = {{ density = 7850, youngs_modulus = 2.1e11 }}
{}
[[force]]
kind = "force"
on = "beam.tip"
direction = [0, 1, 0]
value = "{}"
)",
                                       simulation, model, force);
  return parse_scene(text + joint("clamp", "weld", "ground", "beam.root", "") + output("tip", "beam.tip", "position"), "cantilever.toml");
}

inline Results run_cantilever(const std::string& simulation, const std::string& model, const std::string& force,
                              const SimulateOptions& options) {
  return run_scene(cantilever(simulation, model, force), options);
}

inline const VecX& tip(const Results& results) { return column(results, "tip.y"); }

inline bool said(const Results& results, Severity severity, const std::string& words) {
  const std::vector<std::string> texts = results.statistics.notes.texts(severity);
  return std::any_of(texts.begin(), texts.end(), [&](const std::string& t) { return t.find(words) != std::string::npos; });
}

}  // namespace flexframe::sim
