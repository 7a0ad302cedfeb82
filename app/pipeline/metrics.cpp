#include "app/pipeline/metrics.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/base/error.h"
#include "engine/database/model_database.h"
#include "engine/distance/distances.h"
#include "engine/distance/parts/window_check.h"
#include "engine/metric/metric_kernels.h"

namespace merl::pipeline {

std::vector<engine::Metric> open_metrics(std::span<const std::string> texts) {
    std::vector<engine::Metric> metrics;
    for (const auto& text : texts) {
        if (text == "all") {
            const auto library = engine::metrics();
            metrics.insert(metrics.end(), library.begin(), library.end());
        } else {
            metrics.push_back(engine::open_metric(text));
        }
    }
    for (auto m = metrics.begin(); m != metrics.end(); ++m) {
        const auto same = [&](const engine::Metric& other) { return other.name == m->name; };
        if (const auto other = std::find_if(metrics.begin(), m, same); other != m) {
            throw Error(Fault::usage, other->file == m->file
                                          ? fmt::format("the metric {} is named twice", m->name)
                                          : fmt::format("{} and {} would both be called {} in the "
                                                        "results: rename one",
                                                        other->file, m->file, m->name));
        }
    }
    return metrics;
}

std::vector<std::string> leave_out_empty(std::vector<engine::Metric>& metrics,
                                         std::span<const std::string> texts,
                                         const engine::Grid& grid) {
    std::vector<std::string> left_out;
    if (std::ranges::find(texts, "all") == texts.end()) {
        return left_out;
    }
    const auto library = engine::metrics();
    std::erase_if(metrics, [&](const engine::Metric& metric) {
        // With other parameters it has another name, by which it was asked for.
        if (std::ranges::find(library, metric.name, &engine::Metric::name) == library.end()) {
            return false;
        }
        const auto windows = engine::empty_windows(metric, grid);
        if (!windows.empty()) {
            left_out.push_back(engine::empty_windows_text(metric, windows, grid));
        }
        return !windows.empty();
    });
    return left_out;
}

void try_metric(const engine::Metric& metric, const device::ContextOptions& device) {
    engine::compile_kernels(metric);  // what is wrong with the file comes before the device
    const auto database = engine::make_model_database(
        *engine::find_model("abc"),
        "material,kd_red,kd_green,kd_blue,A_red,A_green,A_blue,B,C,ior\n"
        "made-up matte,0.1,0.2,0.3,0,0,0,1,1,1.5\n"
        "made-up glossy,0.2,0.2,0.2,9,9,9,50,1,1.5\n",
        "made-up", {.theta_h = 4, .theta_d = 4, .phi_d = 8});
    const engine::Metric* const one[] = {&metric};
    engine::Engines engines(device);
    engine::compute_distances(engines, *database, one, {.is_trial = true});
}

}  // namespace merl::pipeline
