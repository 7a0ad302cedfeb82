#include "scan/statistics/crossed_bootstrap.h"

#include <cmath>

namespace merl::scan {
namespace {

/// The change of the mean from drawing the clusters again, which have these influences. With the
/// factor the variance is that of independent clusters, and not (n - 1) / n of it.
double change(const std::vector<double>& influences, const std::vector<std::uint32_t>& times) {
    const auto clusters = static_cast<double>(influences.size());
    if (clusters < 2) {
        return 0;
    }
    double sum = 0;
    for (std::size_t i = 0; i < influences.size(); ++i) {
        sum += (static_cast<double>(times[i]) - 1) * influences[i];
    }
    return sum * std::sqrt(clusters / (clusters - 1));
}

}  // namespace

std::vector<double> crossed_bootstrap(std::span<const CrossedValue> values, std::uint32_t judges,
                                      std::span<const std::vector<std::uint32_t>> materials,
                                      std::uint32_t material_count, const BootstrapOptions& options,
                                      const std::function<void(double share)>& progress) {
    if (values.empty()) {
        return {};
    }
    double mean = 0;
    for (const auto& value : values) {
        mean += value.value / static_cast<double>(values.size());
    }
    std::vector<double> of_judges(judges);
    std::vector<double> of_materials(material_count);
    for (const auto& value : values) {
        const double influence = (value.value - mean) / static_cast<double>(values.size());
        of_judges[value.judge] += influence;
        for (const auto material : materials[value.configuration]) {
            of_materials[material] += influence;
        }
    }
    std::vector<double> means(options.replicates);
    for (std::uint32_t i = 0; i < options.replicates; ++i) {
        // Two samples of one seed are independent by their numbers.
        means[i] = mean + change(of_judges, resample(options.seed, 2 * i, judges)) +
                   change(of_materials, resample(options.seed, 2 * i + 1, material_count));
        if (progress && i % replicates_per_update == 0) {
            progress(static_cast<double>(i) / options.replicates);
        }
    }
    return means;
}

}  // namespace merl::scan
