#include "app/output/json.h"

#include <fmt/format.h>

#include <cmath>

#include "app/pipeline/version.h"
#include "engine/base/text.h"
#include "scan/io/json_format.h"
#include "scan/pairs/pairs.h"

namespace merl::app {
namespace {

scan::Pair pair_of(const std::vector<std::string>& names, std::uint32_t index) {
    return scan::pair_at(index, static_cast<std::uint32_t>(names.size()));
}

}  // namespace

std::string counted(std::uint64_t number, std::string_view noun) {
    return fmt::format("{} {}{}", fmt::group_digits(number), noun, number == 1 ? "" : "s");
}

std::string pair_text(const std::vector<std::string>& names, std::uint32_t index) {
    const auto pair = pair_of(names, index);
    return fmt::format("{} | {}", names[pair.first], names[pair.second]);
}

nlohmann::ordered_json pair_json(const std::vector<std::string>& names, std::uint32_t index) {
    const auto p = pair_of(names, index);
    return {as_utf8(names[p.first]), as_utf8(names[p.second])};
}

nlohmann::ordered_json configuration_json(const std::vector<std::string>& names,
                                          const scan::Configuration& configuration) {
    return {{"left", pair_json(names, configuration.left)},
            {"right", pair_json(names, configuration.right)},
            {"agreement", configuration.agreement}};
}

nlohmann::ordered_json selection_json(std::span<const scan::Configuration> selection) {
    nlohmann::ordered_json range;
    if (!selection.empty()) {
        range = {selection.front().agreement, selection.back().agreement};
    }
    return {{"configurations", selection.size()}, {"agreement_range", range}};
}

std::string selection_text(std::span<const scan::Configuration> selection) {
    return fmt::format("{}, agreement {:.6f} to {:.6f}", counted(selection.size(), "configuration"),
                       selection.front().agreement, selection.back().agreement);
}

nlohmann::ordered_json counts_json(const scan::Counts& counts) {
    return {{"concordant", counts.concordant()},
            {"discordant", counts.discordant},
            {"tied_in_first_only", counts.tied_first_only},
            {"tied_in_second_only", counts.tied_second_only},
            {"tied_in_both", counts.tied_both}};
}

nlohmann::ordered_json triangle_json(const scan::DistanceTable& table,
                                     const scan::TriangleCheck& check) {
    nlohmann::ordered_json worst;
    if (check.worst) {
        const auto& w = *check.worst;
        worst = {{"a", as_utf8(table.names[w.a])},
                 {"b", as_utf8(table.names[w.b])},
                 {"c", as_utf8(table.names[w.c])},
                 {"distance_ab", w.ab},
                 {"distance_bc", w.bc},
                 {"distance_ac", w.ac},
                 {"ratio", figure_json(w.ratio())},
                 {"excess", figure_json(w.excess)}};
    }
    return {{"metric", as_utf8(table.metrics[check.metric].metric)},
            {"triples", check.triples},
            {"violations", check.violations ? nlohmann::ordered_json(*check.violations)
                                            : nlohmann::ordered_json()},
            {"worst", worst}};
}

std::string triangle_text(const scan::DistanceTable& table, const scan::TriangleCheck& check) {
    if (!check.violations) {
        return fmt::format("not looked for: {} are too many", counted(check.triples, "triple"));
    }
    if (!check.worst) {
        return fmt::format("holds in all of {}", counted(check.triples, "triple"));
    }
    const auto& w = *check.worst;
    const bool fails = w.excess > 0;
    // Beside 1 the digits that tell are those of the excess.
    const auto factor = fails && w.excess < 1e-3 ? fmt::format("1 + {:.2g}", w.excess)
                                                 : fmt::format("{:.4g}", w.ratio());
    const auto found = fails ? fmt::format("fails in {} of {}, most by a factor of {}",
                                           fmt::group_digits(*check.violations),
                                           counted(check.triples, "triple"), factor)
                             : fmt::format("holds in all of {}, at most {} of what it allows",
                                           counted(check.triples, "triple"), factor);
    return fmt::format("{}: {} | {} {:.4g} {} {:.4g} + {:.4g} through {}", found, table.names[w.a],
                       table.names[w.c], w.ac, fails ? ">" : "<=", w.ab, w.bc, table.names[w.b]);
}

std::string clipped_text(std::uint64_t clipped, std::uint64_t spheres, double most,
                         const std::string& name) {
    if (clipped == 0) {
        return "no pixel is brighter than white";
    }
    constexpr double kPercent = 100;
    return fmt::format("{} of {} have pixels brighter than white; most {}, {:.2f} %",
                       fmt::group_digits(clipped), counted(spheres, "sphere"), name,
                       kPercent * most);
}

std::string counted_by(bool streamed) {
    return streamed ? "streaming and inversions" : "inversions";
}

nlohmann::ordered_json figure_json(double value) {
    if (std::isnan(value)) {
        return nullptr;
    }
    return std::isinf(value) ? nlohmann::ordered_json(value > 0 ? "inf" : "-inf")
                             : nlohmann::ordered_json(value);
}

nlohmann::ordered_json estimate_json(const scan::Estimate& estimate) {
    nlohmann::ordered_json json = {{"value", figure_json(estimate.value)},
                                   {"low", figure_json(estimate.interval.low)},
                                   {"high", figure_json(estimate.interval.high)}};
    if (!estimate.too_few.empty()) {
        json["too_few"] = estimate.too_few;
    }
    return json;
}

std::string estimate_text(const scan::Estimate& estimate) {
    const auto& [low, high] = estimate.interval;
    if (std::isnan(estimate.value)) {
        return "-";
    }
    if (std::isnan(low)) {
        return fmt::format("{:.3f} [{}]", estimate.value,
                           estimate.too_few == scan::all_alike ? "all alike" : "too few");
    }
    return fmt::format("{:.3f} [{:.3f}, {:.3f}]", estimate.value, low, high);
}

nlohmann::ordered_json program_json() {
    return scan::json_head(pipeline::kVersion);
}

nlohmann::ordered_json texts_json(const std::vector<std::pair<std::string, std::string>>& texts) {
    auto object = nlohmann::ordered_json::object();
    for (const auto& [name, text] : texts) {
        object[as_utf8(name)] = as_utf8(text);
    }
    return object;
}

nlohmann::ordered_json texts_json(const std::vector<std::string>& texts) {
    auto array = nlohmann::ordered_json::array();
    for (const auto& text : texts) {
        array.push_back(as_utf8(text));
    }
    return array;
}

std::string json_text(const nlohmann::ordered_json& json) {
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace merl::app
