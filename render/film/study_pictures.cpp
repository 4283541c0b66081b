#include "render/film/study_pictures.h"

#include "render/draw/renderer.h"
#include "render/film/animation.h"
#include "render/film/settings.h"
#include "sim/base/cpu_clock.h"
#include "sim/simulate.h"
#include "sim/time/system.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::film {
namespace {

double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return v.empty() ? 0.0 : v[v.size() / 2];
}

// The body with every k-th of its nodes, the first and the last kept.
sim::ResultBody thinned(const sim::ResultBody& body, size_t count) {
  const size_t n = body.nodes.size();
  sim::ResultBody out = body;
  out.nodes.clear();
  std::vector<Eigen::Index> kept;
  for (size_t k = 0; k < count; ++k) {
    const size_t at = count == 1 ? 0 : (k * (n - 1) + (count - 1) / 2) / (count - 1);
    out.nodes.push_back(body.nodes[at]);
    kept.push_back(static_cast<Eigen::Index>(at));
  }
  const auto columns = [&](const sim::RowsX& m) {
    if (m.size() == 0) return sim::RowsX();
    sim::RowsX r(m.rows(), 3 * static_cast<Eigen::Index>(kept.size()));
    for (size_t k = 0; k < kept.size(); ++k) r.middleCols<3>(3 * static_cast<Eigen::Index>(k)) = m.middleCols<3>(3 * kept[k]);
    return r;
  };
  out.displacement = columns(body.displacement);
  out.rotation = columns(body.rotation);
  return out;
}

// Displacements of the vertices at ten times of the motion, and the median CPU time of one.
struct Mapped {
  std::vector<std::vector<float>> displacement;
  double cpu = 0.0;
};
Mapped map_motion(const sim::ResultBody& body, const sim::BodyDef* def, const RenderSettings& settings, const sim::VecX& times,
                  double size) {
  const BodyModel model = make_body_model(body, {.def = def, .size = size, .places = {}}, settings, 0);
  BodyMemory memory;
  Mapped out;
  std::vector<double> cpu;
  for (int k = 1; k <= 10; ++k) {
    const SamplePlace place = find_sample(times, times[0] + 0.1 * k * (times[times.size() - 1] - times[0]));
    for (int repeat = 0; repeat < 3; ++repeat) {
      const double start = sim::process_cpu_seconds();
      update_displacement(model, body, place, memory);
      cpu.push_back(sim::process_cpu_seconds() - start);
    }
    out.displacement.push_back(memory.displacement);
  }
  out.cpu = median(cpu);
  return out;
}

// Largest difference of the vertices relative to the largest displacement of the reference.
double map_error(const Mapped& a, const Mapped& reference) {
  double worst = 0.0, largest = 0.0;
  for (size_t k = 0; k < a.displacement.size(); ++k)
    for (size_t i = 0; i + 2 < a.displacement[k].size(); i += 3) {
      const auto at = [&](const Mapped& m) { return Eigen::Map<const Eigen::Vector3f>(m.displacement[k].data() + i).cast<double>(); };
      worst = std::max(worst, (at(a) - at(reference)).norm());
      largest = std::max(largest, at(reference).norm());
    }
  return largest > 0.0 ? worst / largest : 0.0;
}

void study_map(const sim::Scene& scene, const sim::Results& results, const RenderSettings& settings, bool nodes, bool schemes,
               Study& study) {
  double size = 0.0;
  for (const sim::ResultBody& b : results.bodies)
    for (const sim::ResultNode& n : b.nodes) size = std::max(size, n.origin.norm());
  for (size_t b = 0; b < results.bodies.size(); ++b) {
    const sim::ResultBody& body = results.bodies[b];
    const sim::BodyDef* def = b < scene.bodies.size() ? &scene.bodies[b] : nullptr;
    if (body.nodes.size() < 3 || body.displacement.cwiseAbs().maxCoeff() <= 0.0 || body.node_phi.size() > 0) continue;
    const Mapped reference = map_motion(body, def, settings, results.times, size);
    const auto add = [&](const char* axis, const std::string& label, double knob, const sim::ResultBody& one, const RenderSettings& how) {
      PicturePoint p{axis, body.name, label, knob, 0.0, -1.0, ""};
      try {
        const Mapped mapped = map_motion(one, def, how, results.times, size);
        p.cpu = mapped.cpu;
        p.error = map_error(mapped, reference);
      } catch (const std::exception& e) {
        p.failure = e.what();
      }
      study.pictures.push_back(p);
    };
    if (nodes)
      for (size_t count = 2; count < body.nodes.size(); count = count < 4 ? count + 1 : count * 3 / 2)
        add("nodes", fmt::format("{} of {} nodes", count, body.nodes.size()), static_cast<double>(count), thinned(body, count), settings);
    if (schemes)
      for (interp::Scheme s : {interp::Scheme::kernel, interp::Scheme::elastic, interp::Scheme::lattice, interp::Scheme::r3,
                               interp::Scheme::r, interp::Scheme::tps}) {
        RenderSettings how = settings;
        how.scheme = s;
        add("scheme", std::string(interp::scheme_name(s)), 0.0, body, how);
      }
  }
}

// Antialiasing: against four times the width and height with 16 samples, reduced.
void study_samples(const sim::Scene& scene, const sim::Results& results, RenderSettings settings, Study& study) {
  settings.size = {640, 360};
  settings.overlay = {
      .title = false, .time = false, .scalar_bar = false, .triad = false, .legend = false, .note = false, .plot = {}, .plot_line = 0};
  const auto drawn = [&](const RenderSettings& how, double* cpu) {
    const Animation animation = make_animation(results, how, &scene);
    PictureMemory memory;
    update_picture(animation, animation.count / 2, memory);
    render::Renderer renderer;
    render::Image image;
    std::vector<double> times;
    for (int repeat = 0; repeat < (cpu ? 4 : 1); ++repeat) {
      const double start = sim::process_cpu_seconds();
      image = renderer.draw(memory.picture);
      if (repeat > 0) times.push_back(sim::process_cpu_seconds() - start);
    }
    if (cpu) *cpu = median(times);
    return image;
  };
  try {
    RenderSettings finest = settings;
    finest.size = {settings.size.width * 4, settings.size.height * 4};
    finest.samples = 4;
    const render::Image reference = render::reduce_image(drawn(finest, nullptr), settings.size.width, settings.size.height);
    for (int samples : {1, 4, 9, 16}) {
      RenderSettings how = settings;
      how.samples = samples;
      PicturePoint p{"samples", "640 x 360", fmt::format("{} samples", samples), static_cast<double>(samples), 0.0, 0.0, ""};
      const render::Image image = drawn(how, &p.cpu);
      double sum = 0.0;
      for (size_t i = 0; i < image.pixels.size(); ++i) {
        const double d = (double(image.pixels[i]) - double(reference.pixels[i])) / 255.0;
        sum += d * d;
      }
      p.error = std::sqrt(sum / static_cast<double>(image.pixels.size()));
      study.pictures.push_back(p);
    }
  } catch (const std::runtime_error& e) {
    study.notes.push_back(fmt::format("no pictures could be drawn: {}", e.what()));
  }
}

}  // namespace

void study_pictures(const sim::Scene& scene, const StudyOptions& options, Study& study) {
  const auto asked = [&](const char* axis) { return std::find(options.axes.begin(), options.axes.end(), axis) != options.axes.end(); };
  if (!asked("nodes") && !asked("scheme") && !asked("samples")) return;
  sim::SimulateOptions quick;
  quick.estimate_error = false;
  quick.tolerance = 1e-4;
  const sim::Results results = sim::simulate(scene, quick);
  const RenderSettings settings = parse_render_settings(scene.text, scene.file.string());
  if (asked("nodes") || asked("scheme")) study_map(scene, results, settings, asked("nodes"), asked("scheme"), study);
  if (asked("samples")) study_samples(scene, results, settings, study);
}

}  // namespace flexframe::film
