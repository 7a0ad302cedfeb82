#include "app/python/errors.h"

#include <array>
#include <string>

#include "app/python/text.h"
#include "engine/base/error.h"

namespace py = pybind11;

namespace merl::python {
namespace {

/// In the order of Fault. They live as long as the process.
std::array<PyObject*, 5> classes = {};

PyObject* make_class(py::module_& module, const char* name, const char* doc, PyObject* base,
                     PyObject* other) {
    const auto bases = other == nullptr ? py::make_tuple(py::handle(base))
                                        : py::make_tuple(py::handle(base), py::handle(other));
    auto* const made = PyErr_NewExceptionWithDoc((std::string("merl_scan.") + name).c_str(), doc,
                                                 bases.ptr(), nullptr);
    if (made == nullptr) {
        throw py::error_already_set();
    }
    module.attr(name) = py::handle(made);
    return made;
}

}  // namespace

void bind_errors(py::module_& module) {
    auto* const base =
        make_class(module, "Error", "What input, files, devices and memory can do wrong.",
                   PyExc_Exception, nullptr);
    classes = {
        make_class(module, "UsageError", "An argument that cannot be: a name, a range, a bound.",
                   base, PyExc_ValueError),
        make_class(module, "InputError", "A file or samples that cannot be used.", base,
                   PyExc_ValueError),
        make_class(module, "DeviceError", "No Vulkan device will do, or it failed.", base,
                   PyExc_RuntimeError),
        make_class(module, "OutputError", "A file that cannot be written.", base,
                   PyExc_RuntimeError),
        make_class(module, "ResourceError", "Something that a process has only so much of.", base,
                   PyExc_RuntimeError),
    };
    py::register_local_exception_translator([](std::exception_ptr pointer) {
        try {
            if (pointer) {
                std::rethrow_exception(pointer);
            }
        } catch (const Error& error) {
            PyErr_SetObject(classes.at(static_cast<std::size_t>(error.fault())),
                            to_python(error.what()).ptr());
        }
    });
}

}  // namespace merl::python
