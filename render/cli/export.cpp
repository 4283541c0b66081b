#include "render/cli/export.h"

#include "render/cli/jobs.h"
#include "render/cli/json_text.h"
#include "render/cli/overwrite.h"
#include "render/cli/page.h"
#include "render/cli/results_job.h"
#include "render/cli/terminal.h"

#include "render/film/body_model.h"
#include "render/film/gltf.h"
#include "render/film/vtk.h"
#include "sim/base/file_output.h"
#include "sim/base/words.h"
#include "sim/results/csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include <unistd.h>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

struct ExportWords {
  std::string results, to, out, scene;
  double scale = 1.0;
  bool json = false, head = false, ghosts = false, traces = false;
  RenderWords render;
};

// A folder that goes when the scope is left.
struct TemporaryFolder {
  fs::path path;
  explicit TemporaryFolder(const fs::path& beside) {
    std::string name = (beside / ".flexframe_XXXXXX").string();
    if (!::mkdtemp(name.data())) throw std::runtime_error(fmt::format("{}: cannot create the folder", beside.string()));
    path = name;
  }
  ~TemporaryFolder() {
    std::error_code error;
    fs::remove_all(path, error);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
};

nlohmann::ordered_json export_csv(const sim::Results& results, const std::string& file, const fs::path& out, bool head) {
  if (results.outputs.empty()) {
    const std::string cure = results.scene_file.empty() ? "" : "; add [[output]] tables to " + results.scene_file + " and simulate again";
    throw sim::InputError(fmt::format("{}: holds no outputs{}", file, cure));
  }
  sim::write_histories_csv(results, out, head);
  return {{"columns", results.outputs.size() + 1}, {"rows", results.times.size()}};
}

nlohmann::ordered_json export_gltf(const ResultsJob& job, const ExportWords& words, const fs::path& out, Told& told) {
  const film::Animation animation = film::make_animation(job.results, job.settings, job.scene ? &*job.scene : nullptr);
  film::GltfReport report;
  const std::vector<std::uint8_t> bytes =
      film::make_gltf(animation, words.scale, out.extension() != ".gltf", report, {.ghosts = words.ghosts, .traces = words.traces});
  sim::write_whole_file(out, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  add_notes(told, animation);
  told.notes.insert(told.notes.end(), report.notes.begin(), report.notes.end());
  return {{"nodes", report.nodes},
          {"morph_targets", report.morph_targets},
          {"pictures", report.pictures},
          {"largest_displacement", animation.largest_displacement},
          {"error", report.error}};
}

// name empty: one VTKHDF file.
nlohmann::ordered_json export_vtk(const ResultsJob& job, double scale, const fs::path& out, const std::string& name, Told& told) {
  film::RenderSettings settings = job.settings;
  // Stress comes with the surfaces of bodies that know it; those that do not are none to warn of.
  const bool plain = settings.color_by != film::ColorBy::strain && settings.color_by != film::ColorBy::mode;
  const bool asked = settings.color_by == film::ColorBy::stress;
  if (plain && std::any_of(job.results.bodies.begin(), job.results.bodies.end(), film::knows_stress))
    settings.color_by = film::ColorBy::stress;
  film::Animation animation = film::make_animation(job.results, settings, job.scene ? &*job.scene : nullptr);
  const auto about_colors = [&](const std::string& text) { return !asked && text.find("not coloured by stress") != std::string::npos; };
  std::erase_if(animation.warnings, about_colors);
  std::erase_if(animation.notes, about_colors);
  Progress progress("writing");
  const auto show = [&](int done, int all) { progress.show(double(done) / all); };
  const film::VtkReport report =
      name.empty() ? film::write_vtkhdf(animation, scale, out, show) : film::write_vtk(animation, scale, out, name, show);
  add_notes(told, animation);
  return {{"pictures", report.pictures}, {"index", report.index.string()}};
}

nlohmann::ordered_json export_video(const ResultsJob& job, const RenderWords& render, const fs::path& out, Told& told) {
  const TemporaryFolder folder(fs::absolute(out).parent_path());
  RenderWords words = render;
  words.video = out.string();
  const DrawingReport report = run_drawing(job.results, job.settings, job.scene ? &*job.scene : nullptr, words, folder.path, "film");
  if (!report.video.made) throw std::runtime_error(report.video.note);
  add_notes(told, report);
  return {{"pictures", report.film.pictures}, {"size", {report.size.width, report.size.height}}};
}

}  // namespace

Command add_export(Program& program) {
  const auto words = std::make_shared<ExportWords>();
  Subcommand app = program.subcommand("export", "results for other programs: CSV, HTML page, glTF, VTK, video");
  app.footer(R"(csv   the histories: a column an output (RESULTS.csv)
html  one page for any browser: the scene to be turned round, playing, exaggeration by a slider, plots (RESULTS.html)
gltf  one animated file for viewers and Blender: bodies move, deformation as morph targets (RESULTS.glb; -o NAME.gltf for JSON)
vtk   a surface file a picture and an index for ParaView (folder RESULTS_vtk): displacement, velocity and stress as point data, outputs and
      units as field data
vtkhdf   the same as one file, the mesh once and all packed (RESULTS.vtkhdf; ParaView from 5.12, older readers see the first
         picture of it, and all of vtk)
mp4   the video alone (RESULTS.mp4; -o NAME.gif for a GIF, NAME.apng for an animated PNG)
Pictures a second and speed are those of the scene's [render] table.)");
  app.option("RESULTS", words->results, "results file (HDF5)").required();
  app.option("--to", words->to, "csv, html, gltf, vtk, vtkhdf or mp4")
      .as("WORD")
      .required()
      .one_of({"csv", "html", "gltf", "vtk", "vtkhdf", "mp4"});
  app.option("-o,--out", words->out, "output file, for vtk a folder; default: the name of the results, in the current folder").as("FILE");
  app.flag("--head", words->head, "csv: units and descriptions in comment lines (#) before the names of the columns");
  app.option("--scale", words->scale, "gltf, vtk, vtkhdf: deformation multiplied by this (1)").range(0.0, 1e9);
  app.flag("--ghosts", words->ghosts, "gltf: translucent copies of elastic bodies at the further --scales");
  app.flag("--traces", words->traces, "gltf: the paths of the scene's traces as lines");
  app.option("--scene", words->scene, "scene file whose [render] table is used, in place of the one in the results").as("FILE");
  app.option("--size", words->render.size, "mp4, html: pixels of the pictures, width x height").as("WxH");
  app.option("--scales", words->render.scales, "mp4, html, gltf with --ghosts: auto, or a list as 1,20: in scale and exaggerated")
      .as("LIST");
  app.option("--color-by", words->render.color_by, "mp4, html: " + color_by_help()).as("WORD");
  app.flag("--json", words->json, "summary as JSON");
  app.example("crane.h5 --to gltf -o crane.glb --scale 20", "for Blender and other viewers, deformation twenty times");
  app.example("crane.h5 --to gltf --ghosts --scales 1,50 --traces", "in scale, fifty times as ghosts, and the paths of traces");
  app.example("crane.h5 --to html", "crane.html, for anyone with a browser");
  app.example("crane.h5 --to vtkhdf", "crane.vtkhdf, for ParaView");
  app.example("crane.h5 --to csv", "the histories");

  return {app, [words] {
            const std::string name = fs::path(words->results).stem().string();
            const std::string ending = words->to == "vtk" ? "_vtk" : words->to == "gltf" ? ".glb" : "." + words->to;
            const fs::path out = words->out.empty() ? fs::path(name + ending) : fs::path(words->out);
            if (words->to == "gltf" && out.extension() != ".glb" && out.extension() != ".gltf")
              throw UsageError(fmt::format("-o {}: a glTF file ends in .glb or .gltf", out.string()));
            if (words->to == "vtkhdf" && out.extension() != ".vtkhdf")
              throw UsageError(fmt::format("-o {}: the file must end in .vtkhdf, by which ParaView knows it", out.string()));
            if (words->to == "mp4" && !film::is_video_name(out))
              throw UsageError(
                  fmt::format("-o {}: a video's name must end in {}", sim::quote(out.string()), sim::list_words(film::video_endings())));
            const ResultsJob job = read_results_job(words->results, words->scene, words->render);
            const fs::path folder = words->to == "vtk" ? out : fs::absolute(out).parent_path();
            if (words->to == "vtk") require_writable(folder);
            else require_writable_file(out), require_not_read({out});
            make_folder(folder);
            Told told{job.results.statistics.notes.texts(sim::Severity::warning), job.notes};
            nlohmann::ordered_json json = {{"format", words->to}, {"out", out.string()}};
            json.update(words->to == "csv"      ? export_csv(job.results, words->results, out, words->head)
                        : words->to == "html"   ? write_page(job.results, job.settings, job.scene ? &*job.scene : nullptr, out, told)
                        : words->to == "gltf"   ? export_gltf(job, *words, out, told)
                        : words->to == "vtk"    ? export_vtk(job, words->scale, out, name, told)
                        : words->to == "vtkhdf" ? export_vtk(job, words->scale, out, "", told)
                                                : export_video(job, words->render, out, told));
            json["warnings"] = told.warnings;
            // All that is said, as these summaries have always had it.
            std::vector<std::string> all = told.warnings;
            all.insert(all.end(), told.notes.begin(), told.notes.end());
            json["notes"] = all;
            print_warnings(told.warnings);
            if (words->json) {
              fmt::print("{}\n", json_text(json));
              return 0;
            }
            if (words->to != "html") fmt::print("{:<12} {}\n", words->to, out.string());
            if (json.contains("morph_targets"))
              fmt::print("deformation  {} morph targets, within {:.2g} m of what is drawn (largest {:.2g} m)\n",
                         json["morph_targets"].get<int>(), json["error"].get<double>(), json["largest_displacement"].get<double>());
            if (words->to == "html") print_page(json);
            else if (json.contains("pictures")) fmt::print("pictures     {}\n", json["pictures"].get<int>());
            if (verbosity() == Verbosity::quiet) return 0;
            for (const std::string& note : told.notes) fmt::print("note         {}\n", note);
            return 0;
          }};
}

}  // namespace flexframe::cli
