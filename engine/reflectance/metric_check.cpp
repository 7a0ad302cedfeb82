#include "engine/reflectance/metric_check.h"

#include <fmt/format.h>

#include <numbers>
#include <vector>

namespace merl::reflectance {
namespace {

std::string numbers(const std::array<float, 3>& v) {
    return fmt::format("({:g}, {:g}, {:g})", v[0], v[1], v[2]);
}

/// "chrome", whose sample there is (1, 2, 3).
std::string sample_text(const Database& database, std::uint32_t material, std::uint64_t index) {
    std::vector<double> sample(3);
    database.read(material, {index, index + 1}, sample);
    return fmt::format("\"{}\" ({:g}, {:g}, {:g})", database.materials()[material], sample[0],
                       sample[1], sample[2]);
}

std::string what_is_wrong(const Finding& f, const Metric& metric) {
    const auto arguments = metric.has_bound() ? fmt::format("{:g}", f.a[0] - f.b[0])
                                              : fmt::format("{}, {}", numbers(f.a), numbers(f.b));
    const auto material = f.kind == Finding::first ? f.a : f.b;
    switch (f.kind) {
        case Finding::weight:
            return "weight() is negative, NaN or infinite";
        case Finding::first:
        case Finding::second:
            return fmt::format(
                "transform() of the {} material gives {} (times the weight)",
                f.kind == Finding::first ? "first" : "second",
                metric.has_bound() ? fmt::format("{:g}", material[0]) : numbers(material));
        case Finding::not_finite:
        case Finding::negative:
            return fmt::format("difference({}) is {:g}: expected zero or more", arguments,
                               f.kind == Finding::negative && f.there >= 0 ? f.back : f.there);
        case Finding::asymmetric:
            return fmt::format(
                "difference({}) is {:g} one way and {:g} the other: expected the same", arguments,
                f.there, f.back);
        case Finding::not_degree:
            return fmt::format(
                "difference({}) is {:g}: a metric of degree {} promises |d|^{} "
                "(leave the degree out for another difference)",
                arguments, f.there, metric.header.degree_text, metric.header.degree_text);
        case Finding::endless_loop:
            return "its loops do not come to an end in time";
        case Finding::fine:
            break;
    }
    return "something is wrong";
}

}  // namespace

std::string explain(const Finding& finding, const Metric& metric, const Database& database,
                    std::uint64_t file_index) {
    const Voxel v = Domain(database.grid()).voxel(file_index);
    constexpr double kDegrees = 180 / std::numbers::pi;
    return fmt::format(
        "{}: {}; at voxel {} (theta_h {:.3f}, theta_d {:.3f}, phi_d {:.3f} degrees; cos_theta_i "
        "{:.4g}, cos_theta_o {:.4g}, s_merl {:.4g}), materials {} and {}",
        metric.file, what_is_wrong(finding, metric), file_index, v.theta_h * kDegrees,
        v.theta_d * kDegrees, v.phi_d * kDegrees, v.cos_theta_i, v.cos_theta_o, v.s_merl,
        sample_text(database, finding.first_material, file_index),
        sample_text(database, finding.second_material, file_index));
}

}  // namespace merl::reflectance
