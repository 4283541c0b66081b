// Private to the drawing: the OpenGL objects of one context: programs, buffers, targets, textures.
#pragma once

#include "render/context.h"
#include "render/gl.h"

#include <glm/glm.hpp>

#include <map>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace flexframe::render {

enum class ShaderKind { surface, line, marker };

// Color and depth to draw to. float_color: one 32 bit channel instead of sRGB bytes.
struct Target {
  GLuint framebuffer = 0, color = 0, depth = 0;
  int width = 0, height = 0;
  bool has_color = true, float_color = false;
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
  GLuint buffer(GLenum target, std::span<const T> data) { return buffer(target, data.data(), data.size_bytes()); }
  GLuint buffer(GLenum target, const void* data, std::size_t bytes);
  void forget_buffers();  // at the end of a picture

  // Target of a role, made again where its size has changed.
  Target& target(const std::string& role, int width, int height, bool has_color, bool float_color = false);

  // Texture of a role with linear filtering and clamped edges: sRGB bytes (RGB) or pairs of floats.
  GLuint texture_srgb(const std::string& role, int width, int height, const std::uint8_t* rgb);
  GLuint texture_rg32f(const std::string& role, int width, int height, const float* values);

  // Throws std::runtime_error if OpenGL reports an error since the last call.
  void check(const char* where);

private:
  GLuint texture(const std::string& role);
  std::unique_ptr<Context> context_;
  Gl gl_;
  GLuint vertex_array_ = 0;
  std::map<std::pair<ShaderKind, std::string>, std::unique_ptr<Program>> programs_;
  std::map<std::pair<const void*, std::size_t>, GLuint> uploaded_;
  std::vector<GLuint> free_buffers_;
  std::map<std::string, Target> targets_;
  std::map<std::string, GLuint> textures_;
};

}  // namespace flexframe::render
