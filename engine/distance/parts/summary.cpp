#include "engine/distance/parts/summary.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace merl::engine {
namespace {

// What a feature is off by (docs/numerics.md): a mean, relative to itself; and what computing a
// feature from means rounds, relative to the larger of it and 1. Both with room for what a window's
// weight and a device's logarithm are off by.
constexpr double kMeanError = 1e-14;
constexpr double kFeatureError = 2e-14;

/// How far means are moved to see how much features move.
constexpr double kStep = 0x1p-20;

/// Materials whose features are evaluated at a time, each with all its moved means.
constexpr std::size_t kAtATime = 64;

/// Rows of a material: its means, and each number of them moved.
std::size_t rows_of(const Metric& metric) {
    return 1 + 3 * metric.header.windows.size();
}

void add_compensated(double term, double& sum, double& lost) {
    const double more = lost + term;
    const double both = sum + more;
    lost = more - (both - sum);
    sum = both;
}

/// The features of each material, and how far all of them together can be from exact ones.
struct Evaluated {
    std::vector<double> features;  // [material][feature]
    std::vector<double> errors;    // [material]
};

[[noreturn]] void refuse_feature(const Metric& metric, std::size_t feature, double value,
                                 const std::string& material, std::span<const WindowMean> means) {
    std::string text;
    for (std::size_t w = 0; w < means.size(); ++w) {
        text += fmt::format("{}{} ({:g}, {:g}, {:g})", w == 0 ? "" : ", ",
                            metric.header.windows[w].name, means[w][0], means[w][1], means[w][2]);
    }
    throw InputError(fmt::format(
        "{}: feature({}, m) is {:g}{}: expected a finite number; material \"{}\", whose "
        "means are {}",
        metric.file, feature, value,
        metric.is_checked() ? ", or goes wrong on the way (docs/metrics.md)" : "", material, text));
}

Evaluated evaluate(const Metric& metric, std::span<const WindowMean> means,
                   const Features& features, std::span<const std::string> materials) {
    const std::size_t windows = metric.header.windows.size();
    const std::size_t count = metric.header.features;
    const std::size_t rows = rows_of(metric);
    Evaluated result;
    std::vector<WindowMean> moved;
    std::vector<double> found;
    for (std::size_t first = 0; first < materials.size(); first += kAtATime) {
        const std::size_t size = std::min(kAtATime, materials.size() - first);
        moved.clear();
        for (std::size_t m = first; m < first + size; ++m) {
            const auto of_material = means.subspan(m * windows, windows);
            for (std::size_t row = 0; row < rows; ++row) {
                moved.insert(moved.end(), of_material.begin(), of_material.end());
                if (row > 0) {
                    auto& window = moved[moved.size() - windows + (row - 1) / 3];
                    window[(row - 1) % 3] *= 1 + kStep;
                }
            }
        }
        found.resize(size * rows * count);
        features(moved, found);
        for (std::size_t m = 0; m < size; ++m) {
            const double* const at_means = &found[m * rows * count];
            double squares = 0;
            for (std::size_t i = 0; i < count; ++i) {
                const double feature = at_means[i];
                if (!std::isfinite(feature)) {
                    refuse_feature(metric, i, feature, materials[first + m],
                                   means.subspan((first + m) * windows, windows));
                }
                double slopes = 0;
                for (std::size_t row = 1; row < rows; ++row) {
                    slopes += std::abs(at_means[row * count + i] - feature) / kStep;
                }
                const double error =
                    kMeanError * slopes + kFeatureError * std::max(1.0, std::abs(feature));
                squares += error * error;
                result.features.push_back(feature);
            }
            const double error = std::sqrt(squares);
            result.errors.push_back(std::isnan(error) ? HUGE_VAL : error);
        }
    }
    return result;
}

/// The distance of materials a and b, of [material][feature].
double distance_of(const Metric& metric, std::span<const double> features, std::size_t a,
                   std::size_t b, std::span<const std::string> materials) {
    const std::size_t count = metric.header.features;
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const double d = features[a * count + i] - features[b * count + i];
        sum += d * d;
    }
    const double distance = std::sqrt(sum);
    if (!std::isfinite(distance)) {
        throw InputError(fmt::format(
            "{}: the distance of materials \"{}\" and \"{}\" is {}: beyond the range of float64",
            metric.file, materials[a], materials[b], distance));
    }
    return distance;
}

}  // namespace

WindowTotals::WindowTotals(const Metric& metric, std::uint32_t materials)
    : windows_(metric.header.windows.size()), totals_(windows_ * materials) {}

std::uint64_t WindowTotals::bytes(const Metric& metric, std::uint32_t materials) {
    return metric.header.windows.size() * materials * sizeof(Total);
}

void WindowTotals::add(std::size_t material, std::size_t window, const WindowSum& sum) {
    auto& total = totals_[material * windows_ + window];
    for (std::size_t c = 0; c < sum.samples.size(); ++c) {
        add_compensated(sum.samples[c], total.sum.samples[c], total.lost.samples[c]);
        add_compensated(sum.weights[c], total.sum.weights[c], total.lost.weights[c]);
    }
}

std::vector<WindowMean> WindowTotals::means() const {
    std::vector<WindowMean> means(totals_.size());
    std::ranges::transform(totals_, means.begin(), [](const Total& total) {
        WindowMean mean = {};
        for (std::size_t c = 0; c < mean.size(); ++c) {
            const double weight = total.sum.weights[c];
            mean[c] = weight > 0 ? total.sum.samples[c] / weight : 0;
        }
        return mean;
    });
    return means;
}

std::size_t most_rows(const Metric& metric) {
    return kAtATime * rows_of(metric);
}

Features twin_features(const Metric& metric, Threads threads) {
    return [&metric, threads](std::span<const WindowMean> means, std::span<double> features) {
        const std::size_t windows = metric.header.windows.size();
        const std::size_t count = metric.header.features;
        const std::size_t rows = means.size() / windows;
        const auto evaluate_row = [&](std::size_t row) {
            metric.twin.features(metric.parameters, means.subspan(row * windows, windows),
                                 features.subspan(row * count, count));
        };
        if (threads == Threads::all) {
            tbb::parallel_for(std::size_t{0}, rows, evaluate_row);
            return;
        }
        for (std::size_t row = 0; row < rows; ++row) {
            evaluate_row(row);
        }
    };
}

MetricDistances summary_distances(const Metric& metric, std::vector<WindowMean> means,
                                  const Features& features,
                                  std::span<const std::string> materials) {
    constexpr double kRounding = 1e-14;  // of the root of the sum of 64 squares, relative
    const auto [values, errors] = evaluate(metric, means, features, materials);
    MetricDistances result;
    for (std::size_t a = 0; a < materials.size(); ++a) {
        for (std::size_t b = a + 1; b < materials.size(); ++b) {
            const double distance = distance_of(metric, values, a, b, materials);
            result.values.push_back(distance);
            result.bounds.push_back(errors[a] + errors[b] + kRounding * distance);
        }
    }
    result.means = std::move(means);
    return result;
}

std::vector<double> summary_values(const Metric& metric, std::span<const WindowMean> means,
                                   const Features& features,
                                   std::span<const std::string> materials) {
    const std::size_t windows = metric.header.windows.size();
    const std::size_t count = metric.header.features;
    std::vector<double> found(materials.size() * count);
    features(means, found);
    for (std::size_t i = 0; i < found.size(); ++i) {
        if (!std::isfinite(found[i])) {
            refuse_feature(metric, i % count, found[i], materials[i / count],
                           means.subspan(i / count * windows, windows));
        }
    }
    std::vector<double> distances;
    for (std::size_t a = 0; a < materials.size(); ++a) {
        for (std::size_t b = a + 1; b < materials.size(); ++b) {
            distances.push_back(distance_of(metric, found, a, b, materials));
        }
    }
    return distances;
}

std::optional<std::string> empty_window(const Metric& metric, const Grid& grid) {
    // Voxels from all over the domain first: on a grid like MERL's the first block shows all
    // windows.
    constexpr std::uint64_t kStride = 100'003;  // a prime, so that every voxel has its turn
    const Domain domain(grid);
    const std::uint64_t count = grid.voxels();
    const std::uint64_t stride = count % kStride == 0 ? 1 : kStride;
    std::vector<bool> is_empty(metric.header.windows.size(), true);
    std::vector<Voxel> voxels(kBlockVoxels);
    BlockWeights weights;
    std::uint64_t at = 0;
    for (std::uint64_t first = 0; first < count; first += kBlockVoxels) {
        const std::uint64_t size = std::min<std::uint64_t>(kBlockVoxels, count - first);
        for (std::uint64_t k = 0; k < size; ++k) {
            voxels[k] = domain.voxel(at);
            at = (at + stride) % count;
        }
        for (std::uint32_t w = 0; w < is_empty.size(); ++w) {
            if (is_empty[w]) {
                metric.twin.window(metric.parameters, std::span<const Voxel, kBlockVoxels>(voxels),
                                   w, weights);
                for (std::uint64_t k = 0; k < size; ++k) {
                    if (voxels[k].above_horizon() && weights[k] > 0) {
                        is_empty[w] = false;
                    }
                }
            }
        }
        if (std::ranges::find(is_empty, true) == is_empty.end()) {
            return std::nullopt;
        }
    }
    const auto window = std::ranges::find(is_empty, true) - is_empty.begin();
    return metric.header.windows[static_cast<std::size_t>(window)].name;
}

void refuse_empty_window(const Metric& metric, const std::string& window, const Grid& grid) {
    throw InputError(
        fmt::format("{}: its window \"{}\" has no voxel above the horizon on the grid {}",
                    metric.name, window, grid.text()));
}

}  // namespace merl::engine
