// The module's part for sweeps.
#pragma once

#include <pybind11/pybind11.h>

namespace flexframe::python {

void bind_sweep(pybind11::module_& m);

}  // namespace flexframe::python
