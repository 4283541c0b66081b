#include "render/draw/context.h"

#include "sim/base/error.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>

#include <array>

namespace flexframe::render {
namespace {

// Tokens of GL/osmesa.h, which would pull in a second OpenGL header.
constexpr int osmesa_format = 0x22, osmesa_depth_bits = 0x30, osmesa_profile = 0x33, osmesa_core_profile = 0x34, osmesa_major = 0x36,
              osmesa_minor = 0x37, osmesa_rgba = 0x1908;
constexpr unsigned gl_unsigned_byte = 0x1401;

// Opened once a process and never closed: drivers keep threads and exit handlers in the library.
void* open_library(std::initializer_list<const char*> names, const char* package) {
  std::string tried;
  for (const char* name : names) {
    if (void* library = ::dlopen(name, RTLD_NOW | RTLD_LOCAL)) return library;
    tried += (tried.empty() ? "" : ", ") + std::string(name);
  }
  throw DrawError("no library for drawing: tried " + tried + "; the Debian package is " + package);
}

template <class Function>
Function symbol(void* library, const char* name) {
  const auto found = reinterpret_cast<Function>(::dlsym(library, name));
  if (!found) throw DrawError(std::string("the drawing library has no ") + name);
  return found;
}

void* osmesa_library() {
  static void* library = open_library({"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"}, "libosmesa6");
  return library;
}

class OsMesa final : public Context {
 public:
  OsMesa() {
    void* library = osmesa_library();
    make_ = symbol<decltype(make_)>(library, "OSMesaMakeCurrent");
    proc_ = symbol<decltype(proc_)>(library, "OSMesaGetProcAddress");
    destroy_ = symbol<decltype(destroy_)>(library, "OSMesaDestroyContext");
    const auto create = symbol<void* (*)(const int*, void*)>(library, "OSMesaCreateContextAttribs");
    // No depth, no more than a pixel: pictures are drawn to framebuffer objects only.
    const std::array<int, 12> attributes = {
        osmesa_format, osmesa_rgba, osmesa_depth_bits, 0, osmesa_profile, osmesa_core_profile, osmesa_major, 4, osmesa_minor, 5, 0, 0};
    context_ = create(attributes.data(), nullptr);
    if (!context_) throw DrawError("OSMesa has no OpenGL 4.5 core profile");
    make_current();
  }
  ~OsMesa() override { destroy_(context_); }
  void make_current() override {
    if (!make_(context_, pixel_.data(), gl_unsigned_byte, 1, 1)) throw DrawError("OSMesa: the context cannot be made current");
  }
  void* get_proc(const char* name) override { return reinterpret_cast<void*>(proc_(name)); }

 private:
  unsigned char (*make_)(void*, void*, unsigned, int, int) = nullptr;
  void (*(*proc_)(const char*))() = nullptr;
  void (*destroy_)(void*) = nullptr;
  void* context_ = nullptr;
  std::array<unsigned char, 4> pixel_{};
};

class Egl final : public Context {
 public:
  Egl() {
    static void* library = open_library({"libEGL.so.1", "libEGL.so"}, "libegl1");
    proc_ = symbol<decltype(proc_)>(library, "eglGetProcAddress");
    make_ = symbol<decltype(make_)>(library, "eglMakeCurrent");
    destroy_ = symbol<decltype(destroy_)>(library, "eglDestroyContext");
    const auto initialize = symbol<EGLBoolean (*)(EGLDisplay, EGLint*, EGLint*)>(library, "eglInitialize");
    const auto bind = symbol<EGLBoolean (*)(EGLenum)>(library, "eglBindAPI");
    const auto create = symbol<EGLContext (*)(EGLDisplay, EGLConfig, EGLContext, const EGLint*)>(library, "eglCreateContext");
    const auto platform_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(proc_("eglGetPlatformDisplayEXT"));
    const auto query_devices = reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(proc_("eglQueryDevicesEXT"));
    if (!platform_display) throw DrawError("EGL has no platform displays (EGL_EXT_platform_base)");

    // A context without any surface: on the surfaceless platform, else on a device (GPU drivers without that platform).
    const auto usable = [&](EGLDisplay display) {
      EGLint major = 0, minor = 0;
      if (display == EGL_NO_DISPLAY || !initialize(display, &major, &minor) || !bind(EGL_OPENGL_API)) return false;
      const std::array<EGLint, 7> attributes = {
          EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 5, EGL_CONTEXT_OPENGL_PROFILE_MASK,
          EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
      context_ = create(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes.data());
      if (context_ == EGL_NO_CONTEXT) return false;
      display_ = display;
      return true;
    };
    bool found = usable(platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
    if (!found && query_devices) {
      std::array<EGLDeviceEXT, 16> devices{};
      EGLint count = 0;
      if (query_devices(static_cast<EGLint>(devices.size()), devices.data(), &count))
        for (EGLint i = 0; i < count && !found; ++i) found = usable(platform_display(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr));
    }
    if (!found) throw DrawError("EGL gives no OpenGL 4.5 core profile without a surface (tried the surfaceless platform and every device)");
    make_current();
  }
  // The display stays initialised: other contexts of the process may use it.
  ~Egl() override {
    make_(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    destroy_(display_, context_);
  }
  void make_current() override {
    // Released first: EGL does not notice that OSMesa has bound its own context, and would take ours for current.
    make_(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (!make_(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) throw DrawError("EGL: the context cannot be made current");
  }
  void* get_proc(const char* name) override { return reinterpret_cast<void*>(proc_(name)); }

 private:
  __eglMustCastToProperFunctionPointerType (*proc_)(const char*) = nullptr;
  EGLBoolean (*make_)(EGLDisplay, EGLSurface, EGLSurface, EGLContext) = nullptr;
  EGLBoolean (*destroy_)(EGLDisplay, EGLContext) = nullptr;
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

}  // namespace

void open_osmesa() noexcept {
  try {
    osmesa_library();
  } catch (const std::exception&) {
    // Tried again, and said, by whoever needs a context.
  }
}

std::unique_ptr<Context> create_osmesa_context() { return std::make_unique<OsMesa>(); }
std::unique_ptr<Context> create_egl_context() { return std::make_unique<Egl>(); }

}  // namespace flexframe::render
