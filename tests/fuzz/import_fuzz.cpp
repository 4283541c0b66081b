// libFuzzer entry: any bytes as a result file of another program (render/import/import.h); the first byte chooses the kind, 'g' a mapping
// file over a small table. Build and run: tests/fuzz/fuzz.sh import
#include "render/import/import.h"
#include "render/picture/mesh.h"
#include "sim/base/error.h"
#include "tests/fuzz/scratch.h"

#include <cmath>

namespace {

const char* ending_of(std::uint8_t first) {
  switch (first) {
    case 'f':
      return ".frd";
    case 'u':
      return ".vtu";
    case 'p':
      return ".vtp";
    case 'n':
      return ".npz";
    case 'o':
      return ".mov";
    case 'r':
      return ".urdf";
    case 'g':
      return ".toml";
    default:
      return ".csv";
  }
}

// Three poses and a number beside them: what mapping files and robots move.
std::filesystem::path table() {
  static const std::filesystem::path path = [] {
    const std::string text = "t,a.x,a.y,a.z,a.qw,a.qx,a.qy,a.qz,q\n0,0,0,0,1,0,0,0,0\n1,1,2,3,0,1,0,0,5\n2,4,5,6,0,0,1,0,9\n";
    const std::filesystem::path file = fuzz::scratch_file(reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), ".table.csv");
    return file;
  }();
  return path;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flexframe;
  if (size == 0) return 0;
  const std::string ending = ending_of(data[0]);
  imports::Request request;
  request.step = 0.5;
  try {
    const std::filesystem::path file = fuzz::scratch_file(data + 1, size - 1, ending.c_str());
    request.files = {file};
    if (ending == ".toml") request.files = {table()}, request.mapping = file;
    if (ending == ".urdf") request.files.push_back(table());
    const sim::Results results = imports::import_files(request).results;
    if (!results.times.allFinite() || results.times.size() == 0) std::abort();
    for (const sim::ResultBody& body : results.bodies) {
      if (body.position.rows() != results.times.size() || !body.position.allFinite() || !body.displacement.allFinite()) std::abort();
      // Within what quaternions of other programs are allowed to be off.
      if (body.orientation.rows() != results.times.size() || !((body.orientation.rowwise().norm().array() - 1.0).abs() < 1e-2).all())
        std::abort();
    }
  } catch (const sim::InputError& e) {
    fuzz::require_answer(e.what(), "");
  } catch (const render::MeshError& e) {  // of the meshes that a file names
    fuzz::require_answer(e.what(), "");
  } catch (const sim::FileError& e) {
    fuzz::require_answer(e.what(), "");
  }
  return 0;
}
