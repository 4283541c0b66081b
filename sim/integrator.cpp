#include "sim/integrator.h"

#include <arkode/arkode_arkstep.h>
#include <cvode/cvode.h>
#include <ida/ida.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace flexframe::sim {

struct Integrator::Memory {
  const OdeProblem& problem;
  Method method;
  SUNContext context = nullptr;
  void* solver = nullptr;
  N_Vector y = nullptr, yp = nullptr;
  SUNMatrix matrix = nullptr;
  SUNLinearSolver linear = nullptr;
  SUNNonlinearSolver nonlinear = nullptr;
  VecX state;
  double time = 0.0, previous = 0.0;
  std::vector<int> roots;
  std::string complaint;      // what the right-hand side last threw
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
    if (context) SUNContext_Free(&context);
  }

  // 0 done, 1 recoverable: the integrator tries a smaller step.
  int evaluate(double t, const double* at, double* out) {
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
    return 0;
  }
};

namespace {

double* data(N_Vector v) { return N_VGetArrayPointer(v); }

// SUNDIALS' dense solver with Eigen's factorisation: its own solves one entry at a time, which was a fifth of a run.
struct DenseSolver {
  Eigen::PartialPivLU<MatX> lu;

  static SUNLinearSolver create(SUNContext context) {
    SUNLinearSolver s = SUNLinSolNewEmpty(context);
    s->content = new DenseSolver;
    s->ops->gettype = [](SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; };
    s->ops->initialize = [](SUNLinearSolver) { return 0; };
    s->ops->setup = [](SUNLinearSolver self, SUNMatrix A) {
      const Eigen::Index n = SUNDenseMatrix_Rows(A);
      DenseSolver& me = *static_cast<DenseSolver*>(self->content);
      me.lu.compute(Eigen::Map<const MatX>(SUNDenseMatrix_Data(A), n, n));
      // A zero pivot is recoverable: another step size gives another matrix.
      return me.lu.matrixLU().diagonal().cwiseAbs().minCoeff() > 0.0 ? 0 : 1;
    };
    s->ops->solve = [](SUNLinearSolver self, SUNMatrix, N_Vector x, N_Vector b, double) {
      DenseSolver& me = *static_cast<DenseSolver*>(self->content);
      const Eigen::Index n = me.lu.matrixLU().rows();
      Eigen::Map<VecX>(data(x), n) = me.lu.solve(Eigen::Map<const VecX>(data(b), n));
      return 0;
    };
    s->ops->free = [](SUNLinearSolver self) {
      delete static_cast<DenseSolver*>(self->content);
      self->content = nullptr;
      SUNLinSolFreeEmpty(self);
      return 0;
    };
    return s;
  }
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
  template <class M>
  static int weights(N_Vector y, N_Vector w, void* user) {
    static_cast<M*>(user)->problem.weights(data(y), data(w));
    return 0;
  }
  template <class M>
  static int root(double t, N_Vector y, double* g, void* user) {
    try {
      static_cast<M*>(user)->problem.root(t, data(y), g);
    } catch (const SimulationError& error) {
      static_cast<M*>(user)->complaint = error.what();
      return 1;
    }
    return 0;
  }
  template <class M>
  static int ida_root(double t, N_Vector y, N_Vector, double* g, void* user) { return root<M>(t, y, g, user); }
  static void silent(int, const char*, const char*, char*, void*) {}
};

namespace {

void require(int flag, const char* what) {
  if (flag < 0) throw SimulationError(fmt::format("the integrator could not be set up ({}: {})", what, flag));
}

}  // namespace

Integrator::Integrator(const OdeProblem& problem, Method method, double t0, const VecX& y0) : memory_(std::make_unique<Memory>(problem)) {
  Memory& m = *memory_;
  using C = IntegratorCallbacks;
  m.method = method;
  m.state = y0;
  m.time = m.previous = t0;
  require(SUNContext_Create(nullptr, &m.context), "context");
  m.y = N_VMake_Serial(problem.size, m.state.data(), m.context);
  const bool implicit = method == Method::bdf || method == Method::dirk || method == Method::ida;
  if (implicit) {
    m.matrix = SUNDenseMatrix(problem.size, problem.size, m.context);
    m.linear = DenseSolver::create(m.context);
  }
  // No limit on the number of steps of one call: every call takes one step.
  if (method == Method::adams || method == Method::bdf) {
    m.solver = CVodeCreate(method == Method::adams ? CV_ADAMS : CV_BDF, m.context);
    require(CVodeInit(m.solver, C::rhs<Memory>, t0, m.y), "CVodeInit");
    CVodeSetErrHandlerFn(m.solver, C::silent, nullptr);
    CVodeSetUserData(m.solver, &m);
    require(CVodeWFtolerances(m.solver, C::weights<Memory>), "tolerances");
    if (implicit) {
      require(CVodeSetLinearSolver(m.solver, m.linear, m.matrix), "linear solver");
      // BDF of order 3 to 5 is unstable for lightly damped oscillation: let CVODE find out and lower the order.
      CVodeSetStabLimDet(m.solver, SUNTRUE);
    } else {
      // Functional iteration: it converges for the steps that accuracy asks for and needs no Jacobian.
      m.nonlinear = SUNNonlinSol_FixedPoint(m.y, 0, m.context);
      require(CVodeSetNonlinearSolver(m.solver, m.nonlinear), "nonlinear solver");
    }
    if (problem.roots > 0) require(CVodeRootInit(m.solver, problem.roots, C::root<Memory>), "roots");
  } else if (method == Method::ida) {
    m.yp = N_VNew_Serial(problem.size, m.context);
    m.evaluate(t0, m.state.data(), data(m.yp));
    m.solver = IDACreate(m.context);
    require(IDAInit(m.solver, C::residual<Memory>, t0, m.y, m.yp), "IDAInit");
    IDASetErrHandlerFn(m.solver, C::silent, nullptr);
    IDASetUserData(m.solver, &m);
    require(IDAWFtolerances(m.solver, C::weights<Memory>), "tolerances");
    require(IDASetLinearSolver(m.solver, m.linear, m.matrix), "linear solver");
    if (problem.roots > 0) require(IDARootInit(m.solver, problem.roots, C::ida_root<Memory>), "roots");
  } else {
    m.solver = method == Method::erk ? ARKStepCreate(C::rhs<Memory>, nullptr, t0, m.y, m.context)
                                     : ARKStepCreate(nullptr, C::rhs<Memory>, t0, m.y, m.context);
    if (!m.solver) throw SimulationError("the integrator could not be set up (ARKODE)");
    ARKStepSetErrHandlerFn(m.solver, C::silent, nullptr);
    ARKStepSetUserData(m.solver, &m);
    require(ARKStepWFtolerances(m.solver, C::weights<Memory>), "tolerances");
    if (method == Method::erk) {
      require(ARKStepSetTableNum(m.solver, ARKODE_DIRK_NONE, ARKODE_DORMAND_PRINCE_7_4_5), "table");
    } else {
      // Where vibrations are stepped over the order is lost anyway: the third-order method has fewer stages (a third less work on the
      // slider-crank at 1e-6); below 1e-7 the fourth order pays.
      const bool high = problem.tolerance < 1e-7;
      require(ARKStepSetTableNum(m.solver, high ? ARKODE_ESDIRK436L2SA_6_3_4 : ARKODE_ESDIRK325L2SA_5_2_3, ARKODE_ERK_NONE), "table");
      require(ARKStepSetLinearSolver(m.solver, m.linear, m.matrix), "linear solver");
      // Values at the ends of steps only: derivatives of stiff components would spoil the interpolant.
      require(ARKStepSetInterpolantType(m.solver, ARK_INTERP_LAGRANGE), "interpolant");
      require(ARKStepSetInterpolantDegree(m.solver, 4), "interpolant");
    }
    if (problem.roots > 0) require(ARKStepRootInit(m.solver, problem.roots, C::root<Memory>), "roots");
  }
  m.roots.assign(problem.roots, 0);
}

Integrator::~Integrator() = default;

void Integrator::restart(double t0, const VecX& y0) {
  Memory& m = *memory_;
  m.before = statistics();
  m.state = y0;
  m.time = m.previous = t0;
  if (m.method == Method::ida) {
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

bool Integrator::step(double t_stop) {
  Memory& m = *memory_;
  m.previous = m.time;
  m.complaint.clear();
  int flag = 0;
  if (m.method == Method::ida) {
    IDASetStopTime(m.solver, t_stop);
    flag = IDASolve(m.solver, t_stop, &m.time, m.y, m.yp, IDA_ONE_STEP);
    if (flag == IDA_ROOT_RETURN) IDAGetRootInfo(m.solver, m.roots.data());
  } else if (m.method == Method::erk || m.method == Method::dirk) {
    ARKStepSetStopTime(m.solver, t_stop);
    flag = ARKStepEvolve(m.solver, t_stop, m.y, &m.time, ARK_ONE_STEP);
    if (flag == ARK_ROOT_RETURN) ARKStepGetRootInfo(m.solver, m.roots.data());
  } else {
    CVodeSetStopTime(m.solver, t_stop);
    flag = CVode(m.solver, t_stop, m.y, &m.time, CV_ONE_STEP);
    if (flag == CV_ROOT_RETURN) CVodeGetRootInfo(m.solver, m.roots.data());
  }
  static_assert(CV_ROOT_RETURN == ARK_ROOT_RETURN && CV_ROOT_RETURN == IDA_ROOT_RETURN && CV_TSTOP_RETURN == 1);
  if (flag < 0) {
    const char* why = "the steps became too small";
    if (flag == -3) why = "the error test failed even with the smallest step";
    if (flag == -4 || flag == -5) why = "the implicit equations did not converge even with the smallest step";
    throw SimulationError(fmt::format("the integration stopped at t = {:.9g} s: {}{}{}", m.time, why, m.complaint.empty() ? "" : "; ", m.complaint));
  }
  return flag == CV_ROOT_RETURN;
}

double Integrator::time() const { return memory_->time; }
double Integrator::previous_time() const { return memory_->previous; }
const VecX& Integrator::state() const { return memory_->state; }
const std::vector<int>& Integrator::root_directions() const { return memory_->roots; }

void Integrator::interpolate(double t, VecX& y) const {
  const Memory& m = *memory_;
  y.resize(m.problem.size);
  if (t == m.time) {
    y = m.state;
    return;
  }
  N_Vector out = N_VMake_Serial(m.problem.size, y.data(), m.context);
  int flag = 0;
  if (m.method == Method::ida) flag = IDAGetDky(m.solver, t, 0, out);
  else if (m.method == Method::erk || m.method == Method::dirk) flag = ARKStepGetDky(m.solver, t, 0, out);
  else flag = CVodeGetDky(m.solver, t, 0, out);
  N_VDestroy(out);
  if (flag != 0) throw SimulationError(fmt::format("the solution at t = {:.9g} s cannot be interpolated", t));
}

IntegratorStatistics Integrator::statistics() const {
  const Memory& m = *memory_;
  IntegratorStatistics s;
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
