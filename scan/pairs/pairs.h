#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace merl::scan {

/// Largest number of materials: it keeps every pair index, and twice that, within 32 bits.
inline constexpr std::uint32_t max_materials = 65536;

/// Two materials, as indices into the sorted names; `first` < `second`.
struct Pair {
    std::uint32_t first;
    std::uint32_t second;
    bool operator==(const Pair&) const = default;
};

/// Number of pairs of `materials` things: P = N(N-1)/2.
constexpr std::uint64_t pair_count(std::uint64_t materials) {
    return materials < 2 ? 0 : materials * (materials - 1) / 2;
}

/// Number of configurations, that is pairs of `pairs` pairs: P(P-1)/2.
/// Exact for every P that `max_materials` allows.
constexpr std::uint64_t configuration_count(std::uint64_t pairs) {
    return pair_count(pairs);
}

/// Index of a pair in pair order (0,1), (0,2) ... (0,N-1), (1,2) ... Requires
/// first < second < materials <= max_materials. O(1).
constexpr std::uint32_t pair_index(Pair pair, std::uint32_t materials) {
    const std::uint64_t row = pair.first;
    const std::uint64_t before_row = row * (2 * std::uint64_t{materials} - row - 1) / 2;
    return static_cast<std::uint32_t>(before_row + pair.second - pair.first - 1);
}

/// The pair at an index; the inverse of `pair_index`. Requires 2 <= materials <= max_materials and
/// index < pair_count(materials). O(1).
Pair pair_at(std::uint32_t index, std::uint32_t materials);

/// The distances of two metrics where somebody else holds them: as Distances has them. There may be
/// fifty million pairs under a dozen metrics, of which every two are compared.
struct DistancesView {
    std::span<const std::string> names;
    std::string_view first_metric;
    std::string_view second_metric;
    std::span<const double> first;
    std::span<const double> second;
    std::span<const double> first_bounds = {};
    std::span<const double> second_bounds = {};
    bool first_is_final = false;
    bool second_is_final = false;

    std::uint32_t materials() const { return static_cast<std::uint32_t>(names.size()); }
    std::uint32_t pairs() const { return static_cast<std::uint32_t>(first.size()); }
    std::uint64_t configurations() const { return configuration_count(first.size()); }

    /// As Distances::validate().
    void validate() const;
};

/// What the scan works on: the distance of every pair of materials under two metrics. Where the
/// numbers come from does not matter.
///
/// The functions that count, list, search, select and write validate it first, which costs nothing
/// beside their own work.
struct Distances {
    std::vector<std::string> names;  ///< N materials, ascending bytewise: ties are broken by it
    std::string first_metric;        ///< D1; orients a configuration
    std::string second_metric;       ///< D2
    std::vector<double> first;       ///< D1 of every pair, in pair order
    std::vector<double> second;      ///< D2 of every pair, in pair order

    /// How far each distance can be from the exact one; 0 for an exact one. Empty: all are exact.
    /// Only `to_refine`, `bound_disagreements` and `write_pairs` look at them.
    std::vector<double> first_bounds = {};
    std::vector<double> second_bounds = {};

    /// Whether distances with a bound are float64 all the same: nothing makes them more exact, and
    /// those that are equal tie.
    bool first_is_final = false;
    bool second_is_final = false;

    std::uint32_t materials() const { return static_cast<std::uint32_t>(names.size()); }
    std::uint32_t pairs() const { return static_cast<std::uint32_t>(first.size()); }
    std::uint64_t configurations() const { return configuration_count(first.size()); }

    /// Throws std::invalid_argument, naming what was found and what was expected, unless there are
    /// 2 to max_materials names in strictly ascending order, one distance per pair in both metrics,
    /// every distance is finite and not negative, and bounds are none or one per pair, zero or
    /// more. O(P).
    void validate() const { DistancesView(*this).validate(); }

    operator DistancesView() const {
        return {.names = names,
                .first_metric = first_metric,
                .second_metric = second_metric,
                .first = first,
                .second = second,
                .first_bounds = first_bounds,
                .second_bounds = second_bounds,
                .first_is_final = first_is_final,
                .second_is_final = second_is_final};
    }
};

}  // namespace merl::scan
