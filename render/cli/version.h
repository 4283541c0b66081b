// The program's version and what it is made of.
#pragma once

#include <string>

namespace flexframe::cli {

// First line: the version alone. Then compiler, renderer (found now) and libraries.
std::string version_text();

}  // namespace flexframe::cli
