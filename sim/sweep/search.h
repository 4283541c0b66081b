// One search for the smallest value of a function that simulations give: NLopt's methods without derivatives.
//
// BOBYQA (Powell 2009) for two and more keys without limits, COBYLA (Powell 1994) else. Both build a model of the function from the values
// at a few places and move within a region that shrinks; a search has settled when a second one, begun where the first ended, stays there.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::sim {

// What is made of a run.
struct Judged {
  double goal = 0.0;           // to be made small
  std::vector<double> excess;  // one a limit, kept where <= 0
};

enum class SearchEnd {
  settled,      // nothing smaller nearby, to `precision`
  out_of_runs,  // `runs` runs were made before
  no_start      // no place was found at which a run can be made
};

struct SearchPlan {
  std::size_t keys = 1, limits = 0;
  double precision = 1e-4;  // of the places
  int runs = 200;           // at most
  // Where to begin, keys numbers between 0 and 1; attempt counts up where no run could be made there.
  std::function<std::vector<double>(int attempt)> start;
  // The run at a place (shares of the ranges, 0 to 1), called once a place; none where there is no such run.
  std::function<std::optional<Judged>(const std::vector<double>& place)> judge;
};

// Throws what judge throws; InputError where the program was built without NLopt.
SearchEnd search_minimum(const SearchPlan& plan);

// "NLopt 2.7.1"; empty: built without it.
std::string minimiser_version();

}  // namespace flexframe::sim
