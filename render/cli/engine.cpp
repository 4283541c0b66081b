#include "render/cli/engine.h"

#include "render/cli/jobs.h"
#include "render/cli/terminal.h"

#include "sim/base/file_output.h"
#include "sim/base/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

#include <sys/wait.h>
#include <unistd.h>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

// The text as one word of a shell.
std::string shell_word(const std::string& text) {
  if (!text.empty() && text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=:+,") == text.npos)
    return text;
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

// A command line; a word "{}" becomes `shard`, "{cpus}" `cpus`, both as they are.
std::string shell_line(const std::vector<std::string>& words, const std::string& shard, const std::string& cpus) {
  std::string out = shell_word(program_file().string());
  for (const std::string& word : words) out += " " + (word == "{}" ? shard : word == "{cpus}" ? cpus : shell_word(word));
  return out;
}

bool is_installed(const std::string& program) {
  const char* path = std::getenv("PATH");
  const std::string all = path ? path : "";
  for (std::size_t at = 0; at <= all.size();) {
    const std::size_t colon = std::min(all.find(':', at), all.size());
    if (::access((fs::path(all.substr(at, colon - at)) / program).c_str(), X_OK) == 0) return true;
    at = colon + 1;
  }
  return false;
}

int run_script(const fs::path& script) {
  std::fflush(stdout);
  const pid_t process = ::fork();
  if (process < 0) throw std::runtime_error(fmt::format("cannot start {}: {}", script.string(), std::strerror(errno)));
  if (process == 0) {
    ::execlp("bash", "bash", script.c_str(), static_cast<char*>(nullptr));
    ::_exit(127);
  }
  int status = 0;
  while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {}
  throw_if_interrupted();
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

struct Script {
  fs::path file;
  std::string text;
};

std::string sbatch_lines(const EngineJob& job, const EngineWords& words, bool of_points) {
  std::string out = fmt::format("#SBATCH --job-name={}{}\n", job.name, of_points ? "" : "-collect");
  const auto log = [&](const char* file) { return (job.folder / "jobs" / file).string(); };
  if (of_points) {
    out += fmt::format("#SBATCH --array=1-{}\n#SBATCH --cpus-per-task={}\n", job.shards, words.cpus);
    if (job.task_seconds > 0.0) out += fmt::format("#SBATCH --time={}\n", minutes_for(job.task_seconds));
    out += fmt::format("#SBATCH --requeue\n#SBATCH --output=\"{}\"\n", log("task_%a.log"));
  } else {
    out += fmt::format("#SBATCH --requeue\n#SBATCH --output=\"{}\"\n", log("collect.log"));
  }
  out += "#SBATCH --open-mode=append\n";
  // The user's come last: they count.
  for (const std::string& word : words.sbatch) out += fmt::format("#SBATCH {}{}\n", word.starts_with("-") ? "" : "--", word);
  if (!words.sbatch_file.empty()) {
    std::ifstream file(words.sbatch_file);
    if (!file) throw UsageError(fmt::format("--sbatch-file {}: cannot be read", sim::quote(words.sbatch_file)));
    for (std::string line; std::getline(file, line);)
      if (line.starts_with("#SBATCH")) out += line + "\n";
  }
  return out;
}

std::vector<Script> scripts_of(const EngineJob& job, const EngineWords& words) {
  const fs::path folder = job.folder / "jobs";
  const std::string then = shell_line(job.then, "", "");
  if (words.engine == "parallel") {
    const std::string jobs = words.cpus > 1 ? fmt::format("--jobs $(( ($(nproc) + {}) / {} )) ", words.cpus - 1, words.cpus) : "";
    // A task that is ended from outside is begun again, twice.
    const std::string text = fmt::format(
        "#!/bin/bash\n# {} shards by GNU parallel, one process a core; what is killed is begun again and goes on where it was.\n"
        "seq 1 {} | parallel {}--retries 3 --joblog {} {}\n{}\n",
        job.shards, job.shards, jobs, shell_word((folder / "parallel.log").string()),
        shell_line(job.task, fmt::format("{{}}/{}", job.shards), fmt::format("{}", words.cpus)), then);
    return {{folder / "submit.sh", text}};
  }
  const std::string shard = fmt::format("\"$SLURM_ARRAY_TASK_ID/{}\"", job.shards);
  const std::string points =
      "#!/bin/bash\n" + sbatch_lines(job, words, true) + fmt::format("exec {}\n", shell_line(job.task, shard, "\"$SLURM_CPUS_PER_TASK\""));
  const std::string collect = "#!/bin/bash\n" + sbatch_lines(job, words, false) + fmt::format("exec {}\n", then);
  const std::string submit = fmt::format(
      "#!/bin/bash\nset -euo pipefail\ncd {}\npoints=$(sbatch --parsable points.sh)\npoints=${{points%%;*}}\n"
      "collect=$(sbatch --parsable --dependency=afterany:$points collect.sh)\n"
      "echo \"jobs         $points (tasks 1 to {}), then ${{collect%%;*}} (collect)\"\n",
      shell_word(folder.string()), job.shards);
  return {{folder / "points.sh", points}, {folder / "collect.sh", collect}, {folder / "submit.sh", submit}};
}

}  // namespace

void add_engine_words(Subcommand words, EngineWords& values) {
  words.option("--engine", values.engine, "who does the work: local (this process and its workers), parallel (GNU parallel) or slurm")
      .as("WORD")
      .one_of({"local", "parallel", "slurm"})
      .show_default();
  words.option("--shards", values.shards, "tasks into which parallel and slurm cut the work; default: by a pilot run").range(1, 100000);
  words.option("--cpus", values.cpus, "processes of each task").range(1, 1024).show_default();
  words.option("--sbatch", values.sbatch, "a word for sbatch, as often as wanted: partition=short, mem=2G, time=30").as("TEXT").one_word();
  words.option("--sbatch-file", values.sbatch_file, "file whose #SBATCH lines go into the job scripts").as("FILE");
  words.flag("--dry-run", values.dry_run, "write the scripts of the engine and print them: nothing is run");
}

int minutes_for(double seconds) { return std::max(1, static_cast<int>(std::ceil((3.0 * seconds + 120.0) / 60.0))); }

fs::path program_file() {
  std::error_code error;
  const fs::path file = fs::read_symlink("/proc/self/exe", error);
  return error ? fs::path("flexframe") : file;
}

std::string program_fingerprint() { return sim::sha256_of_file("/proc/self/exe"); }

int hand_over(const EngineJob& job, const EngineWords& words) {
  if (words.engine == "local") throw UsageError("--dry-run prints the scripts of --engine parallel or slurm; there are none for local");
  const std::vector<Script> scripts = scripts_of(job, words);
  make_folder(job.folder / "jobs");
  for (const Script& script : scripts) sim::write_whole_file(script.file, script.text);
  if (words.dry_run) {
    for (const Script& script : scripts) fmt::print("==> {}\n{}\n", script.file.string(), script.text);
    return 0;
  }
  const std::string program = words.engine == "slurm" ? "sbatch" : "parallel";
  if (!is_installed(program))
    throw UsageError(fmt::format("--engine {} needs the program {}, which is not there (Debian: {}); the scripts are in {}", words.engine,
                                 program, words.engine == "slurm" ? "slurm-client" : "parallel", (job.folder / "jobs").string()));
  const int code = run_script(scripts.back().file);
  if (words.engine == "slurm" && code == 0)
    fmt::print("when done    {} {}\n", shell_word(program_file().string()), fmt::join(job.then, " "));
  return code == 0 ? 0 : 1;
}

}  // namespace flexframe::cli
