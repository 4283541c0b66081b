// Named numbers of a scene ([parameters]) and the numbers written with them: "L/2", "10 mm", "[0, 0, 2*pi/3]".
//
// A parameter is a number, or a text in the language of expression.h (without t) in which other parameters may stand, in any order, with
// a unit behind it if it has one (units.h). Parameters are SI numbers; they carry no dimension.
#pragma once

#include "sim/scene/unit_terms.h"

#include <map>
#include <memory>
#include <span>
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
  std::string substitute(std::string_view text) const { return substitute_but(text, {}); }
  // The same of a text whose units have not been taken out of it: what can only be a unit stays ("100 N/m" where m is a parameter too).
  std::string substitute_beside_units(std::string_view text) const;

  // The number that the text says. `unit`: the one in which the number is wanted ("m", "kg/m^3", "deg"; nullptr: numbers without units
  // only); a unit in the text is converted, another dimension refused. Throws InputError, the message completing "which is no number: ".
  double number(std::string_view text, const char* unit) const;

  // "L = 0.4, w = 12": those that the text names, with their values, for messages; "" where it names none.
  std::string values_in(std::string_view text) const;

  // Texts that may be read in two ways, for warnings, each as it is read; copies share them. doubt_units: where a word of a unit is the
  // name of a parameter too, or one of `others`: "5 kg*g".
  void doubt(const std::string& text) const;
  void doubt_units(std::string_view text, std::span<const std::string> others = {}) const;
  const std::vector<std::string>& doubts() const { return *doubts_; }

 private:
  double value(const std::string& name) const;
  // but: places in the text whose names stay
  std::string substitute_but(std::string_view text, const std::vector<std::size_t>& but) const;

  std::map<std::string, std::string> texts_;
  mutable std::map<std::string, double> values_;
  mutable std::vector<std::string> open_;  // being worked out: a name that comes up again closes a circle
  std::shared_ptr<std::vector<std::string>> doubts_ = std::make_shared<std::vector<std::string>>();
};

// Is this word of a unit the unit, whatever has its name? "kg" and "m" of "5 kg/m", not "g" of "5 kg*g".
bool only_a_unit(const UnitWord& word, std::string_view text);

// Names in an expression that are no functions, in order; with the place of each.
struct NameInText {
  std::size_t at, length;
};
// In order of appearance; numbers and their exponents are none.
std::vector<NameInText> names_in(std::string_view text);

}  // namespace flexframe::sim
