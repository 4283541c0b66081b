// Contradictions within SID files. See sid_judge.h.
#include "sim/bodies/sid_judge.h"

#include "sim/base/eigen_solvers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>

namespace flexframe::sim {
namespace {

// The number before "Hz" in a label such as "Eigen Mode 3 : 134.1 Hz".
std::optional<double> labelled_frequency(const std::string& label) {
  const size_t unit = label.rfind("Hz");
  if (unit == std::string::npos) return std::nullopt;
  const size_t end = label.find_last_not_of(" \t", unit == 0 ? 0 : unit - 1);
  if (end == std::string::npos) return std::nullopt;
  const size_t blank = label.find_last_of(" \t:=", end);
  const std::string word = label.substr(blank == std::string::npos ? 0 : blank + 1, end - (blank == std::string::npos ? 0 : blank));
  char* rest = nullptr;
  const double value = std::strtod(word.c_str(), &rest);
  return !word.empty() && *rest == '\0' && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

void judge_inertia(const FlexibleBody& body, SidJudgement& out) {
  if (!(body.mass > 0.0)) return;
  out.centre = body.md0 / body.mass;
  Mat3 J;
  J << body.J0(0), body.J0(3), body.J0(4), body.J0(3), body.J0(1), body.J0(5), body.J0(4), body.J0(5), body.J0(2);
  const Mat3 about = J - body.mass * (out.centre.squaredNorm() * Mat3::Identity() - out.centre * out.centre.transpose());
  out.moments = SymmetricEigen(about, Eigen::EigenvaluesOnly).eigenvalues();
  // A hundred thousandth of the largest: files have some five digits.
  const double rounding = 1e-5 * std::max(about.cwiseAbs().maxCoeff(), J.cwiseAbs().maxCoeff());
  if (out.moments(0) < -rounding || out.moments(2) > out.moments(0) + out.moments(1) + rounding)
    out.contradicted.push_back(fmt::format(
        "no mass has these moments of inertia about its centre: {:.4g}, {:.4g}, {:.4g} kg m^2 (none may be < 0 or exceed the sum "
        "of the others): J may be about another point than mdCM, or in other units",
        out.moments(0), out.moments(1), out.moments(2)));
}

void judge_structure(const SidFile& sid, const FlexibleBody& body, SidJudgement& out) {
  const auto skewed = [](const MatX& A) { return (A - A.transpose()).cwiseAbs().maxCoeff() / std::max(A.cwiseAbs().maxCoeff(), 1e-300); };
  for (const auto& [name, matrix] : {std::pair("Me", &body.Me), std::pair("Ke", &body.Ke)})
    if (const double off = skewed(*matrix); off > 1e-6)
      out.contradicted.push_back(fmt::format("{} is not symmetric: off by {:.2g} of its largest entry", name, off));
  const double least = SymmetricEigen(body.Me, Eigen::EigenvaluesOnly).eigenvalues()(0);
  if (!(least > 0.0))
    return out.contradicted.push_back(
        fmt::format("Me is not positive definite (lowest eigenvalue {:.3g}): modes depend on each other, or one has no mass", least));
  const GeneralizedEigen modes(body.Ke, body.Me);
  if (modes.info() != Eigen::Success) return out.contradicted.push_back("Ke and Me have no frequencies");
  const VecX& values = modes.eigenvalues();
  const double rigid = 1e-9 * std::max(values.maxCoeff(), 0.0);
  const Eigen::Index negative = (values.array() < -rigid).count(), still = (values.array().abs() <= rigid).count();
  if (negative > 0)
    out.contradicted.push_back(fmt::format("Ke is not positive: {} modes are unstable (lowest eigenvalue {:.3g})", negative, values(0)));
  if (still > 0)
    out.contradicted.push_back(fmt::format(
        "{} modes have no stiffness: rigid motions of the model are among the modes; the body's frame has them already", still));
  out.frequencies = values.cwiseMax(0.0).cwiseSqrt() / (2.0 * std::numbers::pi);
  std::vector<double> labels;
  for (const std::string& label : sid.labels)
    if (const auto f = labelled_frequency(label)) labels.push_back(*f);
  if (static_cast<int>(labels.size()) != sid.nelastq) return;
  std::sort(labels.begin(), labels.end());
  int others = 0, first = -1;
  for (int k = 0; k < sid.nelastq; ++k)
    if (std::abs(labels[k] - out.frequencies(k)) > 0.01 * std::max(labels[k], out.frequencies(k))) {
      ++others;
      if (first < 0) first = k;
    }
  if (others > 0)
    out.contradicted.push_back(fmt::format(
        "{} of {} labels name other frequencies than Ke and Me have: the first says {:.6g} Hz where it is {:.6g} Hz; labels are no "
        "part of the simulation",
        others, sid.nelastq, labels[first], out.frequencies(first)));
}

}  // namespace

SidJudgement judge_sid(const SidFile& sid) {
  SidJudgement out;
  FlexibleBody body;
  std::vector<std::string> notes;
  SidLacks lacks;
  try {
    body = to_flexible_body(sid, "file", &notes, &lacks);
  } catch (const InputError& e) {
    out.contradicted.push_back(fmt::format("no body can be made of it: {}", e.what()));
    return out;
  }
  judge_inertia(body, out);
  if (body.n > 0) judge_structure(sid, body, out);
  for (const SidCheck& c : check_sid(sid))
    if (c.residual > 1e-4)
      out.contradicted.push_back(fmt::format("identity {} does not hold: off by {:.2g} of the largest entry", c.identity, c.residual));
  for (std::string& lack : lacks.all) out.contradicted.push_back(std::move(lack));
  // The whole mass matrix, and with it which motion is at fault.
  for (std::string& note : notes)
    if (note.find("contradict each other") != std::string::npos) out.contradicted.push_back(std::move(note));
  return out;
}

}  // namespace flexframe::sim
