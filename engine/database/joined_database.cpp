#include "engine/database/joined_database.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/text.h"
#include "engine/database/over_two_pi.h"

namespace merl::engine {
namespace {

/// A text of each, once, with this between them.
std::string listed(const std::vector<LabelledDatabase>& databases, const auto& text_of,
                   std::string_view between) {
    std::vector<std::string> texts;
    std::string list;
    for (const auto& database : databases) {
        const std::string& text = text_of(database);
        if (std::ranges::find(texts, text) == texts.end()) {
            list += list.empty() ? text : std::string(between) + text;
            texts.push_back(text);
        }
    }
    return list;
}

class JoinedDatabase final : public Database {
  public:
    explicit JoinedDatabase(std::vector<LabelledDatabase> databases)
        : Database(
              listed(
                  databases, [](const auto& d) -> auto& { return d.label; }, ", "),
              listed(
                  databases, [](const auto& d) -> auto& { return d.database->kind(); }, " and ")),
          databases_(std::move(databases)) {
        grid_ = databases_.front().database->grid();
        for (const auto& [label, database] : databases_) {
            for (const auto& [material, reason] : database->skipped()) {
                skipped_.push_back({fmt::format("{}/{}", label, material), reason});
            }
            parts_.push_back({.label = label,
                              .name = database->name(),
                              .kind = database->kind(),
                              .path = database->path(),
                              .first = materials_.size(),
                              .materials = database->materials().size()});
            for (std::size_t m = 0; m < database->materials().size(); ++m) {
                places_.push_back({database.get(), m});
                materials_.push_back(fmt::format("{}/{}", label, database->materials()[m]));
            }
        }
    }

    void read(std::size_t material, VoxelRange range, std::span<double> samples,
              const SampleSink& sink) const override {
        const auto& [database, place] = places_.at(material);
        database->read(place, range, samples, sink);
    }

    std::uint64_t keep(std::uint64_t bytes) const override {
        std::uint64_t kept = 0;
        for (const auto& [label, database] : databases_) {
            kept += database->keep(bytes - std::min(bytes, kept));
        }
        return kept;
    }

    std::string place_of(std::size_t material) const override {
        const auto& [database, place] = places_.at(material);
        return database->place_of(place);
    }

  private:
    struct Place {
        const Database* database;
        std::size_t material;  // in that
    };

    std::vector<LabelledDatabase> databases_;
    std::vector<Place> places_;  // of each material
};

/// Throws Error (usage) when two databases are read from the same place.
void require_different(const std::vector<LabelledDatabase>& databases) {
    for (auto a = databases.begin(); a != databases.end(); ++a) {
        for (auto b = databases.begin(); b != a; ++b) {
            std::error_code not_in_files;
            const std::filesystem::path first = b->database->path();  // of a model its name
            const std::filesystem::path second = a->database->path();
            if ((!first.empty() && first == second) ||
                (first.is_absolute() && second.is_absolute() &&
                 std::filesystem::equivalent(first, second, not_in_files))) {
                throw Error(Fault::usage,
                            fmt::format("{} and {} are the same database; name it once",
                                        b->database->name(), a->database->name()));
            }
        }
    }
}

}  // namespace

void require_label(const std::string& label, const std::string& name) {
    const char* const fault = label.empty()                          ? "is empty"
                              : label.front() == '.'                 ? "begins with a dot"
                              : label.find('/') != std::string::npos ? "has a slash"
                              : label.find('=') != std::string::npos ? "has a \"=\""
                              : printable(label) != label
                                  ? "has bytes that are not UTF-8 or that nobody sees"
                                  : nullptr;
    if (fault != nullptr) {
        throw Error(Fault::usage,
                    fmt::format("the label \"{}\" of the database {} {}; name another: --database "
                                "LABEL=PATH",
                                label, name, fault));
    }
}

std::unique_ptr<Database> make_joined(std::vector<LabelledDatabase> databases) {
    if (databases.empty()) {
        throw std::invalid_argument("a joined database is made of one or more");
    }
    for (const auto& [label, database] : databases) {
        require_label(label, database->name());
        if (!database->parts().empty()) {
            throw std::invalid_argument("a joined database is not joined again");
        }
        const auto& first = databases.front();
        if (database->grid().over_pi() != first.database->grid().over_pi()) {
            throw InputError(fmt::format(
                "{}: the grid is {}, as of all of \"{}\"; {}, of \"{}\", has {}, and databases "
                "that are used together must have the same",
                database->place_of(0), database->grid().text(), label, first.database->place_of(0),
                first.label, first.database->grid().text()));
        }
    }
    require_different(databases);
    if (std::ranges::any_of(databases, [](const auto& d) {
            return d.database->grid().phi_d_range == PhiDRange::two_pi;
        })) {
        for (auto& [label, database] : databases) {
            if (database->grid().phi_d_range == PhiDRange::pi) {
                database = repeat_over_two_pi(std::move(database));
            }
        }
    }
    // With the slash: "a-b/…" comes before "a/…".
    std::ranges::sort(databases, {}, [](const auto& d) { return d.label + '/'; });
    if (std::ranges::adjacent_find(databases, {}, &LabelledDatabase::label) != databases.end()) {
        throw std::invalid_argument("databases that are joined have different labels");
    }
    return std::make_unique<JoinedDatabase>(std::move(databases));
}

}  // namespace merl::engine
