// The Python module's parts, and what they have in common: the GIL, interrupts, arrays that look at C++ memory.
#pragma once

#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <chrono>

namespace flexframe::python {

namespace py = pybind11;

void bind_scene(py::module_& m);  // Scene, Results, simulate, Simulation
void bind_results(py::module_& m);
void bind_simulation(py::module_& m);
void bind_body(py::module_& m);      // Body, reduce
void bind_map(py::module_& m);       // KernelMap
void bind_pictures(py::module_& m);  // Drawing, film, compare, study

// A read-only array that looks at memory which `owner` keeps alive.
inline py::array view(const double* data, std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides, const py::handle& owner) {
  py::array out(py::dtype::of<double>(), std::move(shape), std::move(strides), data, owner);
  py::detail::array_proxy(out.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return out;
}
// Of an Eigen matrix or vector that lives in `owner`.
template <class Matrix>
py::array view_matrix(const Matrix& m, const py::handle& owner) {
  const auto rows = static_cast<py::ssize_t>(m.rows()), columns = static_cast<py::ssize_t>(m.cols());
  constexpr py::ssize_t number = sizeof(double);
  if constexpr (Matrix::ColsAtCompileTime == 1) return view(m.data(), {rows}, {number}, owner);
  else if constexpr (Matrix::IsRowMajor) return view(m.data(), {rows, columns}, {number * columns, number}, owner);
  else return view(m.data(), {rows, columns}, {number, number * rows}, owner);
}

// For the progress functions of long calls that run without the GIL: now and then looks for Ctrl-C and tells the user's function.
class Watcher {
 public:
  explicit Watcher(py::object progress) : progress_(std::move(progress)) {}
  // Throws what Python raised: KeyboardInterrupt, or an exception of the user's function.
  template <class... Arguments>
  void look(Arguments... arguments) {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < std::chrono::milliseconds(20)) return;
    tell(arguments...);
  }
  // The same however short the last call is ago: at the end.
  template <class... Arguments>
  void tell(Arguments... arguments) {
    last_ = std::chrono::steady_clock::now();
    const py::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (!progress_.is_none()) progress_(arguments...);
  }

 private:
  py::object progress_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace flexframe::python
