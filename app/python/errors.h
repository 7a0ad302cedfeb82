#pragma once

#include <pybind11/pybind11.h>

namespace merl::python {

/// Adds merl_scan.Error, one class below it for each Fault, and what turns the one into the other,
/// with the same text.
void bind_errors(pybind11::module_& module);

}  // namespace merl::python
