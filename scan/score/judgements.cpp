#include "scan/score/judgements.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/base/error.h"
#include "scan/io/input.h"
#include "scan/pairs/pairs.h"

namespace merl::scan {
namespace {

constexpr std::uint32_t no_material = max_materials;

/// The index of every name of the file among `materials`, or `no_material`.
std::vector<std::uint32_t> look_up(const std::vector<std::string>& names,
                                   std::span<const std::string> materials) {
    std::vector<std::uint32_t> indices;
    indices.reserve(names.size());
    for (const auto& name : names) {
        const auto place = std::ranges::lower_bound(materials, name);
        indices.push_back(place != materials.end() && *place == name
                              ? static_cast<std::uint32_t>(place - materials.begin())
                              : no_material);
    }
    return indices;
}

/// The materials of a row without repetition.
std::vector<std::uint32_t> named_by(const NamedVotes& row) {
    std::vector<std::uint32_t> all = {row.left_1, row.left_2, row.right_1, row.right_2};
    std::ranges::sort(all);
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
}

/// The row with materials as `index` says, oriented.
Judgement make_judgement(const NamedVotes& row, const std::vector<std::uint32_t>& index,
                         std::uint32_t materials) {
    const auto pair = [&](std::uint32_t a, std::uint32_t b) {
        const auto [first, second] = std::minmax(index[a], index[b]);
        return pair_index({first, second}, materials);
    };
    Judgement judgement{pair(row.left_1, row.left_2), pair(row.right_1, row.right_2),
                        row.votes_left, row.votes_equal, row.votes_right};
    if (judgement.right < judgement.left) {
        std::swap(judgement.left, judgement.right);
        std::swap(judgement.votes_left, judgement.votes_right);
    }
    return judgement;
}

/// Adds up what is on the same configuration; leaves the list sorted.
void merge(std::vector<Judgement>& list) {
    const auto configuration = [](const Judgement& j) { return std::pair(j.left, j.right); };
    std::ranges::sort(list, {}, configuration);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < list.size(); ++i) {
        if (kept > 0 && configuration(list[kept - 1]) == configuration(list[i])) {
            list[kept - 1].votes_left += list[i].votes_left;
            list[kept - 1].votes_equal += list[i].votes_equal;
            list[kept - 1].votes_right += list[i].votes_right;
        } else {
            list[kept++] = list[i];
        }
    }
    list.resize(kept);
}

/// Whether a material is called so but for the label of its database.
bool lacks_label(const std::string& name, std::span<const std::string> materials) {
    return std::ranges::any_of(materials, [&](const std::string& material) {
        return material.size() > name.size() && material.ends_with(name) &&
               material[material.size() - name.size() - 1] == '/';
    });
}

[[noreturn]] void nothing_left(const JudgementFile& file, const Judgements& judgements,
                               std::span<const std::string> materials) {
    constexpr std::size_t named = 5;
    std::string names;
    for (std::size_t i = 0; i < std::min(named, judgements.unknown.size()); ++i) {
        names += fmt::format("{}\"{}\"", i == 0 ? "" : ", ", judgements.unknown[i].name);
    }
    const bool labelled = std::ranges::any_of(judgements.unknown, [&](const UnknownMaterial& one) {
        return lacks_label(one.name, materials);
    });
    throw InputError(fmt::format(
        "{}: each of the {} rows names a material that has no distances; {} such: {}{}{}",
        file.file, judgements.rows, judgements.unknown.size(), names,
        judgements.unknown.size() > named ? " …" : "",
        labelled
            ? "; with several databases, or a label, materials are called label/name: name one "
              "database without a label"
            : ""));
}

}  // namespace

JudgedMaterials materials_of(const Judgement& judgement, std::uint32_t materials) {
    const Pair left = pair_at(judgement.left, materials);
    const Pair right = pair_at(judgement.right, materials);
    for (const std::uint32_t reference : {left.first, left.second}) {
        if (reference == right.first || reference == right.second) {
            return {{reference, left.first + left.second - reference,
                     right.first + right.second - reference, 0},
                    true};
        }
    }
    return {{left.first, left.second, right.first, right.second}, false};
}

Judgements resolve_judgements(const JudgementFile& file, std::span<const std::string> materials) {
    const auto count = static_cast<std::uint32_t>(materials.size());
    const auto index = look_up(file.names, materials);
    std::vector<std::uint64_t> rows_with(file.names.size());
    Judgements result;
    result.materials = count;
    result.rows = file.rows.size();
    result.list.reserve(file.rows.size());
    for (const auto& row : file.rows) {
        bool known = true;
        for (const std::uint32_t material : named_by(row)) {
            ++rows_with[material];
            known = known && index[material] != no_material;
        }
        if (known) {
            result.list.push_back(make_judgement(row, index, count));
        } else {
            ++result.rows_with_unknown;
        }
    }
    for (std::size_t i = 0; i < file.names.size(); ++i) {
        if (index[i] == no_material && rows_with[i] > 0) {
            result.unknown.push_back({file.names[i], rows_with[i]});
        }
    }
    std::ranges::sort(result.unknown, {}, &UnknownMaterial::name);
    if (result.list.empty()) {
        nothing_left(file, result, materials);
    }
    merge(result.list);
    result.without_votes = std::erase_if(result.list, [](const auto& j) { return j.votes() == 0; });
    if (result.list.empty()) {
        throw InputError(fmt::format(
            "{}: found no vote in the {} rows whose materials are known; expected at least one",
            file.file, result.rows - result.rows_with_unknown));
    }
    return result;
}

}  // namespace merl::scan
