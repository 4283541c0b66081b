// What the modes of a reduced body lack of its static deflection at its interfaces, as the first line of its SID file says it.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::sim {

struct InterfaceLack {
  std::string interface;
  double share = 0.0;  // of the deflection or turn of the interface under a force or a moment on it, 0 .. 1
  bool turns = false;  // it is tied to nodes without rotations that lie on a line or at one point, so that nothing resists a turn
};

// "made by flexframe reduce from MODEL", the interfaces that turn, those whose share is beyond one per cent, and all interfaces.
std::string reduced_comment(const std::string& model, const std::vector<InterfaceLack>& lacks);

// Whether a comment says what is lacking, be it nothing: files of other programs do not.
bool knows_lacks(std::string_view comment);

// All interfaces that a comment names; nullopt: it says nothing of them.
std::optional<std::vector<std::string>> interfaces_of_comment(std::string_view comment);

// The interfaces that a comment names for their share; none for files of other programs.
std::vector<InterfaceLack> lacks_of_comment(std::string_view comment);
// Those that it names because they turn.
std::vector<std::string> turning_of_comment(std::string_view comment);

}  // namespace flexframe::sim
