// libFuzzer entry: any bytes as a SID file. Build: clang++ -fsanitize=fuzzer,address -std=c++20 -I. tests/fuzz/sid_fuzz.cpp sim/sid_*.cpp
// -lfmt
#include "sim/bodies/sid.h"

#include <cstdint>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flexframe::sim;
  try {
    const SidFile file = read_sid_text({reinterpret_cast<const char*>(data), size}, "fuzz").file;
    const SidFile again = read_sid_text(write_sid_text(file), "again").file;
    if (!(again == file)) std::abort();
    to_flexible_body(file, "fuzz");
  } catch (const InputError&) {
    // A refusal is an answer.
  }
  return 0;
}
