// What flexframe --version says.
#include "render/cli/version.h"

#include "render/draw/renderer.h"
#include "sim/base/error.h"

#include <fmt/format.h>

namespace flexframe::cli {

std::string version_text() {
  std::string drawing;
  try {
    const render::RendererInfo info = render::Renderer(render::Backend::osmesa).info();
    drawing = fmt::format("OSMesa, OpenGL {}, {}", info.version, info.renderer);
  } catch (const Error& error) {
    drawing = fmt::format("none: {}", error.what());
  }
  return fmt::format("{}\ncompiler   {}\nrenderer   {}\nlibraries  {}", FLEXFRAME_VERSION, FLEXFRAME_COMPILER, drawing,
                     FLEXFRAME_LIBRARIES);
}

}  // namespace flexframe::cli
