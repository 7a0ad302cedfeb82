#include "app/pages/score_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "app/pages/page.h"
#include "app/pages/plot.h"
#include "engine/base/text.h"

namespace merl::app {
namespace {

constexpr double kRow = 26;     // height of a metric
constexpr double kTop = 116;    // above the first
constexpr double kBottom = 40;  // below the last, without notes
constexpr double kNote = 18;    // height of a note
constexpr double kPanel = 220;  // width of a scale
constexpr double kFigure = 58;  // width of the figures beside it
constexpr double kGap = 26;     // between panels
constexpr double kMargin = 24;
constexpr std::size_t kLongest = 36;  // characters of a label

/// One figure of every metric, on a scale.
struct Panel {
    std::string title;
    scan::Estimate scan::MetricScore::*figure;
    double chance;
    std::optional<double> ceiling;
};

Scale scale_of(const scan::Score& score, const Panel& panel) {
    double low = panel.chance;
    double high = panel.ceiling.value_or(panel.chance);
    for (const auto& metric : score.metrics) {
        const auto& [value, interval, too_few] = metric.*panel.figure;
        for (const double x : {value, interval.low, interval.high}) {
            if (std::isfinite(x)) {
                low = std::min(low, x);
                high = std::max(high, x);
            }
        }
    }
    return {low, high, 0, kPanel, 0.04};
}

/// A vertical line over all rows, with its name above.
std::string marker(double x, double height, std::string_view name, std::string_view style,
                   std::string_view anchor) {
    return fmt::format(
        "<line class=\"{}\" x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"-8\" y2=\"{:.1f}\"/>\n"
        "<text class=\"note\" x=\"{:.1f}\" y=\"-13\" text-anchor=\"{}\">{}</text>\n",
        style, x, x, height, x, anchor, name);
}

std::string panel_svg(const scan::Score& score, const std::vector<std::size_t>& order,
                      const Panel& panel, double left) {
    const Scale scale = scale_of(score, panel);
    const double height = kRow * static_cast<double>(order.size());
    std::string svg = fmt::format("<g transform=\"translate({:.1f} {:.1f})\">\n", left, kTop);
    svg += fmt::format("<text class=\"head\" x=\"0\" y=\"-32\">{}</text>\n", panel.title);
    for (const double tick : scale.ticks()) {
        svg += fmt::format(
            "<line class=\"grid\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"0\" y2=\"{1:.1f}\"/>"
            "<text class=\"note\" x=\"{0:.1f}\" y=\"{2:.1f}\" text-anchor=\"middle\">{3}"
            "</text>\n",
            scale.at(tick), height, height + 18, number_text(tick, scale.decimals()));
    }
    const double chance = scale.at(panel.chance);
    svg += marker(chance, height, "chance", "chance", chance < kPanel / 2 ? "start" : "end");
    if (panel.ceiling) {
        svg += marker(scale.at(*panel.ceiling), height, "ceiling", "ceiling", "end");
    }
    for (std::size_t row = 0; row < order.size(); ++row) {
        const auto& metric = score.metrics[order[row]];
        const auto& [value, interval, too_few] = metric.*panel.figure;
        const bool chance_at_best =
            metric.is_chance() && panel.figure == &scan::MetricScore::log_likelihood;
        const double y = kRow * (static_cast<double>(row) + 0.5);
        if (!std::isnan(interval.low)) {
            svg += fmt::format(
                "<line class=\"interval\" x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" "
                "y2=\"{:.1f}\"/>",
                scale.at(interval.low), scale.at(interval.high), y, y);
        }
        if (!std::isnan(value)) {
            svg += fmt::format(
                "<circle{} cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4.5\"/>"
                "<text class=\"figure\" x=\"{:.1f}\" y=\"{:.1f}\" "
                "text-anchor=\"end\">{}</text>\n",
                chance_at_best ? " class=\"opposed\"" : "", scale.at(value), y,
                kPanel + kFigure - 4, y + 4, number_text(value, 3));
        }
    }
    return svg + "</g>\n";
}

/// The name of a metric beside its row.
std::string label(const scan::MetricScore& metric) {
    return shortened(printable(metric.name), kLongest) + (metric.selected ? " *" : "") +
           (metric.fitted ? " †" : "");
}

/// The lines below the panels.
std::vector<std::string> notes_on(const scan::Score& score) {
    std::vector<std::string> notes = {
        "Dots are the judgements as they are, bars 95 % intervals. The "
        "ceiling is what the votes themselves allow."};
    if (std::ranges::any_of(score.metrics, &scan::MetricScore::is_chance)) {
        notes.emplace_back(
            "Open circles: the slope is below 0, and what the metric says is no likelier than "
            "chance.");
    }
    if (std::ranges::any_of(score.metrics, &scan::MetricScore::selected)) {
        notes.emplace_back(
            "* Circular: what was judged are disagreements of this metric with another. Not to be "
            "compared with the others.");
    }
    if (std::ranges::any_of(score.metrics, &scan::MetricScore::fitted)) {
        notes.emplace_back(
            "† Fitted to these judgements: how well it fits them, not how well it predicts "
            "others.");
    }
    return notes;
}

constexpr const char* kStyle = R"(<style>
text { font-family: system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; font-size: 13px; fill: #1b1f24 }
.title { font-size: 18px; font-weight: 600 }
.head { font-weight: 600 }
.note, .subtitle { font-size: 12px; fill: #57606a }
.figure { font-variant-numeric: tabular-nums }
.stripe { fill: #f4f6f8 }
.grid { stroke: #d8dee4; stroke-width: 1 }
.chance { stroke: #57606a; stroke-width: 1.5; stroke-dasharray: 4 3 }
.ceiling { stroke: #b35900; stroke-width: 1.5 }
.interval { stroke: #0550ae; stroke-width: 2.5; stroke-opacity: .45; stroke-linecap: round }
circle { fill: #0550ae }
.opposed { fill: #fff; stroke: #0550ae; stroke-width: 2 }
</style>
)";

}  // namespace

std::string score_svg(const scan::Score& score, const std::string& subtitle) {
    const auto order = scan::best_first(score);
    const std::array<Panel, 3> panels = {
        {{"Majorities predicted", &scan::MetricScore::majorities, 0.5, std::nullopt},
         {"Votes predicted", &scan::MetricScore::votes, 0.5, score.ceiling.value},
         {"Log-likelihood per vote", &scan::MetricScore::log_likelihood, std::log(0.5),
          score.ceiling_log_likelihood.value}}};
    std::size_t longest = 8;
    for (const auto& metric : score.metrics) {
        longest = std::max(longest, characters(label(metric)));
    }
    const double labels = kMargin + kCharacter * static_cast<double>(longest) + 18;
    const double width = labels + 3 * (kPanel + kFigure) + 2 * kGap + kMargin;
    const auto notes = notes_on(score);
    const double height = kTop + kRow * static_cast<double>(order.size()) + kBottom +
                          kNote * static_cast<double>(notes.size());

    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"{0:.0f}\" "
        "height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
        "style=\"max-width:100%;height:auto\">\n"
        "<title>How well metrics predict people</title>\n{2}"
        "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
        "<text class=\"title\" x=\"{3}\" y=\"34\">How well metrics predict people</text>\n"
        "<text class=\"subtitle\" x=\"{3}\" y=\"56\">{4}</text>\n",
        width, height, kStyle, kMargin, markup_text(printable(subtitle)));
    for (std::size_t row = 0; row < order.size(); ++row) {
        const auto& metric = score.metrics[order[row]];
        const double y = kTop + kRow * static_cast<double>(row);
        if (row % 2 == 0) {
            svg += fmt::format(
                R"(<rect class="stripe" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{}"/>)",
                kMargin - 8, y, width - 2 * kMargin + 16, kRow);
        }
        svg += fmt::format("<text x=\"{}\" y=\"{:.1f}\">{}<title>{}</title></text>\n", kMargin,
                           y + kRow / 2 + 4.5, markup_text(label(metric)),
                           markup_text(printable(metric.name)));
    }
    double left = labels;
    for (const auto& panel : panels) {
        svg += panel_svg(score, order, panel, left);
        left += kPanel + kFigure + kGap;
    }
    double y = height - 16 - kNote * static_cast<double>(notes.size() - 1);
    for (const auto& note : notes) {
        svg += fmt::format("<text class=\"note\" x=\"{}\" y=\"{:.1f}\">{}</text>\n", kMargin, y,
                           markup_text(note));
        y += kNote;
    }
    svg += "</svg>\n";
    return svg;
}

}  // namespace merl::app
