#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/database/database.h"
#include "engine/distance/pair_distance.h"
#include "engine/metric/metric.h"
#include "scan/pairs/distance_table.h"

namespace merl::python {

/// An open database, as Python has it.
struct DatabaseHandle {
    std::shared_ptr<const engine::Database> database;
};

/// A metric, and what is kept for single distances under it.
struct MetricHandle {
    engine::Metric metric;
    std::mutex mutex = {};
    std::shared_ptr<const engine::PairDistance> prepared = {};  // for the grid below
    engine::Grid grid = {};
};

/// What distances were computed with: null and empty for those of a table.
struct Source {
    std::shared_ptr<const engine::Database> database;
    std::vector<engine::Metric> metrics;

    std::vector<const engine::Metric*> pointers() const;
};

Source source_of(const pybind11::object& database, const pybind11::sequence& metrics);

/// Copies numbers into an array.
template <typename Number>
pybind11::array_t<Number> array_of(std::span<const Number> numbers) {
    return pybind11::array_t<Number>(static_cast<pybind11::ssize_t>(numbers.size()),
                                     numbers.data());
}

/// (name, values, bounds or None, is_final) of each column.
pybind11::list columns_of(std::span<const scan::MetricColumn> columns);

/// The table of such columns, which are checked. Throws std::invalid_argument.
scan::DistanceTable table_of(const pybind11::sequence& names, const pybind11::sequence& columns);

// What the files of this folder add to the module.
void bind_databases(pybind11::module_& module);
void bind_metrics(pybind11::module_& module);
void bind_distances(pybind11::module_& module);
void bind_scan(pybind11::module_& module);
void bind_score(pybind11::module_& module);
void bind_spheres(pybind11::module_& module);

}  // namespace merl::python
