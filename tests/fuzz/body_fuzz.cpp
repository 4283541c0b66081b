// libFuzzer entry: any bytes as a flexible body in HDF5 (sim/bodies/body_file.h). Build and run: tests/fuzz/fuzz.sh body
#include "sim/bodies/body_file.h"
#include "tests/fuzz/scratch.h"

// See results_fuzz.cpp.
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5_serial\n"; }
extern "C" int H5set_free_list_limits(int, int, int, int, int, int);
extern "C" int LLVMFuzzerInitialize(int*, char***) { return H5set_free_list_limits(-1, -1, -1, -1, -1, -1); }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flexframe::sim;
  try {
    const BodyFile file = read_body(fuzz::scratch_file(data, size, ".h5"), "body");
    const FlexibleBody& body = file.body;
    if (!(body.mass >= 0.0) || !std::isfinite(body.mass) || body.n < 0) std::abort();
    for (const auto& node : body.nodes)
      if (node.phi.cols() != body.n || !node.phi.allFinite() || !node.origin.allFinite()) std::abort();
  } catch (const InputError& e) {
    fuzz::require_answer(e.what(), "input.h5");
  }
  return 0;
}
