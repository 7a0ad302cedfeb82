#include <fmt/format.h>

#include <string>
#include <string_view>

#include "app/cli/exit_status.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "engine/base/error.h"
#include "engine/metric/metric.h"
#include "engine/metric/metric_library.h"

namespace merl::app {
namespace {

/// What the header says of the distance.
std::string kind_of(const engine::Metric& metric) {
    if (metric.is_summary()) {
        return fmt::format(
            "summary: {} features of the means over {} windows, Euclidean, float64, error bound "
            "known",
            metric.header.features, metric.header.windows.size());
    }
    if (!metric.has_degree()) {
        return "no degree: any symmetric difference, error bound unknown";
    }
    return fmt::format(
        "degree {}: {}, error bound known", metric.header.degree_text,
        metric.header.degree == 2 ? "Euclidean" : "symmetric, keeps the triangle inequality");
}

int list() {
    const auto field = [](std::string_view key, const std::string& value) {
        if (!value.empty()) {
            print_line(fmt::format("   {:<10} {}", key, value));
        }
    };
    for (const auto& metric : engine::metrics()) {
        print_line(fmt::format("{}: {}", metric.name, metric.header.title));
        field("formula", metric.header.formula);
        field("source", metric.header.source);
        field("difference", kind_of(metric));
        for (const auto& w : metric.header.windows) {
            field("window", fmt::format("{}: {}", w.name, w.description));
        }
        for (const auto& p : metric.header.parameters) {
            field("parameter", fmt::format("{}={} in [{}, {}] {}", p.name, p.value, p.low, p.high,
                                           p.description));
        }
        for (const auto& data : metric.header.fitted) {
            field("fitted to",
                  fmt::format("{} (a file with the SHA-256 {})", data.citation, data.sha256));
        }
    }
    return kSuccess;
}

/// The text of a file of the library, of one that metrics include, or of a user's.
int show(const std::string& name) {
    std::string_view text;
    for (const auto& file : engine::shader_files()) {
        if (file.name == name && name.starts_with("lib/")) {
            text = file.text;
        }
    }
    print_lines(text.empty() ? engine::open_metric(name).source : text);
    return kSuccess;
}

}  // namespace

void add_metrics(CLI::App& program, Command& chosen) {
    auto* command = program.add_subcommand("metrics", "The library of metrics; what each is");
    command->footer(
        "Examples:\n"
        "  merl-scan metrics\n"
        "  merl-scan metrics show pawcielab > my_metric.glsl     a start for one of your own\n"
        "  merl-scan scan --metrics pawcielab,./my_metric.glsl");
    command->require_subcommand(0, 1);
    auto* one = command->add_subcommand("show", "The file of a metric, or of lib/, as it is");
    auto name = std::make_shared<std::string>();
    one->add_option("name", *name,
                    "A metric, a file of your own, or one that metrics include, as lib/cielab.glsl")
        ->required();
    one->footer(
        "Examples:\n"
        "  merl-scan metrics show rmse\n"
        "  merl-scan metrics show lib/cielab.glsl");
    command->callback([&chosen, one, name] {
        chosen = one->parsed() ? Command([name] { return show(*name); }) : Command(list);
    });
}

}  // namespace merl::app
