// The settings that a search found, kept in a file: the same question of the same scene and program is answered without the search.
//
// The file (NAME.settings.toml) is TOML: what was chosen for each body and joint, the tolerance, the method, the statement of the error,
// what was told, and the SHA-256 of the outputs. A run that is made again from it counts only where its outputs are the same bits;
// otherwise the search begins anew. So a file that was changed by hand, or a setting that the file does not say, leads to no wrong number.
#pragma once

#include "sim/results/results.h"
#include "sim/scene/scene.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::sim {

struct RememberedSettings;

struct SettingsMemory {
  std::filesystem::path file;
  std::string question;  // fingerprint of all that the search depends on: scene, files that it names, program, options
  bool fresh = false;    // search anew, whatever the file holds
  std::shared_ptr<RememberedSettings> found = nullptr;  // where given: filled with what the search ended with, also without a file
};

// Errors of a run by output and time, as its search tells them.
struct ErrorSizes {
  VecX times;
  std::vector<std::string> columns;
  MatX shares;         // columns x times, no signs: of the output's range, or of the size that it is given
  double error = 0.0;  // the largest, of a whole vector
};

// What is kept of a search.
struct RememberedSettings {
  Scene scene;  // with the settings in it
  std::optional<Method> method;
  SolverStatistics statistics;  // error estimate, statement, notes
  std::string outputs;          // SHA-256
  ErrorSizes errors = {};       // not in the file
  double seen = 1.0;            // where pictures were asked: what they show of the error, as a share of it
};

// Gives a scene what a search has chosen for another one with the same bodies: models, elements, modes and effects of bodies, tolerance.
void take_choices(const Scene& chosen, Scene& scene);
// Whether two scenes say the same of all that a search may choose, and of the method.
bool same_choices(const Scene& a, const Scene& b);

// SHA-256 of the outputs' numbers.
std::string outputs_fingerprint(const Results& results);

// What the file says of this question; none where there is no such file, it belongs to another question or is damaged.
std::optional<RememberedSettings> recall_settings(const SettingsMemory& memory, const Scene& scene);

// Throws FileError.
void remember_settings(const SettingsMemory& memory, const RememberedSettings& settings);

}  // namespace flexframe::sim
