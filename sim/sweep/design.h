// What a sweep runs over: keys of the scene with the values that each takes, and the points that they make.
//
//   body.rod.length=0.2:0.4:21        a range: 21 values from 0.2 to 0.4, both among them; 1e-3:1:7:log in equal ratios
//   mu=0.05,0.1,0.2                   a list, of numbers or words; grids are all combinations of ranges and lists
//   mu=0.05:0.2                       anywhere in between, for designs that draw their points: uniform(0.05,0.2), loguniform(a,b) and
//                                     normal(mean,deviation[,low,high]), which is cut off at low and high
//   simulation.tolerance=1e-8         one value: the same at every point
//
// Any point is made from its number alone (random access): workers and machines need not tell each other what they drew.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::sim {

// Values that one key takes by chance.
struct Distribution {
  enum class Kind { uniform, loguniform, normal };
  Kind kind = Kind::uniform;
  double a = 0.0, b = 1.0;                    // ends; of normal: mean and standard deviation
  std::optional<double> low = {}, high = {};  // normal: cut off there

  // The value below which the share u of them lies, 0 <= u <= 1 (0 < u < 1 for a normal one that is not cut off).
  double quantile(double u) const;
};

// A key that varies: over values, or by chance.
struct SweepAxis {
  std::string key;                  // "L", "body.rod.length"
  std::vector<std::string> values;  // as --set takes them; empty: by chance
  std::vector<double> numbers;      // the same as SI numbers; empty: words
  bool logarithmic = false;         // in equal ratios
  std::optional<Distribution> chance;
};

// How the points of the keys that vary by chance are drawn.
enum class Sampling {
  none,
  random,         // independent
  latin,          // Latin hypercube (McKay, Beckman, Conover 1979): one point in each N-th of every key
  sobol,          // Sobol's sequence (directions of Joe, Kuo 2008)
  sobol_indices,  // N blocks of d + 2 points (Saltelli et al. 2010)
  morris,         // N paths of d + 1 points, one key moved at a time (Morris 1991)
  searched        // where searches for a minimum went (minimise.h)
};

struct DesignWords {
  std::vector<std::string> settings;  // of --set: "KEY=VALUES"
  std::string sample;                 // "lhs:500", "sobol:N", "random:N" or empty
  std::string sensitivity;            // "sobol:N", "morris:N" or empty
  std::uint64_t seed = 1;
  int searches = 0, runs = 0;  // for a minimum: how many, and runs of each at most; 0: none
};

class Design {
 public:
  // Throws InputError with the option, what was found and what is allowed.
  explicit Design(const DesignWords& words);

  const std::vector<SweepAxis>& axes() const { return axes_; }
  const std::vector<std::string>& fixed() const { return fixed_; }  // settings that are the same at every point
  Sampling sampling() const { return sampling_; }
  long draws() const { return draws_; }  // N of sample or sensitivity; 0: a grid alone
  long size() const { return size_; }    // points

  struct Value {
    std::string text;     // as --set takes it
    double number = 0.0;  // SI; words: the place in the list
  };
  // One value an axis. 0 <= index < size(): the first axis varies slowest, draws vary fastest.
  std::vector<Value> point(long index) const;
  // The same as "KEY=VALUE", the fixed ones first.
  std::vector<std::string> settings(long index) const { return settings(point(index)); }
  std::vector<std::string> settings(const std::vector<Value>& values) const;

  // Of searches, where search s has the points s * runs to (s + 1) * runs - 1. Places are shares of the keys' ranges, 0 to 1.
  int searches() const { return searches_; }
  int runs() const { return runs_; }
  std::vector<Value> place(const std::vector<double>& shares) const;
  // Where a search begins: the first in the middle of all ranges, the others at points of a Latin hypercube. attempt: another one, for
  // places where the scene cannot be run.
  std::vector<double> start(int search, int attempt = 0) const;
  void note(long index, std::vector<double> shares) { noted_[index] = std::move(shares); }  // point(index) is there from now on
  const std::vector<double>& noted(long index) const;
  bool has(long index) const { return sampling_ != Sampling::searched || noted_.contains(index); }  // false: no search came so far

  // Morris: which axis moves between the points k and k + 1 of a path, and how far, in shares of its distribution.
  struct Move {
    std::size_t axis = 0;
    double step = 0.0;
  };
  Move move(long path, long k) const;

 private:
  void read_setting(const std::string& setting);
  void read_draws(const std::string& words, bool sensitivity);
  void read_searches(const DesignWords& words);
  std::vector<double> sobol_row(long row, std::size_t columns) const;
  std::vector<double> shares(long draw) const;

  std::vector<SweepAxis> axes_;
  std::vector<std::size_t> drawn_;  // axes that vary by chance
  std::vector<std::string> fixed_;
  Sampling sampling_ = Sampling::none;
  std::uint64_t seed_ = 1;
  long draws_ = 0, per_grid_ = 1, size_ = 1;
  int searches_ = 0, runs_ = 0;
  std::map<long, std::vector<double>> noted_;
};

}  // namespace flexframe::sim
