#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "scan/pairs/listed_distances.h"
#include "scan/pairs/pairs.h"

namespace merl::scan {

/// An original and one of its approximations, as indices into names of materials.
struct Approximation {
    std::uint32_t original;
    std::uint32_t approximation;
    std::uint32_t label;  ///< which of the labels of approximations it is of

    Pair pair() const { return pair_of(original, approximation); }
    bool operator==(const Approximation&) const = default;
};

/// An original that lacks approximations.
struct Lacking {
    std::string original;             ///< without its label
    std::vector<std::string> labels;  ///< that have none of it
    bool operator==(const Lacking&) const = default;
};

/// The approximations of the materials of one database by those of the same name in others.
struct Approximations {
    std::string reference;            ///< the label of the originals
    std::vector<std::string> labels;  ///< of the others that approximate anything, ascending
                                      ///< bytewise
    std::vector<Approximation> list;  ///< ascending by original, then label
    std::vector<Lacking> lacking;     ///< ascending by original
    std::vector<std::string> without_original;  ///< "label/name", ascending: of no original
    std::vector<std::string> unrelated;  ///< labels of others, none of whose materials has an
                                         ///< original; ascending
};

/// Finds them among names of the form "label/name", which ascend bytewise. Throws Error (usage)
/// when no name has that label, and InputError when there is no approximation at all; each says
/// what there is.
Approximations find_approximations(std::span<const std::string> names,
                                   const std::string& reference);

/// The pairs of originals and approximations, ascending.
std::vector<Pair> pairs_of(const Approximations& approximations);

}  // namespace merl::scan
