#include "sim/dynamics/signals.h"

#include "sim/base/small_matrices.h"
#include "sim/dynamics/kinematics.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace flexframe::sim {
namespace {

// Digits that a position or a velocity has, relative to the size of the mechanism or its fastest motion.
constexpr double digits = 1e-13;

// Most values that one expression may read.
constexpr std::size_t most_readings = 64;

struct FrameState {
  Pose pose;
  Vec3 v, w;  // its axes
};

template <class W>
FrameState frame_state(const Model& model, W& work, int frame) {
  update_frame_position(model, frame, work);
  update_frame_velocity(model, frame, work);
  const Vec6 V = in_space(work, frame, work.frames[frame].V);
  return {pose_in_space(model, work, frame), V.head<3>(), V.tail<3>()};
}

// Quantity of a frame, seen from another in its axes or from the world.
template <class W>
Vec3 frame_quantity(const Model& model, W& work, const Signal& s) {
  const FrameState seen = frame_state(model, work, s.frame);
  FrameState from{Pose{}, Vec3::Zero(), Vec3::Zero()};
  if (s.relative_to >= 0) from = frame_state(model, work, s.relative_to);
  const Mat3 turn = from.pose.R.transpose() * seen.pose.R;
  Vec3 apart = from.pose.R.transpose() * (seen.pose.p - from.pose.p);
  Vec3 velocity = turn * seen.v - from.v - from.w.cross(apart);
  switch (s.quantity) {
    case Quantity::velocity:
      return velocity;
    case Quantity::angular_velocity:
      return turn * seen.w - from.w;
    case Quantity::distance:
      return {apart.norm(), 0.0, 0.0};
    case Quantity::distance_rate: {
      const double length = apart.norm();
      return {length > 0.0 ? apart.dot(velocity) / length : velocity.norm(), 0.0, 0.0};
    }
    default:
      return apart;
  }
}

// Length or its rate along the frames of a cable.
template <class W>
double path_quantity(const Model& model, W& work, const Signal& s) {
  double sum = 0.0;
  for (size_t k = 1; k < s.path.size(); ++k) {
    Signal stretch;
    stretch.quantity = s.quantity;
    stretch.frame = s.path[k];
    stretch.relative_to = s.path[k - 1];
    sum += frame_quantity(model, work, stretch)[0];
  }
  return sum;
}

template <class W>
double joint_quantity(const Model& model, const W& work, const Signal& s) {
  const Part& part = model.parts[s.part];
  const bool value = s.quantity == Quantity::value;
  if (part.joint.motion >= 0) return value ? work.motion[part.joint.motion].value : work.motion[part.joint.motion].rate;
  return value ? work.q[part.q0 + s.rate] : work.w[part.v0 + s.rate];
}

bool passes_on(const Block& block) { return !block.D.isZero(0.0); }

void take_outputs(const Model& model, int block, SignalWork& signals) {
  for (size_t i = 0; i < model.signals.size(); ++i)
    if (model.signals[i].block == block) signals.value[i] = signals.output[block][model.signals[i].component];
}

VecX block_inputs(const Model& model, const Block& block, const SignalWork& signals, double t) {
  VecX u(static_cast<Eigen::Index>(block.inputs.size()));
  for (size_t k = 0; k < block.inputs.size(); ++k)
    u[static_cast<Eigen::Index>(k)] = function_value(model.functions[block.inputs[k]], signals, t);
  return u;
}

void update_blocks(const Model& model, SignalWork& signals, double t) {
  const auto state = [&](size_t b) -> VecX {
    const Block& block = model.blocks[b];
    return block.sample > 0.0 ? signals.state[b] : VecX(signals.z.segment(block.z0, block.A.rows()));
  };
  for (size_t b = 0; b < model.blocks.size(); ++b) {
    if (model.blocks[b].sample == 0.0 && !passes_on(model.blocks[b])) signals.output[b] = model.blocks[b].C * state(b);
    take_outputs(model, static_cast<int>(b), signals);
  }
  for (size_t b = 0; b < model.blocks.size(); ++b) {
    const Block& block = model.blocks[b];
    if (block.sample > 0.0) continue;
    if (!passes_on(block)) continue;
    signals.output[b] = block.C * state(b) + block.D * block_inputs(model, block, signals, t);
    take_outputs(model, static_cast<int>(b), signals);
  }
  // A block that passes nothing on may stand before what it reads: rates come after all outputs.
  for (const Block& block : model.blocks) {
    if (block.sample > 0.0 || block.A.rows() == 0) continue;
    signals.zdot.segment(block.z0, block.A.rows()) =
        block.A * signals.z.segment(block.z0, block.A.rows()) + block.B * block_inputs(model, block, signals, t);
  }
}

// Values of what a function reads, in its order.
std::array<double, most_readings> readings(const StateFunction& f, const SignalWork& signals) {
  std::array<double, most_readings> out;
  for (size_t k = 0; k < f.signals.size(); ++k) out[k] = signals.value[f.signals[k]];
  return out;
}

// Calls on_switch(function, its switch, place among all).
template <class Functions, class OnSwitch>
void for_switches(Functions& functions, OnSwitch&& on_switch) {
  int at = 0;
  for (auto& f : functions)
    for (int k = 0; k < f.expression.state_switches(); ++k) on_switch(f, k, at++);
}

bool is_length_quantity(Quantity q) { return q == Quantity::position || q == Quantity::distance || q == Quantity::value; }

}  // namespace

void reserve_signals(const Model& model, Work& work) {
  SignalWork& s = work.signals;
  s.value.assign(model.signals.size(), 0.0);
  s.size.assign(model.signals.size(), 0.0);
  s.z = s.zdot = VecX::Zero(model.nz);
  s.contacts.resize(model.contacts.size());
  for (const Block& block : model.blocks) {
    s.state.push_back(block.initial);
    s.output.push_back(block.C * block.initial);
    if (block.sample == 0.0) s.z.segment(block.z0, block.initial.size()) = block.initial;
  }
}

template <class W>
void update_signals(const Model& model, W& work) {
  if (model.signals.empty() && model.blocks.empty()) return;
  SignalWork& signals = work.signals;
  for (size_t i = 0; i < model.signals.size(); ++i) {
    const Signal& s = model.signals[i];
    if (s.block >= 0) continue;
    if (!s.path.empty()) signals.value[i] = path_quantity(model, work, s);
    else signals.value[i] = s.frame >= 0 ? frame_quantity(model, work, s)[s.component] : joint_quantity(model, work, s);
  }
  if (!model.blocks.empty()) update_blocks(model, signals, work.time);
}
template void update_signals(const Model&, Work&);
template void update_signals(const Model&, PlaneWork&);

double function_value(const StateFunction& function, const SignalWork& signals, double t) try {
  return function.expression.value(t, readings(function, signals).data());
} catch (const SimulationError& error) {
  throw SimulationError(fmt::format("{}: {}", function.owner, error.what()));
}

double first_margin(const StateFunction& function, const SignalWork& signals, double t) {
  return function.expression.margin(0, t, readings(function, signals).data());
}

void sample_blocks(Model& model, Work& work, double t) {
  SignalWork& signals = work.signals;
  std::vector<size_t> passing, waiting;
  for (size_t b = 0; b < model.blocks.size(); ++b) {
    if (model.blocks[b].sample == 0.0) continue;
    const double periods = t / model.blocks[b].sample;
    if (std::abs(periods - std::round(periods)) > 1e-9 * std::max(1.0, periods)) continue;
    (passes_on(model.blocks[b]) ? passing : waiting).push_back(b);
  }
  // What follows from states alone is told first, so that every block reads what the others put out at this sample.
  for (const size_t b : waiting) signals.output[b] = model.blocks[b].C * signals.state[b];
  const auto inputs = [&](size_t b) {
    update_signals(model, work);
    hold_switches(model, work);
    return block_inputs(model, model.blocks[b], signals, t);
  };
  for (const size_t b : passing) {
    const Block& block = model.blocks[b];
    const VecX u = inputs(b), x = signals.state[b];
    signals.output[b] = block.C * x + block.D * u;
    signals.state[b] = block.A * x + block.B * u;
  }
  for (const size_t b : waiting) signals.state[b] = model.blocks[b].A * signals.state[b] + model.blocks[b].B * inputs(b);
  update_signals(model, work);
}

std::vector<double> sample_times(const Model& model, double from, double to) {
  std::vector<double> out;
  for (const Block& block : model.blocks) {
    if (block.sample == 0.0) continue;
    for (long k = std::lround(from / block.sample);; ++k) {
      const double t = static_cast<double>(k) * block.sample;
      if (t >= to * (1.0 - 1e-12)) break;
      if (t > from * (1.0 + 1e-12)) out.push_back(t);
    }
  }
  std::sort(out.begin(), out.end());
  // Periods of several blocks that fall together but for rounding are one.
  out.erase(std::unique(out.begin(), out.end(), [](double a, double b) { return b - a <= 1e-12 * b; }), out.end());
  return out;
}

int switch_count(const Model& model) {
  int n = 0;
  for (const StateFunction& f : model.functions) n += f.expression.state_switches();
  return n;
}

void switch_margins(const Model& model, const Work& work, double* margin) {
  for_switches(model.functions, [&](const StateFunction& f, int k, int at) {
    margin[at] = f.expression.margin(k, work.time, readings(f, work.signals).data());
  });
}

void switch_roundings(const Model& model, Work& work, std::vector<double>& rounding) {
  double fastest = 0.0;
  for (const PartWork& p : work.parts) fastest = std::max({fastest, p.V.head<3>().norm(), p.V.tail<3>().norm()});
  SignalWork& signals = work.signals;
  for (size_t i = 0; i < model.signals.size(); ++i) {
    const Signal& s = model.signals[i];
    const double own = std::abs(signals.value[i]);
    const double least = s.block >= 0 ? 0.0 : is_length_quantity(s.quantity) ? model.size : fastest;
    signals.size[i] = std::max({signals.size[i], own, least});
  }
  for_switches(model.functions, [&](const StateFunction& f, int k, int) {
    auto at = readings(f, signals);
    const double here = f.expression.margin(k, work.time, at.data());
    double sum = 1e-15 * std::abs(here);
    for (size_t r = 0; r < f.signals.size(); ++r) {
      const double kept = at[r];
      at[r] = kept + digits * signals.size[f.signals[r]];
      const double beside = f.expression.margin(k, work.time, at.data());
      if (std::isfinite(beside)) sum += std::abs(beside - here);
      at[r] = kept;
    }
    rounding.push_back(sum);
  });
}

void hold_switches(Model& model, Work& work) {
  const auto hold = [&] {
    for (StateFunction& f : model.functions)
      if (f.expression.has_switches()) f.expression.hold(work.time, readings(f, work.signals).data());
  };
  hold();
  // What a block passes on by the piece that it holds may be what the next one switches by.
  for (const Block& block : model.blocks) {
    if (block.sample > 0.0 || !passes_on(block)) continue;
    update_signals(model, work);
    hold();
  }
}

void pass_switches(Model& model, const Work& work, const std::vector<bool>& ended) {
  size_t at = 0;
  for (StateFunction& f : model.functions) {
    const size_t n = f.expression.state_switches();
    const std::vector<bool> own(ended.begin() + static_cast<std::ptrdiff_t>(at), ended.begin() + static_cast<std::ptrdiff_t>(at + n));
    at += n;
    if (n > 0) f.expression.pass(own, work.time, readings(f, work.signals).data());
  }
}

const StateFunction& switch_owner(const Model& model, int at) {
  for (const StateFunction& f : model.functions) {
    if (at < f.expression.state_switches()) return f;
    at -= f.expression.state_switches();
  }
  return model.functions.front();
}

}  // namespace flexframe::sim
