#include "engine/metric/check/finding.h"

#include <fmt/format.h>

#include <numbers>
#include <vector>

namespace merl::engine {
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

/// The bits of guard_faults in shaders/framework/guards.glsl.
constexpr std::uint32_t kAllFaults = 31;
std::string faults(std::uint32_t bits) {
    constexpr std::array kFaults = {
        "has a loop that does not end (docs/metrics.md: the iterations there are)",
        "has an index beyond its array",
        "divides an integer by zero, or takes the remainder of a negative one",
        "shifts by more than 31 bits",
        "makes an integer of a number that is none or too large (a conversion)"};
    std::string text;
    for (std::size_t i = 0; i < kFaults.size(); ++i) {
        if ((bits >> i & 1U) != 0) {
            text += fmt::format("{}{}", text.empty() ? "" : ", or ", kFaults[i]);
        }
    }
    return text;
}

std::string what_is_wrong(const Finding& f, const Metric& metric) {
    const auto arguments = metric.has_degree() ? fmt::format("{:g}", f.a[0] - f.b[0])
                                               : fmt::format("{}, {}", numbers(f.a), numbers(f.b));
    const auto material = f.kind == Finding::first ? f.a : f.b;
    switch (f.kind) {
        case Finding::weight:
            return fmt::format("weight() is negative, NaN or infinite, or {}", faults(kAllFaults));
        case Finding::first:
        case Finding::second:
            return fmt::format(
                "transform() of the {} material gives {} (times the weight), or {}",
                f.kind == Finding::first ? "first" : "second",
                metric.has_degree() ? fmt::format("{:g}", material[0]) : numbers(material),
                faults(kAllFaults));
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
        case Finding::fault:
            return fmt::format("difference({}) {}", arguments,
                               f.there == 0 ? "is not a number that is zero or more, or not the "
                                              "same one way and the other"
                                            : faults(static_cast<std::uint32_t>(f.there)));
        case Finding::fine:
            break;
    }
    return "something is wrong";
}

/// Where a voxel is.
std::string place(const Database& database, std::uint64_t file_index) {
    const Voxel v = Domain(database.grid()).voxel(file_index);
    constexpr double kDegrees = 180 / std::numbers::pi;
    return fmt::format(
        "at voxel {} (theta_h {:.3f}, theta_d {:.3f}, phi_d {:.3f} degrees; cos_theta_i "
        "{:.4g}, cos_theta_o {:.4g}, s_merl {:.4g})",
        file_index, v.theta_h * kDegrees, v.theta_d * kDegrees, v.phi_d * kDegrees, v.cos_theta_i,
        v.cos_theta_o, v.s_merl);
}

}  // namespace

std::string explain(const Finding& finding, const Metric& metric, const Database& database,
                    std::uint64_t file_index) {
    if (finding.first_material == Finding::kNone) {
        return fmt::format("{}: {}", metric.file, what_is_wrong(finding, metric));
    }
    return fmt::format("{}: {}; {}, materials {} and {}", metric.file,
                       what_is_wrong(finding, metric), place(database, file_index),
                       sample_text(database, finding.first_material, file_index),
                       sample_text(database, finding.second_material, file_index));
}

std::string explain_window(const Metric& metric, std::size_t window, float weight,
                           const Database& database, std::uint64_t file_index) {
    return fmt::format(
        "{}: window({}, v) is {:g}: expected a finite number, zero or more, on a path without "
        "what {}; {}",
        metric.file, metric.header.windows[window].name, weight, faults(kAllFaults),
        place(database, file_index));
}

std::string warn_of_same(const Finding& finding, const Metric& metric, const Database& database,
                         std::uint64_t file_index) {
    return fmt::format(
        "{}: difference(a, a) is {:g}, not 0: a material differs from itself; {}, "
        "material {}",
        metric.name, finding.same_difference, place(database, file_index),
        sample_text(database, finding.same_material, file_index));
}

}  // namespace merl::engine
