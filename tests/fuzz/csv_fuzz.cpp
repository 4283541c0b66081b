// libFuzzer entry: any bytes as a table of nodes (render/film/deform.h). Build and run: tests/fuzz/fuzz.sh csv
#include "render/film/deform.h"
#include "sim/base/types.h"
#include "tests/fuzz/scratch.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flexframe;
  try {
    const film::NodeTable table = film::read_node_table(fuzz::scratch_file(data, size, ".csv"));
    if (table.displacement.rows() != table.nodes.positions.rows() || !table.nodes.positions.allFinite() ||
        !table.displacement.allFinite() || !table.rotation.allFinite())
      std::abort();
  } catch (const sim::InputError& e) {
    fuzz::require_answer(e.what(), "input.csv");
  }
  return 0;
}
