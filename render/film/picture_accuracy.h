// A scene simulated so that its pictures are right to an asked distance: accuracy = "0.5 px", "0.1 mm".
//
// Every drawn vertex of every picture, at the scene's exaggeration and camera, is to lie within that distance of where an exact simulation
// and an exact map would put it. A loose run tells cameras, scales and what the way from samples and nodes to vertices takes of the
// distance (vertex_errors.h); the rest is asked of the simulation, at places of every body: its corners or its ends and middle, in
// the world and, where it is exaggerated, of its elastic displacement, each as many metres as a pixel is there at its nearest to the
// camera. The search for settings (sim/accuracy/accuracy.h) then weighs tolerance, modes or elements and effects against that. Where
// samples are too far apart there become more of them. What it came to is judged with the final run's own nodes and cameras.
#pragma once

#include "render/film/settings.h"
#include "sim/accuracy/settings_memory.h"
#include "sim/results/results.h"
#include "sim/run/histories_run.h"
#include "sim/scene/scene.h"

#include <string>
#include <vector>

namespace flexframe::film {

// scene.simulation.picture_accuracy says what is asked. options: tolerance and accuracy are ignored. memory: as for simulate_to_accuracy,
// or null. The results have the scene's outputs, and statistics.accuracy->picture; a warning where the distance is not kept. Throws what
// simulate and make_animation throw.
sim::Results simulate_for_pictures(const sim::Scene& scene, const RenderSettings& settings, const sim::SimulateOptions& options,
                                   const sim::SettingsMemory* memory = nullptr);

// The shares as a line of letters of `width` signs, a full line being what is allowed: "[tttteeeem.....]"; and what the letters mean, each
// with its number: "t 0.12 time integration".
std::string shares_bar(const sim::PictureShares& shares, int width);
std::vector<std::string> shares_words(const sim::PictureShares& shares);
// A distance of the shares with its unit, in words: "0.31 px", "12 um".
std::string distance_words(double value, const std::string& unit);

}  // namespace flexframe::film
