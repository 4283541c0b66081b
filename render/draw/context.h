// The seam to whoever provides OpenGL 4.5 core without a display: create (the functions below), get_proc, destroy.
// Both libraries are opened when the first context is made or by open_osmesa, not when the program starts.
#pragma once

#include <memory>
#include <string>

namespace flexframe::render {

class Context {
 public:
  virtual ~Context() = default;
  virtual void make_current() = 0;
  virtual void* get_proc(const char* name) = 0;
};

// Throw DrawError naming the library, what it answered and what could help.
std::unique_ptr<Context> create_osmesa_context();
std::unique_ptr<Context> create_egl_context();

// Opens OSMesa's library and no more: its relocations take 0.05 s that may pass in a thread beside other work, and before a fork.
// Whether it is there shows when the context is made.
void open_osmesa() noexcept;

}  // namespace flexframe::render
