#include <pybind11/pybind11.h>

#include "app/pipeline/version.h"
#include "app/python/errors.h"
#include "app/python/handles.h"
#include "app/python/unlocked.h"

#if defined(__SANITIZE_ADDRESS__)
#define MERL_SCAN_LIMITS_MEMORY false
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define MERL_SCAN_LIMITS_MEMORY false
#endif
#endif
#ifndef MERL_SCAN_LIMITS_MEMORY
#define MERL_SCAN_LIMITS_MEMORY true
#endif

// What merl_scan/ (the part of the package that is Python) is made of; _core.pyi says what these
// functions take. Importing it does nothing to the process but to say what is called when it ends.
PYBIND11_MODULE(_core, module) {
    module.attr("__version__") = merl::pipeline::kVersion;
    // AddressSanitizer takes more address space than any limit.
    module.attr("limits_memory") = MERL_SCAN_LIMITS_MEMORY;
    merl::python::bind_errors(module);
    merl::python::bind_databases(module);
    merl::python::bind_metrics(module);
    merl::python::bind_distances(module);
    merl::python::bind_scan(module);
    merl::python::bind_score(module);
    merl::python::bind_spheres(module);
    pybind11::module_::import("atexit").attr("register")(
        pybind11::cpp_function(merl::python::end_calls));
}
