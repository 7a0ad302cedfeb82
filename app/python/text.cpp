#include "app/python/text.h"

namespace py = pybind11;

namespace merl::python {

py::str to_python(std::string_view text) {
    auto* const decoded =
        PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "surrogateescape");
    if (decoded == nullptr) {
        throw py::error_already_set();
    }
    return py::reinterpret_steal<py::str>(decoded);
}

py::list to_python(const std::vector<std::string>& texts) {
    py::list list;
    for (const auto& text : texts) {
        list.append(to_python(text));
    }
    return list;
}

std::string from_python(const py::handle& text) {
    if (!py::isinstance<py::str>(text)) {
        throw py::type_error("found " + std::string(py::repr(py::type::of(text))) +
                             "; expected a str");
    }
    const auto bytes = py::reinterpret_steal<py::bytes>(
        PyUnicode_AsEncodedString(text.ptr(), "utf-8", "surrogateescape"));
    if (!bytes) {
        throw py::error_already_set();
    }
    return std::string(bytes);
}

std::vector<std::string> from_python_list(const py::sequence& texts) {
    std::vector<std::string> result;
    for (const auto& text : texts) {
        result.push_back(from_python(text));
    }
    return result;
}

}  // namespace merl::python
