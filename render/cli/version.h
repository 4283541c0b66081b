// The program's version and what it is made of.
#pragma once

#include <string>

namespace flexframe::cli {

// What draws in software here, or why nothing does; starts OpenGL (0.2 s).
std::string renderer_text();

// Processor, architecture and kernel.
std::string machine_text();

// First line: the version alone. Then compiler, renderer (found now) and libraries.
std::string version_text();

}  // namespace flexframe::cli
