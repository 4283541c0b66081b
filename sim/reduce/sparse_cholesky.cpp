// MUMPS behind SparseCholesky. The only file that knows it.
#include "sim/reduce/sparse_cholesky.h"

#include "sim/reduce/sparse_libraries.h"

#include <fmt/format.h>

#include <unistd.h>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <mutex>
#include <numeric>
#include <thread>
#include <vector>

namespace flexframe::sim {
namespace {

constexpr std::chrono::milliseconds patience(20);

// MUMPS keeps data of a call in variables of the process, METIS draws from rand(): one call at a time. Whoever waits is asked meanwhile.
std::timed_mutex in_use;
std::unique_lock<std::timed_mutex> alone(const std::function<void()>& ask = {}) {
  std::unique_lock lock(in_use, std::defer_lock);
  while (!lock.try_lock_for(patience))
    if (ask) ask();
  return lock;
}

// Threads that factorise, some of them for nobody any more. At exit the libraries that they are in are taken down under them, and to wait
// for them could take minutes: the process then ends without taking down anything.
std::atomic<int> factorising = 0;
struct Counted {
  Counted() { ++factorising; }
  ~Counted() { --factorising; }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;
};
#ifdef __GLIBC__
[[maybe_unused]] const int told = ::on_exit(
    [](int status, void*) {
      if (factorising == 0) return;
      std::fflush(nullptr);
      ::_exit(status);
    },
    nullptr);
#endif

}  // namespace

struct SparseCholesky::State {
  mutable DMUMPS_STRUC_C mumps{};
  Eigen::SparseMatrix<double> matrix;  // its rows are numbered from 1 once MUMPS has them
  std::vector<int> columns, order;
  int threads = 1;
  bool begun = false;
  std::atomic<bool> given_up = false;  // nobody waits for the factor

  // MUMPS' arrays are numbered from 1 in its manual.
  int& icntl(int i) const { return mumps.icntl[i - 1]; }
  void call(int job) const {
    mumps.job = job;
    sim::mumps().call(&mumps);
  }
  void factorise() {
    if (given_up) return;
    openblas().set_threads(threads);  // OpenMP's number is each thread's own: with another one the last bits would differ
    call(2);
    if (mumps.infog[0] == -9 || mumps.infog[0] == -8) {
      icntl(14) = 60;
      call(2);
    }
  }
  ~State() {
    if (!begun) return;
    const auto lock = alone();
    call(-2);
  }
};

namespace {

// Place in the elimination of each unknown, from 1. METIS works on groups of unknowns with equal columns (the motions of a node),
// which makes its graph three to six times smaller than MUMPS would give it.
std::vector<int> nested_dissection(const Eigen::SparseMatrix<double>& lower) {
  const int n = static_cast<int>(lower.rows());
  const int *outer = lower.outerIndexPtr(), *inner = lower.innerIndexPtr();
  std::vector<int> group(n, 0);
  int groups = 0;
  for (int c = 0; c < n; ++c) {
    const auto same = [&] {
      const int previous = outer[c - 1], here = outer[c];
      return outer[c] - previous == outer[c + 1] - here + 1 && std::equal(inner + here, inner + outer[c + 1], inner + previous + 1);
    };
    if (c > 0 && !same()) ++groups;
    group[c] = groups;
  }
  groups = n == 0 ? 0 : groups + 1;
  // Graph of groups, both directions, each edge once.
  std::vector<int> first(groups + 1, n);
  for (int c = n - 1; c >= 0; --c) first[group[c]] = c;
  std::vector<idx_t> degree(groups + 1, 0), weight(groups);
  const auto each_edge = [&](auto&& edge) {
    for (int g = 0; g < groups; ++g) {
      int last = g;
      for (int k = outer[first[g]]; k < outer[first[g] + 1]; ++k)
        if (const int h = group[inner[k]]; h != last) edge(g, last = h);
    }
  };
  each_edge([&](int g, int h) { ++degree[g + 1], ++degree[h + 1]; });
  std::partial_sum(degree.begin(), degree.end(), degree.begin());
  std::vector<idx_t> neighbours(degree.back()), at(degree.begin(), degree.end() - 1), permutation(groups), inverse(groups);
  each_edge([&](int g, int h) {
    neighbours[at[g]++] = h;
    neighbours[at[h]++] = g;
  });
  for (int g = 0; g < groups; ++g) weight[g] = first[g + 1] - first[g];
  idx_t count = groups, options[METIS_NOPTIONS];
  metis().defaults(options);
  if (metis().nested_dissection(&count, degree.data(), neighbours.data(), weight.data(), options, permutation.data(), inverse.data()) !=
      METIS_OK)
    throw SimulationError("sparse factorisation: METIS could not order the matrix");
  std::vector<int> order(n);
  int place = 0;
  for (int k = 0; k < groups; ++k)
    for (int c = first[permutation[k]]; c < first[permutation[k] + 1]; ++c) order[c] = ++place;
  return order;
}

}  // namespace

SparseCholesky::SparseCholesky(Eigen::SparseMatrix<double>&& lower, int threads, std::function<void()> asked, const std::string& scratch)
    : state(std::make_shared<State>()), ask(std::move(asked)) {
  const auto lock = alone(ask);
  DMUMPS_STRUC_C& m = state->mumps;
  state->threads = threads;
  state->begun = true;
  m.par = 1;
  m.sym = 1;                 // positive definite
  m.comm_fortran = -987654;  // MUMPS' name for MPI_COMM_WORLD
  state->call(-1);
  for (int i = 1; i <= 4; ++i) state->icntl(i) = i == 4 ? 0 : -1;  // silent
  state->icntl(7) = 1;                                             // the ordering below
  state->icntl(14) = 5;                                            // per cent of room beyond the estimate, which is exact without pivoting
  if (!scratch.empty()) {
    if (scratch.size() + 1 > sizeof(m.ooc_tmpdir))
      throw InputError(fmt::format("the name of the scratch folder is longer than {} characters", sizeof(m.ooc_tmpdir) - 1));
    state->icntl(22) = 1;
    std::snprintf(m.ooc_tmpdir, sizeof(m.ooc_tmpdir), "%s", scratch.c_str());
  }
  lower.makeCompressed();
  state->order = nested_dissection(lower);
  // MUMPS reads the matrix where it lies: a copy would be a tenth of the factor.
  state->matrix.swap(lower);
  Eigen::SparseMatrix<double>& A = state->matrix;
  state->columns.reserve(A.nonZeros());
  for (int c = 0; c < A.outerSize(); ++c)
    state->columns.insert(state->columns.end(), A.outerIndexPtr()[c + 1] - A.outerIndexPtr()[c], c + 1);
  for (Eigen::Index k = 0; k < A.nonZeros(); ++k) ++A.innerIndexPtr()[k];
  m.n = static_cast<int>(A.rows());
  m.nnz = static_cast<MUMPS_INT8>(A.nonZeros());
  m.irn = A.innerIndexPtr();
  m.jcn = state->columns.data();
  m.a = A.valuePtr();
  m.perm_in = state->order.data();
  state->call(1);
  if (m.infog[0] < 0)
    throw SimulationError(fmt::format("sparse factorisation: the analysis failed (MUMPS error {}, {})", m.infog[0], m.infog[1]));
}

SparseCholesky::~SparseCholesky() = default;

double SparseCholesky::estimated_bytes() const { return 1e6 * state->mumps.infog[state->icntl(22) == 1 ? 25 : 15]; }
double SparseCholesky::factor_entries() const {
  const int n = state->mumps.infog[19];
  return n >= 0 ? n : -1e6 * n;
}

void SparseCholesky::factorise() {
  std::packaged_task<void()> task([own = state] {
    const auto lock = alone();
    own->factorise();
  });
  std::future<void> done = task.get_future();
  std::thread([counted = std::make_unique<Counted>(), task = std::move(task)]() mutable {
    task();
    task = {};  // what it owns is let go while it counts
  }).detach();
  try {
    while (done.wait_for(patience) != std::future_status::ready)
      if (ask) ask();
  } catch (...) {
    state->given_up = true;
    throw;
  }
  done.get();
  const int error = state->mumps.infog[0], detail = state->mumps.infog[1];
  if (error == -10 || error == -40)
    throw SimulationError(fmt::format(
        "sparse factorisation: the matrix is not positive definite (pivot {}): the model has a mechanism, or a node without stiffness",
        detail));
  if (error == -13 || error == -9 || error == -8) throw SimulationError("sparse factorisation: out of memory");
  if (error == -90) throw SimulationError("sparse factorisation: the factor cannot be written to the scratch folder (is there room?)");
  if (error < 0) throw SimulationError(fmt::format("sparse factorisation failed (MUMPS error {}, {})", error, detail));
  // Without iterative refinement the matrix is not read again.
  Eigen::SparseMatrix<double>().swap(state->matrix);
  state->columns = std::vector<int>();
  state->order = std::vector<int>();
  state->mumps.irn = state->mumps.jcn = state->mumps.perm_in = nullptr;
  state->mumps.a = nullptr;
}

void SparseCholesky::solve(MatX& b) const {
  constexpr Eigen::Index together = 32;
  for (Eigen::Index first = 0; first < b.cols(); first += together) {
    if (ask) ask();
    const auto lock = alone(ask);
    state->mumps.rhs = b.col(first).data();
    state->mumps.nrhs = static_cast<int>(std::min(together, b.cols() - first));
    state->mumps.lrhs = static_cast<int>(b.rows());
    state->icntl(27) = together;
    state->call(3);
    if (state->mumps.infog[0] < 0) throw SimulationError(fmt::format("sparse solution failed (MUMPS error {})", state->mumps.infog[0]));
  }
}

}  // namespace flexframe::sim
