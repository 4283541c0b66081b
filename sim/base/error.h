// Errors of the program, one family: catch flexframe::Error for all of them. The one header that every module includes.
//
//   Error
//     InputError         what was given cannot be used: a file, a scene, a body, an array        (the program exits with 2)
//       MeshError        a mesh
//     ArgumentError      a call that makes no sense: an unknown name, sizes that do not fit       (all others: 1)
//     SimulationError    a computation that could not be done
//     MapError           sound input that no kernel map can serve
//     DrawError          what draws is missing or fails: OSMesa, OpenGL, a drawing process
//     FileError          a file or folder that cannot be read or written
//
// Every message is a sentence for the user: what was found, where (file, line, key; time; body), what is allowed, what to do.
#pragma once

#include <stdexcept>

namespace flexframe {

struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Bad input: the message names file, line, key, what was found and what is allowed.
struct InputError : Error {
  using Error::Error;
};

// A mesh file or mesh that cannot be used: the message says file, line where there is one, what was found and what is needed.
struct MeshError : InputError {
  using InputError::InputError;
};

// A call whose arguments make no sense together, or name what does not exist.
struct ArgumentError : Error {
  using Error::Error;
};

// A computation that could not be done: the message says what failed, when, and what to change.
struct SimulationError : Error {
  using Error::Error;
};

// Sound input that no map can serve: Lebesgue constant above the limit, singular system.
struct MapError : Error {
  using Error::Error;
};

// Drawing is not possible: a library is missing or refuses, a process that draws ended.
struct DrawError : Error {
  using Error::Error;
};

// A file or folder that cannot be read, made or written; path and the system's reason.
struct FileError : Error {
  using Error::Error;
};

}  // namespace flexframe
