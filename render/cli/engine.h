// Work that is cut into shards, for engines that exist: GNU parallel on one machine, Slurm on many. The program writes scripts and hands
// them over; it has no scheduler of its own.
//
// Every script is a file of FOLDER/jobs: first.sh (before all, where there is such work), tasks.sh (an array of tasks, one a shard),
// last.sh (after all of them), submit.sh. A task that is killed and started again goes on where it was, because its command resumes; what
// is still missing at the end, the last one tells or makes.
#pragma once

#include "render/cli/command.h"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace flexframe::cli {

// --engine, --shards, --sbatch, --sbatch-file, --dry-run
struct EngineWords {
  std::string engine = "local", sbatch_file;
  std::vector<std::string> sbatch;
  int shards = 0, cpus = 1;
  bool dry_run = false;
  bool elsewhere() const { return engine != "local" || dry_run; }
};
void add_engine_words(Subcommand words, EngineWords& values);

struct EngineJob {
  std::string name;                     // of the job
  std::filesystem::path folder;         // absolute; scripts go to folder/jobs
  std::vector<std::string> first = {};  // words of flexframe before all shards, which are not begun where it fails; empty: none
  std::vector<std::string> task;        // words of flexframe for one shard, in which {} stands for "I/N" and {cpus} for its processes
  std::vector<std::string> last;        // words of flexframe once all shards have ended
  int shards = 1;
  double task_seconds = 0.0;  // wall seconds that a shard takes, by a pilot run; 0: unknown
};

// The words of this program's command line behind its name, without those of add_engine_words.
std::vector<std::string> words_without_engine();

// "I/N" of --shard; 1/1 where it is empty. Throws UsageError.
std::pair<int, int> shard_of(const std::string& text);

// A limit of time for a task: three times what the pilot run says and two minutes, in whole minutes.
int minutes_for(double seconds);

// Writes the scripts; prints them for --dry-run, else hands them over. With parallel returns after `last` has run, with its exit code; with
// Slurm as soon as the jobs are queued. Throws UsageError for an engine that is not installed, FileError.
int hand_over(const EngineJob& job, const EngineWords& words);

// The program's own file, and what tells one build of it from another.
std::filesystem::path program_file();
std::string program_fingerprint();

}  // namespace flexframe::cli
