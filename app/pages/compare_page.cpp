#include "app/pages/compare_page.h"

#include <fmt/format.h>

#include <charconv>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <random>
#include <span>
#include <vector>

#include "app/output/json.h"
#include "app/output/provenance.h"
#include "app/pages/compare_page_html.h"
#include "app/pages/page.h"
#include "app/pipeline/quotable_line.h"
#include "engine/base/text.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

/// `count` of the pairs 0 to `pairs` - 1, ascending, the same ones every time (D. E. Knuth, TAOCP
/// 2, 3.4.2, algorithm S).
std::vector<std::uint32_t> draw_lots(std::uint64_t pairs, std::uint64_t count) {
    std::mt19937_64 random(1);
    std::vector<std::uint32_t> drawn;
    drawn.reserve(count);
    for (std::uint64_t pair = 0; pair < pairs; ++pair) {
        if (random() % (pairs - pair) < count - drawn.size()) {
            drawn.push_back(static_cast<std::uint32_t>(pair));
        }
    }
    return drawn;
}

/// Six digits are more than a plot shows.
double shortened(double value) {
    const std::string text = fmt::format("{:.6g}", value);
    double result = value;  // what it stays if rounding up took it beyond the largest double
    std::from_chars(text.data(), text.data() + text.size(), result);
    return result;
}

ordered_json comparison_json(const scan::DistanceTable& table, const scan::Comparison& c) {
    ordered_json strongest = ordered_json::array();
    const auto side = [&](std::uint32_t index) -> ordered_json {
        const auto pair = scan::pair_at(index, table.materials());
        return {{"pair", {pair.first, pair.second}},
                {"first", table.metrics[c.first].values[index]},
                {"second", table.metrics[c.second].values[index]}};
    };
    for (const auto& found : c.strongest) {
        strongest.push_back({{"left", side(found.left)},
                             {"right", side(found.right)},
                             {"agreement", found.agreement}});
    }
    return {{"first", c.first},
            {"second", c.second},
            {"disagreements", c.counts.disagreements()},
            {"rate", c.counts.disagreement_rate()},
            {"tau_b", c.tau_b ? ordered_json(*c.tau_b) : ordered_json()},
            {"undecided", c.undecided ? ordered_json(*c.undecided) : ordered_json()},
            {"strongest", strongest}};
}

ordered_json page_data(const pipeline::PairDistances& distances,
                       const scan::ComparisonResult& compared,
                       std::span<const scan::TriangleCheck> triangles) {
    const auto& table = distances.table;
    ordered_json facts = ordered_json::array();
    for (const auto& lines : {source_lines(distances), engine_lines(distances.provenance)}) {
        for (const auto& [name, text] : lines) {
            facts.push_back({name, printable(text)});
        }
    }
    ordered_json materials = ordered_json::array();
    for (const auto& name : table.names) {
        materials.push_back(printable(name));
    }
    const bool all = table.pairs() <= kPairsOnPage;
    const auto shown = draw_lots(table.pairs(), all ? table.pairs() : kPairsOnPage);
    ordered_json values = ordered_json::array();
    for (const auto& column : table.metrics) {
        std::vector<double> numbers;
        numbers.reserve(shown.size());
        for (const auto pair : shown) {
            numbers.push_back(shortened(column.values[pair]));
        }
        values.push_back(numbers);
    }
    ordered_json comparisons = ordered_json::array();
    for (const auto& comparison : compared.comparisons) {
        comparisons.push_back(comparison_json(table, comparison));
    }
    ordered_json triangle_texts(table.metrics.size(), nullptr);  // null where it is proven
    for (const auto& check : triangles) {
        triangle_texts[check.metric] = printable(triangle_text(table, check));
    }
    return {{"version", distances.provenance.version},
            {"quote", printable(pipeline::quotable_line(distances.provenance))},
            {"facts", facts},
            {"metrics", metrics_json(distances.provenance)},
            {"materials", materials},
            {"pairs", table.pairs()},
            {"configurations", scan::configuration_count(table.pairs())},
            {"shown", all ? ordered_json() : ordered_json(shown)},
            {"values", values},
            {"comparisons", comparisons},
            {"triangles", triangle_texts}};
}

}  // namespace

std::string compare_page(const pipeline::PairDistances& distances,
                         const scan::ComparisonResult& compared,
                         std::span<const scan::TriangleCheck> triangles) {
    return page_of(kComparePage, page_data(distances, compared, triangles));
}

}  // namespace merl::app
