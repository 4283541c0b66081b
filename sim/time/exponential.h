// Exponential method for vibrations that ride on a slow motion: what is linear in them is solved exactly, however often they turn within
// a step, and only the rest is approximated by polynomials.
//
// A step from t to t + h linearises the equations of motion about the state predicted for its middle, t* = t + h/2,
//   q' = T w + d_q(t),   w' = w*' + (A + (t - t*) A1) P (q - q*) + B (w - w*) + d_w(t),
// with A1 the change of A from the step before, and takes the remainders d for parabolas through their values at the beginning, the middle
// (d_w: zero; d_q: what prescribed motions make of coordinates that close loops) and the end. Two evaluations and a matrix a step.
// The linear equations are solved in amounts of the modes of A (modes.h). What vibrates faster than some ten radians in a step is split:
// its free part is followed by itself, over many radians at once (free_motion.h), to a twentieth of the tolerance; the rest, in which it
// is held and given so much inertia that it makes no more radians than what else there is, goes by Taylor series over pieces of a dozen
// radians of the fastest (power_series.h). Where what should be held is off its place in the end, more radians are left to the series, at
// last all of them; steps of few radians go by series alone.
// The end is first predicted with a remainder that is extrapolated; what the remainder there changes is less than the tolerance, and what
// follows from it is added in closed form, vibration by vibration, instead of by series once more.
// What turns by several radians within the step is taken out of the states at which the remainders are evaluated (brought to where it
// would rest), since parabolas through its oscillation would be slow loads that are not there.
// What the oscillation itself makes of the remainder (second order; a hundred tolerances a step where they are tight) is asked for where
// the tolerance is below 2e-7: the remainder is evaluated along the solution found, as often as it takes until half as
// many places tell the same to a tolerance, and the parabola closest to it acts instead; what is left of it shakes the vibrations, each
// by itself (sampled_remainder.h).
// Exponential integrators: Hochbruck, Ostermann, Acta Numerica 19 (2010) 209; linearisation about the middle: Magnus' expansion (Iserles,
// Norsett, Phil. Trans. R. Soc. A 357 (1999) 983); states without oscillation: mollified methods (Garcia-Archilla, Sanz-Serna, Skeel, SIAM
// J. Sci. Comput. 20 (1998) 930). The estimated error of a step is what the evaluation at its end changed.
#pragma once

#include "sim/time/free_motion.h"
#include "sim/time/integrator.h"
#include "sim/time/modes.h"
#include "sim/time/power_series.h"
#include "sim/time/sampled_remainder.h"

namespace flexframe::sim {

class ExponentialSolver {
 public:
  // evaluate: rates of a state, false where a smaller step has to be tried. Both outlive the solver. The problem has closed_derivatives and
  // all_derivatives.
  using Evaluate = std::function<bool(double t, const double* y, double* dy)>;
  ExponentialSolver(const OdeProblem& problem, Evaluate evaluate);

  void restart(double t0, const VecX& y0);
  // One step, not beyond t_stop; writes the state and returns the time reached. Throws SimulationError where steps become too small.
  double step(double t_stop, VecX& y);
  // The solution at a time within the last step.
  void interpolate(double t, VecX& y) const;
  // The coordinates alone at four of them, a row each of 4 x size.
  void interpolate_four(const double* times, MatX& states) const;

  long steps = 0, failures = 0, jacobians = 0;
  double last_step = 0.0;

  // Amount of a mode that a correction drives: a + b x + c x^2 - a cos + sine sin, of the angle that the mode turns by.
  struct ClosedForm {
    double a, b, c, sine;
  };

 private:
  // y' = rates + J (y - state) about a state; J by parts: w' by (A + (t - time) A1) P dq + B dw, q' by T dw.
  struct LinearModel {
    double time = 0.0;
    VecX state, rates;
    SparseEntries T, P;  // q x n, n x q
    MatX A, B, A1;       // n x n
    MatX closed;         // the part of A that is known in closed form, whose change A1 follows
    MatX slope;          // its divided difference to the model before, which is `apart` seconds earlier
    double apart = 0.0;
    // Of A. Where steps are too short for anything to be followed apart those of a model before, and amounts are w and p themselves.
    Modes modes;
    bool plain = false;
    MatX moves;                                               // q by amounts of p
    VecX directions(const Eigen::Ref<const VecX>& q) const;   // P q
    VecX coordinates(const Eigen::Ref<const VecX>& p) const;  // T p
    // The same into room that stays.
    void directions_into(const double* q, VecX& out) const;
    void coordinates_into(const double* p, VecX& out) const;
    void write_amounts(const double* w, double* out) const;  // of w or p
    void of_amounts_into(const double* amounts, VecX& out) const;
  };
  // Coefficients of the powers of (time since start) / length of the amounts (modes.h) of w and p = P (q - q*), one under the other as
  // power_series.h has them.
  struct Piece {
    double start = 0.0, length = 0.0;  // s since the step's beginning
    MatX terms;
    int count = 0;
  };
  static Powers powers_of(const Piece& piece) {
    const int size = static_cast<int>(piece.terms.rows());
    return {piece.terms.col(1).data(), size, size, piece.count};
  }
  struct Solution {
    std::vector<Piece> pieces;
    size_t used = 0;
    VecX begin;       // amounts at the beginning, as the pieces' columns have them
    FreeMotion free;  // what has to be added to the pieces
  };
  // The remainder of a step: d0 + x d1 + x^2 d2 with the columns of d, x = (time since the step's beginning) / span.
  struct Parabola {
    const MatX& d;
    double span;
  };
  // What of a solution is followed apart, as it did last: radians that the rest of it makes at least, spans of its free motion.
  struct Splitting {
    double radians = 0.0;
    int spans = 1;
  };
  // How far a solution goes, s, what the series' terms may leave out and what following fast modes apart may, in weights
  // (0: their free motion is not asked for).
  struct Reach {
    double length, negligible, left_out;
    Splitting* splitting;
  };
  // The equations of a solution in amounts: its loads as coefficients of the powers of time / span, rows as power_series.h has them.
  struct Amounts {
    double tau = 0.0, span = 0.0;  // the beginning, s since that of the model; span of the loads
    Eigen::Index rows = 0;
    VecX z;
    MatX loads;
    ModalWeights weights;
    const ModalState& state(const VecX& at, double s) const;
  };
  bool linearise(double t, const VecX& y, const LinearModel* before, double h, LinearModel& model);
  VecX driven_rates(const LinearModel& model) const;
  VecX remainder(const LinearModel& model, double t, const VecX& y, const VecX& rates) const;
  void set_modes(LinearModel& model, double h);
  void find_amounts(const LinearModel& model, const VecX& y, double t, const Parabola& remainder, Amounts& out) const;
  bool solve(const LinearModel& model, const VecX& y, double t, const Parabola& remainder, const Reach& reach, Solution& out) const;
  void split(const Modes& modes, const Amounts& amounts, double limit, VecX& fast, VecX& free) const;
  double unrest(const Modes& modes, const Amounts& rest, const VecX& share, const Solution& solution, double s) const;
  bool march(const Modes& modes, const Amounts& amounts, const VecX& share, const Reach& reach, Solution& out) const;
  void evaluate_solution(const LinearModel& model, const VecX& y, const Parabola& remainder, const Solution& solution, double s,
                         VecX& out) const;
  double fastest(const MatX& A, const MatX& B) const;
  double turning_span(double h) const;
  void remove_oscillation(const LinearModel& model, const Parabola& remainder, double s, double h, VecX& y) const;
  bool correct_end(const VecX& change, double h, const VecX& weight, VecX& end) const;
  // A remainder that is `change` (2 theta^2 - theta) more, with its rows of w and p in amounts.
  struct Correction {
    VecX change, w, p;
  };
  Correction correction_by(const LinearModel& model, const VecX& change) const;
  void add_correction(const LinearModel& model, const Correction& by, double h, double theta, VecX& y) const;
  // What states within the last step have in common, made where the first is asked for.
  struct Within {
    bool made = false;
    MatX powers;             // state as far as it is a polynomial of the share of the step: size x 4
    MatX shapes, moves;      // w and q by amounts
    MatX correction_moves;   // q by those of the correction, where the others are no modes
    Eigen::Index rows = 0;   // as of Amounts
    size_t piece = 0;        // where the last state was
    VecX z, corrected, out;  // room for amounts of the series, of the correction ([w; p]), and what they make
    MatX apart, four;        // of the coordinates of four states: amounts, a column each, and a row each
    struct Fast {
      Eigen::Index at;
      double frequency;
      ClosedForm form;
    };
    std::vector<Fast> fast;              // modes that turn within the step, driven by the correction
    std::vector<Eigen::Index> slow;      // the others
    std::vector<double> sines, cosines;  // of the fast ones
  };
  void begin_within() const;
  void correct_within(double theta) const;
  const Piece& piece_within(double s) const;
  void series_four(const double* since) const;
  void correct_four(const double* shares) const;
  bool find_middle(double h);
  bool find_end(const VecX& centre, const VecX& slope, const VecX& bend, double h, VecX& end);
  bool attempt(double h);
  double effect_of(const LinearModel& model, const MatX& load, double h, const VecX& weight) const;
  void look_at_rounding();
  double rounding_of(const LinearModel& model, double h, const VecX& weight) const;
  bool sample(double h, Eigen::Index first, Eigen::Index every, MatX& values);
  MatX shaking_loads(const MatX& values, double h) const;
  bool follow_oscillation(double h, const VecX& weight);
  void add_shaken(const LinearModel& model, const Shaken& shaken, double s, VecX& y) const;

  const OdeProblem& problem_;
  Evaluate rates_of_;
  Eigen::Index nq_ = 0, nw_ = 0;
  MechanicalJacobian jacobian_;
  MatX restA_, restB_, restA1_,
      restB1_;  // what the closed form of the matrix leaves out, by differences at rest_time_, and its change in time
  double rest_time_ = 0.0;
  bool rest_moves_ = false;  // differenced twice
  double evaluations_ = 0.0, renewed_ = 0.0;

  double time_ = 0.0, previous_ = 0.0, h_ = 0.0;
  VecX state_, begin_;         // now, at the last step's beginning
  VecX calm_, calm_rate_;      // now, without what oscillates within a step; rates there
  VecX before_, before_rate_;  // the same at the last step's beginning
  LinearModel model_, trial_model_;
  MatX d_, trial_d_;  // remainder of the last step as a polynomial of the share of it: size x 3
  // What was added to its end's remainder after the series, which have changed_ (2 theta^2 - theta) less than d_; size 0: nothing.
  VecX changed_, trial_changed_;
  // Of the last step where there is such a change: what its solution was found with, for the states within it.
  MatX solved_;
  Correction correction_;
  double span_ = 0.0;  // the step that d_ belongs to; 0: none
  // Evaluated with what oscillates, of steps that follow it: a state at the last step's end, of the trial step's end; rates there.
  VecX full_, full_rate_, full_end_, full_end_rate_;
  Shaken shaken_, trial_shaken_;  // by what oscillates in the remainder, beside its parabola
  double turning_ = 0.0;          // s: in which vibrations were taken out last
  Eigen::Index places_ = 0;       // spans between the places where the remainder was sampled last
  Solution solution_, work_;
  mutable Within within_;
  VecX end_, calm_end_, calm_end_rate_, predicted_;
  mutable VecX probe_;
  double error_ = 0.0;
  VecX rounding_;                          // of w' at the present state, once looked at
  long looked_at_ = 0;                     // failures then
  int models_since_ = 0;                   // whose modes were taken over
  Splitting splitting_, splitting_ahead_;  // of whole steps and of ways to their middle
};

}  // namespace flexframe::sim
