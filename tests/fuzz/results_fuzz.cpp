// libFuzzer entry: any bytes as a results file (sim/results/results_file.h). Build and run: tests/fuzz/fuzz.sh results
#include "sim/results/results_file.h"
#include "tests/fuzz/scratch.h"

// HDF5 1.10 does not free an object header that it found damaged; nothing of ours stands in between (malloc is called by the library).
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5_serial\n"; }

// Of its half megabyte for each open file HDF5 keeps nothing beyond 64 KB for the next one unless told so: half of the time went into fresh
// pages.
extern "C" int H5set_free_list_limits(int, int, int, int, int, int);
extern "C" int LLVMFuzzerInitialize(int*, char***) { return H5set_free_list_limits(-1, -1, -1, -1, -1, -1); }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flexframe::sim;
  try {
    const Results results = read_results(fuzz::scratch_file(data, size, ".h5"));
    if (!results.times.allFinite()) std::abort();
    for (const ResultBody& body : results.bodies)
      if (body.position.rows() != results.times.size() || !body.position.allFinite() || !body.displacement.allFinite()) std::abort();
  } catch (const InputError& e) {
    fuzz::require_answer(e.what(), "input.h5");
  }
  return 0;
}
