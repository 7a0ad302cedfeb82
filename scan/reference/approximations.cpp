#include "scan/reference/approximations.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <string_view>
#include <tuple>

#include "engine/base/error.h"
#include "scan/pairs/material_labels.h"

namespace merl::scan {
namespace {

/// So many names stand for all of them in an error.
constexpr std::size_t most_named = 3;

/// So many approximations there may be if all labels had all originals: what they lack is listed.
constexpr std::uint64_t most_possible = 10'000'000;

/// The materials of each label, by their names without it.
using ByLabel = std::map<std::string, std::map<std::string, std::uint32_t>>;

ByLabel by_label(std::span<const std::string> names) {
    ByLabel result;
    for (std::uint32_t n = 0; n < names.size(); ++n) {
        const auto [label, name] = labelled(names[n]);
        if (!label.empty()) {
            result[std::string(label)][std::string(name)] = n;
        }
    }
    return result;
}

std::vector<std::string> labels_of(const ByLabel& materials) {
    std::vector<std::string> labels;
    for (const auto& [label, of_label] : materials) {
        labels.push_back(label);
    }
    return labels;
}

/// The first names of a database, as errors show them.
std::string some_of(const std::map<std::string, std::uint32_t>& materials) {
    std::vector<std::string> names;
    for (const auto& [name, material] : materials) {
        if (names.size() == most_named) {
            names.emplace_back("...");
            break;
        }
        names.push_back(name);
    }
    return fmt::format("{}", fmt::join(names, ", "));
}

[[noreturn]] void fail_without_reference(std::span<const std::string> names,
                                         const ByLabel& materials, const std::string& reference) {
    if (materials.empty()) {
        throw Error(
            Fault::usage,
            fmt::format("found no labels: materials are called like \"{}\"; expected "
                        "\"{}/NAME\" for originals and other labels for approximations, as several "
                        "databases give them",
                        names.empty() ? "" : names.front(), reference));
    }
    throw Error(Fault::usage, fmt::format("found no material of \"{}\"; the labels are: {}",
                                          reference, fmt::join(labels_of(materials), ", ")));
}

[[noreturn]] void fail_without_approximation(const ByLabel& materials,
                                             const std::string& reference) {
    const auto& originals = materials.at(reference);
    const auto other = std::ranges::find_if(
        materials, [&](const auto& of_label) { return of_label.first != reference; });
    if (other == materials.end()) {
        throw InputError(
            fmt::format("all materials are of \"{}\", and nothing approximates them; expected "
                        "another database with materials of the same names",
                        reference));
    }
    throw InputError(fmt::format(
        "no material of another label has the name of one of \"{}\": those are called {}, of "
        "\"{}\" {}; expected approximations to be called like their originals",
        reference, some_of(originals), other->first, some_of(other->second)));
}

}  // namespace

Approximations find_approximations(std::span<const std::string> names,
                                   const std::string& reference) {
    const auto materials = by_label(names);
    const auto originals = materials.find(reference);
    if (originals == materials.end()) {
        fail_without_reference(names, materials, reference);
    }
    Approximations result;
    result.reference = reference;
    for (const auto& [label, of_label] : materials) {
        if (label == reference) {
            continue;
        }
        const auto index = static_cast<std::uint32_t>(result.labels.size());
        const auto known = result.list.size();
        for (const auto& [name, material] : of_label) {
            const auto original = originals->second.find(name);
            if (original == originals->second.end()) {
                result.without_original.push_back(names[material]);
            } else {
                result.list.push_back({original->second, material, index});
            }
        }
        (result.list.size() == known ? result.unrelated : result.labels).push_back(label);
    }
    if (result.list.empty()) {
        fail_without_approximation(materials, reference);
    }
    if (originals->second.size() * result.labels.size() > most_possible) {
        throw InputError(
            fmt::format("found {} originals of \"{}\" and {} labels of approximations; expected at "
                        "most {} of both multiplied",
                        originals->second.size(), reference, result.labels.size(), most_possible));
    }
    std::ranges::sort(result.list, {},
                      [](const Approximation& one) { return std::tuple(one.original, one.label); });
    std::ranges::sort(result.without_original);
    auto next = result.list.cbegin();
    for (const auto& [name, material] : originals->second) {
        Lacking lacking{name, {}};
        for (std::uint32_t label = 0; label < result.labels.size(); ++label) {
            if (next != result.list.cend() && next->original == material && next->label == label) {
                ++next;
            } else {
                lacking.labels.push_back(result.labels[label]);
            }
        }
        if (!lacking.labels.empty()) {
            result.lacking.push_back(std::move(lacking));
        }
    }
    return result;
}

std::vector<Pair> pairs_of(const Approximations& approximations) {
    std::vector<Pair> pairs;
    pairs.reserve(approximations.list.size());
    for (const auto& one : approximations.list) {
        pairs.push_back(one.pair());
    }
    std::ranges::sort(pairs, {},
                      [](const Pair& pair) { return std::tuple(pair.first, pair.second); });
    return pairs;
}

}  // namespace merl::scan
