// Where a function of time acts: keeps the steps of an integrator from passing over what is narrower than they are (a Gaussian pulse,
// sin(t)^200, a peak in a table), which the error control of a method that looks at single times cannot know of.
//
// A box of times shows a function if a straight line through it differs by no more than half of what its slope makes of the box, or by less
// than 1e-9 of its largest value in the run: by bounds of the function and its derivatives over the box (interval arithmetic on Taylor
// coefficients: Moore, Kearfott, Cloud: Introduction to Interval Analysis, SIAM 2009, ch. 9; of a table by its points). sin(w t) is shown
// by boxes up to 4/w, a Gaussian by boxes up to about twice its width, an exponential by four of its time constants: no step that a
// tolerance allows is shortened by it but where a function begins that is new to it.
#pragma once

#include "sim/scene/expression.h"
#include "sim/scene/scene.h"
#include "sim/scene/table.h"

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::sim {

// Bounds over a box of times of what acts of a function, its value or its second derivative, and of that one's first and second derivative;
// infinite where there is none.
struct FunctionBounds {
  double size = 0.0;    // largest size
  double varies = 0.0;  // highest less lowest, at most
  double slope = 0.0, bend = 0.0;
};

// How a value that an expression reads may go within a box of times: bounds of it, of its rate and of its second derivative.
struct PathBounds {
  double least = 0.0, most = 0.0, slowest = 0.0, fastest = 0.0, bend_least = 0.0, bend_most = 0.0;
};

class FunctionScan {
 public:
  // A function within a segment [from, to] in which it keeps its piece; derivative: 0 where its value acts (forces), 2 where its
  // acceleration does (prescribed motions). The text is one that Expression has read; times of a table may be places as well.
  FunctionScan(const std::string& expression, int derivative, double from, double to);
  FunctionScan(const TableDef& table, int derivative, double from, double to);
  ~FunctionScan();
  FunctionScan(FunctionScan&&) noexcept;
  FunctionScan& operator=(FunctionScan&&) noexcept;

  // How far a step from t may go, where the last one had the length `step` and the next goes to `farthest` at most: to a time beyond t by
  // 1e-13 of the segment at least, infinite where nothing is left to pass over.
  double limit(double t, double step, double farthest);
  // The function varies so densely that it has shortened a hundred thousand steps: steps are no longer kept from passing over it.
  bool gave_up() const { return shortened_ > most_shortened; }

  // Whether a box shows the function, and by which bounds.
  bool shows(double lo, double hi) const;
  FunctionBounds bounds(double lo, double hi) const;
  // Largest size of what acts, found by bisecting the box with the largest bound.
  double peak() const { return peak_; }

 private:
  struct Code;
  static constexpr long most_shortened = 100'000;
  void find_peak(double from, double to);
  FunctionBounds bounds_of_table(double lo, double hi) const;

  std::unique_ptr<const Code> code_;  // of an expression, else
  std::unique_ptr<const CubicTable> table_;
  std::vector<double> points_;
  double period_ = 0.0;  // of the table, 0: none
  int derivative_;
  double to_, least_, known_until_, peak_ = 0.0;
  long shortened_ = 0;
};

// The same of an expression that reads values which follow from the motion, along paths on which they are expected: a bell over a place,
// a pulse of time that is multiplied by a speed.
class PathScan {
 public:
  // An expression that Expression has read with these names.
  PathScan(std::string_view text, std::span<const std::string> variables);

  // Whether it can be narrow at all: sums, products and powers up to the third of what it reads and of numbers never are.
  bool may_peak() const { return may_peak_; }
  // The pieces that hold at these values from here on.
  void choose(double t, const double* values);
  // Bounds in a box of times [lo, hi] on these paths, one a variable.
  FunctionBounds bounds(double lo, double hi, std::span<const PathBounds> paths) const;

 private:
  std::vector<Expression::Instruction> code_;
  std::vector<double> chosen_;
  bool may_peak_ = false;
};

// Whether a box of that width shows a function with these bounds, of which the share `floor` of its size is nothing.
bool is_shown(const FunctionBounds& bounds, double width, double floor);

}  // namespace flexframe::sim
