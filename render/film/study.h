// What accuracy costs in time: a scene run over its settings, against a reference that the study makes itself.
//
// Points and axes. A point is the scene with one setting (tolerance, method, elements, ...). Each is run once for its histories and a few
// times more, interleaved with all others, for the median of its CPU time. Two errors are told, both as in sim/results/histories.h (largest
// over time, relative to the range of each output): `error` against the study's reference, with everything that is wrong at that setting,
// and `axis_error` against the finest point of its own series, which is the error of that one knob. Orders are slopes of axis_error.
//
// The reference is refined (twice the elements, a tenth of the tolerance) until two agree; its own error is estimated from the last
// difference. A point nearer than three times that is at the floor: not a number but a bound.
//
// Every run is kept in folder/runs, so that an interrupted study goes on where it stopped.
#pragma once

#include "render/film/study_overview.h"
#include "sim/results/histories.h"
#include "sim/scene/scene.h"

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::film {

// tolerance method elements kept modes volumes model stiffening nodes scheme samples
const std::vector<std::string>& study_axes();

struct StudyOptions {
  std::vector<std::string> axes;                                           // empty: all that the scene has
  int repeats = 3;                                                         // of every run, for the median CPU time
  double longest = 0.0;                                                    // CPU s of one run; 0: twenty times the scene's own, at least 5
  double seconds = 60.0;                                                   // CPU s that the study may take in all
  double reference_seconds = 0.0;                                          // of them for the reference; 0: a sixth
  std::optional<std::filesystem::path> reference;                          // histories (CSV) instead of an own one
  std::filesystem::path folder;                                            // everything goes there
  bool resume = false;                                                     // keep what folder/runs has of the same scene and program
  std::string version;                                                     // of the program
  std::string command;                                                     // for the report: how it is made again
  std::function<void(double fraction, const std::string& what)> progress;  // may throw to stop
};

struct StudyPoint {
  std::string axis, series, label;  // "elements", "finite-element", "10 elements"
  double knob = 0.0;                // the number that the axis varies; 0: a word
  std::string setting;              // words for the scene or the command line that give this point
  double tolerance = 0.0;
  std::string method;
  int coordinates = 0;      // elastic
  std::vector<double> cpu;  // s, every repeat
  double median_cpu = 0.0;
  double error = -1.0, axis_error = -1.0;  // negative: not measured
  std::string column;                      // of error
  std::vector<double> column_errors;       // per column of the study
  bool floor = false, axis_floor = false, front = false;
  std::string failure;  // why there is no run
};

struct StudyOrder {
  std::string axis, series;
  double order = 0.0;
  int points = 0;
};
struct StudyAdvice {
  double wanted = 0.0;
  int point = -1;
};  // -1: no point is that accurate

// What interpolation and antialiasing cost a picture: errors relative to the largest displacement, or of pixels in 1/255.
struct PicturePoint {
  std::string axis, series, label;
  double knob = 0.0, cpu = 0.0, error = 0.0;  // CPU s a picture
  std::string failure;
};

struct Study {
  std::string title, scene_file, command;
  std::vector<std::string> columns;
  std::string reference;          // what it is
  double reference_error = 0.0;   // estimated
  bool reference_judged = false;  // by a coarser one; else its error is not known
  double reference_cpu = 0.0;
  std::vector<StudyPoint> points;
  std::vector<StudyOrder> orders;
  std::vector<StudyAdvice> advice;  // 1e-2, 1e-3, 1e-4, 1e-5
  std::vector<PicturePoint> pictures;
  std::optional<StudyOverview> overview;  // the figure that it leads with
  std::vector<std::string> notes;
};

// One shard's share of the runs, kept in options.folder as run_study keeps them, so that run_study with `resume` finds them all: points
// with number % shards == shard % shards, and of shard 1 the scene as it stands and the reference. options.longest must be given, because
// it decides which runs count. Throws sim::InputError as run_study does, and for a shard that is none.
void run_study_shard(const sim::Scene& scene, const StudyOptions& options, int shard, int shards);

// Throws sim::InputError for a scene without outputs, an axis that it does not have or a reference that does not fit.
Study run_study(const sim::Scene& scene, const StudyOptions& options);

// study.csv, study.json, study.md and the diagrams front and one an axis (SVG and PNG) into the folder.
void write_study(const Study& study, const std::filesystem::path& folder);

}  // namespace flexframe::film
