// Exponential method for vibrations that ride on a slow motion: what is linear in them is solved exactly, however often they turn within
// a step, and only the rest is approximated by polynomials.
//
// A step from t to t + h linearises the equations of motion about the state predicted for its middle, t* = t + h/2,
//   q' = T w + d_q(t),   w' = w*' + (A + (t - t*) A1) P (q - q*) + B (w - w*) + d_w(t),
// with A1 the change of A from the step before, and takes the remainders d for parabolas through their values at the beginning, the middle
// (d_w: zero; d_q: what prescribed motions make of coordinates that close loops) and the end. The linear equations are solved by Taylor
// series over pieces of a dozen radians of the fastest vibration:
// products of a small matrix with a vector, a hundredth of the price of an evaluation of f each. Two evaluations and a matrix a step.
// The end is first predicted with a remainder that is extrapolated; what the remainder there changes is less than the tolerance, and what
// follows from it is added in closed form, vibration by vibration, instead of by series once more.
// What turns by several radians within the step is taken out of the states at which the remainders are evaluated (brought to where it
// would rest), since parabolas through its oscillation would be slow loads that are not there.
// Exponential integrators: Hochbruck, Ostermann, Acta Numerica 19 (2010) 209; linearisation about the middle: Magnus' expansion (Iserles,
// Norsett, Phil. Trans. R. Soc. A 357 (1999) 983); states without oscillation: mollified methods (Garcia-Archilla, Sanz-Serna, Skeel, SIAM
// J. Sci. Comput. 20 (1998) 930). The estimated error of a step is what the evaluation at its end changed.
#pragma once

#include "sim/time/integrator.h"

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

  long steps = 0, failures = 0, jacobians = 0;
  double last_step = 0.0;

 private:
  // y' = rates + J (y - state) about a state; J by parts: w' by (A + (t - time) A1) P dq + B dw, q' by T dw.
  struct LinearModel {
    double time = 0.0;
    VecX state, rates;
    MatX T, P, A, B, A1;  // q x n, n x q, n x n
    MatX closed;          // the part of A that is known in closed form, whose change A1 follows
    MatX slope;           // its divided difference to the model before, which is `apart` seconds earlier
    double apart = 0.0;
  };
  // Coefficients of the powers of (time since start) / length of w and p = P (q - q*), one under the other as power_series.h has them.
  struct Piece {
    double start = 0.0, length = 0.0;  // s since the step's beginning
    MatX terms;
    int count = 0;
  };
  struct Solution {
    std::vector<Piece> pieces;
    size_t used = 0;
  };
  // The remainder of a step: d0 + x d1 + x^2 d2 with the columns of d, x = (time since the step's beginning) / span.
  struct Parabola {
    const MatX& d;
    double span;
  };
  // How far a solution goes, s, and which share of it the series' terms may leave out.
  struct Reach {
    double length, negligible;
  };
  bool linearise(double t, const VecX& y, const LinearModel* before, LinearModel& model);
  VecX driven_rates(const LinearModel& model) const;
  VecX remainder(const LinearModel& model, double t, const VecX& y, const VecX& rates) const;
  bool solve(const LinearModel& model, const VecX& y, double t, const Parabola& remainder, const Reach& reach, Solution& out) const;
  void evaluate_solution(const LinearModel& model, const VecX& y, const Parabola& remainder, const Solution& solution, double s,
                         VecX& out) const;
  double fastest(const LinearModel& model) const;
  void find_vibrations(const MatX& A);
  void remove_oscillation(const LinearModel& model, const Parabola& remainder, double s, double h, VecX& y) const;
  bool correct_end(const VecX& change, double h, const VecX& weight, VecX& end) const;
  void add_correction(const LinearModel& model, const VecX& change, double h, double theta, VecX& y) const;
  bool find_middle(double h);
  bool find_end(const VecX& centre, const VecX& slope, const VecX& bend, double h, VecX& end);
  bool attempt(double h);

  const OdeProblem& problem_;
  Evaluate rates_of_;
  Eigen::Index nq_ = 0, nw_ = 0;
  MechanicalJacobian jacobian_;
  MatX restA_, restB_, restA1_,
      restB1_;  // what the closed form of the matrix leaves out, by differences at rest_time_, and its change in time
  double rest_time_ = 0.0;
  bool rest_moves_ = false;  // differenced twice
  MatX shapes_, gauges_;     // vibrations of A as last made anew: w = shapes (n x m) times their rates, rates = gauges (m x n) w
  VecX frequencies_;         // rad/s, m
  double evaluations_ = 0.0, renewed_ = 0.0;

  double time_ = 0.0, previous_ = 0.0, h_ = 0.0;
  VecX state_, begin_;         // now, at the last step's beginning
  VecX calm_, calm_rate_;      // now, without what oscillates within a step; rates there
  VecX before_, before_rate_;  // the same at the last step's beginning
  LinearModel model_, trial_model_;
  MatX d_, trial_d_;  // remainder of the last step as a polynomial of the share of it: size x 3
  // What was added to its end's remainder after the series, which have changed_ (2 theta^2 - theta) less than d_; size 0: nothing.
  VecX changed_, trial_changed_;
  double span_ = 0.0;  // the step that d_ belongs to; 0: none
  Solution solution_, work_;
  VecX end_, calm_end_, calm_end_rate_, predicted_;
  mutable VecX probe_;
  double error_ = 0.0;
};

}  // namespace flexframe::sim
