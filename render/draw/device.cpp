#include "render/draw/device.h"

#include "render/draw/shaders.h"
#include "sim/base/error.h"

namespace flexframe::render {

GLint Program::location(const char* name) {
  const auto found = locations_.find(name);
  if (found != locations_.end()) return found->second;
  return locations_[name] = gl_.GetUniformLocation(id_, name);
}

Device::Device(std::unique_ptr<Context> context) : context_(std::move(context)) {
#define FLEXFRAME_GL_LOAD(type, name)                                \
  gl_.name = reinterpret_cast<type>(context_->get_proc("gl" #name)); \
  if (!gl_.name) throw DrawError("OpenGL lacks gl" #name);
  FLEXFRAME_GL_FUNCTIONS(FLEXFRAME_GL_LOAD)
#undef FLEXFRAME_GL_LOAD
  gl_.GenVertexArrays(1, &vertex_array_);
  gl_.BindVertexArray(vertex_array_);
  gl_.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
}

Device::~Device() {
  for (auto& [role, t] : targets_) remove(t);
  for (auto& [role, t] : textures_) gl_.DeleteTextures(1, &t);
  for (auto& [key, b] : uploaded_) gl_.DeleteBuffers(1, &b);
  if (stream_) gl_.DeleteBuffers(1, &stream_);
  for (GLuint b : free_buffers_) gl_.DeleteBuffers(1, &b);
  for (auto& [key, p] : programs_) gl_.DeleteProgram(p->id());
  gl_.DeleteVertexArrays(1, &vertex_array_);
}

Program& Device::program(ShaderKind kind, const std::vector<const char*>& switches) {
  std::string head = "#version 450 core\n#define COLOR_STEPS " + std::to_string(color_steps) + "\n";
  for (const char* s : switches) head += std::string("#define ") + s + "\n";
  auto& slot = programs_[{kind, head}];
  if (slot) return *slot;

  const auto compile = [&](GLenum stage, const char* body) {
    const GLuint shader = gl_.CreateShader(stage);
    const char* parts[] = {head.c_str(), body};
    gl_.ShaderSource(shader, 2, parts, nullptr);
    gl_.CompileShader(shader);
    GLint good = 0;
    gl_.GetShaderiv(shader, GL_COMPILE_STATUS, &good);
    if (!good) {
      std::string log(4096, '\0');
      GLsizei length = 0;
      gl_.GetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), &length, log.data());
      throw DrawError("shader: " + log.substr(0, static_cast<std::size_t>(length)));
    }
    return shader;
  };
  static const std::map<ShaderKind, std::pair<const char*, const char*>> sources = {
      {ShaderKind::surface, {surface_vertex, surface_fragment}},
      {ShaderKind::cover, {cover_vertex, surface_fragment}},
      {ShaderKind::line, {line_vertex, line_fragment}},
      {ShaderKind::marker, {marker_vertex, marker_fragment}}};
  const auto& source = sources.at(kind);
  const GLuint vertex = compile(GL_VERTEX_SHADER, source.first), fragment = compile(GL_FRAGMENT_SHADER, source.second);
  const GLuint id = gl_.CreateProgram();
  gl_.AttachShader(id, vertex);
  gl_.AttachShader(id, fragment);
  gl_.LinkProgram(id);
  GLint good = 0;
  gl_.GetProgramiv(id, GL_LINK_STATUS, &good);
  if (!good) {
    std::string log(4096, '\0');
    GLsizei length = 0;
    gl_.GetProgramInfoLog(id, static_cast<GLsizei>(log.size()), &length, log.data());
    throw DrawError("shader link: " + log.substr(0, static_cast<std::size_t>(length)));
  }
  gl_.DeleteShader(vertex);
  gl_.DeleteShader(fragment);
  slot = std::make_unique<Program>(gl_, id);
  return *slot;
}

GLuint Device::buffer(GLenum target, const void* data, std::size_t bytes) {
  auto& slot = uploaded_[{data, bytes}];
  if (slot) {
    gl_.BindBuffer(target, slot);
    return slot;
  }
  if (free_buffers_.empty()) {
    gl_.GenBuffers(1, &slot);
  } else {
    slot = free_buffers_.back();
    free_buffers_.pop_back();
  }
  gl_.BindBuffer(target, slot);
  gl_.BufferData(target, static_cast<GLsizeiptr>(bytes), data, GL_STREAM_DRAW);
  return slot;
}

void Device::stream(GLenum target, const void* data, std::size_t bytes) {
  if (!stream_) gl_.GenBuffers(1, &stream_);
  gl_.BindBuffer(target, stream_);
  gl_.BufferData(target, static_cast<GLsizeiptr>(bytes), data, GL_STREAM_DRAW);
}

void Device::forget_buffers() {
  for (auto& [key, b] : uploaded_) free_buffers_.push_back(b);
  uploaded_.clear();
  // Memory stays flat: what many surfaces of one picture needed is not kept for ever.
  while (free_buffers_.size() > 64) {
    gl_.DeleteBuffers(1, &free_buffers_.back());
    free_buffers_.pop_back();
  }
}

namespace {

// For texelFetch only.
GLuint fetched_texture(const Gl& gl, GLint format, GLenum components, GLenum type, int width, int height) {
  GLuint t = 0;
  gl.GenTextures(1, &t);
  gl.BindTexture(GL_TEXTURE_2D, t);
  gl.TexImage2D(GL_TEXTURE_2D, 0, format, width, height, 0, components, type, nullptr);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  return t;
}

}  // namespace

void Device::remove(Target& t) {
  for (GLuint f : {t.framebuffer, t.store_framebuffer})
    if (f) gl_.DeleteFramebuffers(1, &f);
  for (GLuint texture : {t.color, t.depth, t.store})
    if (texture) gl_.DeleteTextures(1, &texture);
}

void Device::add_store(Target& t) {
  if (t.store) return;
  t.store = fetched_texture(gl_, GL_RG32UI, GL_RG_INTEGER, GL_UNSIGNED_INT, t.width, t.height);
  gl_.GenFramebuffers(1, &t.store_framebuffer);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, t.store_framebuffer);
  gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, t.store, 0);
  gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, t.depth, 0);
  if (gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw DrawError("OpenGL cannot keep " + std::to_string(t.width) + " x " + std::to_string(t.height) + " samples to be lit later");
}

Target& Device::target(const std::string& role, int width, int height, ColorFormat color) {
  Target& t = targets_[role];
  // Things that move ask for a little more or less each time. Clearing costs by the size.
  width = (width + 63) / 64 * 64;
  height = (height + 63) / 64 * 64;
  if (t.framebuffer && t.width == width && t.height == height) {
    gl_.BindFramebuffer(GL_FRAMEBUFFER, t.framebuffer);
    return t;
  }
  if (t.framebuffer) remove(t);
  t = {0, 0, 0, width, height};
  gl_.GenFramebuffers(1, &t.framebuffer);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, t.framebuffer);
  if (color != ColorFormat::none) {
    t.color = color == ColorFormat::bytes   ? fetched_texture(gl_, GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, width, height)
              : color == ColorFormat::words ? fetched_texture(gl_, GL_RGBA16, GL_RGBA, GL_UNSIGNED_SHORT, width, height)
                                            : fetched_texture(gl_, GL_R32F, GL_RED, GL_FLOAT, width, height);
    gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, t.color, 0);
  } else {
    gl_.DrawBuffer(GL_NONE);
    gl_.ReadBuffer(GL_NONE);
  }
  t.depth = fetched_texture(gl_, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT, width, height);
  gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, t.depth, 0);
  if (gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw DrawError("OpenGL cannot draw to " + std::to_string(width) + " x " + std::to_string(height) + " samples");
  return t;
}

void Device::upload(const Target& t, const PixelRect& part, int row, const std::uint8_t* colors, const float* depth) {
  gl_.PixelStorei(GL_UNPACK_ROW_LENGTH, row);
  const std::size_t first = std::size_t(part.y) * row + part.x;
  gl_.BindTexture(GL_TEXTURE_2D, t.depth);
  gl_.TexSubImage2D(GL_TEXTURE_2D, 0, part.x, part.y, part.width, part.height, GL_DEPTH_COMPONENT, GL_FLOAT, depth + first);
  if (colors) {
    gl_.BindTexture(GL_TEXTURE_2D, t.color);
    gl_.TexSubImage2D(GL_TEXTURE_2D, 0, part.x, part.y, part.width, part.height, GL_RGBA, GL_UNSIGNED_BYTE, colors + 4 * first);
  }
  gl_.PixelStorei(GL_UNPACK_ROW_LENGTH, 0);
}

void Device::download(const PixelRect& part, int row, std::uint8_t* colors, float* depth) {
  gl_.PixelStorei(GL_PACK_ROW_LENGTH, row);
  const std::size_t first = std::size_t(part.y) * row + part.x;
  if (colors) gl_.ReadPixels(part.x, part.y, part.width, part.height, GL_RGBA, GL_UNSIGNED_BYTE, colors + 4 * first);
  if (depth) gl_.ReadPixels(part.x, part.y, part.width, part.height, GL_DEPTH_COMPONENT, GL_FLOAT, depth + first);
  gl_.PixelStorei(GL_PACK_ROW_LENGTH, 0);
}

GLuint Device::texture(const std::string& role) {
  GLuint& t = textures_[role];
  const bool fresh = t == 0;
  if (fresh) gl_.GenTextures(1, &t);
  gl_.BindTexture(GL_TEXTURE_2D, t);
  if (fresh) {
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  }
  return t;
}

GLuint Device::texture_rg32f(const std::string& role, int width, int height, const float* values) {
  const GLuint t = texture(role);
  gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_RG32F, width, height, 0, GL_RG, GL_FLOAT, values);
  return t;
}

void Device::check(const char* where) {
  const GLenum error = gl_.GetError();
  if (error == GL_NO_ERROR) return;
  if (error == GL_OUT_OF_MEMORY) throw DrawError(std::string("OpenGL is out of memory while drawing ") + where);
  throw DrawError(std::string("OpenGL error ") + std::to_string(error) + " while drawing " + where);
}

}  // namespace flexframe::render
