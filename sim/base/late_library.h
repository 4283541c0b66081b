// Libraries of C that are opened where the first of their functions is called. To look up the symbols of NetCDF, MUMPS and their like took
// half of every start of the program, and hardly a run needs them.
#pragma once

#include <string>

namespace flexframe::sim {

class LateLibrary {
 public:
  // file: as the linker would name it ("libnetcdf.so.19"). for_what: what cannot be done without it. Throws FileError.
  LateLibrary(const char* file, const char* for_what);
  // An address that becomes a pointer to a function of whatever type it is given to: decltype(&name), as its header says.
  struct Address {
    void* at;
    template <class Function>
    operator Function*() const {
      return reinterpret_cast<Function*>(at);
    }
  };
  // Throws FileError.
  Address function(const char* name) const;

 private:
  std::string file_;
  void* library_;
};

}  // namespace flexframe::sim
