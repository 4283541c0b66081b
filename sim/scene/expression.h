// Expressions of time, as scene files write them: "t <= 0.7 ? 0.01*(1 - exp(-t/0.167)) : 0".
//
// The language is muParser's (the unit tests compare the two): numbers, t, the constants pi, e, _pi, _e, the operators
//   ?:   ||   &&   == != < > <= >=   + -   * /   unary + -   ^        (from loosest to tightest; ^ groups to the right, -2^2 = -4)
// and the functions sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp ln log log2 log10 sqrt abs sign rint
// min max sum avg (log is the natural logarithm, as in muParser). A comparison is 1 or 0; every number but 0 is true.
// It is compiled here, not by muParser, because a simulation needs what muParser cannot give: derivatives to the last bits
// (prescribed motion) and every discontinuity located.
//
// Discontinuities. Comparisons, truth values, abs, sign, rint, min, max and atan2 choose between smooth pieces; each choice is a
// selector. switch_times() isolates every change of a selector with interval arithmetic on it and its derivative (Moore, Kearfott,
// Cloud: Introduction to Interval Analysis, 2009, chapters 5 and 8) and bisects to the last bit, so that short pulses are found
// whatever their width; only where a selector touches its threshold without visible slope, excursions shorter than 2e-10 of the
// span can be missed. freeze() then holds the selectors, so that the expression is smooth and may be evaluated a little beyond
// the ends of its segment.
//
// Variables. An expression may read named values beside t (outputs of the scene, the length of a spring): those names are given when
// it is compiled, their values whenever it is evaluated. Selectors whose operands read one change at instants that only the motion
// tells: margin() is what a search for roots follows, pass() goes over to the next piece; switch_times() leaves them out.
#pragma once

#include "sim/base/types.h"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace flexframe::sim {

// Value, first and second derivative with respect to time.
struct TimeJet {
  double value = 0.0, rate = 0.0, acceleration = 0.0;
};

// A value: copies are independent. value() and jet() neither allocate nor change anything.
class Expression {
 public:
  Expression() : Expression(0.0) {}
  // A number.
  explicit Expression(double constant);
  // Throws InputError: "column 5: ... ; allowed: ...".
  explicit Expression(std::string_view text);
  // With values that it may read by these names, any text that is no number; words of the language go first, of names the longest.
  Expression(std::string_view text, std::span<const std::string> names);

  const std::string& text() const { return text_; }
  bool constant() const { return constant_; }  // depends neither on t nor on variables
  bool depends_on_time() const;
  // Names that it reads, in the order in which value(t, variables) wants them.
  const std::vector<std::string>& variables() const { return variables_; }
  bool has_switches() const { return !selectors_.empty(); }

  // Sorted times strictly inside (t0, t1) at which a selector changes: the piece before holds up to the time, the next one after it.
  // Throws SimulationError if there are more than 100 000 or they cannot be told apart.
  std::vector<double> switch_times(double t0, double t1) const;

  // Holds every selector as it is at t_inside, a time inside a segment between two switch times; unfreeze() lets go.
  void freeze(double t_inside);
  void unfreeze() { frozen_.clear(); }

  // Throw SimulationError naming t and the text where the result (of jet: any of the three) is not finite.
  double value(double t) const;
  TimeJet jet(double t) const;

  // The same where it reads variables: their values in the order of variables().
  double value(double t, const double* variables) const;
  // Selectors that the motion switches: their number; what each is held at, from the values at (t, variables).
  int state_switches() const { return static_cast<int>(state_selectors_.size()); }
  void hold(double t, const double* variables);
  // Positive while the k-th of them keeps what it is held at, zero where that ends; in the unit of its operands.
  double margin(int k, double t, const double* variables) const;
  // Goes over to the next piece: those with ended[k] change, the others are held anew.
  void pass(const std::vector<bool>& ended, double t, const double* variables);

  // The machine's code, for the implementation (expression_code.h).
  enum class Op : std::uint8_t;
  struct Instruction {
    Op op;
    int index = 0;  // selector, or target of a jump
    double number = 0.0;
  };
  struct Selector {
    int begin = 0, end = 0;  // code that leaves its operands on the stack
    Op op;
  };

 private:
  // Of selector s, with the selectors inside them held.
  std::pair<double, double> operands(std::size_t s, const std::vector<double>& held, double t, const double* variables) const;

  std::string text_;
  std::vector<Instruction> code_;
  std::vector<Selector> selectors_;
  std::vector<double> frozen_;  // per selector, empty: live
  bool constant_ = true;
  std::vector<std::string> variables_;
  std::vector<int> state_selectors_;  // those whose operands read a variable
};

}  // namespace flexframe::sim
