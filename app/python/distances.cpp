#include <fcntl.h>
#include <fmt/format.h>
#include <pybind11/stl.h>
#include <unistd.h>

#include <cerrno>
#include <optional>
#include <system_error>
#include <utility>

#include "app/pipeline/pair_distances.h"
#include "app/python/call.h"
#include "app/python/handles.h"
#include "app/python/text.h"
#include "app/python/unlocked.h"
#include "engine/base/error.h"

namespace py = pybind11;

namespace merl::python {
namespace {

py::list pairs_of(const std::vector<std::pair<std::string, double>>& pairs) {
    py::list list;
    for (const auto& [name, value] : pairs) {
        list.append(py::make_tuple(to_python(name), value));
    }
    return list;
}

/// What a result has to say of where it is from.
py::dict provenance_of(const pipeline::Provenance& from) {
    using namespace py::literals;
    py::dict result("version"_a = from.version, "database"_a = py::none(), "table"_a = py::none());
    if (from.table) {
        result["table"] = py::dict("file"_a = to_python(from.table->file),
                                   "content_hash"_a = from.table->content_hash);
    }
    if (from.database) {
        const auto& d = *from.database;
        py::dict materials;
        for (const auto& m : d.materials) {
            materials[to_python(m.name)] =
                py::dict("content_hash"_a = m.content_hash, "negative"_a = m.negative,
                         "negative_above_horizon"_a = m.negative_above_horizon);
        }
        py::list parts;
        for (const auto& p : d.parts) {
            parts.append(py::dict("label"_a = to_python(p.label), "name"_a = to_python(p.name),
                                  "kind"_a = to_python(p.kind), "path"_a = to_python(p.path),
                                  "content_hash"_a = p.content_hash, "materials"_a = p.materials));
        }
        result["database"] =
            py::dict("name"_a = to_python(d.name), "kind"_a = to_python(d.kind),
                     "path"_a = to_python(d.path), "content_hash"_a = d.content_hash,
                     "grid"_a = py::make_tuple(d.grid.theta_h, d.grid.theta_d, d.grid.phi_d),
                     "phi_d_range"_a = engine::range_name(d.grid.phi_d_range),
                     "voxels"_a = d.voxels, "materials"_a = materials, "parts"_a = parts);
    }
    py::list metrics;
    for (const auto& m : from.metrics) {
        metrics.append(py::dict("name"_a = to_python(m.name), "title"_a = to_python(m.title),
                                "formula"_a = to_python(m.formula),
                                "source"_a = to_python(m.source),
                                "parameters"_a = py::dict(pairs_of(m.parameters))));
    }
    result["metrics"] = metrics;
    py::list engines;
    for (const auto& e : from.engines) {
        engines.append(py::dict("engine"_a = e.engine.engine, "name"_a = to_python(e.engine.name),
                                "driver"_a = to_python(e.engine.driver),
                                "metrics"_a = to_python(e.metrics)));
    }
    result["engines"] = engines;
    result["warnings"] = to_python(from.warnings);
    return result;
}

py::dict result_of(const pipeline::PairDistances& distances) {
    using namespace py::literals;
    return py::dict("names"_a = to_python(distances.table.names),
                    "columns"_a = columns_of(distances.table.metrics),
                    "provenance"_a = provenance_of(distances.provenance));
}

py::dict distances(const py::object& database, const py::sequence& metrics, const py::dict& call) {
    const auto source = source_of(database, metrics);
    if (!source.database) {
        throw py::type_error("found None; expected a database");
    }
    const auto options = call_options(call);
    pipeline::PairDistances result;
    run(options, [&](const pipeline::Control& control) {
        BorrowedEngines engines(options.device);
        result = pipeline::compute_pair_distances(*engines, *source.database, source.pointers(),
                                                  options.memory_bytes, control);
    });
    return result_of(result);
}

py::dict read_distances(const py::str& file, const py::sequence& columns, const py::dict& call) {
    const auto path = from_python(file);
    const auto wanted = from_python_list(columns);
    pipeline::PairDistances result;
    run(call_options(call), [&](const pipeline::Control& control) {
        result = pipeline::read_pair_distances(path, wanted, control);
    });
    return result_of(result);
}

void write_distances(const py::str& file, const py::sequence& names, const py::sequence& columns) {
    const auto table = table_of(names, columns);
    const auto path = from_python(file);
    const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (descriptor < 0) {
        throw Error(Fault::output,
                    fmt::format("{}: {}", path, std::generic_category().message(errno)));
    }
    const Unlocked unlocked;
    try {
        scan::write_distance_table(descriptor, table);
    } catch (const std::system_error& error) {
        ::close(descriptor);
        throw Error(Fault::output, fmt::format("{}: {}", path, error.code().message()));
    }
    if (::close(descriptor) != 0) {
        throw Error(Fault::output,
                    fmt::format("{}: {}", path, std::generic_category().message(errno)));
    }
}

}  // namespace

void bind_distances(py::module_& module) {
    module.def("distances", distances);
    module.def("read_distances", read_distances);
    module.def("write_distances", write_distances);
}

}  // namespace merl::python
