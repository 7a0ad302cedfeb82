#include "scan/score/ratings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <map>
#include <set>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "engine/base/number.h"
#include "scan/pairs/material_labels.h"

namespace merl::scan {
namespace {

constexpr std::size_t named = 5;  // in an error

std::string lower(std::string_view text) {
    std::string result(text);
    std::ranges::transform(result, result.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return result;
}

/// A row whose names are found.
struct Row {
    std::uint32_t original;
    std::uint32_t approximation;
    std::string_view name;  // of the approximation
    double rating;
};

/// Finds the materials that names stand for.
class Resolver {
  public:
    Resolver(const RatingFile& file, const RatingNaming& naming,
             std::span<const std::string> materials)
        : file_(file), naming_(naming), materials_(materials), originals_(file.names.size()) {
        for (const auto& name : materials) {
            const auto [label, rest] = labelled(name);
            close_.try_emplace(lower(name), name);
            close_.try_emplace(lower(label), label);
            close_.try_emplace(lower(rest), name);
            labels_.insert(label);
        }
    }

    /// The original and the approximation of a row, which are the same where an original was rated
    /// itself; none where one is unknown.
    std::optional<Row> find(const NamedRating& row) {
        const auto original = find_original(row.original);
        if (!original) {
            ++unknown_[name_of(row.original)];
            return std::nullopt;
        }
        const std::string& text = name_of(row.approximation);
        const std::string material(labelled(materials_[*original]).name);
        if (text == name_of(row.original)) {
            return Row{*original, *original, {}, row.rating};
        }
        const auto within = fmt::format("{}/{}", text, material);
        const auto found = only(text, {text, within});
        if (!found) {
            // Of a database that is there it is the material that is missing.
            ++unknown_[labels_.contains(text) ? within : text];
            return std::nullopt;
        }
        const auto label = labelled(materials_[*found]).label;
        return Row{*original, *found, label.empty() ? std::string_view(text) : label, row.rating};
    }

    std::vector<UnknownRated> unknown() const {
        std::vector<UnknownRated> result;
        for (const auto& [name, rows] : unknown_) {
            const auto close = close_.find(lower(name));
            result.push_back({name, rows, close == close_.end() ? "" : std::string(close->second)});
        }
        return result;
    }

    std::vector<std::string> unused_names() const {
        std::vector<std::string> result;
        for (const auto& [from, to] : naming_.names) {
            if (std::ranges::find(file_.names, from) == file_.names.end()) {
                result.push_back(from);
            }
        }
        return result;
    }

  private:
    /// A name of the file, or what it stands for.
    const std::string& name_of(std::uint32_t index) const {
        const auto found = naming_.names.find(file_.names[index]);
        return found == naming_.names.end() ? file_.names[index] : found->second;
    }

    std::optional<std::uint32_t> index_of(std::string_view material) const {
        const auto found = std::ranges::lower_bound(materials_, material);
        return found == materials_.end() || *found != material
                   ? std::nullopt
                   : std::optional(static_cast<std::uint32_t>(found - materials_.begin()));
    }

    /// The one of two materials that there is.
    std::optional<std::uint32_t> only(const std::string& text,
                                      const std::pair<std::string, std::string>& names) const {
        const auto first = index_of(names.first);
        const auto second = index_of(names.second);
        if (first && second && first != second) {
            throw InputError(
                fmt::format("{}: \"{}\" may be the material \"{}\" or \"{}\"; --names says which "
                            "name stands for which",
                            file_.file, text, names.first, names.second));
        }
        return first ? first : second;
    }

    std::optional<std::uint32_t> find_original(std::uint32_t index) {
        auto& known = originals_[index];
        if (!known) {
            const auto& text = name_of(index);
            const auto& reference = naming_.reference;
            known = only(text,
                         {text, reference.empty() ? text : fmt::format("{}/{}", reference, text)});
        }
        return known;
    }

    const RatingFile& file_;
    const RatingNaming& naming_;
    std::span<const std::string> materials_;
    std::vector<std::optional<std::uint32_t>> originals_;  // by name, once they are found
    std::unordered_map<std::string, std::string_view> close_;
    std::set<std::string_view> labels_;
    std::map<std::string, std::uint64_t> unknown_;
};

/// Throws where no material has the label of the originals.
void expect_label(const std::string& label, std::span<const std::string> materials) {
    std::set<std::string_view> labels;
    for (const auto& name : materials) {
        if (const auto found = labelled(name).label; !found.empty()) {
            labels.insert(found);
        }
    }
    if (!label.empty() && !labels.contains(label)) {
        throw Error(
            Fault::usage,
            fmt::format("--reference: found \"{}\"; expected the label of a database: {}", label,
                        labels.empty() ? "there is none, as materials are of one without"
                                       : fmt::format("{}", fmt::join(labels, ", "))));
    }
}

/// Rows of one approximation as one, and the names by number.
void merge(std::vector<Row>& rows, Ratings& ratings) {
    // By rating last: sums do not depend on the order of the rows.
    std::ranges::sort(rows, {}, [](const Row& row) {
        return std::tuple(row.original, row.approximation, row.name, row.rating);
    });
    for (const auto& row : rows) {
        ratings.names.emplace_back(row.name);
    }
    std::ranges::sort(ratings.names);
    ratings.names.erase(std::unique(ratings.names.begin(), ratings.names.end()),
                        ratings.names.end());
    const auto number = [&](std::string_view name) {
        return static_cast<std::uint32_t>(std::ranges::lower_bound(ratings.names, name) -
                                          ratings.names.begin());
    };
    for (const auto& row : rows) {
        if (!ratings.list.empty() && ratings.list.back().original == row.original &&
            ratings.list.back().approximation == row.approximation) {
            ratings.list.back().rating += row.rating;
            ++ratings.list.back().ratings;
        } else {
            ratings.list.push_back(
                {row.original, row.approximation, number(row.name), row.rating, 1});
        }
    }
    for (auto& rated : ratings.list) {
        if (rated.ratings > 1) {
            rated.rating = decimal_mean(rated.rating, rated.ratings);
        }
    }
}

[[noreturn]] void nothing_left(const RatingFile& file, const RatingNaming& naming,
                               const Ratings& ratings) {
    if (ratings.unknown.empty()) {
        throw InputError(
            fmt::format("{}: each of the {} rows rates an original itself; expected "
                        "approximations",
                        file.file, ratings.rows));
    }
    std::string names;
    for (std::size_t i = 0; i < std::min(named, ratings.unknown.size()); ++i) {
        const auto& [name, rows, close] = ratings.unknown[i];
        names += fmt::format("{}\"{}\"{}", i == 0 ? "" : ", ", name,
                             close.empty() ? "" : fmt::format(" (there is \"{}\")", close));
    }
    throw InputError(fmt::format(
        "{}: each of the {} rows names something that has no distances; {} such: {}{}; {}--names "
        "FILE maps names",
        file.file, ratings.rows, ratings.unknown.size(), names,
        ratings.unknown.size() > named ? " …" : "",
        naming.reference.empty() ? "--reference LABEL says of which database originals are, "
                                 : ""));
}

/// Ratings that are all the same say nothing of which is better.
void expect_variation(const RatingFile& file, const Ratings& ratings) {
    const auto [least, most] = std::ranges::minmax_element(
        ratings.list, {}, [](const auto& rated) { return rated.rating; });
    if (least->rating == most->rating) {
        throw InputError(fmt::format(
            "{}: found {} rated approximation{}, {} the rating {}; expected two or more whose "
            "ratings differ",
            file.file, ratings.list.size(), ratings.list.size() == 1 ? "" : "s",
            ratings.list.size() == 1 ? "with" : "all with", least->rating));
    }
}

}  // namespace

double decimal_mean(double sum, std::uint64_t count) {
    const auto mean = parse_finite(fmt::format("{:.12g}", sum / static_cast<double>(count)));
    return mean.value() + 0.0;
}

Ratings resolve_ratings(const RatingFile& file, const RatingNaming& naming,
                        std::span<const std::string> materials) {
    Ratings result{
        .higher_is_better = file.higher_is_better, .scale = file.scale, .list = {}, .names = {}};
    expect_label(naming.reference, materials);
    Resolver resolver(file, naming, materials);
    std::vector<Row> rows;
    rows.reserve(file.rows.size());
    for (const auto& row : file.rows) {
        const auto found = resolver.find(row);
        if (!found) {
            ++result.rows_with_unknown;
        } else if (found->original == found->approximation) {
            ++result.rows_of_originals;
        } else {
            rows.push_back(*found);
        }
    }
    result.rows = file.rows.size();
    result.unknown = resolver.unknown();
    result.unused_names = resolver.unused_names();
    if (rows.empty()) {
        nothing_left(file, naming, result);
    }
    merge(rows, result);
    expect_variation(file, result);
    return result;
}

std::vector<Pair> rated_pairs(const Ratings& ratings) {
    std::vector<Pair> pairs;
    for (const auto& rated : ratings.list) {
        pairs.push_back(rated.pair());
    }
    const auto order = [](const Pair& pair) { return std::pair(pair.first, pair.second); };
    std::ranges::sort(pairs, {}, order);
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    return pairs;
}

}  // namespace merl::scan
