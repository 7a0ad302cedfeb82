#include <fmt/format.h>
#include <pybind11/stl.h>

#include <limits>
#include <memory>
#include <numbers>
#include <utility>

#include "app/python/array_database.h"
#include "app/python/call.h"
#include "app/python/handles.h"
#include "app/python/text.h"
#include "app/python/unlocked.h"
#include "engine/base/error.h"
#include "engine/database/content_hash.h"
#include "engine/database/joined_database.h"
#include "engine/database/open_databases.h"
#include "engine/database/subset_database.h"

namespace py = pybind11;

namespace merl::python {
namespace {

engine::PhiDRange range_of(const std::string& name) {
    for (const auto range : {engine::PhiDRange::pi, engine::PhiDRange::two_pi}) {
        if (name == engine::range_name(range)) {
            return range;
        }
    }
    throw Error(Fault::usage, fmt::format("phi_d_range: found \"{}\"; expected pi or 2pi", name));
}

engine::Grid grid_of(const py::sequence& sides, const std::string& phi_d_range) {
    if (sides.size() != 3) {
        throw Error(Fault::usage, fmt::format("a grid of {} sides; expected theta_h, theta_d and "
                                              "phi_d",
                                              sides.size()));
    }
    std::array<std::uint32_t, 3> found = {};
    for (std::size_t i = 0; i < found.size(); ++i) {
        const auto side = sides[i].cast<py::ssize_t>();
        if (side < 1 || side > static_cast<py::ssize_t>(engine::kMaxSide)) {
            throw Error(Fault::usage, fmt::format("a side of {} voxels; expected 1 to {}", side,
                                                  engine::kMaxSide));
        }
        found[i] = static_cast<std::uint32_t>(side);
    }
    const engine::Grid grid = {found[0], found[1], found[2], range_of(phi_d_range)};
    if (grid.phi_d_range == engine::PhiDRange::two_pi && grid.phi_d % 2 != 0) {
        throw Error(Fault::usage,
                    fmt::format("{} phi_d over 2pi; expected an even number", grid.phi_d));
    }
    engine::require_usable(grid, "grid");
    return grid;
}

DatabaseHandle open(const py::str& name, const py::object& grid, const py::object& phi_d_range,
                    bool skip_bad, const py::sequence& materials, const py::sequence& exclude,
                    const py::dict& call) {
    engine::DatabaseChoice choice;
    choice.databases = {{.label = {}, .name = from_python(name)}};
    if (!grid.is_none()) {
        choice.grid = grid_of(grid, "pi");
    }
    if (!phi_d_range.is_none()) {
        choice.phi_d_range = range_of(from_python(phi_d_range));
    }
    choice.skip_bad = skip_bad;
    choice.materials = {from_python_list(materials), from_python_list(exclude)};
    DatabaseHandle opened;
    run(call_options(call), [&](const pipeline::Control& control) {
        opened.database = engine::open_databases(choice);
        control.update("opening", 1);
    });
    return opened;
}

SampleArray sample_array(const py::array& array, const std::string& name,
                         const engine::Grid& grid) {
    const auto type = array.dtype();
    const bool is_float32 = type.is(py::dtype::of<float>()) || type.equal(py::dtype::of<float>());
    if (!is_float32 && !type.equal(py::dtype::of<double>())) {
        throw py::type_error(
            fmt::format("{}: found numbers of type {}; expected float64 or "
                        "float32",
                        name, std::string(py::str(py::handle(type)))));
    }
    const std::array<std::uint32_t, 4> sides = {grid.theta_h, grid.theta_d, grid.phi_d, 3};
    SampleArray result = {.data = static_cast<const std::byte*>(array.data()),
                          .is_float32 = is_float32};
    for (std::size_t i = 0; i < sides.size(); ++i) {
        if (array.ndim() != 4 || array.shape(static_cast<py::ssize_t>(i)) != sides[i]) {
            throw InputError(fmt::format(
                "{}: found an array of shape {}; expected ({}, {}, {}, 3): theta_h, theta_d, "
                "phi_d, channel",
                name, std::string(py::str(array.attr("shape"))), sides[0], sides[1], sides[2]));
        }
        result.strides[i] = array.strides(static_cast<py::ssize_t>(i));
    }
    result.owner = {new py::object(array), [](const py::object* object) {
                        const py::gil_scoped_acquire locked;
                        delete object;
                    }};
    return result;
}

DatabaseHandle from_arrays(const py::str& name, const py::sequence& materials,
                           const py::sequence& arrays, const std::string& phi_d_range) {
    auto names = from_python_list(materials);
    if (names.empty() || names.size() != arrays.size()) {
        throw Error(Fault::usage, fmt::format("found {} names and {} arrays; expected as many, at "
                                              "least one",
                                              names.size(), arrays.size()));
    }
    const auto first = py::array(arrays[0]);
    if (first.ndim() != 4) {
        throw InputError(
            fmt::format("{}: found an array of shape {}; expected (theta_h, theta_d, phi_d, 3)",
                        names[0], std::string(py::str(first.attr("shape")))));
    }
    const auto grid =
        grid_of(py::make_tuple(first.shape(0), first.shape(1), first.shape(2)), phi_d_range);
    std::vector<SampleArray> samples;
    for (std::size_t i = 0; i < names.size(); ++i) {
        samples.push_back(sample_array(py::array(arrays[i]), names[i], grid));
    }
    return {std::make_shared<ArrayDatabase>(from_python(name), grid, std::move(names),
                                            std::move(samples))};
}

DatabaseHandle join(const py::sequence& labels, const py::sequence& databases) {
    std::vector<engine::LabelledDatabase> members;
    for (std::size_t i = 0; i < databases.size(); ++i) {
        auto label = from_python(labels[i]);
        const auto& database = databases[i].cast<const DatabaseHandle&>().database;
        engine::require_label(label, database->name());
        members.push_back({std::move(label), database});
    }
    auto joined = engine::make_joined(std::move(members));
    engine::require_usable(*joined);
    return {std::shared_ptr<const engine::Database>(std::move(joined))};
}

DatabaseHandle subset(const DatabaseHandle& whole, std::vector<std::size_t> materials) {
    return {std::shared_ptr<const engine::Database>(
        engine::make_subset(whole.database, std::move(materials)))};
}

py::array_t<double> read(const DatabaseHandle& handle, std::size_t material) {
    const auto& database = *handle.database;
    const auto& grid = database.grid();
    if (material >= database.materials().size()) {
        throw py::index_error("no such material");
    }
    py::array_t<double> samples({static_cast<py::ssize_t>(grid.theta_h),
                                 static_cast<py::ssize_t>(grid.theta_d),
                                 static_cast<py::ssize_t>(grid.phi_d), py::ssize_t{3}});
    double* const to = samples.mutable_data();
    const Unlocked unlocked;
    engine::read_material(
        database, material, {}, [&](engine::VoxelRange range, std::span<const double> planes) {
            for (std::uint64_t i = 0; i < range.size(); ++i) {
                for (std::size_t c = 0; c < 3; ++c) {
                    const double sample = planes[c * range.size() + i];
                    to[3 * (range.first + i) + c] =
                        sample < 0 ? std::numeric_limits<double>::quiet_NaN() : sample;
                }
            }
        });
    return samples;
}

std::string content_hash(const DatabaseHandle& handle, const py::dict& call) {
    std::string hash;
    run(call_options(call), [&](const pipeline::Control& control) {
        hash = engine::content_hash_of(*handle.database, control.stage("hashing"));
    });
    return hash;
}

/// The directions of a voxel beyond pi are those at phi_d - pi, exchanged.
py::dict geometry(const py::sequence& sides, const std::string& phi_d_range) {
    const auto grid = grid_of(sides, phi_d_range);
    const engine::Domain domain(grid);
    const std::vector<py::ssize_t> shape = {static_cast<py::ssize_t>(grid.theta_h),
                                            static_cast<py::ssize_t>(grid.theta_d),
                                            static_cast<py::ssize_t>(grid.phi_d)};
    constexpr std::array kNames = {"theta_h",     "theta_d", "phi_d",      "cos_theta_i",
                                   "cos_theta_o", "s_merl",  "solid_angle"};
    py::dict result;
    std::array<double*, kNames.size()> to = {};
    for (std::size_t i = 0; i < kNames.size(); ++i) {
        py::array_t<double> numbers(shape);
        to[i] = numbers.mutable_data();
        result[kNames[i]] = std::move(numbers);
    }
    const Unlocked unlocked;
    for (std::uint64_t k = 0; k < grid.voxels(); ++k) {
        auto voxel = domain.voxel(k);
        if (k % grid.phi_d >= grid.over_pi().phi_d) {
            voxel.phi_d += std::numbers::pi;
            std::swap(voxel.cos_theta_i, voxel.cos_theta_o);
        }
        const std::array numbers = {voxel.theta_h,     voxel.theta_d,     voxel.phi_d,
                                    voxel.cos_theta_i, voxel.cos_theta_o, voxel.s_merl,
                                    voxel.solid_angle};
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            to[i][k] = numbers[i];
        }
    }
    return result;
}

}  // namespace

void bind_databases(py::module_& module) {
    py::class_<DatabaseHandle>(module, "Database")
        .def_property_readonly(
            "name", [](const DatabaseHandle& h) { return to_python(h.database->name()); })
        .def_property_readonly(
            "kind", [](const DatabaseHandle& h) { return to_python(h.database->kind()); })
        .def_property_readonly(
            "path", [](const DatabaseHandle& h) { return to_python(h.database->path()); })
        .def_property_readonly(
            "materials", [](const DatabaseHandle& h) { return to_python(h.database->materials()); })
        .def_property_readonly("shape",
                               [](const DatabaseHandle& h) {
                                   const auto& grid = h.database->grid();
                                   return py::make_tuple(grid.theta_h, grid.theta_d, grid.phi_d);
                               })
        .def_property_readonly("phi_d_range",
                               [](const DatabaseHandle& h) {
                                   return engine::range_name(h.database->grid().phi_d_range);
                               })
        .def_property_readonly(
            "skipped",
            [](const DatabaseHandle& h) {
                py::list list;
                for (const auto& [material, reason] : h.database->skipped()) {
                    list.append(py::make_tuple(to_python(material), to_python(reason)));
                }
                return list;
            })
        .def("read", read)
        .def("subset", subset)
        .def("content_hash", content_hash);
    module.def("open", open);
    module.def("is_evaluated",
               [](const py::str& name) { return engine::is_evaluated(from_python(name)); });
    module.def("default_label", [](const py::str& name) {
        return to_python(engine::default_label(from_python(name)));
    });
    module.def("from_arrays", from_arrays);
    module.def("join", join);
    module.def("geometry", geometry);
}

}  // namespace merl::python
