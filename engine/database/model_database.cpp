#include "engine/database/model_database.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <utility>

#include "engine/base/csv_reader.h"
#include "engine/base/error.h"
#include "engine/base/file.h"
#include "engine/database/kept_samples.h"

namespace merl::engine {
namespace {

/// Of a user's table; that of SGD, with 33 numbers for each of 100 materials, has 32 KiB.
constexpr std::uint64_t kMostTableBytes = 1ULL << 26U;

/// Voxels that are evaluated at a time: those of a row of MERL's grid, which fit into a cache.
constexpr std::uint64_t kMostAtATime = 256;

constexpr const char* kMaterial = "material";

/// The row of a table, in the order of the model's columns.
struct Figures {
    std::string material;
    std::uint64_t line = 0;  // of the file
    std::string text;        // as tabulated, for the content hash
    std::vector<double> values;
};

/// Where in a row of the table each of the columns is: the material, then those of the model.
std::vector<std::size_t> places_of(const std::vector<std::string>& columns,
                                   const std::vector<std::string>& header, const Model& model,
                                   const CsvReader& reader) {
    const auto refuse = [&](const std::string& found) {
        reader.fail(fmt::format("found {}; expected the columns of {}, in any order: {}", found,
                                model.name, fmt::join(columns, ",")));
    };
    for (const auto& column : header) {
        if (std::ranges::find(columns, column) == columns.end()) {
            refuse(fmt::format("the column \"{}\" in {}", column, columns_text(header)));
        }
        if (std::ranges::count(header, column) > 1) {
            refuse(fmt::format("the column \"{}\" twice", column));
        }
    }
    std::vector<std::size_t> places;
    for (const auto& column : columns) {
        const auto found = std::ranges::find(header, column);
        if (found == header.end()) {
            refuse(fmt::format("no column \"{}\" in {}", column, columns_text(header)));
        }
        places.push_back(static_cast<std::size_t>(found - header.begin()));
    }
    return places;
}

Figures parse_figures(const std::vector<std::string>& fields,
                      const std::vector<std::string>& columns,
                      const std::vector<std::size_t>& places, CsvReader& reader) {
    Figures figures;
    figures.material = fields[places[0]];
    figures.line = reader.line();
    figures.text = figures.material;
    for (std::size_t c = 1; c < columns.size(); ++c) {
        const auto& field = fields[places[c]];
        const auto value = reader.number(field);
        if (!value) {
            reader.fail(
                fmt::format(R"(the column {} of "{}": found "{}"; expected a finite number{})",
                            columns[c], figures.material, field, reader.decimal_comma_hint(field)));
        }
        // The same figures have the same hash, whatever the decimal mark.
        figures.text += ',';
        figures.text += field;
        std::ranges::replace(figures.text.end() - static_cast<std::ptrdiff_t>(field.size()),
                             figures.text.end(), ',', '.');
        figures.values.push_back(*value);
    }
    return figures;
}

/// The rows of a table, by material.
std::vector<Figures> parse_table(const Model& model, const std::string& table,
                                 const std::string& name) {
    CsvReader reader(table, name);
    auto columns = model.header.columns();
    columns.insert(columns.begin(), kMaterial);
    const auto places = places_of(columns, reader.header(), model, reader);
    std::vector<Figures> rows;
    std::vector<std::string> fields;
    while (reader.next(fields)) {
        rows.push_back(parse_figures(fields, columns, places, reader));
    }
    if (rows.empty()) {
        reader.fail("found no row after the header; expected one for each material");
    }
    std::ranges::stable_sort(rows, {}, &Figures::material);
    const auto twice = std::ranges::adjacent_find(rows, {}, &Figures::material);
    if (twice != rows.end()) {
        throw InputError(
            fmt::format("{}, line {}: found the material \"{}\" again, as in line {}; "
                        "expected a row for each",
                        name, std::next(twice)->line, twice->material, twice->line));
    }
    return rows;
}

class ModelDatabase final : public Database {
  public:
    ModelDatabase(const Model& model, std::vector<Figures> rows, std::string name, std::string kind,
                  std::string path, const Grid& grid)
        : Database(std::move(name), std::move(kind), std::move(path)),
          model_(model),
          domain_(grid),
          rows_(std::move(rows)) {
        grid_ = grid;
        for (const auto& row : rows_) {
            materials_.push_back(row.material);
        }
        if (!model.header.slow.empty()) {
            kept_.emplace(grid, rows_.size());
        }
    }

    void read(std::size_t material, VoxelRange range, std::span<double> samples,
              const SampleSink& sink) const override {
        const auto& figures = rows_.at(material);
        if (sink && range.first == 0) {
            identify(figures, sink);
        }
        if (!kept_) {
            evaluate(figures, range, samples);
            return;
        }
        kept_->read(material, range, samples, [&](VoxelRange part, std::span<double> planes) {
            evaluate(figures, part, planes);
        });
    }

    std::uint64_t keep(std::uint64_t bytes) const override {
        return kept_ ? kept_->keep(bytes) : 0;
    }

  private:
    void evaluate(const Figures& figures, VoxelRange range, std::span<double> samples) const {
        std::array<Voxel, kMostAtATime> voxels;
        std::uint64_t last = 0;
        for (std::uint64_t first = range.first; first < range.last; first = last) {
            const auto end_of_row = (first / grid_.phi_d + 1) * grid_.phi_d;
            last = std::min({range.last, end_of_row, first + kMostAtATime});
            const auto row = std::span(voxels).first(last - first);
            domain_.row(first, row);
            const auto plane = [&](std::size_t number) {
                return samples.subspan(number * range.size() + first - range.first, last - first);
            };
            model_.twin(figures.values, row, plane(0), plane(1), plane(2));
        }
        check(figures.material, range, samples);
    }

    void identify(const Figures& figures, const SampleSink& sink) const {
        sink(0, std::as_bytes(std::span(figures.text)));
        // Two models may have the same figures. The hashes of ABC are older than the other models.
        if (model_.name != kBuiltInModel) {
            const auto name = "\n" + model_.name;
            sink(0, std::as_bytes(std::span(name)));
        }
    }

    void check(const std::string& material, VoxelRange range,
               std::span<const double> samples) const {
        int good = 1;  // without a branch for each sample
        for (const double sample : samples) {
            good &= static_cast<int>(sample >= 0) & static_cast<int>(sample <= kMaxReflectance);
        }
        if (good == 1 || range.size() == 0) {
            return;
        }
        const auto bad = std::ranges::find_if_not(
            samples, [](double sample) { return sample >= 0 && sample <= kMaxReflectance; });
        const auto index =
            range.first + static_cast<std::uint64_t>(bad - samples.begin()) % range.size();
        throw InputError(fmt::format(
            "{}: {} makes \"{}\" {}/sr at voxel theta_h {}, theta_d {}, phi_d {}; "
            "expected a finite number from 0 to {}; are its figures those of that model?",
            name(), model_.name, material, *bad, index / grid_.phi_d / grid_.theta_d,
            index / grid_.phi_d % grid_.theta_d, index % grid_.phi_d, kMaxReflectance));
    }

    const Model& model_;
    Domain domain_;
    std::vector<Figures> rows_;
    mutable std::optional<KeptSamples> kept_;  // of a slow model
};

/// "ward" of "ward:params.csv", and "params.csv"; that is empty without a colon.
std::pair<std::string, std::string> split(const std::string& name) {
    const auto colon = std::min(name.find(':'), name.size());
    return {name.substr(0, colon), name.substr(std::min(colon + 1, name.size()))};
}

/// Database::kind() of a model with a user's table.
std::string table_kind(const Model& model) {
    return model.name + " table";
}

}  // namespace

bool is_model(const std::string& name) {
    return find_model(split(name).first) != nullptr;
}

std::unique_ptr<Database> open_model(const std::string& name, const Grid& grid) {
    const auto [model_name, file] = split(name);
    const auto* const model = find_model(model_name);
    if (model == nullptr) {
        throw InputError(
            fmt::format("\"{}\" is no model; merl-scan models lists them", model_name));
    }
    if (model_name == name) {
        return std::make_unique<ModelDatabase>(*model,
                                               parse_table(*model, model->table, name + ".csv"),
                                               model->header.database, built_in_kind, name, grid);
    }
    if (file.empty()) {
        throw InputError(
            fmt::format("{}: names no table; expected {}:TABLE.csv", name, model_name));
    }
    const auto table = File(file).read_all(kMostTableBytes);
    const auto path = std::filesystem::absolute(file).lexically_normal().string();
    return std::make_unique<ModelDatabase>(*model, parse_table(*model, table, file), name,
                                           table_kind(*model), model_name + ":" + path, grid);
}

std::unique_ptr<Database> make_model_database(const Model& model, const std::string& table,
                                              const std::string& name, const Grid& grid) {
    return std::make_unique<ModelDatabase>(model, parse_table(model, table, name), name,
                                           table_kind(model), "", grid);
}

std::vector<std::string> merl_materials() {
    return open_model(kBuiltInModel)->materials();
}

}  // namespace merl::engine
