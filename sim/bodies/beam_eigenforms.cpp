// Characteristic equations: Blevins, Formulas for Natural Frequency and Mode Shape (1979), table 8-1, divided by cosh so that every
// term is bounded; the form is the null vector of its four boundary conditions.
#include "sim/bodies/beam_eigenforms.h"

#include <fmt/format.h>

#include <Eigen/SVD>

#include <cmath>
#include <numbers>

namespace flexframe::sim::beam {
namespace {

constexpr double pi = std::numbers::pi;

// Newton's iteration on cos(lambda) + sign / cosh(lambda).
double root_of_cosine(double lambda, double sign) {
  for (int step = 0; step < 50; ++step) {
    const double sech = 1.0 / std::cosh(lambda);
    const double d = (std::cos(lambda) + sign * sech) / (-std::sin(lambda) - sign * sech * std::tanh(lambda));
    lambda -= d;
    if (std::abs(d) <= 1e-16 * lambda) break;
  }
  return lambda;
}

// Newton's iteration on sin(lambda) - tanh(lambda) cos(lambda).
double root_of_tangent(double lambda) {
  for (int step = 0; step < 50; ++step) {
    const double th = std::tanh(lambda), sech = 1.0 / std::cosh(lambda);
    const double d =
        (std::sin(lambda) - th * std::cos(lambda)) / (std::cos(lambda) - sech * sech * std::cos(lambda) + th * std::sin(lambda));
    lambda -= d;
    if (std::abs(d) <= 1e-16 * lambda) break;
  }
  return lambda;
}

double bending_root(Boundary boundary, int mode) {
  switch (boundary) {
    case Boundary::clamped_free:
      return root_of_cosine(mode == 1 ? 1.875 : (mode - 0.5) * pi, 1.0);
    case Boundary::free_free:
    case Boundary::clamped_clamped:
      return root_of_cosine((mode + 0.5) * pi, -1.0);
    case Boundary::supported_free:
    case Boundary::clamped_supported:
      return root_of_tangent((mode + 0.25) * pi);
    case Boundary::supported_supported:
      break;
  }
  return mode * pi;
}

// Derivatives that vanish at the root and at the tip.
struct Ends {
  int root[2], tip[2];
};

Ends vanishing(Boundary boundary) {
  switch (boundary) {
    case Boundary::clamped_free:
      return {{0, 1}, {2, 3}};
    case Boundary::supported_supported:
      return {{0, 2}, {0, 2}};
    case Boundary::supported_free:
      return {{0, 2}, {2, 3}};
    case Boundary::free_free:
      return {{2, 3}, {2, 3}};
    case Boundary::clamped_clamped:
      return {{0, 1}, {0, 1}};
    case Boundary::clamped_supported:
      break;
  }
  return {{0, 1}, {0, 2}};
}

// The four functions' derivative of an order at xi, divided by lambda^order.
Eigen::RowVector4d functions(double lambda, double xi, int order) {
  const double c = std::cos(lambda * xi), s = std::sin(lambda * xi), e0 = std::exp(-lambda * xi), e1 = std::exp(-lambda * (1.0 - xi));
  switch (order) {
    case 0:
      return {c, s, e0, e1};
    case 1:
      return {-s, c, -e0, e1};
    case 2:
      return {-c, -s, e0, e1};
    default:
      return {s, -c, -e0, e1};
  }
}

void check_mode(int mode) {
  if (mode < 1) throw InputError(fmt::format("mode numbers are 1, 2, ...; found {}", mode));
}

}  // namespace

Eigenform bending_form(Boundary boundary, int mode) {
  check_mode(mode);
  Eigenform form;
  form.lambda = bending_root(boundary, mode);
  const double lambda = form.lambda;
  const Ends ends = vanishing(boundary);
  Eigen::Matrix4d conditions;
  for (int i = 0; i < 2; ++i) {
    conditions.row(i) = functions(lambda, 0.0, ends.root[i]);
    conditions.row(2 + i) = functions(lambda, 1.0, ends.tip[i]);
  }
  const Eigen::JacobiSVD<Eigen::Matrix4d> svd(conditions, Eigen::ComputeFullV);
  Eigen::Vector4d k = svd.matrixV().col(3);
  if (boundary == Boundary::supported_supported) k = Eigen::Vector4d::Unit(1);

  // with phi'''' = lambda^4 phi, 4 lambda^4 phi^2 is the derivative of
  //   xi (lambda^4 phi^2 + phi''^2 - 2 phi' phi''') + 3 phi phi''' - phi' phi'',
  // whose last two products vanish at every end condition
  const auto d = [&](int order) { return functions(lambda, 1.0, order).dot(k); };
  const double square = 0.25 * (d(0) * d(0) + d(2) * d(2) - 2.0 * d(1) * d(3));
  k /= std::sqrt(square);

  // positive where it leaves the root: the first derivative that does not vanish there
  const int leaving = boundary == Boundary::free_free ? 0 : ends.root[1] == 1 ? 2 : 1;
  if (functions(lambda, 0.0, leaving).dot(k) < 0.0) k = -k;
  form.cosine = k[0], form.sine = k[1], form.root_decay = k[2], form.tip_decay = k[3];
  return form;
}

Eigenform rod_form(Boundary boundary, int mode) {
  check_mode(mode);
  Eigenform form;
  if (boundary == Boundary::free_free) {
    form.lambda = mode * pi;
    form.cosine = std::numbers::sqrt2;
  } else {
    form.lambda = (boundary == Boundary::clamped_clamped ? mode : mode - 0.5) * pi;
    form.sine = std::numbers::sqrt2;
  }
  return form;
}

double evaluate(const Eigenform& form, double xi, int order) {
  const Eigen::Vector4d k(form.cosine, form.sine, form.root_decay, form.tip_decay);
  return std::pow(form.lambda, order) * functions(form.lambda, xi, order).dot(k);
}

}  // namespace flexframe::sim::beam
