#include "app/pipeline/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/database/model_database.h"
#include "engine/database/subset_database.h"
#include "engine/distance/distances.h"
#include "engine/distance/float64_distances.h"

namespace merl::pipeline {
namespace {

using engine::Metric;

/// A metric with slopes and one with norms: most kernels of the library.
std::array<const Metric*, 2> metrics_with_a_bound() {
    return {&engine::find_metric("cwcbrt"), &engine::find_metric("pawcielab")};
}

/// The first materials of the built-in database: enough for tiles on the diagonal and above it, of
/// each side that is measured but the largest.
std::unique_ptr<engine::Database> some_materials(const engine::Grid& grid) {
    constexpr std::size_t kMaterials = 24;
    std::vector<std::size_t> chosen(kMaterials);
    std::iota(chosen.begin(), chosen.end(), std::size_t{0});
    return engine::make_subset(engine::open_model("abc", grid), chosen);
}

/// Holds the distances of some materials to float64.
void check(device::Context& context, const engine::Grid& grid,
           std::span<const Metric* const> metrics) {
    constexpr double kUnboundedTolerance = 1e-4;  // relative, as in verify
    const auto database = some_materials(grid);
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
            const double bound =
                metrics[m]->has_bound() ? distances.bounds[p] : kUnboundedTolerance * expected[p];
            if (!(std::abs(distances.values[p] - expected[p]) <= bound)) {
                throw device::UnfitError(fmt::format(
                    "{} computes wrongly: a distance under {} is {}, expected {} within {:.1e}",
                    context.info().name, metrics[m]->name, distances.values[p], expected[p],
                    bound));
            }
        }
    }
}

/// Every kernel of the library. The windows of a summary need more layers of theta_h.
void check(device::Context& context) {
    const auto bounded = metrics_with_a_bound();
    const std::array sums = {bounded[0], bounded[1], &engine::find_metric("paw-ciede2000")};
    check(context, {.theta_h = 12, .theta_d = 12, .phi_d = 24}, sums);
    if (context.limits().floats.float64) {
        const std::array summary = {&engine::find_metric("gloss-contrast")};
        check(context, {.theta_h = 24, .theta_d = 12, .phi_d = 24}, summary);
    }
}

/// The least of some times that a part of the distances of the built-in database takes.
double least_seconds(engine::Engines& engines, std::span<const Metric* const> metrics,
                     const std::function<double(const engine::DistanceSeconds&)>& part) {
    constexpr int kTimes = 3;
    const auto database = engine::open_model("abc", {.theta_h = 18, .theta_d = 18, .phi_d = 36});
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
    const auto known =
        static_cast<std::size_t>(std::ranges::find(kSides, sides.*side) - kSides.begin());
    std::uint32_t best = sides.*side;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = known > 0 ? known - 1 : 0; i < std::min(known + 2, kSides.size()); ++i) {
        sides.*side = kSides[i];
        auto with_sides = options;
        with_sides.trials = {{.device = identity, .tiles = sides}};
        device::Context context(with_sides);
        engine::Engines engines(context);
        const Metric* const one[] = {&metric};
        const double seconds =
            least_seconds(engines, one, [](const auto& s) { return s.difference; });
        if (seconds < least) {
            least = seconds;
            best = kSides[i];
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
    const auto metrics = metrics_with_a_bound();
    return least_seconds(on_host, metrics, without_kernels) <
           least_seconds(on_device, metrics, without_kernels);
}

}  // namespace

device::Trial try_device(const device::ContextOptions& options) {
    device::Trial trial;
    try {
        const auto opened = std::make_unique<device::Context>(options);
        const auto info = opened->info();
        const bool is_gpu = !info.limits.is_host;
        trial.device = device::identity(info);
        if (is_gpu && opened->measures_time()) {
            const auto [power, square] = metrics_with_a_bound();
            using Sides = device::TileSides;
            Sides sides = info.limits.tiles;
            sides.power = fastest_side(options, trial.device, sides, &Sides::power, *power);
            sides.square = fastest_side(options, trial.device, sides, &Sides::square, *square);
            trial.tiles = sides;
        }
        auto with_tiles = options;
        with_tiles.trials = {trial};
        device::Context context(with_tiles);
        check(context);
        trial.loses_to_host = is_gpu && info.kind != "discrete GPU" && loses_to_host(with_tiles);
    } catch (const device::UnfitError& error) {
        trial.refusal = error.what();
    } catch (const std::logic_error& error) {  // a sum that is no number, for one
        trial.refusal = fmt::format("it computes wrongly: {}", error.what());
    }
    return trial;
}

}  // namespace merl::pipeline
