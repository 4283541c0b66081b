// What a run is asked for, as one number: "max(abs(slider.x))", "deflection = range(rod.y)/L".
//
// A response is an expression (sim/scene/expression.h) over what histories come to and over the settings of the sweep. A history comes to
// a number by one of
//   max min mean rms range final initial integral     of an expression of the outputs' columns and t, over all samples
//   time_of_max time_of_min                           s, of its first largest and smallest sample
//   time_of(CONDITION)                                s, of the first sample at which the condition is true
//   frequency                                         Hz, of the largest line of its spectrum (spectrum.h), between two lines by a parabola
// mean, rms and integral are over time (trapezoidal rule). Inside one of them another may stand: rms(x - mean(x)). max and min of several
// arguments choose among these, as in any expression.
#pragma once

#include "sim/results/histories.h"
#include "sim/scene/expression.h"

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace flexframe::sim {

// The words that make a number of a history.
const std::vector<std::string>& response_words();

class Response {
 public:
  // text: "EXPRESSION" or "NAME=EXPRESSION". columns: of the histories; settings: keys of the sweep. Throws InputError with the text, what
  // was found and what is known.
  Response(const std::string& text, std::span<const std::string> columns, std::span<const std::string> settings);

  const std::string& name() const { return name_; }  // NAME, or the expression itself

  // columns as they were given, settings in their order, SI units. Throws SimulationError where there is no such number: a condition that
  // is never true, a root of a negative number.
  double value(const Histories& histories, std::span<const double> settings) const;

  // By what share of it the value may be off because it is seen at samples only: what leaving out every second sample, the odd or the
  // even ones, shows (a third of what it changes, of extremes a seventh), or what parabolas through the largest and smallest samples add
  // to these. Of times the share is of the run. None where that is no measure (frequencies, values of one sample alone).
  std::optional<double> share_of_sampling(const Histories& histories, std::span<const double> settings) const;

  // A frequency in it of which the run holds too few periods, as a sentence; empty: none. The histories are those of a value.
  std::string too_few_periods(const Histories& histories, std::span<const double> settings) const;

  // Marks the columns that it reads.
  void mark_read(std::vector<bool>& columns) const { mark_read(formula_, columns); }

  // Is a frequency of a history in it?
  bool reads_frequency() const;

 private:
  struct Reduction;
  struct Formula {
    Expression expression;
    enum class Source { column, setting, reduction };
    std::vector<std::pair<Source, std::size_t>> reads;  // in the order of the expression's variables
    std::vector<std::shared_ptr<const Reduction>> reductions;
  };
  struct Reduction {
    std::size_t word = 0;  // of response_words()
    std::string text;
    Formula of;
  };
  struct Known {
    std::span<const std::string> columns, settings;
  };
  static void mark_read(const Formula& formula, std::vector<bool>& columns);
  static Formula read(const std::string& text, const Known& known, bool of_histories);
  // What extreme values are taken of: the samples, or what lies between them too.
  enum class Seen { samples, between };
  static VecX series(const Formula& of, const Histories& histories, std::span<const double> settings, Seen seen);
  static double reduce(const Reduction& reduction, const Histories& histories, std::span<const double> settings, Seen seen);
  static std::string too_few_periods(const Formula& formula, const Histories& histories, std::span<const double> settings);
  double value(const Histories& histories, std::span<const double> settings, Seen seen) const;
  // Of the histories that it takes extremes and means of.
  double largest(const Histories& histories, std::span<const double> settings) const;

  std::string name_;
  Formula formula_;
};

// "NAME=EXPRESSION" as name and expression; the name is the expression where none is given.
std::pair<std::string, std::string> split_response(const std::string& text);

}  // namespace flexframe::sim
