#include "engine/distance/parts/summary.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/error.h"

namespace merl::engine {
namespace {

/// What a mean is off by, relative to itself (docs/numerics.md).
constexpr double kMeanError = 1e-14;

/// The bounds on errors are computed in float64 too.
constexpr double kSlack = 1.001;

// The features of a user's file are evaluated some times, to see what moves them: at the means;
// with each number of them moved, up and down; and at places in a row, from one to the next of
// which all numbers are moved, each by another share of kPlace.
constexpr double kStep = 0x1p-20;
constexpr double kPlace = 0x1p-24;
constexpr std::size_t kPlaces = 16;

/// Taken of a feature's noise, which is a standard deviation: the sum of ten errors, each of them
/// uniform, is within.
constexpr double kOfNoise = 6;

/// What a feature is off by besides, relative to the larger of it and 1: logarithms of devices, all
/// on one side.
constexpr double kFeatureError = 2e-14;

/// Materials whose features are evaluated at a time, each in all its rows.
constexpr std::size_t kAtATime = 16;

/// Rows of means of a material.
std::size_t rows_of(const Metric& metric) {
    return 1 + 6 * metric.header.windows.size() + kPlaces;
}

void add_compensated(double term, double& sum, double& lost) {
    const double more = lost + term;
    const double both = sum + more;
    lost = more - (both - sum);
    sum = both;
}

/// The features of each material that is in a pair, and how far all of them together can be from
/// exact ones.
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

void require_finite(const Metric& metric, std::span<const double> features,
                    const std::string& material, std::span<const WindowMean> means) {
    for (std::size_t i = 0; i < features.size(); ++i) {
        if (!std::isfinite(features[i])) {
            refuse_feature(metric, i, features[i], material, means);
        }
    }
}

double norm(std::span<const double> errors) {
    double squares = 0;
    for (const double error : errors) {
        squares += error * error;
    }
    return std::isnan(squares) ? HUGE_VAL : kSlack * std::sqrt(squares);
}

/// By the metric's twin, with bounds.
Evaluated evaluate(const Metric& metric, std::span<const WindowMean> means, const PairList& pairs,
                   std::span<const std::string> materials) {
    const std::size_t windows = metric.header.windows.size();
    const std::size_t count = metric.header.features;
    Evaluated result = {.features = std::vector<double>(materials.size() * count),
                        .errors = std::vector<double>(materials.size())};
    const auto paired = pairs.paired();
    tbb::parallel_for(std::size_t{0}, paired.size(), [&](std::size_t i) {
        const std::size_t m = paired[i];
        const auto of_material = means.subspan(m * windows, windows);
        metric.twin.features(metric.parameters, of_material,
                             std::span(result.features).subspan(m * count, count));
        std::vector<double> errors(count);
        metric.twin.errors(metric.parameters, of_material, kMeanError, errors);
        result.errors[m] = norm(errors);
    });
    for (const std::size_t m : paired) {
        require_finite(metric, std::span(result.features).subspan(m * count, count), materials[m],
                       means.subspan(m * windows, windows));
    }
    return result;
}

/// The rows of one material, [row][window].
void append_rows(std::span<const WindowMean> means, std::vector<WindowMean>& rows) {
    const auto append = [&](const auto& moved) {
        for (std::size_t w = 0; w < means.size(); ++w) {
            auto& mean = rows.emplace_back(means[w]);
            for (std::size_t c = 0; c < mean.size(); ++c) {
                mean[c] *= 1 + moved(w * mean.size() + c);
            }
        }
    };
    append([](std::size_t) { return 0.0; });
    for (std::size_t number = 0; number < 3 * means.size(); ++number) {
        for (const double step : {kStep, -kStep}) {
            append([&](std::size_t i) { return i == number ? step : 0.0; });
        }
    }
    for (std::size_t place = 1; place <= kPlaces; ++place) {
        append([&](std::size_t i) {
            const double golden = 0.618034 * static_cast<double>(i);
            const double share = 0.5 + golden - std::floor(golden);
            return kPlace * static_cast<double>(place) * (i % 2 == 0 ? share : -share);
        });
    }
}

/// The standard deviation of what rounding adds to a smooth function, from its values at places in
/// a row: there is next to nothing else in their fourth differences (Moré and Wild, "Estimating
/// Computational Noise", 2011). The median of these, so that a corner between two places does not
/// count; at the means themselves it is before the first.
double noise_of(std::span<const double, kPlaces> values) {
    std::array<double, kPlaces> differences = {};
    std::ranges::copy(values, differences.begin());
    std::size_t size = kPlaces;
    for (int order = 0; order < 4; ++order) {
        --size;
        for (std::size_t i = 0; i < size; ++i) {
            differences[i] = differences[i + 1] - differences[i];
        }
    }
    for (std::size_t i = 0; i < size; ++i) {
        // NaN where a value is none has no place in an order.
        differences[i] = std::isnan(differences[i]) ? HUGE_VAL : std::abs(differences[i]);
    }
    double* const middle = differences.data() + size / 2;
    std::nth_element(differences.data(), middle, differences.data() + size);
    constexpr double kMedian = 0.6745;      // of |x|, x normal with a standard deviation of 1
    const double of_one = std::sqrt(70.0);  // 1, 4, 6, 4 and 1 of them
    return *middle / (kMedian * of_one);
}

/// By what evaluates a user's file, with estimates in the place of bounds.
Evaluated estimate(const Metric& metric, std::span<const WindowMean> means,
                   const Features& features, const PairList& pairs,
                   std::span<const std::string> materials) {
    const std::size_t windows = metric.header.windows.size();
    const std::size_t count = metric.header.features;
    const std::size_t rows = rows_of(metric);
    Evaluated result = {.features = std::vector<double>(materials.size() * count),
                        .errors = std::vector<double>(materials.size())};
    const auto paired = pairs.paired();
    std::vector<WindowMean> moved;
    std::vector<double> found;
    std::vector<double> errors(count);
    for (std::size_t first = 0; first < paired.size(); first += kAtATime) {
        const std::size_t size = std::min(kAtATime, paired.size() - first);
        moved.clear();
        for (std::size_t m = 0; m < size; ++m) {
            append_rows(means.subspan(paired[first + m] * windows, windows), moved);
        }
        found.resize(size * rows * count);
        features(moved, found);
        for (std::size_t m = 0; m < size; ++m) {
            const auto at = [&](std::size_t row, std::size_t i) {
                return found[(m * rows + row) * count + i];
            };
            const auto at_means = std::span(found).subspan(m * rows * count, count);
            const std::size_t material = paired[first + m];
            require_finite(metric, at_means, materials[material],
                           means.subspan(material * windows, windows));
            for (std::size_t i = 0; i < count; ++i) {
                double slopes = 0;
                for (std::size_t number = 0; number < 3 * windows; ++number) {
                    // Where there is a corner, as in min(R, G, B) of grey, the steeper side.
                    slopes += std::max(std::abs(at(1 + 2 * number, i) - at_means[i]),
                                       std::abs(at(2 + 2 * number, i) - at_means[i])) /
                              kStep;
                }
                std::array<double, kPlaces> values = {};
                for (std::size_t place = 0; place < kPlaces; ++place) {
                    values[place] = at(rows - kPlaces + place, i);
                }
                errors[i] = kMeanError * slopes + kOfNoise * noise_of(values) +
                            kFeatureError * std::max(1.0, std::abs(at_means[i]));
            }
            std::ranges::copy(
                at_means, result.features.begin() + static_cast<std::ptrdiff_t>(material * count));
            result.errors[material] = norm(errors);
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
            R"({}: the distance of materials "{}" and "{}" is {}: beyond the range of float64)",
            metric.file, materials[a], materials[b], distance));
    }
    return distance;
}

MetricDistances distances_between(const Metric& metric, const Evaluated& evaluated,
                                  std::vector<WindowMean> means, const PairList& pairs,
                                  std::span<const std::string> materials) {
    constexpr double kRounding = 1e-14;  // of the root of the sum of 64 squares, relative
    MetricDistances result;
    pairs.each([&](std::size_t /*place*/, std::uint32_t a, std::uint32_t b) {
        const double distance = distance_of(metric, evaluated.features, a, b, materials);
        result.values.push_back(distance);
        result.bounds.push_back(evaluated.errors[a] + evaluated.errors[b] + kRounding * distance);
    });
    result.means = std::move(means);
    return result;
}

/// Throws InputError unless the weights of a window add up to nothing, where nothing was measured,
/// or to something in whose products with samples all digits are left.
void require_weight(const Metric& metric, std::size_t window, double weight) {
    constexpr double kLeast = 1e-200;
    constexpr double kMost = 1e200;
    if (weight != 0 && !(weight >= kLeast && weight <= kMost)) {
        throw InputError(
            fmt::format(R"({}: the weights of its window "{}" add up to {:g}: expected {:g} to )"
                        "{:g}; a factor of all weights changes no mean",
                        metric.file, metric.header.windows[window].name, weight, kLeast, kMost));
    }
}

}  // namespace

WindowTotals::WindowTotals(const Metric& metric, std::uint32_t materials)
    : metric_(&metric), windows_(metric.header.windows.size()), totals_(windows_ * materials) {}

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
    for (std::size_t at = 0; at < means.size(); ++at) {
        const auto& sum = totals_[at].sum;
        for (std::size_t c = 0; c < sum.weights.size(); ++c) {
            require_weight(*metric_, at % windows_, sum.weights[c]);
            means[at][c] = sum.weights[c] > 0 ? sum.samples[c] / sum.weights[c] : 0;
        }
    }
    return means;
}

std::size_t most_rows(const Metric& metric) {
    return kAtATime * rows_of(metric);
}

Features twin_features(const Metric& metric) {
    return [&metric](std::span<const WindowMean> means, std::span<double> features) {
        const std::size_t windows = metric.header.windows.size();
        const std::size_t count = metric.header.features;
        for (std::size_t row = 0; row < means.size() / windows; ++row) {
            metric.twin.features(metric.parameters, means.subspan(row * windows, windows),
                                 features.subspan(row * count, count));
        }
    };
}

MetricDistances summary_distances(const Metric& metric, std::vector<WindowMean> means,
                                  const PairList& pairs, std::span<const std::string> materials) {
    const auto evaluated = evaluate(metric, means, pairs, materials);
    return distances_between(metric, evaluated, std::move(means), pairs, materials);
}

MetricDistances estimated_summary_distances(const Metric& metric, std::vector<WindowMean> means,
                                            const Features& features, const PairList& pairs,
                                            std::span<const std::string> materials) {
    const auto evaluated = estimate(metric, means, features, pairs, materials);
    return distances_between(metric, evaluated, std::move(means), pairs, materials);
}

std::vector<double> summary_values(const Metric& metric, std::span<const WindowMean> means,
                                   const Features& features,
                                   std::span<const std::string> materials) {
    const std::size_t windows = metric.header.windows.size();
    const std::size_t count = metric.header.features;
    std::vector<double> found(materials.size() * count);
    features(means, found);
    for (std::size_t m = 0; m < materials.size(); ++m) {
        require_finite(metric, std::span(found).subspan(m * count, count), materials[m],
                       means.subspan(m * windows, windows));
    }
    std::vector<double> distances;
    PairList(static_cast<std::uint32_t>(materials.size()))
        .each([&](std::size_t /*place*/, std::uint32_t a, std::uint32_t b) {
            distances.push_back(distance_of(metric, found, a, b, materials));
        });
    return distances;
}

}  // namespace merl::engine
