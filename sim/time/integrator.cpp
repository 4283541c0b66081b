#include "sim/time/integrator.h"

#include "sim/base/small_matrices.h"
#include "sim/time/exponential.h"
#include "sim/time/integrator_vector.h"
#include "sim/time/step_path.h"

#include <arkode/arkode_arkstep.h>
#include <cvode/cvode.h>
#include <ida/ida.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace flexframe::sim {
namespace {

double* data(N_Vector v) { return N_VGetArrayPointer(v); }

// A direct solver of our own for SUNDIALS, which owns it: `Solver` with setup(SUNMatrix) and solve(b, x, count). setup's answer: 0, or 1
// for a zero pivot, which is recoverable: another step size gives another matrix.
template <class Solver>
SUNLinearSolver direct_solver(SUNContext context) {
  SUNLinearSolver s = SUNLinSolNewEmpty(context);
  s->content = new Solver;
  s->ops->gettype = [](SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; };
  s->ops->initialize = [](SUNLinearSolver) { return 0; };
  s->ops->setup = [](SUNLinearSolver self, SUNMatrix A) { return static_cast<Solver*>(self->content)->setup(A); };
  s->ops->solve = [](SUNLinearSolver self, SUNMatrix, N_Vector x, N_Vector b, double) {
    static_cast<Solver*>(self->content)->solve(data(b), data(x), N_VGetLength(b));
    return 0;
  };
  s->ops->free = [](SUNLinearSolver self) {
    delete static_cast<Solver*>(self->content);
    self->content = nullptr;
    SUNLinSolFreeEmpty(self);
    return 0;
  };
  return s;
}

// Newton's matrix 1 - g J of mechanical equations, solved for the rates alone:
//   (1 - g B - g^2 A) dw = b_w + g A P b_q,   dq = b_q + g T dw,   the rest unchanged.
// Where A and B follow from pieces of mass, stiffness and damping but for a few columns, (M + g D + g^2 K) is factorised instead and the
// columns beside are put in by the formula of Woodbury: neither M^-1 K nor a factorisation without symmetry is needed.
struct MechanicalSolver {
  MechanicalJacobian jacobian;
  double gamma = 0.0;
  std::function<double()> current_gamma;  // where the step's may have changed since the matrix was set up
  MatX matrix;                            // its factors
  std::vector<int> order;
  struct Factor {
    MatX L;                  // of a piece; what rounding or a negative stiffness leaves without a root:
    std::vector<int> order;  // the factors with row exchanges, else empty
  };
  std::vector<Factor> factors;
  MatX beside, closing;  // the pieces' matrix solved for the columns beside; inverse of what they leave of theirs
  VecX direction, product, rhs, rates;

  int setup(SUNMatrix) { return factorise(); }
  int factorise() {
    if (!jacobian.pieces.empty()) return factorise_pieces();
    matrix = -gamma * jacobian.B - gamma * gamma * jacobian.A;
    matrix.diagonal().array() += 1.0;
    return sim::factorise(matrix, order) > 0.0 ? 0 : 1;
  }

  int factorise_pieces() {
    factors.resize(jacobian.pieces.size());
    for (size_t i = 0; i < factors.size(); ++i) {
      const MechanicalJacobian::Piece& piece = jacobian.pieces[i];
      matrix = piece.mass;
      if (piece.stiffness.size() > 0) matrix += gamma * gamma * piece.stiffness;
      else matrix.diagonal() += gamma * gamma * piece.diagonal;
      if (piece.damping.size() > 0) matrix += gamma * piece.damping;
      factors[i].order.clear();
      if (cholesky(matrix, factors[i].L)) continue;
      factors[i].L = matrix;
      if (!(sim::factorise(factors[i].L, factors[i].order) > 0.0)) return 1;
    }
    const Eigen::Index n = jacobian.A.rows(), m = static_cast<Eigen::Index>(jacobian.beside.size());
    beside.resize(n, m);
    closing.resize(m, m);
    for (Eigen::Index j = 0; j < m; ++j) {
      const int at = jacobian.beside[static_cast<size_t>(j)];
      rates = -gamma * jacobian.B.col(at) - gamma * gamma * jacobian.A.col(at);
      solve_pieces(nullptr);
      beside.col(j) = rates;
      for (Eigen::Index i = 0; i < m; ++i) closing(i, j) = (i == j ? 1.0 : 0.0) + rates[jacobian.beside[static_cast<size_t>(i)]];
    }
    return m == 0 || invert(closing) ? 0 : 1;
  }

  // rates = (M + g D + g^2 K)^-1 (M rates - g K p), p may be null.
  void solve_pieces(const double* p) {
    for (size_t i = 0; i < factors.size(); ++i) {
      const MechanicalJacobian::Piece& piece = jacobian.pieces[i];
      const Eigen::Index n = piece.mass.rows();
      double* const x = rates.data() + piece.first;
      rhs.resize(n);
      multiply(piece.mass, x, rhs.data());
      if (p && piece.stiffness.size() == 0) {
        rhs.array() -= gamma * piece.diagonal.array() * Eigen::Map<const VecX>(p + piece.first, n).array();
      } else if (p) {
        product.resize(n);
        multiply(piece.stiffness, p + piece.first, product.data());
        rhs -= gamma * product;
      }
      if (factors[i].order.empty()) {
        sim::solve(factors[i].L, rhs.data());
        std::copy_n(rhs.data(), n, x);
      } else {
        sim::solve(factors[i].L, factors[i].order, rhs.data(), x);
      }
    }
  }

  // rates: b_w on entry.
  void solve_rates() {
    if (jacobian.pieces.empty()) {
      product.resize(rates.size());
      multiply(jacobian.A, direction.data(), product.data());
      rhs = rates + gamma * product;
      return sim::solve(matrix, order, rhs.data(), rates.data());
    }
    for (const int j : jacobian.beside) rates += (gamma * direction[j]) * jacobian.A.col(j);
    solve_pieces(direction.data());
    const Eigen::Index m = beside.cols();
    if (m == 0) return;
    rhs.resize(m);
    for (Eigen::Index j = 0; j < m; ++j) rhs[j] = rates[jacobian.beside[static_cast<size_t>(j)]];
    // What the columns beside belong to themselves, so that a joint much stiffer than the rest keeps its digits.
    product.noalias() = closing * rhs;
    for (Eigen::Index j = 0; j < m; ++j) rates -= product[j] * beside.col(j);  // few: one, mostly
    for (Eigen::Index j = 0; j < m; ++j) rates[jacobian.beside[static_cast<size_t>(j)]] = product[j];
  }

  void solve(const double* b, double* x, Eigen::Index size) {
    if (const double g = current_gamma ? current_gamma() : gamma; g != gamma) {
      gamma = g;
      factorise();
    }
    const Eigen::Index nq = jacobian.T.rows, nw = jacobian.T.cols;
    direction.setZero(nw);
    jacobian.P.add_product(1.0, b, direction.data());
    rates = Eigen::Map<const VecX>(b + nq, nw);
    solve_rates();
    if (x != b) std::copy(b, b + size, x);
    jacobian.T.add_product(gamma, rates.data(), x);
    Eigen::Map<VecX>(x + nq, nw) = rates;
  }
};

}  // namespace

struct Integrator::Memory {
  const OdeProblem& problem;
  Method method;
  SUNContext context = nullptr;
  void* solver = nullptr;
  N_Vector y = nullptr, yp = nullptr;
  N_Vector inside = nullptr;  // a view of where interpolate writes
  SUNMatrix matrix = nullptr;
  SUNLinearSolver linear = nullptr;
  SUNNonlinearSolver nonlinear = nullptr;
  VecX state, beginning;  // now; where the last step of ARKODE's explicit method began
  VecX rates;
  StepPath path;  // of that method
  const StepPath::Rates rates_at = [this](double t, const VecX& at, VecX& out) {
    out.resize(at.size());
    return evaluate(t, at.data(), out.data()) == 0;
  };
  double time = 0.0, previous = 0.0;
  std::string complaint;  // what the right-hand side threw, where nothing has been evaluated since
  std::unique_ptr<ExponentialSolver> exponential;
  IntegratorStatistics before;  // counters from before restarts of ARKODE

  explicit Memory(const OdeProblem& p) : problem(p), method(Method::bdf) {}
  ~Memory() {
    if (solver) {
      if (method == Method::ida) IDAFree(&solver);
      else if (method == Method::erk || method == Method::dirk) ARKStepFree(&solver);
      else CVodeFree(&solver);
    }
    if (nonlinear) SUNNonlinSolFree(nonlinear);
    if (linear) SUNLinSolFree(linear);
    if (matrix) SUNMatDestroy(matrix);
    if (y) N_VDestroy(y);
    if (yp) N_VDestroy(yp);
    if (inside) N_VDestroy(inside);
    if (context) SUNContext_Free(&context);
  }

  // 0 done, 1 recoverable: the integrator tries a smaller step.
  // States evaluated or asked for most lately: the beginning of the step, and the iterates of two stages or more.
  struct Recent {
    long used = 0;  // 0: empty
    double time = 0.0;
    VecX y, rate, kept;
  };
  std::array<Recent, 8> recent;
  VecX made_at;  // the state that Newton's matrix was made for last; empty: none
  long requests = 0;
  bool beginning_only = false, at_beginning = true;  // stages' rates are never asked for again: remember those of the step's beginning only

  bool recall(double t, const double* at, double* out) {
    for (Recent& r : recent) {
      if (r.used == 0 || !std::equal(at, at + problem.size, r.y.data())) continue;
      std::copy(r.rate.data(), r.rate.data() + problem.size, out);
      if (t != r.time && (!problem.shift || !problem.shift(r.time, t, r.kept, out))) return false;
      r.used = ++requests;
      return true;
    }
    return false;
  }

  void remember(double t, const double* at, const double* rate) {
    Recent& r = *std::min_element(recent.begin(), recent.end(), [](const Recent& a, const Recent& b) { return a.used < b.used; });
    r.used = ++requests;
    r.time = t;
    r.y = Eigen::Map<const VecX>(at, problem.size);
    r.rate = Eigen::Map<const VecX>(rate, problem.size);
    // Stages set out from the state of the step's beginning: of no other are rates asked for at another time.
    r.kept.resize(0);
    if (problem.keep && t == time) problem.keep(r.kept);
  }

  // CVODE's stability limit detection can leave a step of length zero, which Newton's loop would try for ever. gamma is the step times a
  // number of its order, and zero before the first step only.
  bool stands_still() const {
    long steps = 0;
    double gamma = 0.0;
    CVodeGetNumSteps(solver, &steps);
    CVodeGetCurrentGamma(solver, &gamma);
    return steps > 0 && gamma == 0.0;
  }

  // ARKODE has the rates where the memory stands now as the next step's first stage. False where they cannot be evaluated.
  bool keep_end() {
    rates.resize(state.size());
    if (evaluate(time, state.data(), rates.data()) != 0) return false;
    path.add(time, state, rates);
    return true;
  }

  // ARKODE tries a shorter step where an implicit stage cannot be evaluated, and gives up where an explicit one cannot: there it is begun
  // again, a quarter as long. So it is where its end cannot be, from which nothing would go on.
  int arkode_step(double t_stop) {
    ARKStepSetStopTime(solver, t_stop);
    if (method == Method::dirk) return ARKStepEvolve(solver, t_stop, y, &time, ARK_ONE_STEP);
    if (path.empty()) keep_end();
    beginning = state;
    int flag = ARKStepEvolve(solver, t_stop, y, &time, ARK_ONE_STEP);
    const auto stuck = [&] { return flag == ARK_UNREC_RHSFUNC_ERR || flag == ARK_REPTD_RHSFUNC_ERR || (flag >= 0 && !keep_end()); };
    bool again = stuck();
    if (again) {
      double h = 0.0;
      if (flag >= 0) h = time - previous;
      else ARKStepGetCurrentStep(solver, &h);
      h = std::min(h, t_stop - previous);
      for (; again && h > 1e-14 * std::max(std::abs(previous), t_stop - previous); again = stuck()) {
        h *= 0.25;
        state = beginning;
        time = previous;
        ARKStepReset(solver, previous, y);
        ARKStepSetInitStep(solver, h);
        ARKStepSetStopTime(solver, t_stop);
        flag = ARKStepEvolve(solver, t_stop, y, &time, ARK_ONE_STEP);
      }
      ARKStepSetInitStep(solver, 0.0);
      if (again) path.clear();
    }
    return flag;
  }

  int evaluate(double t, const double* at, double* out) {
    if (method == Method::bdf && t == time && stands_still()) {
      complaint = "the method asked for a step of length zero";
      return -1;
    }
    if (recall(t, at, out)) return 0;
    try {
      for (int i = 0; i < problem.size; ++i)
        if (!std::isfinite(at[i])) {
          complaint = "a coordinate became infinite";
          return 1;
        }
      problem.rhs(t, at, out);
    } catch (const SimulationError& error) {
      complaint = error.what();
      return 1;
    }
    for (int i = 0; i < problem.size; ++i)
      if (!std::isfinite(out[i])) {
        complaint = "an acceleration became infinite";
        return 1;
      }
    complaint.clear();
    if (at_beginning) remember(t, at, out);
    at_beginning = !beginning_only;
    return 0;
  }
};

namespace {

// SUNDIALS' dense solver with Eigen's factorisation: its own solves one entry at a time, which was a fifth of a run.
struct DenseSolver {
  Eigen::PartialPivLU<MatX> lu;

  int setup(SUNMatrix A) {
    const Eigen::Index n = SUNDenseMatrix_Rows(A);
    lu.compute(Eigen::Map<const MatX>(SUNDenseMatrix_Data(A), n, n));
    return lu.matrixLU().diagonal().cwiseAbs().minCoeff() > 0.0 ? 0 : 1;
  }
  void solve(const double* b, double* x, Eigen::Index size) { Eigen::Map<VecX>(x, size) = lu.solve(Eigen::Map<const VecX>(b, size)); }
};

}  // namespace

// C callbacks see the memory through user data.
struct IntegratorCallbacks {
  template <class M>
  static int rhs(double t, N_Vector y, N_Vector dy, void* user) {
    return static_cast<M*>(user)->evaluate(t, data(y), data(dy));
  }
  template <class M>
  static int residual(double t, N_Vector y, N_Vector yp, N_Vector r, void* user) {
    M* m = static_cast<M*>(user);
    const int flag = m->evaluate(t, data(y), data(r));
    for (int i = 0; flag == 0 && i < m->problem.size; ++i) data(r)[i] = data(yp)[i] - data(r)[i];
    return flag;
  }
  // The matrix itself stays where MechanicalSolver keeps its parts. SUNDIALS prescribes the parameters.
  // Parameters: those of SUNDIALS.
  template <class M>
  static int linear_system(double t, N_Vector y, N_Vector, SUNMatrix, SUNMatrix, int still_good, int* renewed, double gamma, void* user,
                           N_Vector, N_Vector, N_Vector) {
    M* m = static_cast<M*>(user);
    MechanicalSolver& solver = *static_cast<MechanicalSolver*>(m->linear->content);
    solver.gamma = gamma;
    *renewed = still_good ? SUNFALSE : SUNTRUE;
    // A step that is tried again, shorter, begins where it did.
    const bool there = m->made_at.size() == m->problem.size && std::equal(data(y), data(y) + m->problem.size, m->made_at.data());
    if (still_good && there) return 0;
    m->made_at.resize(0);
    try {
      m->problem.jacobian(t, data(y), !still_good, solver.jacobian);
    } catch (const SimulationError& error) {
      m->complaint = error.what();
      return 1;
    }
    m->made_at = Eigen::Map<const VecX>(data(y), m->problem.size);
    return 0;
  }
  // Parameters: those of SUNDIALS.
  template <class M>
  static int linear_system_bdf(double t, N_Vector y, N_Vector dy, SUNMatrix A, int still_good, int* renewed, double gamma, void* user,
                               N_Vector t1, N_Vector t2, N_Vector t3) {
    return linear_system<M>(t, y, dy, A, nullptr, still_good, renewed, gamma, user, t1, t2, t3);
  }
  template <class M>
  static int weights(N_Vector y, N_Vector w, void* user) {
    static_cast<M*>(user)->problem.weights(data(y), data(w));
    return 0;
  }
  static void silent(int, const char*, const char*, char*, void*) {}
};

namespace {

void require(int flag, const char* what) {
  if (flag < 0) throw SimulationError(fmt::format("the integrator could not be set up ({}: {})", what, flag));
}

// The solver of each method, for the memory m that has the vector, and where it needs them the matrix and its solver. mechanical: the
// matrix is that of a mechanical system (newton_matrix.h).
template <class Memory>
void set_up_cvode(Memory& m, const OdeProblem& problem, Method method, double t0, bool mechanical) {
  using C = IntegratorCallbacks;
  m.solver = CVodeCreate(method == Method::adams ? CV_ADAMS : CV_BDF, m.context);
  require(CVodeInit(m.solver, C::rhs<Memory>, t0, m.y), "CVodeInit");
  CVodeSetErrHandlerFn(m.solver, C::silent, nullptr);
  CVodeSetUserData(m.solver, &m);
  require(CVodeWFtolerances(m.solver, C::weights<Memory>), "tolerances");
  if (method == Method::bdf) {
    require(CVodeSetLinearSolver(m.solver, m.linear, m.matrix), "linear solver");
    if (mechanical) require(CVodeSetLinSysFn(m.solver, C::linear_system_bdf<Memory>), "linear system");
    // BDF of order 3 to 5 is unstable for lightly damped oscillation: let CVODE find out and lower the order.
    CVodeSetStabLimDet(m.solver, SUNTRUE);
    // With a matrix that has been left behind, far too stiff, every correction looks small enough and the predictor is taken for the
    // solution.
    if (problem.sharp_jacobian) {
      CVodeSetLSetupFrequency(m.solver, 1);
      CVodeSetJacEvalFrequency(m.solver, 1);
    }
  } else {
    // Functional iteration: it converges for the steps that accuracy asks for and needs no Jacobian.
    m.nonlinear = SUNNonlinSol_FixedPoint(m.y, 0, m.context);
    require(CVodeSetNonlinearSolver(m.solver, m.nonlinear), "nonlinear solver");
  }
}

template <class Memory>
void set_up_ida(Memory& m, double t0) {
  using C = IntegratorCallbacks;
  m.yp = N_VClone(m.y);
  m.evaluate(t0, m.state.data(), data(m.yp));
  m.solver = IDACreate(m.context);
  require(IDAInit(m.solver, C::residual<Memory>, t0, m.y, m.yp), "IDAInit");
  IDASetErrHandlerFn(m.solver, C::silent, nullptr);
  IDASetUserData(m.solver, &m);
  require(IDAWFtolerances(m.solver, C::weights<Memory>), "tolerances");
  require(IDASetLinearSolver(m.solver, m.linear, m.matrix), "linear solver");
  // Its first step is a thousandth of what lies before it, at first order, and each failure makes it a quarter: what begins at rest and is
  // driven needed more of them at 1e-9 than the ten that it allows.
  require(IDASetMaxErrTestFails(m.solver, 40), "error test");
}

template <class Memory>
void set_up_dirk(Memory& m, const OdeProblem& problem, bool mechanical) {
  using C = IntegratorCallbacks;
  // Where vibrations are stepped over the order is lost anyway: methods of fourth and fifth order need more work for the same error
  // (tried on the pendulum and the slider-crank at 1e-5 and 1e-6).
  require(ARKStepSetTableNum(m.solver, ARKODE_ESDIRK325L2SA_5_2_3, ARKODE_ERK_NONE), "table");
  require(ARKStepSetLinearSolver(m.solver, m.linear, m.matrix), "linear solver");
  if (mechanical) {
    require(ARKStepSetLinSysFn(m.solver, C::linear_system<Memory>), "linear system");
    // The matrix follows every change of the step by itself, so that the rate of convergence found so far stays valid.
    static_cast<MechanicalSolver*>(m.linear->content)->current_gamma = [solver = m.solver] {
      double gamma = 0.0;
      ARKStepGetCurrentGamma(solver, &gamma);
      return gamma;
    };
    ARKStepSetDeltaGammaMax(m.solver, 1e10);
    ARKStepSetLinearSolutionScaling(m.solver, SUNFALSE);
  }
  // The step follows its error closely (a change costs no more than a factorisation here), and the estimate is taken as it is.
  ARKStepSetErrorBias(m.solver, 1.0);
  ARKStepSetFixedStepBounds(m.solver, 1.0, 1.2);
  // What Newton's method leaves adds up over the steps in slow coordinates, unlike the error of the method.
  ARKStepSetNonlinConvCoef(m.solver, 0.02);
  if (mechanical && problem.cheap_jacobian) {
    // With the matrix of the step itself an iteration gains two digits or more: a stage's rate then follows from its equation
    // instead of another evaluation (Hairer and Wanner, Solving Ordinary Differential Equations II, IV.8), a third fewer of them.
    // With an older matrix the error would stay in slow coordinates: the slider-crank's position was ten times worse. So would what the
    // iteration leaves over the stiff lengths that close a loop, tiny in them but a force on all that moves: there rates are evaluated
    // (slider-crank whose rods stretch, 1e-6: its slider 2e-5 m off instead of 4e-4 m, for a quarter more evaluations).
    ARKStepSetLSetupFrequency(m.solver, 1);
    if (!problem.closes_loops) {
      require(ARKStepSetDeduceImplicitRhs(m.solver, SUNTRUE), "stages");
      m.beginning_only = true;
    }
    ARKStepSetNonlinConvCoef(m.solver, 0.05);
    // The rate of convergence hardly changes from stage to stage: what was found lasts.
    ARKStepSetNonlinCRDown(m.solver, 0.1);
  }
  if (problem.sharp_jacobian) {
    ARKStepSetLSetupFrequency(m.solver, 1);
    ARKStepSetJacEvalFrequency(m.solver, 1);
  }
  // Values at the ends of steps only: derivatives of stiff components would spoil the interpolant.
  require(ARKStepSetInterpolantType(m.solver, ARK_INTERP_LAGRANGE), "interpolant");
  require(ARKStepSetInterpolantDegree(m.solver, 4), "interpolant");
}

template <class Memory>
void set_up_arkode(Memory& m, const OdeProblem& problem, Method method, double t0, bool mechanical) {
  using C = IntegratorCallbacks;
  m.solver = method == Method::erk ? ARKStepCreate(C::rhs<Memory>, nullptr, t0, m.y, m.context)
                                   : ARKStepCreate(nullptr, C::rhs<Memory>, t0, m.y, m.context);
  if (!m.solver) throw SimulationError("the integrator could not be set up (ARKODE)");
  ARKStepSetErrHandlerFn(m.solver, C::silent, nullptr);
  ARKStepSetUserData(m.solver, &m);
  require(ARKStepWFtolerances(m.solver, C::weights<Memory>), "tolerances");
  if (method == Method::erk) {
    // Sixth order at eight stages: on the pendulum and the slider-crank with eight and six modes a tenth of Dormand and Prince's error
    // (fifth order, seven stages) for four fifths of the evaluations; Fehlberg's eighth order has more, with thirteen stages.
    require(ARKStepSetTableNum(m.solver, ARKODE_DIRK_NONE, ARKODE_VERNER_8_5_6), "table");
  } else {
    set_up_dirk(m, problem, mechanical);
  }
}

}  // namespace

Integrator::Integrator(const OdeProblem& problem, Method method, double t0, const VecX& y0) : memory_(std::make_unique<Memory>(problem)) {
  Memory& m = *memory_;
  m.method = method;
  m.state = y0;
  m.time = m.previous = t0;
  if (method == Method::exponential) {
    m.beginning_only = true;
    m.exponential =
        std::make_unique<ExponentialSolver>(problem, [&m](double t, const double* y, double* dy) { return m.evaluate(t, y, dy) == 0; });
    m.exponential->restart(t0, y0);
    return;
  }
  require(SUNContext_Create(nullptr, &m.context), "context");
  m.y = make_solver_vector(problem.size, m.state.data(), m.context);
  const bool implicit = method == Method::bdf || method == Method::dirk || method == Method::ida;
  const bool mechanical = problem.jacobian && (method == Method::bdf || method == Method::dirk);
  if (implicit) {
    // SUNDIALS wants a matrix even where the mechanical solver keeps its own.
    const int rows = mechanical ? 1 : problem.size;
    m.matrix = SUNDenseMatrix(rows, rows, m.context);
    m.linear = mechanical ? direct_solver<MechanicalSolver>(m.context) : direct_solver<DenseSolver>(m.context);
  }
  // No limit on the number of steps of one call: every call takes one step.
  if (method == Method::adams || method == Method::bdf) set_up_cvode(m, problem, method, t0, mechanical);
  else if (method == Method::ida) set_up_ida(m, t0);
  else set_up_arkode(m, problem, method, t0, mechanical);
}

Integrator::~Integrator() = default;

void Integrator::restart(double t0, const VecX& y0) {
  Memory& m = *memory_;
  m.before = statistics();
  for (auto& r : m.recent) r.used = 0;
  m.made_at.resize(0);
  m.path.clear();
  m.state = y0;
  m.time = m.previous = t0;
  if (m.exponential) {
    m.exponential->restart(t0, y0);
  } else if (m.method == Method::ida) {
    m.evaluate(t0, m.state.data(), data(m.yp));
    require(IDAReInit(m.solver, t0, m.y, m.yp), "restart");
  } else if (m.method == Method::erk) {
    require(ARKStepReInit(m.solver, IntegratorCallbacks::rhs<Memory>, nullptr, t0, m.y), "restart");
  } else if (m.method == Method::dirk) {
    require(ARKStepReInit(m.solver, nullptr, IntegratorCallbacks::rhs<Memory>, t0, m.y), "restart");
  } else {
    require(CVodeReInit(m.solver, t0, m.y), "restart");
  }
}

void Integrator::step(double t_stop) {
  Memory& m = *memory_;
  m.previous = m.time;
  m.complaint.clear();
  m.at_beginning = true;
  if (m.exponential) {
    try {
      m.time = m.exponential->step(t_stop, m.state);
    } catch (const SimulationError& error) {
      throw SimulationError(fmt::format("the integration stopped at t = {:.9g} s: {}", m.time, error.what()));
    }
    return;
  }
  int flag = 0;
  if (m.method == Method::ida) {
    IDASetStopTime(m.solver, t_stop);
    flag = IDASolve(m.solver, t_stop, &m.time, m.y, m.yp, IDA_ONE_STEP);
  } else if (m.method == Method::erk || m.method == Method::dirk) {
    flag = m.arkode_step(t_stop);
  } else {
    CVodeSetStopTime(m.solver, t_stop);
    flag = CVode(m.solver, t_stop, m.y, &m.time, CV_ONE_STEP);
  }
  if (flag < 0) {
    const char* why = "the steps became too small";
    if (flag == -3) why = "the error test failed even with the smallest step";
    if (flag == -4 || flag == -5) why = "the implicit equations did not converge even with the smallest step";
    throw SimulationError(fmt::format("the integration stopped at t = {:.9g} s: {}", m.time, why));
  }
}

double Integrator::time() const { return memory_->time; }
const std::string& Integrator::complaint() const { return memory_->complaint; }
double Integrator::previous_time() const { return memory_->previous; }
const VecX& Integrator::state() const { return memory_->state; }

void Integrator::interpolate(double t, VecX& y) const {
  Memory& m = *memory_;
  y.resize(m.problem.size);
  if (t == m.time) {
    y = m.state;
    return;
  }
  if (m.exponential) {
    m.exponential->interpolate(t, y);
    return;
  }
  const auto own = [&m](double at, VecX& out) {
    out.resize(m.problem.size);
    if (!m.inside) m.inside = make_solver_vector(m.problem.size, out.data(), m.context);
    N_VSetArrayPointer(out.data(), m.inside);
    int flag = 0;
    if (m.method == Method::ida) flag = IDAGetDky(m.solver, at, 0, m.inside);
    else if (m.method == Method::erk || m.method == Method::dirk) flag = ARKStepGetDky(m.solver, at, 0, m.inside);
    else flag = CVodeGetDky(m.solver, at, 0, m.inside);
    if (flag != 0) throw SimulationError(fmt::format("the solution at t = {:.9g} s cannot be interpolated", at));
  };
  if (!m.path.at(t, m.rates_at, own, y)) own(t, y);
}

void Integrator::interpolate_four(const double* times, MatX& states) const {
  Memory& m = *memory_;
  states.setZero(4, m.problem.size);
  if (m.exponential) m.exponential->interpolate_four(times, states);
  VecX y;
  for (int k = 0; k < 4; ++k) {
    if (m.exponential && times[k] != m.time) continue;
    interpolate(times[k], y);
    states.row(k) = y.transpose();
  }
}

IntegratorStatistics Integrator::statistics() const {
  const Memory& m = *memory_;
  IntegratorStatistics s;
  if (m.exponential) {
    const ExponentialSolver& e = *m.exponential;
    s.steps = e.steps, s.jacobians = e.jacobians, s.failures = e.failures, s.last_step = e.last_step;
    return s;
  }
  long fe = 0, fi = 0, fails = 0;
  if (m.method == Method::ida) {
    IDAGetNumSteps(m.solver, &s.steps);
    IDAGetNumResEvals(m.solver, &fe);
    IDAGetNumLinResEvals(m.solver, &fi);
    IDAGetNumJacEvals(m.solver, &s.jacobians);
    IDAGetNumErrTestFails(m.solver, &fails);
    IDAGetLastStep(m.solver, &s.last_step);
    IDAGetLastOrder(m.solver, &s.last_order);
  } else if (m.method == Method::erk || m.method == Method::dirk) {
    ARKStepGetNumSteps(m.solver, &s.steps);
    ARKStepGetNumRhsEvals(m.solver, &fe, &fi);
    if (m.method == Method::dirk) {
      long lin = 0;
      ARKStepGetNumLinRhsEvals(m.solver, &lin);
      fi += lin;
      ARKStepGetNumJacEvals(m.solver, &s.jacobians);
    }
    ARKStepGetNumErrTestFails(m.solver, &fails);
    ARKStepGetLastStep(m.solver, &s.last_step);
  } else {
    CVodeGetNumSteps(m.solver, &s.steps);
    CVodeGetNumRhsEvals(m.solver, &fe);
    if (m.method == Method::bdf) {
      CVodeGetNumLinRhsEvals(m.solver, &fi);
      CVodeGetNumJacEvals(m.solver, &s.jacobians);
    }
    CVodeGetNumErrTestFails(m.solver, &fails);
    CVodeGetLastStep(m.solver, &s.last_step);
    CVodeGetLastOrder(m.solver, &s.last_order);
  }
  s.evaluations = fe + fi;
  s.failures = fails;
  // A restart sets the integrators' counters to zero.
  s.steps += m.before.steps;
  s.evaluations += m.before.evaluations;
  s.jacobians += m.before.jacobians;
  s.failures += m.before.failures;
  return s;
}

}  // namespace flexframe::sim
