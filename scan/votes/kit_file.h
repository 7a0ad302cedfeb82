#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "scan/pairs/four_materials.h"
#include "scan/votes/exclusion_rules.h"
#include "scan/votes/kit_plan.h"

namespace merl::scan {

/// One of the databases that were joined (engine/database/joined_database.h).
struct KitPart {
    std::string label;
    std::string name;
    std::string kind;
    std::optional<std::string> content_hash;  ///< of what was scanned of it, if that is known
    bool operator==(const KitPart&) const = default;
};

/// The database whose spheres a kit shows.
struct KitDatabase {
    std::string name;
    std::string kind;
    std::optional<std::string> content_hash;                  ///< of the whole, if that is known
    bool checked = false;                                     ///< against what was scanned
    std::map<std::string, std::string> material_hashes = {};  ///< of what is shown, by material
    std::map<std::string, std::string> skipped = {};          ///< bad materials, and why
    std::vector<KitPart> databases = {};                      ///< none: it is one by itself
    bool operator==(const KitDatabase&) const = default;
};

/// What the page draws by lot for each judge.
struct KitLots {
    bool sides = true;  ///< left and right are exchanged
    bool pairs = true;  ///< the two materials of a side are exchanged
    bool order = true;  ///< of the trials
    bool operator==(const KitLots&) const = default;
};

/// How the spheres of a kit are seen (docs/file-formats.md).
struct KitView {
    std::uint32_t size = 0;    ///< pixels in width and height
    double field_of_view = 0;  ///< degrees
    std::vector<std::array<double, 3>> lights;
    double exposure = 0;    ///< stops
    double background = 0;  ///< grey as displayed, 0 to 1
    std::string encoding;   ///< "gamma" or "srgb"
    bool operator==(const KitView&) const = default;
};

/// What is in kit.json (docs/file-formats.md). Texts are UTF-8. Older kits lack some of it: that is
/// empty, or as it is by default.
struct Kit {
    std::string file;     ///< what errors call it; not in the file
    std::string version;  ///< of the program that wrote it
    std::string kit_hash;
    std::string selection_hash;
    std::string first_metric;
    std::string second_metric;
    /// The label of the originals where judges say which of two approximations looks more like the
    /// original; every trial has that first on both sides. Empty: which of two pairs is more alike.
    std::string reference;
    KitDatabase database;
    std::vector<std::string> warnings;
    KitPlan plan;
    std::uint64_t sentinel_pairs = 0;  ///< closest, and as many farthest, that sentinels are from
    KitLots lots;
    KitView view;
    FourMaterials practice;
    std::vector<StatedRule> exclusion = {};  ///< of the study, if it has one
    std::vector<KitTrial> trials;
    /// After `practice`, where a study asks for more.
    std::vector<FourMaterials> more_practice = {};
    std::string study = {};       ///< the settings of its study file (JSON); empty: it has none
    std::string study_hash = {};  ///< content hash of that file
    /// Read from the study: within so many seconds nobody has seen what is to be compared.
    std::optional<double> seconds_to_see = {};
    /// Read from the study: questions that judges answer in their own words, or with any number.
    std::set<std::string> open_questions = {};
    std::string post = {};  ///< where the page sends what judges answer; empty: nowhere
    /// How each image was made, by material as shown_materials has them and by light: stops, and
    /// the share of the sphere's pixels that are brighter than white in a channel.
    std::vector<std::vector<double>> exposures = {};
    std::vector<std::vector<double>> clipped = {};
};

/// The materials that the trials show, each once, in the order in which they first occur.
std::vector<std::string> shown_materials(const Kit& kit);

/// What is drawn by lot, as kit.json and the page have it.
nlohmann::ordered_json lots_json(const KitLots& lots);

/// kit.json of a kit: its keys in their order. Hashes of materials are in the order of
/// shown_materials, and only those.
nlohmann::ordered_json kit_json(const Kit& kit);

/// kit.json as it is written.
std::string kit_text(const Kit& kit);

/// The hash (engine/base/hash.h) that tells kits apart: of everything in the kit but kit_hash, and
/// of its images, PNG files by material as shown_materials has them and by light.
std::string kit_hash_of(const Kit& kit, std::span<const std::vector<std::string>> images);

/// Reads kit.json; keys that it does not know may hold anything. Hashes, metrics and trials must be
/// there, and of a database its kind. Throws InputError.
Kit parse_kit(std::string_view text, const std::string& file);

}  // namespace merl::scan
