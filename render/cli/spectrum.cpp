// flexframe spectrum: amplitude spectra of outputs in results, over frequency or order, CSV and SVG.
#include "render/cli/commands.h"
#include "render/cli/jobs.h"
#include "render/cli/json_text.h"
#include "render/cli/overwrite.h"

#include "render/film/diagram.h"
#include "sim/base/file_output.h"
#include "sim/base/words.h"
#include "sim/results/computed_outputs.h"
#include "sim/results/driven_coordinates.h"
#include "sim/results/results_file.h"
#include "sim/results/sampling.h"
#include "sim/results/spectrum.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

struct SpectrumWords {
  std::string results, order, out;
  std::vector<std::string> columns;
  double from = 0.0, to = 0.0, highest = 0.0;
  bool json = false;
  bool written(double at) const { return highest == 0.0 || at <= highest; }
};

const sim::ResultOutput& find_column(const sim::Results& results, const std::string& file, const std::string& name) {
  std::vector<std::string> known;
  for (const sim::ResultOutput& output : results.outputs) {
    if (output.column == name) return output;
    known.push_back(output.column);
  }
  const std::string hint = sim::did_you_mean(name, known);
  throw sim::InputError(
      fmt::format("{}: {} is no column of the outputs{}{} {}", file, sim::quote(name), hint, hint.empty() ? ";" : "",
                  known.empty() ? "there are none: add [[output]] tables to the scene" : "there are " + sim::list_words(known)));
}

struct Named {
  const sim::ResultOutput* output;
  sim::Spectrum spectrum;
};

struct Samples {
  Eigen::Index first, count;
};

// Those between --from and --to.
Samples wanted_samples(const SpectrumWords& w, const sim::Results& results) {
  Eigen::Index first = 0, end = results.times.size();
  while (first < end && results.times[first] < w.from) ++first;
  while (w.to > 0.0 && end > first && results.times[end - 1] > w.to) --end;
  return {first, end - first};
}

// Over time or turns of the shaft.
std::vector<Named> spectra_of(const SpectrumWords& w, const sim::Results& results, const Samples& samples) {
  std::vector<const sim::ResultOutput*> outputs;
  for (const std::string& name : w.columns) outputs.push_back(&find_column(results, w.results, name));
  if (outputs.empty())
    for (const sim::ResultOutput& output : results.outputs) outputs.push_back(&output);
  if (outputs.empty()) find_column(results, w.results, "");
  const auto [first, count] = samples;
  sim::VecX x = results.times.segment(first, count);
  if (!w.order.empty()) x = find_column(results, w.results, w.order).values.segment(first, count) / (2.0 * std::numbers::pi);
  if (x.size() > 1 && x[x.size() - 1] < x[0]) x = -x;
  std::vector<Named> spectra;
  for (const sim::ResultOutput* output : outputs) {
    try {
      spectra.push_back({output, sim::amplitude_spectrum(x, output->values.segment(first, count))});
    } catch (const sim::InputError& error) {
      throw sim::InputError(fmt::format("{}: {}", w.results, error.what()));
    }
  }
  return spectra;
}

std::string spectrum_csv(const SpectrumWords& w, const std::vector<Named>& spectra, const std::string& axis) {
  std::string csv = axis;
  for (const Named& one : spectra) csv += "," + one.output->column;
  csv += '\n';
  const sim::VecX& at = spectra.front().spectrum.at;
  for (Eigen::Index k = 0; k < at.size() && w.written(at[k]); ++k) {
    csv += fmt::format("{}", at[k]);
    for (const Named& one : spectra) csv += fmt::format(",{}", one.spectrum.amplitude[k]);
    csv += '\n';
  }
  return csv;
}

film::Diagram spectrum_diagram(const SpectrumWords& w, const std::vector<Named>& spectra) {
  film::Diagram diagram{.title = fs::path(w.results).stem().string() + ": spectrum",
                        .x_label = w.order.empty() ? "frequency, Hz" : "order, periods a turn of " + w.order,
                        .y_label = "amplitude",
                        .note = {},
                        .series = {}};
  diagram.linear_x = true;
  for (const auto& [output, s] : spectra) {
    film::DiagramSeries series{.label = fmt::format("{}, {}", output->column, output->unit), .points = {}};
    for (Eigen::Index k = 1; k < s.at.size() && w.written(s.at[k]); ++k) series.points.push_back({s.at[k], s.amplitude[k], false, {}});
    diagram.series.push_back(std::move(series));
  }
  return diagram;
}

// What repeats every turn of a shaft appears slower where a turn has fewer than two samples.
void warn_of_fast_turns(const sim::Results& results, const Samples& samples, std::vector<std::string>& warnings) {
  if (samples.count < 2) return;
  const sim::VecX t = results.times.segment(samples.first, samples.count);
  const double rate = static_cast<double>(samples.count - 1) / (t[samples.count - 1] - t[0]);
  for (const sim::ResultJoint& joint : results.joints) {
    if (joint.kind != "revolute" || joint.value.cols() != 1) continue;
    const sim::VecX angle = joint.value.col(0).segment(samples.first, samples.count);
    const Eigen::Index n = samples.count - 1;
    const double turns =
        (angle.tail(n) - angle.head(n)).cwiseQuotient(t.tail(n) - t.head(n)).cwiseAbs().maxCoeff() / (2.0 * std::numbers::pi);
    if (2.0 * turns > rate)
      warnings.push_back(
          fmt::format("joint '{}' turns {:.3g} times a second, too fast for {:.4g} samples a second: what repeats with its turns "
                      "appears at a lower frequency; take a larger output_rate",
                      joint.name, turns, rate));
  }
}

// How often what an output shows is a derivative of a joint's value, by its unit: forces are accelerations.
int derivatives_of(const std::string& unit) { return unit == "m" || unit == "rad" ? 0 : unit == "m/s" || unit == "rad/s" ? 1 : 2; }

// A vibration faster than the samples that hardly shows in how they follow each other: too little beside a slow motion, and yet most of its
// acceleration, or nearly as fast as the samples, so that it seems to creep. It stands at a lower frequency, where its rate over its value
// tells the true one.
void warn_of_unseen_vibrations(const sim::Results& results, const Samples& samples, const std::vector<Named>& spectra,
                               std::vector<std::string>& warnings) {
  constexpr double seen = 0.02, rounding = 1e-9;  // of the largest line; of the largest value
  int derivatives = 0;
  for (const Named& one : spectra) derivatives = std::max(derivatives, derivatives_of(one.output->unit));
  const sim::VecX t = results.times.segment(samples.first, samples.count);
  const double highest = 0.5 * static_cast<double>(samples.count - 1) / (t[t.size() - 1] - t[0]);
  for (const sim::ResultJoint& joint : results.joints) {
    // Elsewhere rates are no derivatives of the values.
    if (joint.kind == "spherical" || joint.kind == "free" || joint.kind == "constant-velocity" || joint.value.cols() != joint.rate.cols())
      continue;
    for (Eigen::Index c = 0; c < joint.value.cols(); ++c) {
      const sim::Spectrum value = sim::amplitude_spectrum(t, joint.value.col(c).segment(samples.first, samples.count));
      const sim::Spectrum rate = sim::amplitude_spectrum(t, joint.rate.col(c).segment(samples.first, samples.count));
      const double least = rounding * value.amplitude.maxCoeff();
      double slow = 0.0, fast = 0.0, frequency = 0.0;  // largest lines at frequencies that samples show and that they do not
      for (Eigen::Index k = 1; k < value.at.size(); ++k) {
        if (!(value.amplitude[k] > least)) continue;
        const double omega = rate.amplitude[k] / value.amplitude[k], size = value.amplitude[k] * std::pow(omega, derivatives);
        if (omega <= 2.0 * std::numbers::pi * highest) {
          slow = std::max(slow, size);
        } else if (size > fast) {
          fast = size;
          frequency = omega / (2.0 * std::numbers::pi);
        }
      }
      if (!(fast > seen * slow)) continue;
      return warnings.push_back(fmt::format(
          "joint '{}' also vibrates at about {:.3g} Hz, too fast for {:.4g} samples a second: it appears at a lower frequency in "
          "these spectra; take a larger output_rate",
          joint.name, frequency, 2.0 * highest));
    }
  }
}

// A product of vibrations, or an expression of time, that is faster than the samples though nothing moves so fast.
void warn_of_computed(const sim::Results& results, const Samples& samples, const std::vector<Named>& spectra,
                      std::vector<std::string>& warnings) {
  for (const sim::UnseenOutput& unseen : sim::computed_beyond_samples(results, samples.first, samples.count)) {
    const auto shown = [&](const Named& one) { return one.output->column == unseen.column; };
    if (std::none_of(spectra.begin(), spectra.end(), shown)) continue;
    warnings.push_back(
        fmt::format("{}: its expression is faster than {:.4g} samples a second show, they miss {:.2g} of its swing: it appears at a lower "
                    "frequency in this spectrum; take a larger output_rate",
                    unseen.column, unseen.samples, std::min(1.0, unseen.share)));
  }
}

int write_spectrum(const SpectrumWords& w) {
  sim::Results results = sim::read_results(w.results);
  sim::add_driven_coordinates(results);
  const Samples samples = wanted_samples(w, results);
  const std::vector<Named> spectra = spectra_of(w, results, samples);
  const std::string axis = w.order.empty() ? "frequency" : "order";
  const fs::path csv = w.out.empty() ? fs::path(fs::path(w.results).stem().string() + "-spectrum.csv") : fs::path(w.out);
  const fs::path svg = fs::path(csv).replace_extension(".svg");
  require_not_read({csv, svg});
  make_folder(fs::absolute(csv).parent_path());
  sim::write_whole_file(csv, spectrum_csv(w, spectra, axis));
  sim::write_whole_file(svg, film::diagram_svg(spectrum_diagram(w, spectra)));
  nlohmann::ordered_json json = {{"results", w.results}, {"outputs", nlohmann::ordered_json::array()}};
  std::vector<std::string> warnings;
  for (const auto& [output, s] : spectra) {
    const sim::SpectralLine line = sim::largest_line(s);
    json["outputs"].push_back({{"column", output->column}, {"unit", output->unit}, {"largest", line.amplitude}, {axis, line.at}});
    if (const std::string doubt = sim::doubt_of(s, line); !doubt.empty())
      warnings.push_back(fmt::format("{}: its largest line, at {} {:.4g}, {}", output->column, axis, line.at, doubt));
    if (!w.json) fmt::print("{:<20} largest {:.5g} {} at {} {:.5g}\n", output->column, line.amplitude, output->unit, axis, line.at);
  }
  json.update({{"csv", csv.string()}, {"svg", svg.string()}, {"warnings", nlohmann::ordered_json::array()}});
  if (const auto fast = sim::faster_than_samples(results, samples.first, samples.count))
    warnings.push_back(fmt::format("{} {}: it appears at a lower frequency in these spectra", fast->owner, sim::fast_motion_text(*fast)));
  else warn_of_unseen_vibrations(results, samples, spectra, warnings);
  warn_of_fast_turns(results, samples, warnings);
  warn_of_computed(results, samples, spectra, warnings);
  json["warnings"] = warnings;
  print_warnings(warnings);
  if (w.json) fmt::print("{}\n", json_text(json));
  else fmt::print("spectrum     {}\ndiagram      {}\n", csv.string(), svg.string());
  return 0;
}

}  // namespace

Command add_spectrum(Program& program) {
  const auto w = std::make_shared<SpectrumWords>();
  Subcommand app = program.subcommand("spectrum", "amplitude spectra of outputs, over frequency or over the order of a shaft");
  app.option("RESULTS", w->results, "results file (HDF5)").required();
  app.option("--column", w->columns, "a column of the outputs, tip.y for example; as often as wanted; default: all").as("NAME").one_word();
  app.option("--order", w->order, "column of the shaft's angle (rad): the spectrum is over periods a turn").as("NAME");
  app.option("--from", w->from, "samples before this time, s, are left out").not_negative();
  app.option("--to", w->to, "samples behind this time, s, are left out").positive();
  app.option("--highest", w->highest, "highest frequency or order that is written").positive();
  app.option("-o,--out", w->out, "CSV file, beside it the diagram as SVG; default: RESULTS-spectrum.csv").as("FILE");
  app.flag("--json", w->json, "report as JSON: where each spectrum is largest");
  app.footer(
      R"(A sine between two lines shows at least 85 % of its amplitude in them; "largest" is that of the sine itself, and its frequency,
where a line and its neighbours are those of one sine.)");
  app.example("out/results.h5 --column tip.y --highest 50", "of the output tip.y, up to 50 Hz");
  app.example("out/results.h5 --order shaft.angle", "over periods a turn of the shaft");
  return {app, [w] { return write_spectrum(*w); }};
}

}  // namespace flexframe::cli
