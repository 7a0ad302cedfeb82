#include "app/cli/open_metrics.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/cli/guard.h"
#include "engine/base/error.h"
#include "engine/database/abc_database.h"
#include "engine/device/context.h"
#include "engine/distance/distances.h"
#include "engine/metric/metric_kernels.h"

namespace merl::app {

namespace {

constexpr double kTrySeconds = 60;
constexpr std::uint64_t kTryBytes = 4ULL << 30U;

/// Compiles a metric for the device and computes a distance of two materials on a tiny grid with
/// it.
void try_metric(const engine::Metric& metric, const std::string& device) {
    run_guarded(
        fmt::format("{}: compiling and trying it", metric.file), kTrySeconds, kTryBytes, [&] {
            engine::compile_kernels(metric);  // what is wrong with the file comes before the device
            device::Context context({.device = device});
            const auto database = engine::make_abc_database(
                {.theta_h = 4, .theta_d = 4, .phi_d = 8},
                "material\nmade-up matte,0.1,0.2,0.3,0,0,0,1,1,1.5\nmade-up "
                "glossy,0.2,0.2,0.2,9,9,9,50,1,1.5\n");
            const engine::Metric* const one[] = {&metric};
            engine::compute_distances(context, *database, one);
        });
}

}  // namespace

std::vector<engine::Metric> open_metrics(const std::vector<std::string>& texts,
                                         const std::string& device) {
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
    for (const auto& metric : metrics) {
        if (!metric.has_twin()) {
            try_metric(metric, device);
        }
    }
    return metrics;
}

}  // namespace merl::app
