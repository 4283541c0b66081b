// Reactions that rigid bodies leave open (dynamics/shared_reactions.h), told of where they are outputs or make friction, and friction of
// joints that rest together.
#pragma once

#include "sim/base/notes.h"
#include "sim/dynamics/shared_reactions.h"
#include "sim/time/system.h"

#include <string>
#include <vector>

namespace flexframe::sim {

class OpenReactions {
 public:
  explicit OpenReactions(const System& system);
  // Whether a sample of so many is to be looked at: none where no joint in a loop has its reaction asked for, else some twenty.
  bool wants(size_t sample, size_t samples) const;
  // Looks at the state that set_state brought `system` to.
  void look(System& system);
  // A warning that names the joints of whose reaction more than a hundredth is open, and one of those that rest by friction together.
  void warn(Notes& into) const;

 private:
  struct Watched {
    std::string joint;
    int part = -1, loop = -1;
    bool rubs = false;  // its friction follows the reaction
    double open = 0.0;  // largest share
  };
  // Of a cluster in which several rates can stick.
  struct Resting {
    int cluster = 0;
    bool rubs = false;              // normal forces are reactions
    std::vector<std::string> open;  // joints
  };
  std::vector<Watched> watched_;
  std::vector<Resting> resting_;
  Reactions reactions_;
};

}  // namespace flexframe::sim
