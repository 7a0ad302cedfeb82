#include "tests/bench/inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "app/pipeline/refine.h"
#include "engine/database/blends_database.h"
#include "engine/database/merl_directory.h"
#include "engine/database/model_database.h"
#include "engine/distance/float64_distances.h"
#include "tests/bench/bench.h"

namespace merl::bench {

using engine::Database;
using engine::Metric;

device::Context& context() {
    device::widen_lavapipe();
    static device::Context context({.device = settings().device});
    return context;
}

engine::Engines& engines() {
    static engine::Engines engines(context(), context().limits().is_host
                                                  ? engine::Engines::Use::rest
                                                  : engine::Engines::Use::everything);
    return engines;
}

engine::Engines& shader_engines() {
    static engine::Engines engines(context());
    return engines;
}

const Database& database() {
    static const std::unique_ptr<Database> database = []() -> std::unique_ptr<Database> {
        if (settings().check) {
            return engine::open_blends("blends:30", {.theta_h = 18, .theta_d = 18, .phi_d = 36});
        }
        return settings().database.empty() ? engine::open_model("abc")
                                           : engine::open_merl_directory(settings().database);
    }();
    return *database;
}

const std::array<const Metric*, 2>& two_metrics() {
    static const std::array<const Metric*, 2> metrics = {&engine::find_metric("cwcbrt"),
                                                         &engine::find_metric("pawcielab")};
    return metrics;
}

const scan::Distances& device_distances() {
    static const scan::Distances distances = [] {
        auto computed = engine::compute_distances(engines(), database(), two_metrics());
        return scan::Distances{.names = database().materials(),
                               .first_metric = two_metrics()[0]->name,
                               .second_metric = two_metrics()[1]->name,
                               .first = std::move(computed.distances[0].values),
                               .second = std::move(computed.distances[1].values),
                               .first_bounds = std::move(computed.distances[0].bounds),
                               .second_bounds = std::move(computed.distances[1].bounds)};
    }();
    return distances;
}

const scan::Distances& exact_distances() {
    static const scan::Distances distances = [] {
        auto refined = device_distances();
        pipeline::refine(refined, database(), two_metrics(), 100, 10, 1ULL << 30U, {});
        return refined;
    }();
    return distances;
}

scan::Distances made_up_distances(std::uint32_t materials) {
    scan::Distances distances = {
        .names = {}, .first_metric = "one", .second_metric = "two", .first = {}, .second = {}};
    for (std::uint32_t m = 0; m < materials; ++m) {
        distances.names.push_back(fmt::format("material-{:05}", m));
    }
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    for (std::uint64_t p = 0; p < scan::pair_count(materials); ++p) {
        const double shared = normal(random);
        distances.first.push_back(std::exp(shared + 0.5 * normal(random)));
        distances.second.push_back(std::exp(shared + 0.5 * normal(random)));
    }
    return distances;
}

double check_distances(const Database& database, std::span<const Metric* const> metrics,
                       const engine::PairList& pairs,
                       std::span<const engine::MetricDistances> distances) {
    constexpr std::size_t kChecked = 50;
    std::vector<std::size_t> chosen;
    for (std::size_t i = 0; i < std::min(kChecked, pairs.size()); ++i) {
        chosen.push_back(pairs.size() * i / std::min(kChecked, pairs.size()));
    }
    std::vector<engine::MaterialPair> all;
    pairs.each([&](std::size_t /*place*/, std::uint32_t first, std::uint32_t second) {
        all.emplace_back(first, second);
    });
    std::vector<engine::Float64Request> requests;
    for (const auto* metric : metrics) {
        auto& request = requests.emplace_back(engine::Float64Request{metric, {}});
        for (const auto place : chosen) {
            request.pairs.push_back(all[place]);
        }
    }
    const auto exact = engine::float64_distances(database, requests);
    double largest = 0;
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        require(distances[m].values.size() == pairs.size(),
                fmt::format("{}: {} distances, expected {}", metrics[m]->name,
                            distances[m].values.size(), pairs.size()));
        for (std::size_t i = 0; i < chosen.size(); ++i) {
            const double value = distances[m].values[chosen[i]];
            const double error = std::abs(value - exact[m][i]);
            const double allowed =
                metrics[m]->has_bound() ? distances[m].bounds[chosen[i]] : 1e-5 * exact[m][i];
            require(error <= allowed,
                    fmt::format("{}, pair {}: {}, expected {} +- {}", metrics[m]->name, chosen[i],
                                value, exact[m][i], allowed));
            largest = std::max(largest, exact[m][i] > 0 ? error / exact[m][i] : 0);
        }
    }
    return largest;
}

engine::Grid coarse_grid(std::uint32_t divisor) {
    const engine::Grid merl;
    divisor = settings().check ? 10 : divisor;
    return {merl.theta_h / divisor, merl.theta_d / divisor, merl.phi_d / divisor};
}

std::unique_ptr<Database> coarse_blends(std::size_t materials, std::uint32_t divisor) {
    return engine::open_blends(fmt::format("blends:{}", materials), coarse_grid(divisor));
}

}  // namespace merl::bench
