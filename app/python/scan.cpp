#include "app/pipeline/scan.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "app/python/call.h"
#include "app/python/handles.h"
#include "app/python/text.h"

namespace py = pybind11;

namespace merl::python {
namespace {

/// (left pairs, right pairs, agreements) of configurations.
py::tuple configurations_of(std::span<const scan::Configuration> configurations) {
    const auto column = [&](auto member) {
        using Number = std::remove_cvref_t<decltype(configurations[0].*member)>;
        py::array_t<Number> numbers(static_cast<py::ssize_t>(configurations.size()));
        std::ranges::transform(configurations, numbers.mutable_data(), member);
        return numbers;
    };
    return py::make_tuple(column(&scan::Configuration::left), column(&scan::Configuration::right),
                          column(&scan::Configuration::agreement));
}

py::dict scan_table(const py::sequence& names, const py::sequence& columns,
                    const py::object& database, const py::sequence& metrics, std::uint32_t select,
                    std::uint32_t per_material, std::optional<std::uint64_t> disagreements,
                    bool fast, const py::dict& call) {
    using namespace py::literals;
    auto table = table_of(names, columns);
    const auto source = source_of(database, metrics);
    const auto options = call_options(call);
    pipeline::ScanResult result;
    run(options, [&](const pipeline::Control& control) {
        result =
            pipeline::scan_distances(std::move(table), source.database.get(), source.pointers(),
                                     {.select = select,
                                      .per_material = per_material,
                                      .disagreements = disagreements,
                                      .fast = fast,
                                      .memory_bytes = options.memory_bytes},
                                     control);
    });
    const auto& d = result.distances;
    const auto& counts = result.census.counts;
    const scan::MetricColumn refined[] = {
        {d.first_metric, d.first, d.first_bounds, d.first_is_final},
        {d.second_metric, d.second, d.second_bounds, d.second_is_final}};
    return py::dict(
        "columns"_a = columns_of(refined),
        "counts"_a = py::dict(
            "configurations"_a = counts.configurations, "disagreements"_a = counts.disagreements(),
            "rate"_a = counts.disagreement_rate(), "discordant"_a = counts.discordant,
            "tied_first_only"_a = counts.tied_first_only,
            "tied_second_only"_a = counts.tied_second_only, "tied_both"_a = counts.tied_both),
        "exact"_a = result.exact, "undecided"_a = result.left_open,
        "refined"_a = py::make_tuple(result.refined.first, result.refined.second),
        "disagreements"_a = configurations_of(result.disagreements),
        "selection"_a = configurations_of(result.selection));
}

}  // namespace

void bind_scan(py::module_& module) {
    module.def("scan", scan_table);
}

}  // namespace merl::python
