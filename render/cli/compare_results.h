// Two results of one scene compared by what is seen of them: how far drawn vertices are apart.
#pragma once

#include <string>

namespace flexframe::cli {

struct ResultsComparison {
  std::string baseline, candidate;  // results files; the first one's scene has the cameras and scales
  double pixels = 0.0;              // that vertices may be apart; 0: any distance
  int pictures = 200;               // looked at, evenly over the film
  bool json = false;
};

// Whether the name is that of a results file (.h5).
bool is_results_name(const std::string& name);

// Exit code: 0 near enough, 1 not. Throws sim::InputError.
int compare_results(const ResultsComparison& asked);

}  // namespace flexframe::cli
