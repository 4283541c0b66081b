// Libraries of C that are opened where the first of their functions is called. To look up the symbols of NetCDF, MUMPS and their like took
// half of every start of the program, and hardly a run needs them.
#pragma once

#include <string>

namespace flexframe::sim {

class LateLibrary {
 public:
  // file: as the linker would name it ("libnetcdf.so.19"). for_what: what cannot be done without it. Throws FileError.
  LateLibrary(const char* file, const char* for_what);
  // The function of that name; the type is what its header says, decltype(&name). Throws FileError.
  template <class Function>
  Function function(const char* name) const {
    return reinterpret_cast<Function>(find(name));
  }

 private:
  void* find(const char* name) const;
  std::string file_;
  void* library_;
};

}  // namespace flexframe::sim
