// flexframe spectrum: amplitude spectra of outputs in results, over frequency or order, CSV and SVG.
#include "render/cli/commands.h"
#include "render/cli/jobs.h"

#include "render/film/diagram.h"
#include "sim/base/file_output.h"
#include "sim/base/words.h"
#include "sim/results/results_file.h"
#include "sim/results/spectrum.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <numbers>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

struct Words {
  std::string results, order, out;
  std::vector<std::string> columns;
  double from = 0.0, to = 0.0, highest = 0.0;
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

}  // namespace

Command add_spectrum(Program& program) {
  const auto w = std::make_shared<Words>();
  Subcommand app = program.subcommand("spectrum", "amplitude spectra of outputs, over frequency or over the order of a shaft");
  app.option("RESULTS", w->results, "results file (HDF5)").required();
  app.option("--column", w->columns, "a column of the outputs, tip.y for example; as often as wanted; default: all").one_word();
  app.option("--order", w->order, "column of the shaft's angle (rad): the spectrum is over periods a turn");
  app.option("--from", w->from, "s, samples before are left out").not_negative();
  app.option("--to", w->to, "s, samples behind are left out").positive();
  app.option("--highest", w->highest, "highest frequency or order that is written").positive();
  app.option("-o,--out", w->out, "CSV file, beside it the diagram as SVG; default: RESULTS-spectrum.csv");
  return {app, [w] {
            const sim::Results results = sim::read_results(w->results);
            std::vector<const sim::ResultOutput*> outputs;
            for (const std::string& name : w->columns) outputs.push_back(&find_column(results, w->results, name));
            if (outputs.empty())
              for (const sim::ResultOutput& output : results.outputs) outputs.push_back(&output);
            if (outputs.empty()) find_column(results, w->results, "");
            Eigen::Index first = 0, end = results.times.size();
            while (first < end && results.times[first] < w->from) ++first;
            while (w->to > 0.0 && end > first && results.times[end - 1] > w->to) --end;
            sim::VecX x = results.times.segment(first, end - first);
            if (!w->order.empty())
              x = find_column(results, w->results, w->order).values.segment(first, end - first) / (2.0 * std::numbers::pi);
            if (x.size() > 1 && x[x.size() - 1] < x[0]) x = -x;
            const std::string axis = w->order.empty() ? "frequency" : "order";
            film::Diagram diagram{.title = fs::path(w->results).stem().string() + ": spectrum",
                                  .x_label = w->order.empty() ? "frequency, Hz" : "order, periods a turn of " + w->order,
                                  .y_label = "amplitude",
                                  .note = {},
                                  .series = {}};
            diagram.linear_x = true;
            std::string csv = axis;
            std::vector<sim::Spectrum> spectra;
            for (const sim::ResultOutput* output : outputs) {
              csv += "," + output->column;
              try {
                spectra.push_back(sim::amplitude_spectrum(x, output->values.segment(first, end - first)));
              } catch (const sim::InputError& error) {
                throw sim::InputError(fmt::format("{}: {}", w->results, error.what()));
              }
              film::DiagramSeries series{.label = fmt::format("{}, {}", output->column, output->unit), .points = {}};
              const sim::Spectrum& s = spectra.back();
              for (Eigen::Index k = 1; k < s.at.size() && (w->highest == 0.0 || s.at[k] <= w->highest); ++k)
                series.points.push_back({s.at[k], s.amplitude[k], false, {}});
              diagram.series.push_back(std::move(series));
              Eigen::Index peak = 0;
              s.amplitude.tail(s.amplitude.size() - 1).maxCoeff(&peak);
              fmt::print("{:<20} largest {:.5g} {} at {} {:.5g}\n", output->column, s.amplitude[peak + 1], output->unit, axis,
                         s.at[peak + 1]);
            }
            csv += '\n';
            for (Eigen::Index k = 0; k < spectra.front().at.size(); ++k) {
              if (w->highest > 0.0 && spectra.front().at[k] > w->highest) break;
              csv += fmt::format("{}", spectra.front().at[k]);
              for (const sim::Spectrum& s : spectra) csv += fmt::format(",{}", s.amplitude[k]);
              csv += '\n';
            }
            const fs::path out = w->out.empty() ? fs::path(fs::path(w->results).stem().string() + "-spectrum.csv") : fs::path(w->out);
            make_folder(fs::absolute(out).parent_path());
            sim::write_whole_file(out, csv);
            sim::write_whole_file(fs::path(out).replace_extension(".svg"), film::diagram_svg(diagram));
            fmt::print("spectrum     {}\ndiagram      {}\n", out.string(), fs::path(out).replace_extension(".svg").string());
            return 0;
          }};
}

}  // namespace flexframe::cli
