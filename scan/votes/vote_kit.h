#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "scan/votes/vote_file.h"

namespace merl::scan {

/// A trial that a kit has for every judge.
struct KitTrial {
    std::uint64_t configuration;
    TrialKind kind;
    FourMaterials materials;    ///< as the selection has its sides, not as a screen shows them
    std::uint8_t expected = 0;  ///< of a sentinel: 1 left or 3 right, what both metrics say
    std::optional<double> agreement;
};

/// What `votes` needs of kit.json. Of the last two, which older kits lack, there may be nothing.
struct VoteKit {
    std::string file;  ///< what errors call it
    std::string kit_hash;
    std::string selection_hash;
    std::string first_metric;
    std::string second_metric;
    std::vector<KitTrial> trials;
    std::string database_kind;
    std::map<std::string, std::string> material_hashes;  ///< of what is shown, by material
};

/// Reads kit.json (docs/file-formats.md); keys that it does not know may hold anything. Throws
/// InputError.
VoteKit parse_vote_kit(std::string_view text, const std::string& file);

}  // namespace merl::scan
