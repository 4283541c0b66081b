// Runs of the search for a setting that keeps an asked accuracy (accuracy.h): the scene at a resolution and a tolerance, with effects
// switched.
#pragma once

#include "sim/base/notes.h"
#include "sim/base/work_clock.h"
#include "sim/run/effect_report.h"
#include "sim/time/system.h"

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace flexframe::sim {

// A body whose resolution may be chosen.
struct Resolvable {
  size_t body = 0;
  BeamModel model = BeamModel::finite_element;
  int given = 0;                           // elements, volumes, highest mode of the scene
  std::vector<double> frequencies;         // rad/s, finite elements: of the softest direction, ascending
  int coordinates = 0;                     // as the scene has it
  bool stretches = false, twists = false;  // besides
};

struct Setting {
  int level = 1;
  double tolerance = 1e-4;
};

// What may be refined by itself: a body with its modes, or with those of stretching and torsion, or (no body) the level of all bodies that
// are no finite elements.
struct Refinement {
  std::optional<size_t> body;
  bool stiff = false;                // stretching and torsion
  double left = 0.0, before = 0.0;   // what the next finer run changed, and the one before
  double growth = 1.0, grown = 1.0;  // by which the modes (or levels' elements) of that run were more, and of the one before
  // With what lies beyond the next finer one too.
  double error() const;
};

// The search has taken the CPU time that it may.
struct SearchSpent {};

class Search {
 public:
  Search(const Scene& scene, const SimulateOptions& options);

  bool has_levels() const { return !bodies_.empty(); }
  // Whether modes may stand for all of them (with_modes): a beam in modes of its own or in volumes stays as it is.
  bool all_in_elements() const;
  // Whether levels change this body of the scene.
  bool chooses(size_t body) const;
  const Scene& scene() const { return scene_; }
  Scene at(const Setting& setting) const;
  // The setting with half of the modes of bending.
  Scene with_half(const Setting& setting) const;
  // The next level, with two modes more at least in every flexible body than this one has: what the run's own resolution is judged by.
  Scene finer_than(const Setting& setting) const;
  // From now on no fewer modes than these.
  void keep_at_least(const Scene& scene);
  std::vector<Refinement> refinements(const Setting& setting) const;
  // From now on the body keeps as many modes as the next level that has two more, or twice as many of stretching and torsion; or the others
  // have the next level. How many times as many these are.
  double refine(const Refinement& what, Setting& setting);
  // All of them at once, each by what the setting has before; by how much more is left in their `growth`.
  void refine_all(std::vector<Refinement>& list, Setting& setting);
  // The scene with a half (or another share) of the elements, volumes or modes of every body whose resolution may be chosen, rounded up;
  // none where it has no such body, or nothing to divide.
  std::optional<Scene> coarser(int by = 2) const;
  // The same with twice the elements or volumes; none where a body has modes that the scene names.
  std::optional<Scene> doubled() const;
  // The scene with an element of half the length at most beside each end of beams where a named place sets its length, be the elements half
  // or twice as many; none where there is no such beam, or no output sees it.
  std::optional<Scene> shorter_at_ends() const;
  // Whether a run of the scene as it stands costs far more than one with a few modes of every beam: finite elements have so many
  // coordinates, and nothing else is to be chosen.
  bool dear_as_given() const;
  // The scene with so many modes of bending of every beam of finite elements, however stiff, and the static deflections of the rest; of
  // stretching and torsion as few as at first, and `more`.
  Scene with_modes(int modes, int more) const;
  // The lowest level with so many modes.
  static int level_for_modes(double modes);
  // The fewest elements, volumes or modes of a body whose resolution may be chosen; 0 where there is no such body.
  int fewest() const;
  // Bodies that a setting makes rigid.
  std::vector<std::string> rigid_at(const Setting& setting) const;

  // Both throw SearchSpent at the end of the search's time.
  Histories run(const Scene& scene);
  // The same, given up after so many CPU seconds, or where it fails.
  // start: null, or what make_system gives for the scene at any tolerance.
  std::optional<Histories> run_within(const Scene& scene, double seconds, const System* start = nullptr);

  void set_effect(const EffectState& s, bool on);
  // Effects that a run turned out to need are on from now on; whether there were any.
  bool adopt(const std::vector<EffectState>& of_run);
  // What stretches or twists in one body passes its vibrations on to the next: these have it too where the program decides it. Whether
  // there were any.
  bool spread_stiff();
  // Whether the program decides this effect.
  bool decides(const EffectState& s) const;
  std::vector<std::string> describe(const Setting& setting) const;
  // The same of a scene that with_modes made.
  std::vector<std::string> describe(const Scene& chosen, double tolerance) const;

  std::vector<EffectState> states;
  std::vector<Note> warnings;  // of the scene as it is built: no setting takes them away
  bool elastic = false;        // a body deforms, whether its resolution may be chosen or not
  // Outputs are forces, accelerations or stresses. What modes lack of these falls as 1/n, of which twice as many see a part only, unless
  // the shapes of forces at rest stand beside them (reaction of an arm that starts up: 0.08 and 0.03 with 16 and 48 modes, 4e-5 with
  // three and these).
  bool reads_forces = false;
  bool pictures = false;           // outputs are places of pictures, which have sizes
  bool undamped = true;            // no body damps its own vibrations
  bool rings = true;               // no body damps them by more than a tenth of critical damping
  bool touches = false;            // dry friction, stops, contacts: events that lie where the motion puts them
  bool smooth = true;              // the exponential method is for it: nothing touches, nothing is massless, no blocks
  std::optional<Method> method;    // of all runs
  double cpu = 0.0;                // s, of all runs but the last
  double until = 1e300;            // work_seconds() at which the search ends
  std::set<std::string> flexible;  // stiff bodies whose flexibility matters
  std::set<size_t> with_static;    // bodies whose followed modes have the shapes beside them that forces at rest make
  double fineness = 1.0;           // of the elements behind modes
  // Of stretching and torsion, which are stiffer than bending and follow loads that are spread along the beam, so many are kept at first:
  // two carry nine tenths of what a beam stretches under its own inertia, and each costs as much as one of bending.
  int stiff_at_first = 2;
  // The accuracy that modes have to keep, of a deflection: 0 where nobody asks for one.
  double accuracy = 0.0;

 private:
  Scene scene_;
  const SimulateOptions* options_;
  std::vector<Resolvable> bodies_;
  double softest_ = 0.0;
  bool cheap_ = false;           // moves in a plane, or Newton's matrix takes no differences beside each coordinate (newton_matrix.h)
  std::map<size_t, int> least_;  // modes of bodies, at any level
  std::map<size_t, int> more_;   // of their modes of stretching and of torsion, beyond the fewest

  void keep(const Resolvable& body, int modes, int more, BeamDef& beam) const;
  bool lacks_shear(size_t body, int modes) const;
  bool takes_moments(size_t body) const;
  bool turns_hinge(const ForceDef& force) const;
  bool bends_in_space(size_t body) const;
};

// Whether a run's method resolves the fastest vibration that it keeps.
inline bool follows_vibrations(const std::optional<Method>& method) { return method == Method::erk || method == Method::exponential; }

}  // namespace flexframe::sim
