#include "render/cli/engine.h"

#include "render/cli/jobs.h"
#include "render/cli/shell_word.h"
#include "render/cli/terminal.h"

#include "sim/base/file_output.h"
#include "sim/base/files_read.h"
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

#include <elf.h>
#include <link.h>
#include <sys/wait.h>
#include <unistd.h>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

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

enum class Stage { first, tasks, last };
const char* stage_word(Stage stage) { return stage == Stage::first ? "first" : stage == Stage::tasks ? "tasks" : "last"; }

std::string sbatch_lines(const EngineJob& job, const EngineWords& words, Stage stage) {
  const bool of_tasks = stage == Stage::tasks;
  std::string out = fmt::format("#SBATCH --job-name={}{}\n", job.name, of_tasks ? std::string() : fmt::format("-{}", stage_word(stage)));
  const auto log = [&](const char* file) { return (job.folder / "jobs" / file).string(); };
  if (of_tasks) {
    out += fmt::format("#SBATCH --array=1-{}\n#SBATCH --cpus-per-task={}\n", job.shards, words.cpus);
    if (job.task_seconds > 0.0) out += fmt::format("#SBATCH --time={}\n", minutes_for(job.task_seconds));
    out += fmt::format("#SBATCH --requeue\n#SBATCH --output=\"{}\"\n", log("task_%a.log"));
  } else {
    out += fmt::format("#SBATCH --requeue\n#SBATCH --output=\"{}.log\"\n", log(stage_word(stage)));
  }
  out += "#SBATCH --open-mode=append\n";
  // The user's come last: they count.
  for (const std::string& word : words.sbatch) out += fmt::format("#SBATCH {}{}\n", word.starts_with("-") ? "" : "--", word);
  if (!words.sbatch_file.empty()) {
    std::ifstream file(words.sbatch_file);
    if (!file) throw UsageError(fmt::format("--sbatch-file {}: cannot be read", sim::quote(words.sbatch_file)));
    for (std::string line; std::getline(file, line);)
      if (line.starts_with("#SBATCH")) out += line + "\n";
    sim::require_whole(file, words.sbatch_file);
  }
  return out;
}

std::vector<Script> scripts_of(const EngineJob& job, const EngineWords& words) {
  const fs::path folder = job.folder / "jobs";
  // Relative names of files go on from where the program was called.
  const std::string head = fmt::format("#!/bin/bash\ncd {} || exit 1\n", shell_word(fs::current_path().string()));
  const std::string last = shell_line(job.last, "", ""), first = job.first.empty() ? "" : shell_line(job.first, "", "");
  if (words.engine == "parallel") {
    const std::string jobs = words.cpus > 1 ? fmt::format("--jobs $(( ($(nproc) + {}) / {} )) ", words.cpus - 1, words.cpus) : "";
    // A task that is ended from outside is begun again, twice.
    const std::string text =
        head + (first.empty() ? "" : first + " || exit 1\n") +
        fmt::format("seq 1 {} | parallel {}--retries 3 --joblog {} {}\n{}\n", job.shards, jobs,
                    shell_word((folder / "parallel.log").string()),
                    shell_word(shell_line(job.task, fmt::format("{{}}/{}", job.shards), fmt::format("{}", words.cpus))), last);
    return {{folder / "submit.sh", text}};
  }
  const std::string shard = fmt::format("\"$SLURM_ARRAY_TASK_ID/{}\"", job.shards);
  const auto script = [&](Stage stage, const std::string& line) {
    return "#!/bin/bash\n" + sbatch_lines(job, words, stage) + head.substr(head.find('\n') + 1) + "exec " + line + "\n";
  };
  const std::string submit = fmt::format(
      "#!/bin/bash\nset -euo pipefail\ncd {}\n{}tasks=$(sbatch --parsable {}tasks.sh)\ntasks=${{tasks%%;*}}\n"
      "last=$(sbatch --parsable --dependency=afterany:$tasks last.sh)\n"
      "echo \"jobs         $tasks (tasks 1 to {}), then ${{last%%;*}}\"\n",
      shell_word(folder.string()), first.empty() ? "" : "first=$(sbatch --parsable first.sh)\nfirst=${first%%;*}\n",
      first.empty() ? "" : "--dependency=afterok:$first --kill-on-invalid-dep=yes ", job.shards);
  std::vector<Script> scripts = {{folder / "tasks.sh", script(Stage::tasks, shell_line(job.task, shard, "\"$SLURM_CPUS_PER_TASK\""))},
                                 {folder / "last.sh", script(Stage::last, last)},
                                 {folder / "submit.sh", submit}};
  if (!first.empty()) scripts.insert(scripts.begin(), {folder / "first.sh", script(Stage::first, first)});
  return scripts;
}

}  // namespace

void add_engine_words(Subcommand words, EngineWords& values) {
  words.option("--engine", values.engine, "who does the work: local (this process and its workers), parallel (GNU parallel) or slurm")
      .as("WORD")
      .one_of({"local", "parallel", "slurm"})
      .show_default();
  words.option("--shards", values.shards, "tasks into which parallel and slurm cut the work; default: by a pilot run").range(1, 100000);
  words.option("--cpus", values.cpus, "processes of each task").range(1, 1024).show_default();
  words.option("--sbatch", values.sbatch, "a word for sbatch, as often as wanted: partition=short, mem=2G, time=30")
      .as("WORD=VALUE")
      .one_word();
  words.option("--sbatch-file", values.sbatch_file, "file whose #SBATCH lines go into the job scripts").as("FILE");
  words.flag("--dry-run", values.dry_run, "write the scripts of the engine and print them: nothing is run");
}

std::vector<std::string> words_without_engine() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> all, out;
  for (std::string word; std::getline(file, word, '\0');) all.push_back(word);
  const std::vector<std::string> with_value = {"--engine", "--shards", "--cpus", "--sbatch", "--sbatch-file"};
  for (std::size_t k = 1; k < all.size(); ++k) {
    const std::string name = all[k].substr(0, all[k].find('='));
    if (name == "--dry-run") continue;
    if (std::find(with_value.begin(), with_value.end(), name) == with_value.end()) out.push_back(all[k]);
    else if (name == all[k]) ++k;
  }
  return out;
}

std::pair<int, int> shard_of(const std::string& text) {
  int shard = 1, shards = 1, read = 0;
  if (text.empty()) return {1, 1};
  if (std::sscanf(text.c_str(), "%6d/%6d%n", &shard, &shards, &read) != 2 || read != static_cast<int>(text.size()) || shard < 1 ||
      shard > shards)
    throw UsageError(fmt::format("--shard {} must be I/N with whole numbers, 1 <= I <= N", text));
  return {shard, shards};
}

int minutes_for(double seconds) { return std::max(1, static_cast<int>(std::ceil((3.0 * seconds + 120.0) / 60.0))); }

fs::path program_file() {
  std::error_code error;
  const fs::path file = fs::read_symlink("/proc/self/exe", error);
  return error ? fs::path("flexframe") : file;
}

namespace {

// The linker's mark of a loaded file, a hash of all that it linked; empty where it left none.
std::string build_id(const dl_phdr_info& info) {
  for (int k = 0; k < info.dlpi_phnum; ++k) {
    const ElfW(Phdr)& segment = info.dlpi_phdr[k];
    if (segment.p_type != PT_NOTE) continue;
    // NOLINTNEXTLINE(performance-no-int-to-ptr): the loader gives the address of a segment as a number
    const char *at = reinterpret_cast<const char*>(info.dlpi_addr + segment.p_vaddr), *const end = at + segment.p_memsz;
    while (at + sizeof(ElfW(Nhdr)) <= end) {
      ElfW(Nhdr) note;
      std::memcpy(&note, at, sizeof note);
      const auto padded = [](size_t size) { return (size + 3) & ~size_t{3}; };
      const char *const name = at + sizeof note, *const content = name + padded(note.n_namesz);
      at = content + padded(note.n_descsz);
      if (note.n_type != NT_GNU_BUILD_ID || note.n_namesz != 4 || std::memcmp(name, "GNU", 4) != 0 || at > end) continue;
      std::string id;
      for (size_t b = 0; b < note.n_descsz; ++b) id += fmt::format("{:02x}", static_cast<unsigned char>(content[b]));
      return id;
    }
  }
  return "";
}

}  // namespace

// Reading the whole program for its hash takes longer than a short simulation: only where the linker left no mark.
std::string program_fingerprint() {
  std::string id;
  dl_iterate_phdr(
      [](dl_phdr_info* info, size_t, void* out) {
        *static_cast<std::string*>(out) = build_id(*info);
        return 1;  // the program itself comes first
      },
      &id);
  return id.empty() ? sim::sha256_of_file("/proc/self/exe") : id;
}

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
  if (words.engine == "slurm" && code == 0) fmt::print("when done    {}\n", shell_line(job.last, "", ""));
  return code == 0 ? 0 : 1;
}

}  // namespace flexframe::cli
