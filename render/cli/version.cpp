// What flexframe --version says.
#include "render/cli/version.h"

#include "render/draw/renderer.h"
#include "sim/base/error.h"

#include "sim/sweep/search.h"

#include <fmt/format.h>

#include <fstream>

#include <sys/utsname.h>

namespace flexframe::cli {

std::string renderer_text() {
  try {
    const render::RendererInfo info = render::Renderer(render::Backend::osmesa).info();
    return fmt::format("OSMesa, OpenGL {}, {}", info.version, info.renderer);
  } catch (const Error& error) {
    return fmt::format("none: {}", error.what());
  }
}

std::string machine_text() {
  utsname name{};
  ::uname(&name);
  std::ifstream info("/proc/cpuinfo");
  std::string processor;
  for (std::string line; processor.empty() && std::getline(info, line);)
    if (const std::size_t at = line.find(": "); line.starts_with("model name") && at != std::string::npos)
      processor = line.substr(at + 2) + ", ";
  return fmt::format("{}{}, {} {}", processor, name.machine, name.sysname, name.release);
}

std::string version_text() {
  const std::string minimiser = sim::minimiser_version();
  return fmt::format("{}\ncompiler   {}\nrenderer   {}\nlibraries  {}{}", FLEXFRAME_VERSION, FLEXFRAME_COMPILER, renderer_text(),
                     FLEXFRAME_LIBRARIES, minimiser.empty() ? "" : ", " + minimiser);
}

}  // namespace flexframe::cli
