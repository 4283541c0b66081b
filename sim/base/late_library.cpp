#include "sim/base/late_library.h"

#include "sim/base/error.h"

#include <fmt/format.h>

#include <dlfcn.h>

namespace flexframe::sim {

// Never closed: its threads and handlers of the exit may still be there.
LateLibrary::LateLibrary(const char* file, const char* for_what) : file_(file), library_(::dlopen(file, RTLD_NOW | RTLD_LOCAL)) {
  if (!library_) throw FileError(fmt::format("the library for {} is missing or cannot be opened: {}", for_what, ::dlerror()));
}

LateLibrary::Address LateLibrary::function(const char* name) const {
  void* const found = ::dlsym(library_, name);
  if (!found) throw FileError(fmt::format("the library {} has no function {}: it is of another version than the program", file_, name));
  return {found};
}

}  // namespace flexframe::sim
