// Drawing, film, compare, study.
#include "render/python/bindings.h"
#include "render/python/scene.h"

#include "interp/watch.h"
#include "render/draw/renderer.h"
#include "render/film/animation.h"
#include "render/film/filming.h"
#include "render/film/study.h"
#include "render/film/video.h"
#include "render/image/image_compare.h"
#include "render/image/png.h"
#include "sim/base/words.h"
#include "sim/scene/scene_reader.h"

#include <fmt/format.h>

#include <cmath>
#include <mutex>

namespace flexframe::python {
namespace {

py::array_t<std::uint8_t> to_array(const render::Image& image) {
  // Always with alpha, so that a picture has one shape.
  py::array_t<std::uint8_t> out({image.height, image.width, 4});
  std::uint8_t* to = out.mutable_data();
  for (std::size_t k = 0; k < static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height); ++k, to += 4) {
    const std::uint8_t* from = image.pixels.data() + k * static_cast<std::size_t>(image.channels);
    for (int c = 0; c < 3; ++c) to[c] = from[image.channels < 3 ? 0 : c];
    to[3] = image.channels == 4 ? from[3] : 255;
  }
  return out;
}

// Numbers of another type are refused: as bytes, a picture of 0..1 would be black.
render::Image to_image(const py::object& given) {
  if (!py::isinstance<py::array_t<std::uint8_t>>(given) || py::array(given).ndim() != 3 || py::array(given).size() == 0 ||
      (py::array(given).shape(2) != 3 && py::array(given).shape(2) != 4)) {
    const std::string found = py::isinstance<py::array>(given)
                                  ? fmt::format("{} of shape {}", py::str(given.attr("dtype")).cast<std::string>(),
                                                py::str(given.attr("shape")).cast<std::string>())
                                  : py::str(py::type::of(given).attr("__name__")).cast<std::string>();
    throw ArgumentError(fmt::format("a picture must be a uint8 array of shape (height, width, 3 or 4), found {}", found));
  }
  const py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast> a(py::reinterpret_borrow<py::object>(given));
  render::Image out{static_cast<int>(a.shape(1)), static_cast<int>(a.shape(0)), static_cast<int>(a.shape(2)), {}};
  out.pixels.assign(a.data(), a.data() + a.size());
  return out;
}

// Results made ready to be drawn: meshes, maps, ranges and camera are found once.
struct Drawing {
  std::shared_ptr<sim::Results> results;
  std::optional<sim::Scene> scene;
  film::Animation animation;
  film::PictureMemory memory;

  // settings: "render.KEY=VALUE".
  Drawing(std::shared_ptr<sim::Results> from, const std::vector<std::string>& settings) : results(std::move(from)) {
    Watcher watcher{py::none()};
    const interp::Watch watch([&] { watcher.look(); });
    const py::gil_scoped_release free;
    const std::string name = results->scene_file.empty() ? "results" : results->scene_file;
    film::RenderSettings render;
    const sim::SceneDocument document = sim::parse_document(results->scene_text, name, settings);
    render = film::read_render_settings(document);
    if (!results->scene_text.empty()) {
      try {
        scene = sim::make_scene(document);
      } catch (const InputError&) {
        // Its files may be gone: the pictures do without.
      }
    }
    film::check_render_settings(render, *results, name);
    animation = film::make_animation(*results, render, scene ? &*scene : nullptr);
  }

  int picture_at(double t) const {
    if (!std::isfinite(t)) throw ArgumentError(fmt::format("a picture's time must be a finite number of seconds, found {}", t));
    if (animation.count < 2 || !(animation.step > 0.0)) return 0;
    return std::clamp(static_cast<int>(std::lround((t - film::picture_time(animation, 0)) / animation.step)), 0, animation.count - 1);
  }

  py::array_t<std::uint8_t> draw(int picture) {
    if (picture < 0 || picture >= animation.count)
      throw ArgumentError(fmt::format("there is no picture {}: the sequence has {}, from 0", picture, animation.count));
    // One renderer for all: two in one process take turns anyway. It is never deleted: at the end of the process OSMesa's own end comes
    // before that of static objects here.
    static std::mutex turn;
    static render::Renderer* renderer = nullptr;
    render::Image image;
    {
      const py::gil_scoped_release free;
      const std::lock_guard lock(turn);
      if (!renderer) renderer = new render::Renderer;
      film::update_picture(animation, picture, memory);
      image = renderer->draw(memory.picture);
    }
    return to_array(image);
  }

  py::dict film(const std::filesystem::path& folder, std::pair<int, int> frames, int workers,
                const std::optional<std::filesystem::path>& video_file, const py::object& progress) {
    if (workers < 0) throw ArgumentError(fmt::format("workers must be a number of processes, or 0: one a core; found {}", workers));
    if (video_file && !film::is_video_name(*video_file))
      throw ArgumentError(fmt::format("video '{}': its name must end in {}", video_file->string(), sim::list_words(film::video_endings())));
    film::FilmOptions options;
    options.folder = folder;
    options.first = frames.first;
    options.end = frames.second;
    options.workers = workers;
    Watcher watcher(progress);
    options.progress = [&](int done, int all) { watcher.look(static_cast<double>(done) / all); };
    std::optional<film::VideoWriter> video;
    film::FilmReport report;
    film::VideoReport made;
    {
      const py::gil_scoped_release free;
      if (video_file) {
        video.emplace(*video_file, animation.settings.frame_rate);
        options.finished = [&](const std::filesystem::path& picture) { video->add(picture); };
      }
      report = film::film(animation, options);
      if (video) made = video->finish([&] { watcher.look(1.0); });
    }
    py::dict out;
    out["pictures"] = report.pictures;
    out["folder"] = folder;
    out["cpu_seconds"] = report.cpu_deform + report.cpu_draw + report.cpu_encode;
    if (made.made) out["video"] = *video_file;
    else if (!made.note.empty()) out["note"] = made.note;
    return out;
  }
};

py::dict compare(const render::Image& a, const render::Image& b, bool exact) {
  render::ImageDifference d;
  {
    const py::gil_scoped_release free;
    d = render::compare_images(a, b, {.exact = exact});
  }
  py::dict out;
  out["passes"] = d.passes;
  out["equal"] = d.equal;
  out["same_size"] = d.same_size;
  render::for_each_number(d, [&](const char* name, auto number) { out[name] = number; });
  return out;
}

void study(const Scene& scene, const std::filesystem::path& folder, const std::vector<std::string>& axes, int repeats,
           double reference_seconds, const py::object& progress) {
  film::StudyOptions options;
  options.axes = axes;
  options.repeats = repeats;
  options.reference_seconds = reference_seconds;
  options.folder = folder;
  options.version = FLEXFRAME_VERSION;
  options.command = fmt::format("flexframe.study({})", scene.scene.file.filename().string());
  Watcher watcher(progress);
  double at = 0.0;
  options.progress = [&](double fraction, const std::string&) {
    if (fraction >= 0.0) at = fraction;
    watcher.look(at);
  };
  const py::gil_scoped_release free;
  film::write_study(film::run_study(scene.scene, options), folder);
}

}  // namespace

void bind_pictures(py::module_& m) {
  py::class_<Drawing>(m, "Drawing", "Results ready to be drawn: meshes, kernel maps, colour range and camera are found once.")
      .def(py::init<std::shared_ptr<sim::Results>, const std::vector<std::string>&>())
      .def_property_readonly(
          "count", [](const Drawing& d) { return d.animation.count; }, "Pictures of the sequence.")
      .def(
          "time", [](const Drawing& d, int picture) { return film::picture_time(d.animation, picture); }, py::arg("picture"),
          "Its time, s.")
      .def("picture_at", &Drawing::picture_at, py::arg("t"), "The picture nearest to a time in s.")
      .def("draw", &Drawing::draw, py::arg("picture"),
           "(height, width, 4) uint8 array: sRGB with straight alpha. Raises DrawError, MapError.")
      .def("_film", &Drawing::film, py::arg("folder"), py::arg("frames"), py::arg("workers"), py::arg("video"), py::arg("progress"))
      .def_property_readonly(
          "notes", [](const Drawing& d) { return d.animation.notes; }, "What was chosen and why, one sentence each.")
      .def_property_readonly(
          "warnings", [](const Drawing& d) { return d.animation.warnings; }, "What the pictures may show wrongly, one sentence each.");
  m.def("_compare", [](const py::object& a, const py::object& b, bool exact) { return compare(to_image(a), to_image(b), exact); });
  m.def(
      "read_png", [](const std::filesystem::path& path) { return to_array(render::read_png(path)); }, py::arg("path"),
      "(height, width, 4) uint8 array of a PNG file. Raises FileError.");
  m.def(
      "png",
      [](const py::object& picture) {
        const std::vector<std::uint8_t> bytes = render::encode_png(to_image(picture));
        return py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size());
      },
      py::arg("picture"), "A picture, (height, width, 3 or 4) uint8, as the bytes of a PNG file. Raises ArgumentError for other arrays.");
  m.def("_study", &study, py::arg("scene"), py::arg("folder"), py::arg("axes"), py::arg("repeats"), py::arg("reference_seconds"),
        py::arg("progress"));
}

}  // namespace flexframe::python
