// An asked accuracy without a search: the run as it is written, judged, or its vibrations followed (go_straight in accuracy_task.h).
// Files: accuracy_straight.cpp makes the runs and leads from one to the next, accuracy_straight_time, _space and _effects judge them, and
// accuracy_straight_follow follows vibrations.
#pragma once

#include "sim/accuracy/accuracy_task.h"
#include "sim/run/coarse_beams.h"
#include "sim/run/judged_run.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace flexframe::sim {

class Straight {
 public:
  explicit Straight(Task& task) : t_(task) {}
  std::optional<Finished> go(const Scene& as_given);
  std::optional<StraightRun> left;  // go_straight
  void keep_last();

 private:
  // Shares of the asked accuracy that time, space and what is left out may take each.
  static constexpr double share_of_time = 0.5, most_of_time = 0.75, share_of_space = 0.5, share_of_effects = 0.5;
  // Estimates of elastic scenes as written were up to 3.4 times too low (pendulums and released beams of tests/trust/kinds_asked.py).
  static constexpr double elastic_margin = 5.0;
  // Where so little is missing half a decade does, which with a looser run of its own costs less than a decade that costs so many times
  // more.
  static constexpr double nearly = 1.5, dear_decade = 2.5, half_a_decade = 0.3;
  // What is left out and worth less is not brought back where what is left out keeps a run from the accuracy.
  static constexpr double little = 0.1;
  // A run as it is written is not waited for longer, CPU s; one that follows vibrations is never given up before (a search takes longer).
  static constexpr double longest = 120.0, shortest = 3.0;
  // CPU s of a run as written whose effects are not called for by another one.
  static constexpr double dear_run = 1.0;
  // The next run is not made where it costs that much, s, and so many times the last one (beam on a stop at 1e-3, its 30 coordinates
  // followed at 1e-8: 2 CPU s and no end).
  static constexpr double dear_step = 0.3, dearer_step = 5.0;
  // What is exaggerated takes a search of ten CPU s or more (four-bar, a hundred times for 3 px: 8 s, where the next step takes one).
  static constexpr double dear_if_exaggerated = 1.5;

  enum class Verdict { kept, tighter, rather_follow, follow, lost };

  bool run_pilot(const Scene& scene, bool again = true);
  bool run_few(const SimulateOptions& options, bool again);
  const Scene& as_run(const Scene& scene) const { return few_ > 0 ? few_scene_ : scene; }
  int more_than_few() const { return std::max(few_ + least_more, few_ + few_ / 2); }
  // What came of judging space: the end, with the run or a search that has to begin; effects that have come; or neither.
  struct Spaced {
    std::optional<Finished> finished;
    bool ends = false, more = false, resolved = false;
  };
  Spaced finish_in_space();
  bool refine_few();
  std::optional<Finished> try_few(const Scene& as_given, const Search& search, double within);
  double allowed_to_try() const;
  double allowed_for_few() const;
  double most_for_few() const;
  double few_or_try() const { return t_.search.touches ? std::max(allowed_to_try(), allowed_for_few()) : allowed_to_try(); }
  std::vector<std::string> described() const;
  StraightRun for_search(bool kept) const;
  Verdict verdict_as_called(const Scene& scene);
  std::optional<Finished> follow_first();
  double allowed_to_follow() const;
  bool may_try_following() const;
  std::optional<Finished> try_following();
  bool bring_what_shifts();
  bool bring(double worth, bool blows = false);
  bool judge_space();
  bool judge_by_quarter();
  bool judge_by_doubled();
  bool space_by(const Scene& other, const ByKind& shares);
  bool by_program(const EffectState& s) const;
  bool decided(const LeftOutWorth& w) const;
  void set_aside_lacking();
  bool chosen_by_scene(const LeftOutWorth& w) const;
  bool leaves_out_more() const;
  bool judge_deformations(bool following);
  bool judge_effects(bool following = false);
  bool judge_forces(Finished& f);
  void count_effects(Finished& f) const;
  std::vector<std::string> to_measure(bool following);
  std::vector<std::string> shift_forces() const;
  std::optional<std::vector<Neglected>> leave_out_measured(NeglectOptions check, const Histories& base, double least);
  void leave(const Task::Share& share);
  void report_chosen(Finished& f) const;
  Finished as_written() const;
  double add_up(Finished& f, double of_time, double of_space, double of_effects) const;
  void keep_written(double by_energy = 0.0);
  std::optional<Finished> finish_as_written();
  std::optional<Finished> follow_vibrations(double within);
  std::optional<Finished> followed(double within) const;
  bool check(Finished& f);
  bool warned(const Notes& notes, bool misfits = true) const;
  double price_of_volumes(const Finished& f) const;
  double energy_share() const;
  double as_seen(double missing, double change) const;
  bool lacks_margin_of_time() const;
  double next_work() const;
  double next_allowed() const;
  VecX sizes_of(const Histories& h) const;
  std::optional<Histories> loose_run(const Scene& scene, double tolerance, const System* start = nullptr);
  Verdict judge_time(const Scene& scene);
  bool look_tighter(const Scene& scene, const Histories& thinned, double change);

  Task& t_;
  // Modes of bending that each beam keeps in these runs, with the static deflections of the rest, and the scene with them; 0: the scene as
  // it is written.
  int few_ = 0;
  // Of stretching and twist so many more than the two that they have; a run with twice as many judges them.
  int few_stiff_ = 0;
  Scene few_scene_;
  static constexpr int least_more = 2;
  double first_tolerance() const { return std::clamp(0.1 * asked(), 1e-9, 1e-3); }
  // Where forces at rest make most of what is seen, few modes bring the rest.
  static constexpr int fewest_at_first = 3;
  int few_at_first() const { return std::max(fewest_at_first, static_cast<int>(std::ceil(0.5 * std::pow(asked(), -1.0 / 3.0)))); }
  // Distances in pictures are shares of the picture: what tolerances and modes have to keep is a share of what is moved (DECISIONS).
  // pictured_: how much of the sizes of outputs they move by, 1 where that is not known.
  double asked() const { return std::max(t_.accuracy, std::min(coarsest, t_.accuracy / pictured_)); }
  // Whether pictures show a share of what is moved that is larger than what is asked (exaggerated, or seen from near).
  bool exaggerated() const { return pictured_ < 0.3; }
  void begin_with_few();
  static constexpr double coarsest = 0.1;
  double pictured_ = 1.0;
  double looked_ = 0.0;                   // CPU s of the loose run that tells it; 0: none
  int refined_ = 0;                       // times that it was too few
  double lacked_ = 0.0;                   // of space then
  bool refined_stiff_ = false;            // and what it was given more of
  bool short_of_margins_ = false;         // what the estimates say has to be several times smaller
  bool short_of_effects_ = false;         // what is left out has to be
  double space_margin_ = elastic_margin;  // by how much, of space
  double tolerance_ = 0.0;
  double judged_at_ = 1.0;                 // the last one that was judged
  double begin_at_ = 1.0;                  // looser ones were too loose for another way
  double before_ = 0.0, before_at_ = 0.0;  // what a decade changed at a looser tolerance, 0: not known, and this
  double missed_ = 0.0;                    // what the energy missing there could move (energy_share)
  JudgedRun run_;
  Histories fine_, looser_;
  bool has_looser_ = false;
  bool tried_ = false;                                    // to follow vibrations
  double tried_for_ = 1e300;                              // CPU s of work that it was given
  bool tried_few_ = false;                                // modes, beside dear steps
  double few_in_vain_ = 0.0;                              // CPU s that they had and were too few
  bool brought_ = false;                                  // what kept it from being judged
  std::set<std::pair<std::string, std::string>> pinned_;  // bodies and their effects that have been brought
  Verdict by_time_ = Verdict::kept;                       // of a run that called for more effects
  double needed_ = 0.0;                                   // how many times as near it has to be in time
  double lost_before_ = 0.0;                              // the same of the run before where that was too far off to tell, else 0
  MatX time_, space_;                                     // by which a run is accepted
  MatX told_;                                             // of time, what is told
  bool timed_ = false;                                    // run_ has been judged in time
  Histories judge_;                                       // by this looser run, where pictures are asked for
  double lost_ = 0.0;                                     // what its energy said
  std::optional<Histories> other_;                        // the last run by which space was judged
  double other_at_ = 0.0;                                 // its tolerance
  double allowed_ = longest;                              // CPU s of the next run
  double until_ = 1e300;                                  // work_seconds() at which this ends
  double step_ = 0.1;                                     // by which the tolerance has to fall
  double effects_ = 0.0;                                  // what is left out is worth
  std::vector<Task::Share> shares_;                       // of them
  BendingWorth bending_;                                  // in beams' own frames
};

}  // namespace flexframe::sim
