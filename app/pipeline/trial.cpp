#include "app/pipeline/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
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

/// The least of some times that a part of the distances of the built-in database takes.
double least_seconds(engine::Engines& engines, std::span<const Metric* const> metrics,
                     const std::function<double(const engine::DistanceSeconds&)>& part) {
    constexpr int kTimes = 3;
    const auto database = engine::make_abc_database({.theta_h = 18, .theta_d = 18, .phi_d = 36});
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kTimes; ++i) {
        least =
            std::min(least, part(engine::compute_distances(engines, *database, metrics).seconds));
    }
    return least;
}

/// The side of the largest tiles, one of those around what `sides` has, in which the device takes
/// least for the difference of a metric.
std::uint32_t fastest_side(const device::ContextOptions& options, const std::string& identity,
                           device::TileSides sides, std::uint32_t device::TileSides::*side,
                           const Metric& metric) {
    constexpr std::array<std::uint32_t, 7> kSides = {2, 3, 4, 5, 6, 8, 10};
    const auto* const start = std::ranges::find(kSides, sides.*side);
    std::uint32_t best = sides.*side;
    double least = std::numeric_limits<double>::infinity();
    for (const auto candidate : kSides) {
        const auto* const at = std::ranges::find(kSides, candidate);
        if (std::abs(at - start) > 1) {
            continue;
        }
        sides.*side = candidate;
        auto with_sides = options;
        with_sides.trials = {{.device = identity, .tiles = sides}};
        device::Context context(with_sides);
        engine::Engines engines(context);
        const Metric* const one[] = {&metric};
        const double seconds =
            least_seconds(engines, one, [](const auto& s) { return s.difference; });
        if (seconds < least) {
            least = seconds;
            best = candidate;
        }
    }
    return best;
}

bool loses_to_host(const device::ContextOptions& options) {
    const auto without_kernels = [](const engine::DistanceSeconds& seconds) {
        return seconds.without_opening() - seconds.kernels;
    };
    device::Context context(options);
    engine::Engines on_device(context);
    engine::Engines on_host({.device = engine::kHost});
    const auto metrics = kinds_of_metrics();
    return least_seconds(on_host, metrics, without_kernels) <
           least_seconds(on_device, metrics, without_kernels);
}

/// Opens the device, and holds it to float64.
device::DeviceInfo checked(const device::ContextOptions& options, bool& measures_time) {
    device::Context context(options);
    check(context);
    measures_time = context.measures_time();
    return context.info();
}

}  // namespace

device::Trial try_device(const device::ContextOptions& options) {
    device::Trial trial;
    try {
        bool measures_time = false;
        const auto info = checked(options, measures_time);
        trial.device = device::identity(info);
        const auto [power, square] = kinds_of_metrics();
        auto with_tiles = options;
        if (!info.limits.is_host && measures_time) {
            using Sides = device::TileSides;
            Sides sides = info.limits.tiles;
            sides.power = fastest_side(options, trial.device, sides, &Sides::power, *power);
            sides.square = fastest_side(options, trial.device, sides, &Sides::square, *square);
            trial.tiles = sides;
            with_tiles.trials = {trial};
        }
        if (!info.limits.is_host && info.kind != "discrete GPU") {
            trial.loses_to_host = loses_to_host(with_tiles);
        }
    } catch (const device::UnfitError& error) {
        trial.refusal = error.what();
    }
    return trial;
}

}  // namespace merl::pipeline
