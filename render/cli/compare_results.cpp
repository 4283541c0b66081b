#include "render/cli/compare_results.h"

#include "render/cli/jobs.h"
#include "render/cli/json_text.h"
#include "render/cli/results_job.h"
#include "render/cli/terminal.h"
#include "render/film/picture_accuracy.h"
#include "render/film/vertex_errors.h"

#include <fmt/format.h>

namespace flexframe::cli {

bool is_results_name(const std::string& name) { return name.ends_with(".h5") || name.ends_with(".hdf5"); }

int compare_results(const ResultsComparison& asked) {
  const ResultsJob a = read_results_job(asked.baseline, "", {}), b = read_results_job(asked.candidate, "", {});
  if (b.results.bodies.size() != a.results.bodies.size())
    throw sim::InputError(fmt::format("{} has {} bodies and {} has {}: results of one scene are compared", asked.baseline,
                                      a.results.bodies.size(), asked.candidate, b.results.bodies.size()));
  const film::Animation animation = film::make_animation(a.results, a.settings, a.scene ? &*a.scene : nullptr);
  const film::VertexDistance apart = film::vertices_apart(animation, b.results, b.scene ? &*b.scene : nullptr, asked.pictures);
  const int pictures = std::min(asked.pictures, animation.count) - apart.left_out;
  if (apart.left_out > 0)
    print_warnings({fmt::format("{} runs from {:.4g} to {:.4g} s only: {} pictures of {} beyond are not compared", asked.candidate,
                                b.results.times[0], b.results.times[b.results.times.size() - 1], apart.left_out, asked.baseline)});
  const std::string body = a.results.bodies[apart.body].name;
  const double t = apart.picture < 0 ? 0.0 : film::picture_time(animation, apart.picture);
  if (asked.json)
    fmt::print("{}\n", json_text(nlohmann::ordered_json{{"pixels", apart.pixels},
                                                        {"metres", apart.metres},
                                                        {"body", body},
                                                        {"time", t},
                                                        {"pictures", pictures},
                                                        {"left_out", apart.left_out},
                                                        {"scales", animation.scales}}));
  else
    fmt::print("vertices     at most {} or {} apart, in pixels farthest at '{}' in the picture at t = {:.4g} s; {} pictures, scales {}\n",
               film::distance_words(apart.pixels, "px"), film::distance_words(apart.metres, "m"), body, t, pictures,
               fmt::join(animation.scales, ", "));
  return asked.pixels > 0.0 && apart.pixels > asked.pixels ? 1 : 0;
}

}  // namespace flexframe::cli
