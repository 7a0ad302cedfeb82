#pragma once

#include <pybind11/pybind11.h>

#include <string>
#include <string_view>
#include <vector>

namespace merl::python {

// Names of files and materials may be any bytes. Python has those that are no UTF-8 as its own
// functions for files have them ("surrogateescape"), so that they come back as they were.

pybind11::str to_python(std::string_view text);
pybind11::list to_python(const std::vector<std::string>& texts);

/// Throws TypeError (of Python) for what is no str.
std::string from_python(const pybind11::handle& text);
std::vector<std::string> from_python_list(const pybind11::sequence& texts);

}  // namespace merl::python
