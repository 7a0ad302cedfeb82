#include "app/pipeline/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "engine/base/error.h"
#include "engine/database/abc_database.h"
#include "engine/distance/distances.h"
#include "engine/distance/float64_distances.h"

namespace merl::pipeline {
namespace {

using engine::Metric;

/// A metric with slopes and one with norms: every kernel of the library's metrics.
std::array<const Metric*, 2> kinds_of_metrics() {
    return {&engine::find_metric("cwcbrt"), &engine::find_metric("pawcielab")};
}

void check(device::Context& context) {
    const auto database =
        engine::make_abc_database({.theta_h = 12, .theta_d = 12, .phi_d = 24},
                                  "material\n"
                                  "dark,0.002,0.003,0.002,0.1,0.1,0.1,90,1,1.5\n"
                                  "glossy,0.2,0.1,0.1,9,8,9,50,1,1.5\n"
                                  "like glossy,0.2,0.1,0.1,9,8,9.0001,50,1,1.5\n"
                                  "matte,0.1,0.2,0.3,0,0,0,1,1,1.5\n"
                                  "mirror,0.01,0.01,0.01,900,800,700,9000,2,1.4\n");
    const auto metrics = kinds_of_metrics();
    engine::Engines engines(context);
    const auto found = engine::compute_distances(engines, *database, metrics);
    std::vector<engine::MaterialPair> pairs;
    for (std::uint32_t i = 0; i < database->materials().size(); ++i) {
        for (std::uint32_t j = i + 1; j < database->materials().size(); ++j) {
            pairs.emplace_back(i, j);
        }
    }
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        const auto expected = engine::float64_distances(*database, *metrics[m], pairs);
        const auto& distances = found.distances[m];
        for (std::size_t p = 0; p < pairs.size(); ++p) {
            if (!(std::abs(distances.values[p] - expected[p]) <= distances.bounds[p])) {
                throw device::UnfitError(fmt::format(
                    "{} computes wrongly: a distance under {} is {}, expected {} within {:.1e}",
                    context.info().name, metrics[m]->name, distances.values[p], expected[p],
                    distances.bounds[p]));
            }
        }
    }
}

/// The time that an engine takes, kernels made: the least of some.
double seconds_of(engine::Engines& engines, const engine::Database& database) {
    constexpr int kTimes = 3;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kTimes; ++i) {
        const auto seconds =
            engine::compute_distances(engines, database, kinds_of_metrics()).seconds;
        least = std::min(least, seconds.without_opening() - seconds.kernels);
    }
    return least;
}

}  // namespace

bool loses_to_host(const device::ContextOptions& options) {
    device::Context context(options);
    check(context);
    // A card of its own need not be asked, and the processor itself has lost.
    if (context.limits().is_host || context.info().kind == "discrete GPU") {
        return false;
    }
    const auto database = engine::make_abc_database({.theta_h = 24, .theta_d = 24, .phi_d = 48});
    engine::Engines on_device(context);
    engine::Engines on_host({.device = engine::kHost});
    return seconds_of(on_host, *database) < seconds_of(on_device, *database);
}

}  // namespace merl::pipeline
