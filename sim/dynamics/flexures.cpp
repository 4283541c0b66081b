#include "sim/dynamics/flexures.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// Values of the links' coordinates in w_all or q_all (joints of rotation vectors have as many of both), 3 x links, zero where held.
Mat3X link_values(const Model& model, const Flexure& f, const VecX& all, bool rates) {
  Mat3X out = Mat3X::Zero(3, static_cast<Eigen::Index>(f.parts.size()));
  for (size_t i = 0; i < f.parts.size(); ++i) {
    const Part& part = model.parts[f.parts[i]];
    int at = rates ? part.v0 : part.q0;
    for (int a = 0; a < 3; ++a)
      if (f.links.free[a]) out(a, static_cast<Eigen::Index>(i)) = all[at++];
  }
  return out;
}

}  // namespace

template <class W>
void add_flexure_moments(const Model& model, W& work) {
  for (const Flexure& f : model.flexures) {
    Mat3X theta = link_values(model, f, work.q, false);
    if (f.links.time_constant > 0.0) theta += f.links.time_constant * link_values(model, f, work.w, true);
    const Mat3X moments = f.held.size() > 0 ? f.held : link_moments(f.links, theta);
    for (size_t i = 0; i < f.parts.size(); ++i) {
      VecX& tau = work.parts[f.parts[i]].tau;
      int at = 0;
      for (int a = 0; a < 3; ++a)
        if (f.links.free[a]) tau[at++] += moments(a, static_cast<Eigen::Index>(i));
    }
  }
}

template void add_flexure_moments(const Model&, Work&);
template void add_flexure_moments(const Model&, PlaneWork&);

double flexure_energy(const Model& model, const VecX& q_all, int scene_body) {
  double e = 0.0;
  for (const Flexure& f : model.flexures) {
    if (scene_body >= 0 && f.scene_body != scene_body) continue;
    const Mat3X theta = link_values(model, f, q_all, false);
    e -= 0.5 * theta.cwiseProduct(link_moments(f.links, theta)).sum();
  }
  return e;
}

double flexure_power(const Model& model, const VecX& w_all) {
  double power = 0.0;
  for (const Flexure& f : model.flexures) {
    if (f.links.time_constant == 0.0) continue;
    const Mat3X rate = link_values(model, f, w_all, true);
    power -= f.links.time_constant * rate.cwiseProduct(link_moments(f.links, rate)).sum();
  }
  return power;
}

void hold_flexures(Model& model, const Work& work) {
  for (Flexure& f : model.flexures) f.held = link_moments(f.links, link_values(model, f, work.q, false));
}

void add_flexure_matrices(const Model& model, const MatX& N, MatX& K, MatX& D) {
  for (const Flexure& f : model.flexures) {
    MatX moments = MatX::Zero(N.rows(), N.cols());
    for (Eigen::Index k = 0; k < N.cols(); ++k) {
      const Mat3X m = link_moments(f.links, link_values(model, f, N.col(k), true));
      for (size_t i = 0; i < f.parts.size(); ++i) {
        int at = model.parts[f.parts[i]].v0;
        for (int a = 0; a < 3; ++a)
          if (f.links.free[a]) moments(at++, k) = m(a, static_cast<Eigen::Index>(i));
      }
    }
    const MatX k = -N.transpose() * moments;
    K += k;
    D += f.links.time_constant * k;
  }
}

double flexure_frequency(const Flexure& f) {
  const double l = f.length / std::max<double>(1.0, static_cast<double>(f.parts.size()));
  const double bending = std::max(f.links.free[1] ? f.links.section(1, 1) : 0.0, f.links.free[2] ? f.links.section(2, 2) : 0.0);
  double omega = 4.0 / (l * l) * std::sqrt(bending / f.mass_per_length);
  if (f.links.free[0]) omega = std::max(omega, 2.0 / l * std::sqrt(f.links.section(0, 0) / f.polar_inertia));
  return omega;
}

}  // namespace flexframe::sim
