// The module flexframe._core: the parts, and the errors as Python's.
#include "render/python/bindings.h"
#include "render/python/sweep.h"

#include "render/draw/renderer.h"
#include "sim/base/error.h"

#include <cstdlib>

namespace flexframe::python {
namespace {

// One class a kind, all of them flexframe.Error; bad input is a ValueError too, what cannot be read or written an OSError.
void bind_errors(py::module_& m) {
  static py::exception<Error> error(m, "Error");
  const auto kind = [&](const char* name, py::tuple bases, const char* text) {
    const std::string full = std::string("flexframe.") + name;
    PyObject* type = PyErr_NewExceptionWithDoc(full.c_str(), text, bases.ptr(), nullptr);
    m.attr(name) = py::reinterpret_steal<py::object>(type);
    return type;
  };
  error.attr("__doc__") = "Base of all errors of this module; the message is a sentence: what was found, where, what is allowed.";
  error.attr("__module__") = "flexframe";
  static PyObject* input =
      kind("InputError", py::make_tuple(error, py::handle(PyExc_ValueError)), "A file, scene, body or array cannot be used.");
  static PyObject* mesh = kind("MeshError", py::make_tuple(py::handle(input)), "A mesh cannot be used.");
  static PyObject* argument = kind("ArgumentError", py::make_tuple(error, py::handle(PyExc_ValueError)), "A call that makes no sense.");
  static PyObject* simulation = kind("SimulationError", py::make_tuple(error), "A computation could not be done.");
  static PyObject* map = kind("MapError", py::make_tuple(error), "Sound input that no kernel map can serve.");
  static PyObject* draw = kind("DrawError", py::make_tuple(error), "Drawing is not possible.");
  static PyObject* file = kind("FileError", py::make_tuple(error, py::handle(PyExc_OSError)), "A file that cannot be read or written.");
  // NOLINTNEXTLINE(performance-unnecessary-value-param): the type that pybind11 wants
  py::register_exception_translator([](std::exception_ptr p) {
    try {
      if (p) std::rethrow_exception(p);
    } catch (const MeshError& e) {
      PyErr_SetString(mesh, e.what());
    } catch (const InputError& e) {
      PyErr_SetString(input, e.what());
    } catch (const ArgumentError& e) {
      PyErr_SetString(argument, e.what());
    } catch (const SimulationError& e) {
      PyErr_SetString(simulation, e.what());
    } catch (const MapError& e) {
      PyErr_SetString(map, e.what());
    } catch (const DrawError& e) {
      PyErr_SetString(draw, e.what());
    } catch (const FileError& e) {
      PyErr_SetString(file, e.what());
    } catch (const Error& e) {
      PyErr_SetString(error.ptr(), e.what());
    }
  });
}

}  // namespace

PYBIND11_MODULE(_core, m) {
  // Pictures are drawn in the calling thread, or by processes of their own that are forked from here.
  ::setenv("LP_NUM_THREADS", "0", 0);
  m.attr("__version__") = FLEXFRAME_VERSION;
  bind_errors(m);
  bind_results(m);
  bind_scene(m);
  bind_simulation(m);
  bind_body(m);
  bind_map(m);
  bind_pictures(m);
  bind_sweep(m);
}

}  // namespace flexframe::python
