#include "app/pipeline/metrics.h"

#include <pybind11/stl.h>

#include <memory>
#include <utility>

#include "app/python/call.h"
#include "app/python/handles.h"
#include "app/python/text.h"
#include "engine/distance/distances.h"

namespace py = pybind11;

namespace merl::python {
namespace {

/// Two materials of two databases on one grid.
class Two final : public engine::Database {
  public:
    using One = std::pair<std::shared_ptr<const engine::Database>, std::size_t>;

    Two(const One& a, const One& b) : Database("two materials", "pair"), ones_{a, b} {
        grid_ = a.first->grid();
        materials_ = {"a", "b"};
        for (const auto& [database, material] : ones_) {
            if (database->grid() != grid_) {
                throw InputError("found materials on " + grid_.text() + " and on " +
                                 database->grid().text() + "; expected the same grid");
            }
            if (material >= database->materials().size()) {
                throw py::index_error("no such material");
            }
        }
    }

    void read(std::size_t material, engine::VoxelRange range, std::span<double> samples,
              const engine::SampleSink& sink) const override {
        const auto& [database, index] = ones_.at(material);
        database->read(index, range, samples, sink);
    }

    std::uint64_t keep(std::uint64_t bytes) const override {
        return ones_[0].first->keep(bytes / 2) + ones_[1].first->keep(bytes / 2);
    }

  private:
    std::array<One, 2> ones_;
};

/// What is known of the voxels of the grid that was last asked for, as long as a metric has it.
std::shared_ptr<const engine::KeptGeometry> geometry_of(const engine::Grid& grid) {
    static std::mutex mutex;
    static std::weak_ptr<const engine::KeptGeometry> last;
    const std::lock_guard lock(mutex);
    auto kept = last.lock();
    if (!kept || kept->domain.grid() != grid) {
        kept = std::make_shared<engine::KeptGeometry>(grid);
        last = kept;
    }
    return kept;
}

std::shared_ptr<const engine::PairDistance> prepared_for(MetricHandle& handle,
                                                         const engine::Grid& grid) {
    const std::lock_guard lock(handle.mutex);
    if (!handle.prepared || handle.grid != grid) {
        handle.prepared = std::make_shared<engine::PairDistance>(handle.metric, geometry_of(grid));
        handle.grid = grid;
    }
    return handle.prepared;
}

double distance(MetricHandle& handle, const DatabaseHandle& a, std::size_t of_a,
                const DatabaseHandle& b, std::size_t of_b, const py::dict& call) {
    const Two database({a.database, of_a}, {b.database, of_b});
    const auto options = call_options(call);
    double result = 0;
    run(options, [&](const pipeline::Control& control) {
        if (handle.metric.twin.sum != nullptr) {
            result = (*prepared_for(handle, database.grid()))(database, {0, 1});
        } else {
            const engine::Metric* const one[] = {&handle.metric};
            BorrowedEngines engines(options.device);
            result = engine::compute_distances(*engines, database, one,
                                               {.memory_bytes = options.memory_bytes,
                                                .progress = control.stage("distances")})
                         .distances[0]
                         .values[0];
        }
        control.update("distances", 1);
    });
    return result;
}

py::dict parameters(const MetricHandle& handle) {
    py::dict result;
    const auto& declared = handle.metric.header.parameters;
    for (std::size_t i = 0; i < declared.size(); ++i) {
        result[to_python(declared[i].name)] = handle.metric.parameters[i];
    }
    return result;
}

std::unique_ptr<MetricHandle> handle_of(engine::Metric metric) {
    auto handle = std::make_unique<MetricHandle>();
    handle->metric = std::move(metric);
    return handle;
}

/// The metrics that texts name, and why metrics of "all" are left out on this grid.
py::tuple open_metrics(const py::sequence& texts, const DatabaseHandle& database) {
    const auto named = from_python_list(texts);
    auto metrics = pipeline::open_metrics(named);
    const auto left_out = pipeline::leave_out_empty(metrics, named, database.database->grid());
    py::list handles;
    for (auto& metric : metrics) {
        handles.append(py::cast(handle_of(std::move(metric))));
    }
    return py::make_tuple(handles, to_python(left_out));
}

}  // namespace

void bind_metrics(py::module_& module) {
    const auto text = [](std::string engine::MetricHeader::*member) {
        return [member](const MetricHandle& handle) {
            return to_python(handle.metric.header.*member);
        };
    };
    py::class_<MetricHandle>(module, "Metric")
        .def(py::init(
            [](const py::str& name) { return handle_of(engine::open_metric(from_python(name))); }))
        .def_property_readonly("name",
                               [](const MetricHandle& h) { return to_python(h.metric.name); })
        .def_property_readonly(
            "text", [](const MetricHandle& h) { return to_python(engine::text_of(h.metric)); })
        .def_property_readonly("source_text",
                               [](const MetricHandle& h) { return to_python(h.metric.source); })
        .def_property_readonly("title", text(&engine::MetricHeader::title))
        .def_property_readonly("formula", text(&engine::MetricHeader::formula))
        .def_property_readonly("source", text(&engine::MetricHeader::source))
        .def_property_readonly("parameters", parameters)
        .def_property_readonly("is_own", [](const MetricHandle& h) { return !h.metric.has_twin(); })
        .def("distance", distance);
    module.def("open_metrics", open_metrics);
    module.def("library", [] {
        std::vector<std::string> names;
        for (const auto& metric : engine::metrics()) {
            names.push_back(metric.name);
        }
        return to_python(names);
    });
    module.def("try_metric", [](const py::str& name, const py::str& device) {
        pipeline::try_metric(engine::open_metric(from_python(name)),
                             {.device = from_python(device)});
    });
}

}  // namespace merl::python
