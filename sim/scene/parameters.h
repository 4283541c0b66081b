// Named numbers of a scene ([parameters]) and the numbers written with them: "L/2", "10 mm", "[0, 0, 2*pi/3]".
//
// A parameter is a number, or a text in the language of expression.h (without t) in which other parameters may stand, in any order, with
// a unit behind it if it has one (units.h). Parameters are SI numbers; they carry no dimension.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::sim {

class Parameters {
 public:
  // Adds a name with its text. Throws InputError where the name is none or one of the expression language.
  void add(const std::string& name, const std::string& text);
  bool empty() const { return texts_.empty(); }
  bool has(const std::string& name) const { return texts_.contains(name); }

  // The text with the value of each parameter, in brackets and to the last bit, in place of its name; as it is where it names none.
  // Throws InputError where the parameter itself has no value: a circle, an unknown name, no finite number.
  std::string substitute(std::string_view text) const;

  // The number that the text says. `unit`: the one in which the number is wanted ("m", "kg/m^3", "deg"; nullptr: numbers without units
  // only); a unit in the text is converted, another dimension refused. Throws InputError, the message completing "which is no number: ".
  double number(std::string_view text, const char* unit) const;

  // "L = 0.4, w = 12": those that the text names, with their values, for messages; "" where it names none.
  std::string values_in(std::string_view text) const;

 private:
  double value(const std::string& name) const;

  std::map<std::string, std::string> texts_;
  mutable std::map<std::string, double> values_;
  mutable std::vector<std::string> open_;  // being worked out: a name that comes up again closes a circle
};

// Names in an expression that are no functions, in order; with the place of each.
struct NameInText {
  std::size_t at, length;
};
// In order of appearance; numbers and their exponents are none.
std::vector<NameInText> names_in(std::string_view text);

}  // namespace flexframe::sim
