#include "scan/pairs/pairs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

namespace merl::scan {
namespace {

void validate_names(std::span<const std::string> names) {
    if (names.size() < 2 || names.size() > max_materials) {
        throw std::invalid_argument(
            fmt::format("{} materials: expected 2 to {}", names.size(), max_materials));
    }
    const auto out_of_order = std::ranges::adjacent_find(names, std::greater_equal<>());
    if (out_of_order != names.end()) {
        throw std::invalid_argument(fmt::format(
            "material '{}' is followed by '{}': expected distinct names in bytewise order",
            *out_of_order, *(out_of_order + 1)));
    }
}

void validate_values(std::span<const double> values, std::string_view metric,
                     std::span<const std::string> names) {
    const std::uint64_t expected = pair_count(names.size());
    if (values.size() != expected) {
        throw std::invalid_argument(
            fmt::format("{} distances under {}: expected {} for {} materials", values.size(),
                        metric, expected, names.size()));
    }
    const auto bad = std::ranges::find_if_not(
        values, [](double value) { return std::isfinite(value) && value >= 0; });
    if (bad != values.end()) {
        const Pair pair = pair_at(static_cast<std::uint32_t>(bad - values.begin()),
                                  static_cast<std::uint32_t>(names.size()));
        throw std::invalid_argument(fmt::format(
            "the distance of '{}' and '{}' under {} is {}: expected a finite number, zero or more",
            names[pair.first], names[pair.second], metric, *bad));
    }
}

void validate_bounds(std::span<const double> bounds, std::string_view metric,
                     std::uint64_t expected) {
    if (!bounds.empty() && bounds.size() != expected) {
        throw std::invalid_argument(fmt::format("{} bounds under {}: expected none or {}",
                                                bounds.size(), metric, expected));
    }
    const auto bad = std::ranges::find_if_not(bounds, [](double bound) { return bound >= 0; });
    if (bad != bounds.end()) {
        throw std::invalid_argument(
            fmt::format("a bound under {} is {}: expected zero or more", metric, *bad));
    }
}

}  // namespace

Pair pair_at(std::uint32_t index, std::uint32_t materials) {
    // Counted from the last pair backwards, the rows of the triangle hold 1, 2, 3 ... pairs. The
    // argument of the square root stays below 2^35, where float64 cannot round across an integer.
    const std::uint64_t from_end = pair_count(materials) - 1 - index;
    const auto row =
        static_cast<std::uint64_t>((std::sqrt(static_cast<double>(8 * from_end + 1)) - 1) / 2);
    const std::uint64_t in_row = from_end - row * (row + 1) / 2;
    return {static_cast<std::uint32_t>(materials - 2 - row),
            static_cast<std::uint32_t>(materials - 1 - in_row)};
}

void DistancesView::validate() const {
    validate_names(names);
    validate_values(first, first_metric, names);
    validate_values(second, second_metric, names);
    validate_bounds(first_bounds, first_metric, first.size());
    validate_bounds(second_bounds, second_metric, second.size());
}

}  // namespace merl::scan
