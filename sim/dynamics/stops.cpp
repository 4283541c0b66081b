#include "sim/dynamics/stops.h"

namespace flexframe::sim {
namespace {

double lower_push(const Stop& s, double q, double w) { return s.stiffness * (*s.lower - q) - s.damping * w; }
double upper_push(const Stop& s, double q, double w) { return s.stiffness * (q - *s.upper) + s.damping * w; }

}  // namespace

std::vector<int> stop_parts(const Model& model) {
  std::vector<int> out;
  for (size_t i = 0; i < model.parts.size(); ++i)
    if (model.parts[i].joint.stop && model.parts[i].joint.nv > 0) out.push_back(static_cast<int>(i));
  return out;
}

StopPhase find_stop_phase(const Stop& s, double q, double w) {
  if (s.lower && q < *s.lower) return lower_push(s, q, w) > 0.0 ? StopPhase::lower : StopPhase::lower_parting;
  if (s.upper && q > *s.upper) return upper_push(s, q, w) > 0.0 ? StopPhase::upper : StopPhase::upper_parting;
  return StopPhase::free;
}

StopMargins stop_margins(const Stop& s, StopPhase phase, double q, double w) {
  StopMargins m;
  switch (phase) {
    case StopPhase::lower:
      m = {*s.lower - q, lower_push(s, q, w)};
      break;
    case StopPhase::lower_parting:
      m = {*s.lower - q, -lower_push(s, q, w)};
      break;
    case StopPhase::upper:
      m = {q - *s.upper, upper_push(s, q, w)};
      break;
    case StopPhase::upper_parting:
      m = {q - *s.upper, -upper_push(s, q, w)};
      break;
    default:
      if (s.lower) m.out = q - *s.lower;
      if (s.upper) m.in = *s.upper - q;
  }
  return m;
}

StopPhase next_stop_phase(StopPhase phase, bool first) {
  switch (phase) {
    case StopPhase::lower:
      return first ? StopPhase::free : StopPhase::lower_parting;
    case StopPhase::lower_parting:
      return first ? StopPhase::free : StopPhase::lower;
    case StopPhase::upper:
      return first ? StopPhase::free : StopPhase::upper_parting;
    case StopPhase::upper_parting:
      return first ? StopPhase::free : StopPhase::upper;
    default:
      return first ? StopPhase::lower : StopPhase::upper;
  }
}

double stop_elastic_force(const Stop& s, StopPhase phase, double q) {
  switch (phase) {
    case StopPhase::lower:
    case StopPhase::lower_parting:
      return s.stiffness * (*s.lower - q);
    case StopPhase::upper:
    case StopPhase::upper_parting:
      return -s.stiffness * (q - *s.upper);
    default:
      return 0.0;
  }
}

double stop_force(const Stop& s, StopPhase phase, double q, double w) {
  switch (phase) {
    case StopPhase::lower:
      return lower_push(s, q, w);
    case StopPhase::upper:
      return -upper_push(s, q, w);
    default:
      return 0.0;
  }
}

}  // namespace flexframe::sim
