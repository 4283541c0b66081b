// Results without a simulation: a beam that swings about the origin and bends, with a rigid block at its tip.
#pragma once

#include "sim/results/results.h"
#include "sim/scene/section.h"

#include <cmath>
#include <string>

namespace flexframe::test {

// Length 1 m, circular section of 40 mm, 9 nodes; angle 0.8 sin(2 t), tip deflection amplitude * sin(9 t), u_y = a (x/L)^2.
inline sim::Results swinging_beam(double amplitude = 0.01, int samples = 201, double duration = 1.0) {
  sim::Results r;
  r.title = "Swinging beam";
  r.times = sim::VecX::LinSpaced(samples, 0.0, duration);
  sim::ResultBody beam, block;
  beam.name = "beam";
  beam.kind = "beam";
  beam.length = 1.0;
  beam.section = sim::make_section("circle", {{"diameter", 0.04}});
  constexpr int nodes = 9;
  for (int k = 0; k < nodes; ++k) beam.nodes.push_back({"node" + std::to_string(k), sim::Vec3(k / double(nodes - 1), 0, 0)});
  block.name = "block";
  block.kind = "rigid";
  for (sim::ResultBody* b : {&beam, &block}) {
    b->position.resize(samples, 3);
    b->orientation.resize(samples, 4);
  }
  // One coordinate, the tip's deflection: v'' = 2 a everywhere.
  beam.q = beam.qd = sim::MatX::Zero(samples, 1);
  beam.strain_stations = sim::VecX::LinSpaced(2, 0.0, 1.0);
  beam.section_strain.resize(2, 3);
  beam.section_strain << 1, 0, 2.0, 5, 0, 2.0;
  beam.displacement = sim::MatX::Zero(samples, 3 * nodes);
  beam.rotation = sim::MatX::Zero(samples, 3 * nodes);
  sim::ResultOutput tip{"tip.y", "m", sim::VecX(samples)};
  for (int i = 0; i < samples; ++i) {
    const double t = r.times[i], angle = 0.8 * std::sin(2.0 * t), a = amplitude * std::sin(9.0 * t);
    beam.position.row(i).setZero();
    beam.q(i, 0) = a;
    beam.qd(i, 0) = 9.0 * amplitude * std::cos(9.0 * t);
    beam.orientation.row(i) << std::cos(0.5 * angle), 0.0, 0.0, std::sin(0.5 * angle);
    for (int k = 0; k < nodes; ++k) {
      const double x = k / double(nodes - 1);
      beam.displacement(i, 3 * k + 1) = a * x * x;
      beam.rotation(i, 3 * k + 2) = 2.0 * a * x;
    }
    block.position.row(i) << std::cos(angle) - a * std::sin(angle), std::sin(angle) + a * std::cos(angle), 0.0;
    block.orientation.row(i) = beam.orientation.row(i);
    tip.values[i] = block.position(i, 1);
  }
  r.bodies = {beam, block};
  r.outputs = {tip};
  return r;
}

// The beam as a modal body of two forms, (x/L)^2 and (x/L)^2 (3 - 4 x/L), of which the second has a fifth of the first's amplitude.
inline void make_modal(sim::Results& results) {
  sim::ResultBody& beam = results.bodies[0];
  const auto nn = static_cast<Eigen::Index>(beam.nodes.size()), nt = results.times.size();
  beam.node_phi = beam.node_psi = sim::MatX::Zero(3 * nn, 2);
  beam.q.resize(nt, 2);
  beam.qd = sim::MatX::Zero(nt, 2);
  beam.section_strain.row(1) << 1, 1, 6.0;  // v'' of the second form: 6 - 24 x
  beam.section_strain.conservativeResize(4, 3);
  beam.section_strain.bottomRows(2) << 5, 0, 2.0, 5, 1, -18.0;
  for (Eigen::Index k = 0; k < nn; ++k) {
    const double x = beam.nodes[static_cast<std::size_t>(k)].origin.x();
    beam.node_phi.row(3 * k + 1) << x * x, x * x * (3.0 - 4.0 * x);
    beam.node_psi.row(3 * k + 2) << 2.0 * x, 6.0 * x - 12.0 * x * x;
  }
  for (Eigen::Index i = 0; i < nt; ++i) {
    const double a = beam.displacement(i, 3 * nn - 2);
    beam.q.row(i) << a, 0.2 * a;
    beam.displacement.row(i) = (beam.node_phi * beam.q.row(i).transpose()).transpose();
    beam.rotation.row(i) = (beam.node_psi * beam.q.row(i).transpose()).transpose();
  }
}

// The scene these results could come from, up to its forces.
inline const char* const swinging_scene = R"toml(
title = "Swinging beam"
[simulation]
duration = 1.0
[[body]]
name = "beam"
kind = "beam"
length = 1.0
section = { shape = "circle", diameter = 0.04 }
material = { density = 2700.0, youngs_modulus = 7e10 }
elements = 8
[[body]]
name = "block"
kind = "rigid"
mass = 1.0
inertia = [0.01, 0.01, 0.01]
[[joint]]
name = "hinge"
kind = "revolute"
parent = "ground"
child = "beam.root"
[[joint]]
name = "clamp"
kind = "weld"
parent = "beam.tip"
child = "block"
[[force]]
kind = "spring-damper"
on = "block"
stiffness = 10.0
)toml";

}  // namespace flexframe::test
