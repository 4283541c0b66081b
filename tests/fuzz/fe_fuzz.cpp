// libFuzzer entry: any bytes as a finite element model (sim/reduce/fe_model.h); the first byte chooses the format. Build and run:
// tests/fuzz/fuzz.sh fe
#include "sim/reduce/fe_model.h"
#include "tests/fuzz/scratch.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flexframe::sim;
  if (size == 0) return 0;
  const bool gmsh = data[0] == 'm' || data[0] == '$';
  const bool nastran = data[0] == 'G' || data[0] == 'C' || data[0] == 'B';
  // Corpus files are plain models: those of gmsh begin with '$', Nastran's with a card, others are Abaqus'.
  try {
    const FeModel model = gmsh      ? read_msh(fuzz::scratch_file(data, size, ".msh"))
                          : nastran ? read_nastran(fuzz::scratch_file(data, size, ".bdf"))
                                    : read_inp(fuzz::scratch_file(data, size, ".inp"));
    for (const Vec3& x : model.nodes)
      if (!x.allFinite()) std::abort();
    for (int k : model.connectivity)
      if (k < 0 || k >= static_cast<int>(model.nodes.size())) std::abort();
  } catch (const InputError& e) {
    fuzz::require_answer(e.what(), "input.", 31);  // thirty complaints and how many there are besides
  }
  return 0;
}
