// Many runs of one scene: its keys over ranges, lists or by chance (design.h), and of each run some numbers (response.h).
//
// A sweep lives in a folder. sweep.toml is the question: scene, settings, responses, options, and fingerprints of all that the answer
// depends on. rows/shard_I_of_N.rows holds the points that are done (rows.h), those with number % N == I % N, as shards of pictures go;
// only one process writes such a file. A point's row depends on the question and its number alone, but for the CPU time: any number of
// workers and shards, killed and resumed, makes the same table (table.h).
#pragma once

#include "sim/run/histories_run.h"
#include "sim/sweep/design.h"
#include "sim/sweep/response.h"
#include "sim/sweep/rows.h"

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::sim {

// What --minimise and --maximise ask for.
struct GoalWords {
  std::string text;  // an expression, as of --response, or the name of a response; empty: points of a design
  bool maximise = false;
  std::vector<std::string> limits;  // "EXPRESSION <= NUMBER", ">="
  double precision = 1e-4;          // of the keys, in their ranges
};

// What is asked: all that decides the rows.
struct SweepQuestion {
  std::filesystem::path scene;  // file
  DesignWords design;
  std::vector<std::string> responses;                    // "EXPRESSION" or "NAME=EXPRESSION"
  std::optional<double> tolerance, accuracy, max_steps;  // in place of the scene's
  std::string method;
  bool estimate_error = true, check_effects = true;
  bool strict = false;   // a run that warns is a failed one
  double longest = 0.0;  // CPU s that one point may take; 0: any
  GoalWords goal;
};

// A response that must not be more, or less, than a number.
struct SweepLimit {
  std::size_t response = 0;
  bool at_most = true;
  double bound = 0.0;
  std::string text;  // as it was given
};
struct SweepGoal {
  std::size_t response = 0;
  bool maximise = false;
  std::vector<SweepLimit> limits;
};

// A sweep that is ready to run.
struct Sweep {
  std::filesystem::path folder;
  SweepQuestion question;
  Design design;
  std::string scene_text;            // of the file
  std::string inputs, program;       // SHA-256 of the scene with all files that it names, and of the program
  std::string identity;              // SHA-256 of the question with both
  std::vector<std::string> columns;  // of the scene's histories
  std::vector<Response> responses;
  std::vector<std::string> names;  // of the responses, those of goal and limits among them
  std::optional<SweepGoal> goal;
  int shards = 1;  // into which it was cut when it was begun; no part of the identity
};

// Reads and checks everything that can be before the first run: the scene, each key, each response. program: fingerprint of what will run
// it. Throws InputError naming option, file, line, key.
Sweep make_sweep(const SweepQuestion& question, const std::filesystem::path& folder, const std::string& program);

// sweep.toml: writes it (the folder must be there), reads it and makes the sweep of it. Throw FileError; InputError where there is none, or
// where scene, files or program are not those that it was begun with. program empty: whatever program it was.
void write_question(const Sweep& sweep);
Sweep read_sweep(const std::filesystem::path& folder, const std::string& program);

struct SharedSettings;  // shared_settings.h

// The row of one point, made in this process. Throws what stop throws, which is called now and then. shared: settings of an asked accuracy
// that all points share, or null.
SweepRow run_point(const Sweep& sweep, long point, const std::function<void()>& stop = {}, const SharedSettings* shared = nullptr);
// The same at values of the design's keys.
SweepRow run_values(const Sweep& sweep, long point, const std::vector<Design::Value>& values, const std::function<void()>& stop = {},
                    const SharedSettings* shared = nullptr);

// What a point is run with: its scene (throws InputError where that is none) and the options of the question.
Scene sweep_scene(const Sweep& sweep, const std::vector<Design::Value>& values);
SimulateOptions sweep_options(const Sweep& sweep);

struct SweepShard {
  int shard = 1, shards = 1;  // points with number % shards == shard % shards
  int workers = 0;            // 0: as many as cores may be used
  bool resume = false;        // keep the rows that are there, and run what is missing; of 1/1: also what other shards' files hold
  std::function<void(long done, long all)> progress = {};  // now and then; may throw to stop
};
struct ShardReport {
  long points = 0, kept = 0, made = 0, without = 0;  // of this shard; without: rows made now that lack a response
  double cpu = 0.0, wall = 0.0;                      // s, of the rows made now; of the whole
  double settings_cpu = 0.0;                         // s, of the search for settings that the points share
  std::string settings;                              // what these are; empty: none
};
// Runs what is missing of the shard into its file of rows. Throws InputError for a shard that is none, FileError.
ShardReport run_shard(const Sweep& sweep, const SweepShard& options);

std::filesystem::path rows_file(const std::filesystem::path& folder, int shard, int shards);
// Files of rows that a folder has: {shards, shard}, ascending.
std::vector<std::pair<int, int>> shards_in(const std::filesystem::path& folder);

// Median CPU s of a few points spread over the design, run here and now: for time limits. At most `most` of them, as long as they take
// less than `seconds` together.
double pilot_cpu(const Sweep& sweep, int most, double seconds);

}  // namespace flexframe::sim
