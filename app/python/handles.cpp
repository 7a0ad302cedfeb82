#include "app/python/handles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "app/python/text.h"

namespace py = pybind11;

namespace merl::python {
namespace {

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

std::vector<double> numbers_of(const py::handle& array, const std::string& metric,
                               std::uint64_t pairs) {
    const auto numbers = Numbers::ensure(array);
    if (!numbers) {
        throw py::type_error(metric + ": expected an array of numbers");
    }
    if (numbers.ndim() != 1 || static_cast<std::uint64_t>(numbers.size()) != pairs) {
        throw std::invalid_argument(
            fmt::format("{}: found {} numbers; expected one for each of {} pairs", metric,
                        numbers.size(), pairs));
    }
    return {numbers.data(), numbers.data() + numbers.size()};
}

}  // namespace

std::vector<const engine::Metric*> Source::pointers() const {
    std::vector<const engine::Metric*> result;
    for (const auto& metric : metrics) {
        result.push_back(&metric);
    }
    return result;
}

Source source_of(const py::object& database, const py::sequence& metrics) {
    Source source;
    if (!database.is_none()) {
        source.database = database.cast<const DatabaseHandle&>().database;
        for (const auto& metric : metrics) {
            source.metrics.push_back(metric.cast<const MetricHandle&>().metric);
        }
    }
    return source;
}

py::list columns_of(std::span<const scan::MetricColumn> columns) {
    py::list list;
    for (const auto& column : columns) {
        list.append(py::make_tuple(to_python(column.metric), array_of<double>(column.values),
                                   column.bounds.empty()
                                       ? py::object(py::none())
                                       : py::object(array_of<double>(column.bounds)),
                                   column.is_final));
    }
    return list;
}

scan::DistanceTable table_of(const py::sequence& names, const py::sequence& columns) {
    scan::DistanceTable table = {.names = from_python_list(names), .metrics = {}};
    if (table.names.size() < 2 || table.names.size() > scan::max_materials ||
        std::ranges::adjacent_find(table.names, std::greater_equal<>()) != table.names.end()) {
        throw std::invalid_argument(fmt::format(
            "found {} names; expected two or more that ascend bytewise", table.names.size()));
    }
    for (const auto& entry : columns) {
        const auto column = entry.cast<py::tuple>();
        auto& to = table.metrics.emplace_back();
        to.metric = from_python(column[0]);
        to.values = numbers_of(column[1], to.metric, table.pairs());
        if (!column[2].is_none()) {
            to.bounds = numbers_of(column[2], to.metric, table.pairs());
        }
        to.is_final = column[3].cast<bool>();
        const auto is_bad = [](double value) { return !(std::isfinite(value) && value >= 0); };
        const auto bad = std::ranges::find_if(to.values, is_bad);
        if (bad != to.values.end()) {
            throw std::invalid_argument(
                fmt::format("{}: distance {} is {}; expected a finite number, zero or more",
                            to.metric, bad - to.values.begin(), *bad));
        }
        if (std::ranges::any_of(to.bounds, [](double bound) { return !(bound >= 0); })) {
            throw std::invalid_argument(to.metric + ": found a bound below zero; expected none");
        }
    }
    return table;
}

}  // namespace merl::python
