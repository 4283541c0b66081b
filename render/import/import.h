// Result files of other programs to results: the door of this room (README.md).
#pragma once

#include "sim/results/results.h"

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::imports {

struct Request {
  std::vector<std::filesystem::path> files;
  std::filesystem::path mapping;              // mapping file, or empty
  std::filesystem::path scene;                // scene that the results are of, or empty
  std::map<std::string, std::string> meshes;  // body -> mesh file
  double mesh_unit = 1.0;                     // m: what lengths in these files are in
  std::optional<double> step;                 // s between samples where the files have no times
  // Of numbers in files that do not say it: m, rad, Pa; none: SI is taken and told.
  std::optional<double> length_unit, angle_unit, stress_unit;
  std::string title;  // "": of the files
  std::string up;     // x, y or z: the world's axis that points up in pictures; "": z of a robot (URDF), else as the motion lies
};

struct Imported {
  sim::Results results;
  std::string kind;  // what the files are: "Modelica result", "CalculiX .frd"
};

// By the first file's ending and content. Throws sim::InputError, render::MeshError: a sentence with file, line where there is one, what
// was found and what is needed.
Imported import_files(const Request& request);

// What one such file holds, for `flexframe info`: bodies where it says itself what moves, of a table all columns as outputs. Throws as
// import_files.
Imported inspect_file(const std::filesystem::path& file);

// Endings of files that import_files reads, lower case, with the dot.
std::vector<std::string> file_endings();

}  // namespace flexframe::imports
