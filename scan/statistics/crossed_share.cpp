#include "scan/statistics/crossed_share.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

namespace merl::scan {
namespace {

double logit(double share) {
    return std::log(share / (1 - share));
}

double from_logit(double x) {
    return 1 / (1 + std::exp(-x));
}

/// With half a value added to either side, which has a logarithm also where a side has none (Cox
/// 1970, the empirical logistic transform).
double empirical_logit(double sum, double count) {
    return std::log((sum + 0.5) / (count - sum + 0.5));
}

}  // namespace

CrossedShare::CrossedShare(std::span<const CrossedValue> values, std::uint32_t judges,
                           std::span<const std::vector<std::uint32_t>> materials,
                           std::uint32_t material_count) {
    std::vector<double> judge_sums(judges);
    std::vector<double> judge_counts(judges);
    std::vector<double> material_sums(material_count);
    std::vector<double> material_counts(material_count);
    for (const auto& [judge, configuration, value] : values) {
        sum_ += value;
        count_ += 1;
        judge_sums[judge] += value;
        judge_counts[judge] += 1;
        for (const auto material : materials[configuration]) {
            material_sums[material] += value;
            material_counts[material] += 1;
        }
    }
    judges_ = leave_out(judge_sums, judge_counts);
    materials_ = leave_out(material_sums, material_counts);
}

CrossedShare::Clusters CrossedShare::leave_out(std::span<const double> sums,
                                               std::span<const double> counts) const {
    Clusters clusters;
    for (std::size_t i = 0; i < sums.size(); ++i) {
        if (counts[i] == 0) {
            continue;
        }
        clusters.count += 1;
        const double left = count_ - counts[i];
        if (left == 0) {
            clusters.most_change = std::numeric_limits<double>::infinity();
            continue;
        }
        const double change = empirical_logit(sum_ - sums[i], left) - empirical_logit(sum_, count_);
        clusters.variance += change * change;
        clusters.most_change =
            std::max(clusters.most_change, std::abs((sum_ - sums[i]) / left - sum_ / count_));
    }
    clusters.variance *= (clusters.count - 1) / clusters.count;
    return clusters;
}

Estimate CrossedShare::estimate(const std::string& reason) const {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    const double mean = sum_ / count_;
    if (!reason.empty()) {
        return {mean, {none, none}, reason};
    }
    if (std::isinf(judges_.most_change) || std::isinf(materials_.most_change)) {
        return {mean, {none, none}, "one judge or material has all votes"};
    }
    // Less than this is rounding.
    if (std::max(judges_.most_change, materials_.most_change) < 1e-12) {
        return {mean, {none, none}, "no judge or material makes a difference"};
    }
    const double half = half_width(0.05);
    return {mean, {from_logit(logit(mean) - half), from_logit(logit(mean) + half)}};
}

double CrossedShare::half_width(double p) const {
    const auto part = [p](const Clusters& clusters) {
        const boost::math::students_t_distribution<double> t(clusters.count - 1);
        const double quantile = boost::math::quantile(boost::math::complement(t, p / 2));
        return quantile * quantile * clusters.variance;
    };
    return std::sqrt(part(judges_) + part(materials_));
}

double CrossedShare::p_value(double mean) const {
    const double distance = std::abs(logit(sum_ / count_) - logit(mean));
    double low = 0;
    double high = 1;
    for (int step = 0; step < 100; ++step) {
        const double p = (low + high) / 2;
        (half_width(p) > distance ? low : high) = p;
    }
    return high;
}

}  // namespace merl::scan
