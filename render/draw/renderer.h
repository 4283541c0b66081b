// Draws pictures without a display: OpenGL 4.5 core on OSMesa (software, the default) or EGL without a surface.
//
// Pixels are the same bits for the same picture on the same machine, whatever the number of threads, processes or the
// order of pictures. One Renderer a thread; two in one process rasterise one after the other, processes scale:
// fork before the first Renderer exists; a child that draws with its parent's, or makes one, gets a DrawError. Set LP_NUM_THREADS
// before the first Renderer (0: rasterise in the calling thread).
#pragma once

#include "render/image/image.h"
#include "render/picture/picture.h"

#include <memory>
#include <string>
#include <vector>

namespace flexframe::render {

// Goes up whenever the same picture gives other pixels than before: files drawn by an older program are no longer current.
constexpr int drawing_version = 7;

enum class Backend { osmesa, egl };

// Who draws solid surfaces: this program itself where OpenGL is llvmpipe, which is slower at it (lines, markers, shells, surfaces with
// lines, isolines or a cut are OpenGL's there too); or OpenGL all of it, as on a graphics card. The pictures agree within compare's limits.
enum class Solids { fastest, opengl };

// Throws ArgumentError for another name than osmesa, egl.
Backend backend_from_name(const std::string& name);

struct RendererInfo {
  std::string backend;   // "osmesa", "egl"
  std::string renderer;  // GL_RENDERER, e.g. "llvmpipe (LLVM 15.0.6, 256 bits)"
  std::string version;   // GL_VERSION
  std::string cpu;       // features that decide the last bits of the pixels: "avx2 avx sse4.1 ..."
};

// CPU seconds of the last picture, this process, all threads.
struct DrawTimes {
  double draw = 0.0;     // geometry, shadow, occlusion
  double filter = 0.0;   // read-back, antialiasing
  double overlay = 0.0;  // text, bars, plots
};

// A picture as SVG, PDF or both: surfaces and lines of the scene as pixels, words, bars and diagrams over them as elements that stay sharp.
struct VectorFile {
  bool svg = true, pdf = false;    // which are wanted
  double dpi = 0.0;                // pixels an inch, for a size in mm; 0: a size in pixels, of which the PDF has 96 an inch
  std::string note;                // comment at the head of each; one line without two hyphens in a row
  std::string svg_file, pdf_file;  // the files' bytes, when they are drawn
};

class Renderer {
 public:
  // Throws DrawError if the back end or OpenGL 4.5 core is not to be had, naming what was tried.
  explicit Renderer(Backend backend = Backend::osmesa, Solids solids = Solids::fastest);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  // Throws ArgumentError if the picture is inconsistent (index out of range, spans of unequal length, bad size).
  // vector: if given, gets the same picture as a vector file.
  Image draw(const Picture& picture, VectorFile* vector = nullptr);

  // The scene without its words for further work: 4 channels of 16 bits, straight alpha, 65535 is white; colours in linear light, finer
  // than the bytes of `draw`. Where nothing is drawn it is clear; shadows on the ground are black in part.
  Image16 draw_linear(const Picture& picture);

  // Distance from the camera's plane (perspective and orthographic alike), linear from near (0) to far (65534); nothing
  // drawn: 65535. One sample a pixel, opaque surfaces only. near and far in m are returned if asked.
  Image16 draw_depth(const Picture& picture, double* near_plane = nullptr, double* far_plane = nullptr);

  // Scalars of the nearest opaque surface, linear from scalar_map.lower (0) to upper (65534); nothing: 65535.
  Image16 draw_scalar(const Picture& picture);

  // What draws: names and versions.
  const RendererInfo& info() const;
  // CPU seconds by stage of the picture drawn last.
  const DrawTimes& times() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Memory settings of the process that speed large pictures up (mallopt); once, at the start of main.
void tune_process();

}  // namespace flexframe::render
