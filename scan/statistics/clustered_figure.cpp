#include "scan/statistics/clustered_figure.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

namespace merl::scan {
namespace {

double standard_error(const ClusteredFigure& figure, double clusters) {
    double squares = 0;
    for (const double influence : figure.influences) {
        squares += influence * influence;
    }
    return std::sqrt(clusters / (clusters - 1) * squares);
}

}  // namespace

ClusteredFigure difference(const ClusteredFigure& first, const ClusteredFigure& second) {
    ClusteredFigure result{first.value - second.value, first.influences};
    for (std::size_t i = 0; i < result.influences.size(); ++i) {
        result.influences[i] -= second.influences[i];
    }
    return result;
}

double effective_clusters(std::span<const std::uint64_t> sizes) {
    double sum = 0;
    double squares = 0;
    for (const auto size : sizes) {
        const auto n = static_cast<double>(size);
        sum += n;
        squares += n * n;
    }
    return squares == 0 ? 0 : sum * sum / squares;
}

Estimate estimated(const ClusteredFigure& figure, double clusters, const std::string& reason) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    if (!reason.empty()) {
        return {figure.value, {none, none}, reason};
    }
    if (!std::isfinite(figure.value)) {
        return {figure.value, {none, none}, "no finite value"};
    }
    const double error = standard_error(figure, clusters);
    // Less than this is rounding.
    if (!(error > 1e-13 * std::max(1.0, std::abs(figure.value)))) {
        return {figure.value, {none, none}, all_alike};
    }
    const boost::math::students_t_distribution<double> t(clusters - 1);
    const double half = boost::math::quantile(t, 0.975) * error;
    return {figure.value, {figure.value - half, figure.value + half}};
}

double p_of_zero(const ClusteredFigure& figure, double clusters, const std::string& reason) {
    if (!estimated(figure, clusters, reason).too_few.empty()) {
        return std::numeric_limits<double>::quiet_NaN();
    }
    const boost::math::students_t_distribution<double> t(clusters - 1);
    return 2 * boost::math::cdf(boost::math::complement(
                   t, std::abs(figure.value) / standard_error(figure, clusters)));
}

}  // namespace merl::scan
