#include "scan/tune/folds.h"

#include <algorithm>
#include <boost/random/uniform_int_distribution.hpp>
#include <random>
#include <span>
#include <utility>

namespace merl::scan {
namespace {

/// Deals the materials that take part to groups, as evenly as there are: [group] of them.
std::vector<std::vector<std::uint32_t>> deal(const std::vector<bool>& takes_part,
                                             std::uint32_t groups, std::uint64_t seed) {
    std::vector<std::uint32_t> materials;
    for (std::uint32_t m = 0; m < takes_part.size(); ++m) {
        if (takes_part[m]) {
            materials.push_back(m);
        }
    }
    std::mt19937_64 random(seed);
    // Not std::shuffle, which may differ from one library to the next.
    for (std::size_t i = materials.size(); i > 1; --i) {
        boost::random::uniform_int_distribution<std::size_t> draw(0, i - 1);
        std::swap(materials[i - 1], materials[draw(random)]);
    }
    std::vector<std::vector<std::uint32_t>> result(std::min<std::size_t>(groups, materials.size()));
    for (std::size_t i = 0; i < materials.size(); ++i) {
        result[i % result.size()].push_back(materials[i]);
    }
    return result;
}

/// Calls `take` with every choice of `size` of `count` things, each marked in a list.
template <typename Take>
void for_each_choice(std::size_t count, std::size_t size, const Take& take) {
    if (size > count) {
        return;
    }
    std::vector<bool> chosen(count);
    std::fill_n(chosen.begin(), size, true);
    do {
        take(chosen);
    } while (std::prev_permutation(chosen.begin(), chosen.end()));
}

bool is_useful(const Fold& fold, const Judgements& judgements) {
    bool trains = false;
    bool tests = false;
    for (const auto& judgement : judgements.list) {
        const auto materials = materials_of(judgement, judgements.materials);
        trains = trains || (judgement.votes() > 0 && fold.trains(materials));
        tests = tests || (judgement.untied() && fold.tests(materials));
        if (trains && tests) {
            return true;
        }
    }
    return false;
}

}  // namespace

std::string name_of(FoldKind kind) {
    return kind == FoldKind::references ? "references" : "materials";
}

bool Fold::tests(const JudgedMaterials& materials) const {
    if (kind == FoldKind::references) {
        return left_out[materials.list[0]];
    }
    return std::ranges::all_of(materials.all(), [&](auto material) { return left_out[material]; });
}

bool Fold::trains(const JudgedMaterials& materials) const {
    if (kind == FoldKind::references) {
        return !left_out[materials.list[0]];
    }
    return std::ranges::none_of(materials.all(), [&](auto material) { return left_out[material]; });
}

std::vector<Fold> make_folds(FoldKind kind, const Judgements& judgements, std::uint64_t seed) {
    std::vector<bool> takes_part(judgements.materials);
    std::size_t most_materials = 0;
    for (const auto& judgement : judgements.list) {
        const auto materials = materials_of(judgement, judgements.materials);
        const auto all = materials.all();
        most_materials = std::max(most_materials, all.size());
        for (const auto material : kind == FoldKind::references ? all.first(1) : all) {
            takes_part[material] = true;
        }
    }
    const bool by_reference = kind == FoldKind::references;
    const auto groups = deal(takes_part, by_reference ? reference_folds : material_groups, seed);
    std::vector<Fold> folds;
    for_each_choice(groups.size(), by_reference ? 1 : most_materials,
                    [&](const std::vector<bool>& chosen) {
                        Fold fold{kind, std::vector<bool>(judgements.materials)};
                        for (std::size_t g = 0; g < groups.size(); ++g) {
                            for (const auto material : groups[g]) {
                                fold.left_out[material] = chosen[g];
                            }
                        }
                        if (is_useful(fold, judgements)) {
                            folds.push_back(std::move(fold));
                        }
                    });
    return folds;
}

}  // namespace merl::scan
