#include "render/cli/page.h"

#include "render/draw/renderer.h"
#include "render/film/page.h"
#include "render/image/png.h"
#include "sim/base/file_output.h"

#include <fmt/format.h>

namespace flexframe::cli {

nlohmann::ordered_json write_page(const sim::Results& results, const film::RenderSettings& settings, const sim::Scene* scene,
                                  const std::filesystem::path& out, Told& told) {
  film::Animation animation = film::make_animation(results, settings, scene);
  // For browsers without WebGL: a picture a third of the way through, where most runs show more than at their ends.
  film::PictureMemory memory;
  film::update_picture(animation, animation.count / 3, memory);
  const std::vector<std::uint8_t> png = render::encode_png(render::Renderer().draw(memory.picture), {.level = 9, .text = {}});
  film::PageReport report;
  const std::string page = film::make_page(animation, scene, png, report);
  sim::write_whole_file(out, page);
  add_notes(told, animation);
  told.notes.insert(told.notes.end(), report.notes.begin(), report.notes.end());
  return {{"page", out.string()},    {"pictures", report.pictures},
          {"bodies", report.bodies}, {"triangles", report.triangles},
          {"bytes", page.size()},    {"largest_displacement", animation.largest_displacement},
          {"error", report.error},   {"value_error", report.value_error},
          {"colors", report.colors}};
}

void print_page(const nlohmann::ordered_json& page) {
  fmt::print(
      "page         {}, {:.2f} MB: {} bodies, {} triangles, {} pictures; vertices within {:.2g} m of what is drawn, colours within {:.1g} "
      "%\n",
      page["page"].get<std::string>(), 1e-6 * page["bytes"].get<double>(), page["bodies"].get<int>(), page["triangles"].get<std::size_t>(),
      page["pictures"].get<int>(), page["error"].get<double>(), 100.0 * page["value_error"].get<double>());
}

}  // namespace flexframe::cli
