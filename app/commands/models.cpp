#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>

#include "app/cli/exit_status.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "engine/base/error.h"
#include "engine/database/model.h"

namespace merl::app {
namespace {

int list() {
    const auto field = [](std::string_view key, const std::string& value) {
        if (!value.empty()) {
            print_line(fmt::format("   {:<10} {}", key, value));
        }
    };
    for (const auto& model : engine::models()) {
        const auto rows = std::ranges::count(model.table, '\n') - 1;  // beside its header
        print_line(fmt::format("{}: {}", model.name, model.header.title));
        field("formula", model.header.formula);
        field("source", model.header.source);
        field("note", model.header.note);
        field("table", fmt::format("{} materials: {}", rows, model.header.table));
        for (const auto& p : model.header.parameters) {
            field("parameter", fmt::format("{}: {}", fmt::join(p.columns(), ", "), p.description));
        }
    }
    return kSuccess;
}

/// The text of a model's file, or of its table.
int show(const std::string& name) {
    constexpr std::string_view kTable = ".csv";
    const bool is_table = name.ends_with(kTable);
    const auto* const model = engine::find_model(
        std::string_view(name).substr(0, name.size() - (is_table ? kTable.size() : 0)));
    if (model == nullptr) {
        std::string names;
        for (const auto& known : engine::models()) {
            names += fmt::format("{}{}", names.empty() ? "" : ", ", known.name);
        }
        throw Error(Fault::usage,
                    fmt::format("\"{}\" is no model; found {}, and of each NAME.csv", name, names));
    }
    print_lines(is_table ? model->table : model->source);
    return kSuccess;
}

}  // namespace

void add_models(CLI::App& program, Command& chosen) {
    auto* command = program.add_subcommand("models", "Reflectance models; what each is");
    command->footer(
        "Examples:\n"
        "  merl-scan models\n"
        "  merl-scan scan --database sgd                         a model with its own table\n"
        "  merl-scan models show ward.csv > mine.csv             a start for a table of your own\n"
        "  merl-scan scan --database ward:mine.csv");
    command->require_subcommand(0, 1);
    auto* one = command->add_subcommand("show", "The file of a model, or its table, as it is");
    auto name = std::make_shared<std::string>();
    one->add_option("name", *name, "A model, or its table, as ward.csv")->required();
    one->footer(
        "Examples:\n"
        "  merl-scan models show ward\n"
        "  merl-scan models show ward.csv");
    command->callback([&chosen, one, name] {
        chosen = one->parsed() ? Command([name] { return show(*name); }) : Command(list);
    });
}

}  // namespace merl::app
