// What the modes of a reduced body lack of its static deflection at its interfaces, as the first line of its SID file says it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace flexframe::sim {

struct InterfaceLack {
  std::string interface;
  double share = 0.0;  // of the deflection or turn of the interface under a force or a moment on it, 0 .. 1
};

// "made by flexframe reduce from MODEL", and the interfaces whose share is beyond one per cent.
std::string reduced_comment(const std::string& model, const std::vector<InterfaceLack>& lacks);

// Whether a comment says what is lacking, be it nothing: files of other programs do not.
bool knows_lacks(std::string_view comment);

// The interfaces that a comment names; none for files of other programs.
std::vector<InterfaceLack> lacks_of_comment(std::string_view comment);

}  // namespace flexframe::sim
