// Damaged copies of real files through the readers of bodies and finite element models, and what can be read through the reducer too. To be
// built with sanitizers (preset asan): a crash, a leak, undefined behaviour or a copy that takes more than 20 s of CPU time ends it with a
// code other than 0.
//   damaged_copies COPIES FILE...      COPIES of each file: .sid .SID_FEM .inp .bdf .msh, and .sti or .mtx (its .mas or mass, .dof and node
//   table beside it are damaged in turn)
// Damage: bytes changed, pieces cut, doubled or moved, numbers replaced by awkward ones, the end missing. Same seed, same copies.
#include "sim/bodies/sid.h"
#include "sim/reduce/reduce.h"
#include "tests/fuzz/damage.h"
#include "tests/fuzz/scratch.h"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>
#include <random>

#include <sys/time.h>

namespace {

using namespace flexframe::sim;
using flexframe::damaged;
namespace fs = std::filesystem;

std::string bytes_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) {
    std::fprintf(stderr, "%s: cannot be opened\n", path.c_str());
    std::exit(2);
  }
  return {std::istreambuf_iterator<char>(in), {}};
}

fs::path put(const std::string& text, const char* ending) {
  return fuzz::scratch_file(reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), ending);
}

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "%s\n", what);
  std::abort();
}

void check(const FlexibleBody& b) {
  require(std::isfinite(b.mass) && b.J0.allFinite() && b.Ke.allFinite() && b.Me.allFinite() && b.md1.allFinite() && b.J1.allFinite(),
          "a body with numbers that are not finite");
  for (const FlexibleNode& node : b.nodes)
    require(node.origin.allFinite() && node.phi.allFinite() && node.psi.allFinite(), "a node with numbers that are not finite");
}

void check(const FeModel& m) {
  for (const Vec3& x : m.nodes) require(x.allFinite(), "a node that is nowhere");
  for (int k : m.connectivity) require(k >= 0 && k < static_cast<int>(m.nodes.size()), "an element with a node that is not there");
  surface_obj(m);
  // Small ones go on through the solver.
  if (m.nodes.size() > 800) return;
  FeModel model = m;
  if (!model.matrices) set_material(model, {"steel", 2.1e11, 0.3, 7850.0});
  ReduceOptions o;
  o.modes = 3;
  o.held = model.constraints;
  o.node_count = 10;
  check(reduce(model, o).body);
}

// True: accepted. A refusal is an answer: lines that name the file or what is wrong, one for each complaint.
bool answered(const auto& action) {
  try {
    action();
    return true;
  } catch (const InputError& e) {
    const std::string text = e.what();
    require(!text.empty() && text.find("\n\n") == std::string::npos && text.back() != '\n',
            "a refusal without a word, or with an empty line");
  } catch (const SimulationError& e) {
    require(e.what()[0] != '\0', "a failure without a word");
  }
  return false;
}

// Ends the process after so many seconds of CPU time, which other work on the machine does not use up; 0: no longer.
void limit_cpu(int seconds) {
  const itimerval limit{{0, 0}, {seconds, 0}};
  ::setitimer(ITIMER_PROF, &limit, nullptr);
}

}  // namespace

int main(int count, char** words) {
  if (count < 3 || std::atoi(words[1]) < 1) {
    std::fprintf(stderr, "usage: damaged_copies COPIES FILE...\n");
    return 2;
  }
  std::mt19937 random(20061004);
  const int copies = std::atoi(words[1]);
  long accepted_all = 0, all = 0;
  double slowest_all = 0.0;
  for (int i = 2; i < count; ++i) {
    const fs::path path = words[i];
    const std::string ending = path.extension().string(), text = bytes_of(path);
    const bool matrices = ending == ".sti" || ending == ".mtx";
    const auto beside = [&](const char* other) { return fs::path(path).replace_extension(other); };
    int accepted = 0;
    double slowest = 0.0;
    for (int copy = 0; copy < copies; ++copy) {
      limit_cpu(20);
      const std::clock_t start = std::clock();
      accepted += answered([&] {
        if (ending == ".inp") {
          check(read_inp(put(damaged(text, random), ".inp")));
        } else if (ending == ".bdf") {
          check(read_nastran(put(damaged(text, random), ".bdf")));
        } else if (ending == ".msh") {
          check(read_msh(put(damaged(text, random), ".msh")));
        } else if (matrices) {
          // One of the four files at a time.
          const int which = copy % 4;
          const auto file = [&](int k, const fs::path& original, const char* name) {
            return k == which ? put(damaged(bytes_of(original), random), name) : original;
          };
          check(read_fe_matrices(file(0, path, ".sti"), file(1, beside(".mas"), ".mas"), file(2, beside(".inp"), ".inp"),
                                 file(3, beside(".dof"), ".dof")));
        } else {
          const SidFile sid = read_sid_text(damaged(text, random), "copy").file;
          require(read_sid_text(write_sid_text(sid), "again").file == sid, "what was written is not what was read");
          check(to_flexible_body(sid, "copy"));
        }
      });
      slowest = std::max(slowest, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    }
    limit_cpu(0);
    std::printf("%-40s %d copies: %d accepted, %d refused, slowest %.2f s\n", path.filename().c_str(), copies, accepted, copies - accepted,
                slowest);
    std::fflush(stdout);
    accepted_all += accepted;
    all += copies;
    slowest_all = std::max(slowest_all, slowest);
  }
  std::printf("%ld damaged copies: %ld accepted, %ld refused, no crash, no hang, slowest %.2f s\n", all, accepted_all, all - accepted_all,
              slowest_all);
  return 0;
}
