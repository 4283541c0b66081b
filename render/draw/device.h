// Private to the drawing: the OpenGL objects of one context: programs, buffers, targets, textures.
#pragma once

#include "render/draw/context.h"
#include "render/draw/gl.h"
#include "render/frame/view.h"

#include <glm/glm.hpp>

#include <map>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace flexframe::render {

enum class ShaderKind { surface, cover, line, marker };

// What a target's colours are: nothing, four bytes, four times 16 bits, one 32 bit number.
enum class ColorFormat { none, bytes, words, red_float };

// Color and depth to draw to.
struct Target {
  GLuint framebuffer = 0, color = 0, depth = 0;  // textures
  int width = 0, height = 0;
  // What is kept of samples to be lit later, two words each, over the same depth; 0 until asked for.
  GLuint store_framebuffer = 0, store = 0;
};

class Program {
 public:
  Program(const Gl& gl, GLuint id) : gl_(gl), id_(id) {}
  void use() const { gl_.UseProgram(id_); }
  GLuint id() const { return id_; }
  // Unknown names are ignored: variants do not have all of them.
  void set(const char* name, int v) { gl_.Uniform1i(location(name), v); }
  void set(const char* name, float v) { gl_.Uniform1f(location(name), v); }
  void set(const char* name, const glm::vec2& v) { gl_.Uniform2f(location(name), v.x, v.y); }
  void set(const char* name, const glm::vec3& v) { gl_.Uniform3fv(location(name), 1, &v[0]); }
  void set(const char* name, const glm::vec4& v) { gl_.Uniform4fv(location(name), 1, &v[0]); }
  void set(const char* name, std::uint32_t v) { gl_.Uniform1uiv(location(name), 1, &v); }
  void set(const char* name, std::span<const std::uint32_t> v) {
    gl_.Uniform1uiv(location(name), static_cast<GLsizei>(v.size()), v.data());
  }
  void set(const char* name, const glm::mat3& v) { gl_.UniformMatrix3fv(location(name), 1, GL_FALSE, &v[0][0]); }
  void set(const char* name, const glm::mat4& v) { gl_.UniformMatrix4fv(location(name), 1, GL_FALSE, &v[0][0]); }

 private:
  GLint location(const char* name);
  const Gl& gl_;
  GLuint id_;
  std::unordered_map<std::string, GLint> locations_;
};

class Device {
 public:
  explicit Device(std::unique_ptr<Context> context);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  const Gl& gl() const { return gl_; }
  void make_current() { context_->make_current(); }

  // Program of a kind with these switches defined, compiled when first asked for.
  Program& program(ShaderKind kind, const std::vector<const char*>& switches);

  // Buffer with these bytes; the same span asked for again in one picture is uploaded once.
  template <class T>
  GLuint buffer(GLenum target, std::span<const T> data) {
    return buffer(target, data.data(), data.size_bytes());
  }
  GLuint buffer(GLenum target, const void* data, std::size_t bytes);
  // Buffer with these bytes for one draw.
  void stream(GLenum target, const void* data, std::size_t bytes);
  void forget_buffers();  // at the end of a picture

  // Target of a role with at least this size (the next multiples of 64), made again where that has changed.
  Target& target(const std::string& role, int width, int height, ColorFormat color);

  // Gives the target of a role its store; contents are undefined.
  void add_store(Target& target);

  // A part of samples on the processor (rows of `row` of them) into the same part of a target, and of the bound target back. Null: not
  // these.
  void upload(const Target& target, const PixelRect& part, int row, const std::uint8_t* colors, const float* depth);
  void download(const PixelRect& part, int row, std::uint8_t* colors, float* depth);

  // Texture of pairs of floats, of a role, with linear filtering and clamped edges.
  GLuint texture_rg32f(const std::string& role, int width, int height, const float* values);

  // Throws DrawError if OpenGL reports an error since the last call.
  void check(const char* where);

 private:
  GLuint texture(const std::string& role);
  void remove(Target& target);
  std::unique_ptr<Context> context_;
  Gl gl_;
  GLuint vertex_array_ = 0;
  std::map<std::pair<ShaderKind, std::string>, std::unique_ptr<Program>> programs_;
  std::map<std::pair<const void*, std::size_t>, GLuint> uploaded_;
  std::vector<GLuint> free_buffers_;
  GLuint stream_ = 0;
  std::map<std::string, Target> targets_;
  std::map<std::string, GLuint> textures_;
};

}  // namespace flexframe::render
