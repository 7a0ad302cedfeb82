#include "scan/votes/kit_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <concepts>
#include <functional>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <tuple>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "scan/io/input.h"
#include "scan/io/json_format.h"

namespace merl::scan {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

/// An object of the file, and how errors call it.
class Object {
  public:
    Object(const json& value, std::string place) : value_(value), place_(std::move(place)) {
        if (!value.is_object()) {
            fail("expected an object");
        }
    }

    const json* find(const char* key) const {
        const auto found = value_.find(key);
        return found == value_.end() ? nullptr : &*found;
    }

    const json& at(const char* key) const {
        const json* const found = find(key);
        if (found == nullptr) {
            fail(fmt::format("\"{}\" is missing", key));
        }
        return *found;
    }

    std::string text(const char* key) const {
        if (!at(key).is_string()) {
            fail(fmt::format("\"{}\": expected a text", key));
        }
        return at(key).get<std::string>();
    }

    std::pair<std::string, std::string> two_texts(const char* key) const {
        const json& both = at(key);
        if (!both.is_array() || both.size() != 2 || !both[0].is_string() || !both[1].is_string()) {
            fail(fmt::format("\"{}\": expected two texts", key));
        }
        return {both[0].get<std::string>(), both[1].get<std::string>()};
    }

    /// An object in this one; none if there is none.
    std::optional<Object> object(const char* key) const {
        const json* const found = find(key);
        return found == nullptr ? std::nullopt : std::optional(Object(*found, place(key)));
    }

    /// How errors call what a key has.
    std::string place(const char* key) const { return fmt::format("{}, {}", place_, key); }

    /// Reads what older kits lack, if it is there.
    void read(const char* key, std::string& to) const {
        if (find(key) != nullptr) {
            to = text(key);
        }
    }

    void read(const char* key, bool& to) const {
        if (const json* const found = find(key)) {
            if (!found->is_boolean()) {
                fail(fmt::format("\"{}\": expected true or false", key));
            }
            to = found->get<bool>();
        }
    }

    void read(const char* key, double& to) const {
        if (const json* const found = find(key)) {
            if (!found->is_number()) {
                fail(fmt::format("\"{}\": expected a number", key));
            }
            to = found->get<double>();
        }
    }

    template <std::unsigned_integral Whole>
    void read(const char* key, Whole& to) const {
        if (const json* const found = find(key)) {
            constexpr auto most = std::numeric_limits<Whole>::max();
            if (!found->is_number_unsigned() || found->get<std::uint64_t>() > most) {
                fail(fmt::format("\"{}\": expected a whole number from 0 to {}", key, most));
            }
            to = found->get<Whole>();
        }
    }

    [[noreturn]] void fail(const std::string& what) const {
        throw InputError(fmt::format("{}: {}", place_, what));
    }

  private:
    const json& value_;
    std::string place_;
};

FourMaterials read_sides(const Object& object) {
    const auto left = object.two_texts("left");
    const auto right = object.two_texts("right");
    return {left.first, left.second, right.first, right.second};
}

KitTrial trial_of(const Object& object) {
    const json& number = object.at("configuration");
    if (!number.is_number_unsigned() || number.get<std::uint64_t>() == 0) {
        object.fail("\"configuration\": expected a whole number from 1");
    }
    const auto kind = kind_of(object.text("kind"));
    if (!kind) {
        object.fail("\"kind\": expected selection, repeat, sentinel or random");
    }
    KitTrial trial{.configuration = number.get<std::uint64_t>(),
                   .kind = *kind,
                   .materials = read_sides(object),
                   .agreement = std::nullopt};
    if (const auto fault = fault_of_trial(trial.materials, *kind); !fault.empty()) {
        object.fail(fault);
    }
    if (*kind == TrialKind::sentinel) {
        const json& expected = object.at("expected");
        if (expected != 1 && expected != 3) {
            object.fail("\"expected\": expected 1 or 3");
        }
        trial.expected = expected == 1 ? 1 : 3;
    }
    if (const json* const agreement = object.find("agreement");
        agreement != nullptr && agreement->is_number()) {
        trial.agreement = agreement->get<double>();
    }
    return trial;
}

/// Takes the trials out of a kit one by one as it is parsed, and of the rest only what is wanted:
/// whatever else a file holds needs no memory. To be called by the parser (nlohmann::json::parse),
/// whose depth is 1 at the keys of the kit, 2 at its trials and 3 at their keys.
class KitFilter {
  public:
    explicit KitFilter(std::string file) : file_(std::move(file)) {}

    std::vector<KitTrial> take_trials() { return std::move(trials_); }

    /// Whether the parser is to keep what it has found.
    bool operator()(int depth, json::parse_event_t event, json& parsed) {
        using Event = json::parse_event_t;
        const bool begins = event == Event::object_start || event == Event::array_start;
        if (begins && depth > kDeepest) {
            fail(file_, fmt::format("is nested more than {} deep", kDeepest));
        }
        if (depth == 0 && event == Event::array_start) {
            fail(file_, "expected an object");
        }
        if (depth == 1 && event == Event::key) {
            return key_of_kit(parsed.get_ref<const std::string&>());
        }
        if (depth == 1 && at_format_ && (begins || event == Event::value)) {
            // Before the trials, which a newer kit may write in another way.
            expect_known_format(json::object({{"format", parsed}}), file_);
        }
        if (in_trials_ && depth == 2 && event == Event::object_end) {
            take(parsed);
            return false;
        }
        if (in_trials_ && depth == 2 && event != Event::object_start) {
            fail(place(), "expected an object");
        }
        if (in_trials_ && depth == 2) {
            values_ = 0;
            skipping_ = false;
        }
        if (in_trials_ && depth == 3 && event == Event::key) {
            skipping_ = !is_among(kKeysOfTrial, parsed.get_ref<const std::string&>());
        }
        if (skipping_) {
            return false;
        }
        if ((begins || event == Event::value) && depth > 1 &&
            ++values_ > (in_trials_ ? kMostValuesOfTrial : kMostValues)) {
            fail(in_trials_ ? place() : file_, "found an array that is too long");
        }
        return true;
    }

  private:
    static constexpr int kDeepest = 100;
    static constexpr int kMostValues = 200'000;  // below a key of the kit
    static constexpr int kMostValuesOfTrial = 100;
    static constexpr std::array<std::string_view, 14> kKeysOfKit = {
        "format",   "program",  "kit_hash", "seed",     "selection_hash", "metrics", "reference",
        "database", "warnings", "options",  "practice", "exclusion",      "study",   "trials"};
    static constexpr std::array<std::string_view, 6> kKeysOfTrial = {
        "configuration", "kind", "left", "right", "expected", "agreement"};

    static bool is_among(std::span<const std::string_view> keys, std::string_view key) {
        return std::ranges::find(keys, key) != keys.end();
    }

    [[noreturn]] static void fail(const std::string& where, const std::string& what) {
        throw InputError(fmt::format("{}: {}", where, what));
    }

    std::string place() const { return fmt::format("{}, trials[{}]", file_, trials_.size()); }

    bool key_of_kit(const std::string& key) {
        values_ = 0;
        in_trials_ = key == "trials";
        at_format_ = key == "format";
        if (in_trials_ && std::exchange(has_trials_, true)) {
            fail(file_, "found \"trials\" twice");
        }
        skipping_ = !is_among(kKeysOfKit, key);
        return !skipping_;
    }

    void take(const json& value) {
        const Object object(value, place());
        trials_.push_back(trial_of(object));
        const auto& trial = trials_.back();
        if (trials_.size() > max_trials) {
            fail(file_, fmt::format("\"trials\": expected an array of 1 to {} trials", max_trials));
        }
        if (!seen_.emplace(trial.configuration, trial.kind).second) {
            object.fail(fmt::format("found configuration {} a second time as {}",
                                    trial.configuration, kind_name(trial.kind)));
        }
    }

    std::string file_;
    std::vector<KitTrial> trials_;
    std::set<std::pair<std::uint64_t, TrialKind>> seen_;
    bool has_trials_ = false;
    bool in_trials_ = false;
    bool at_format_ = false;
    bool skipping_ = false;  // what belongs to an unknown key
    int values_ = 0;
};

std::vector<std::string> read_warnings(const json& list, const Object& kit) {
    if (!list.is_array() || !std::ranges::all_of(list, &json::is_string)) {
        kit.fail("\"warnings\": expected texts");
    }
    return list.get<std::vector<std::string>>();
}

std::optional<std::string> read_content_hash(const Object& object) {
    const json* const hash = object.find("content_hash");
    return hash != nullptr && !hash->is_null() ? std::optional(object.text("content_hash"))
                                               : std::nullopt;
}

std::vector<KitPart> read_parts(const json& list, const Object& database) {
    if (!list.is_array()) {
        database.fail("\"databases\": expected an array");
    }
    std::vector<KitPart> parts;
    for (const json& element : list) {
        const Object object(element, database.place("databases"));
        auto& part = parts.emplace_back();
        part.label = object.text("label");
        object.read("name", part.name);
        part.kind = object.text("kind");
        part.content_hash = read_content_hash(object);
    }
    return parts;
}

KitDatabase read_database(const Object& object) {
    KitDatabase database;
    object.read("name", database.name);
    database.kind = object.text("kind");
    database.content_hash = read_content_hash(object);
    object.read("checked", database.checked);
    if (const json* const parts = object.find("databases")) {
        database.databases = read_parts(*parts, object);
    }
    if (const auto skipped = object.object("skipped")) {
        for (const auto& [material, reason] : object.at("skipped").items()) {
            database.skipped[material] = skipped->text(material.c_str());
        }
    }
    if (const auto hashes = object.object("material_hashes")) {
        for (const auto& [material, hash] : object.at("material_hashes").items()) {
            database.material_hashes[material] = hashes->text(material.c_str());
        }
    }
    return database;
}

std::vector<std::array<double, 3>> read_lights(const json& list, const Object& options) {
    const auto is_direction = [](const json& light) {
        return light.is_array() && light.size() == 3 &&
               std::ranges::all_of(light, [](const json& x) { return x.is_number(); });
    };
    if (!list.is_array() || !std::ranges::all_of(list, is_direction)) {
        options.fail("\"lights\": expected three numbers for each");
    }
    return list.get<std::vector<std::array<double, 3>>>();
}

void read_options(const Object& options, Kit& kit) {
    options.read("repeats_percent", kit.plan.repeats);
    options.read("sentinels", kit.plan.sentinels);
    options.read("sentinel_pairs", kit.sentinel_pairs);
    options.read("random", kit.plan.random);
    if (const auto lots = options.object("randomise")) {
        lots->read("sides", kit.lots.sides);
        lots->read("pairs", kit.lots.pairs);
        lots->read("order", kit.lots.order);
    }
    options.read("size", kit.view.size);
    options.read("field_of_view", kit.view.field_of_view);
    if (const json* const lights = options.find("lights")) {
        kit.view.lights = read_lights(*lights, options);
    }
    options.read("exposure", kit.view.exposure);
    options.read("background", kit.view.background);
    options.read("encoding", kit.view.encoding);
}

/// The second material of a side comes after one period, and the page takes no answer before the
/// earliest time, less the frame or so in which spheres came.
void read_timing(const Object& timing, Kit& kit) {
    constexpr double kFrames = 50;
    double milliseconds = 0;
    timing.read(kit.reference.empty() ? "period_ms" : "earliest_ms", milliseconds);
    if (milliseconds > 0) {
        kit.seconds_to_see = (milliseconds - (kit.reference.empty() ? 0 : kFrames)) / 1000;
    }
}

/// The names of the questions of a study that have no answers to choose from.
std::set<std::string> read_open_questions(const Object& study) {
    std::set<std::string> names;
    for (const auto* key : {"before", "after"}) {
        const json* const questions = study.find(key);
        if (questions == nullptr || questions->is_null()) {  // those of every kit
            continue;
        }
        if (!questions->is_array()) {
            study.fail(fmt::format("\"{}\": expected an array", key));
        }
        for (const json& question : *questions) {
            const Object object(question, study.place(key));
            if (const auto kind = object.text("kind"); kind == "text" || kind == "number") {
                names.insert(object.text("name"));
            }
        }
    }
    return names;
}

/// Throws InputError unless the trials are as the reference says.
void check_reference(const Kit& kit) {
    for (std::size_t i = 0; i < kit.trials.size(); ++i) {
        const auto& m = kit.trials[i].materials;
        if (kit.reference.empty() ? m[0] == m[1] || m[2] == m[3]
                                  : m[0] != m[2] || !m[0].starts_with(kit.reference + "/")) {
            throw InputError(fmt::format(
                "{}, trials[{}]: found {} and {} against {} and {}; expected {}", kit.file, i, m[0],
                m[1], m[2], m[3],
                kit.reference.empty()
                    ? "two materials on each side"
                    : fmt::format("an original, \"{}/…\", first on both sides", kit.reference)));
        }
    }
}

ordered_json sides_json(const FourMaterials& m) {
    return {{"left", {m[0], m[1]}}, {"right", {m[2], m[3]}}};
}

ordered_json trial_json(const KitTrial& trial) {
    ordered_json object = {{"configuration", trial.configuration}, {"kind", kind_name(trial.kind)}};
    object.update(sides_json(trial.materials));
    if (trial.expected != 0) {
        object["expected"] = trial.expected;
    }
    object["agreement"] = trial.agreement ? ordered_json(*trial.agreement) : ordered_json();
    return object;
}

ordered_json database_json(const Kit& kit) {
    const auto& database = kit.database;
    ordered_json hashes = ordered_json::object();
    for (const auto& material : shown_materials(kit)) {
        if (const auto found = database.material_hashes.find(material);
            found != database.material_hashes.end()) {
            hashes[material] = found->second;
        }
    }
    const auto hash_json = [](const std::optional<std::string>& hash) {
        return hash ? ordered_json(*hash) : ordered_json();
    };
    ordered_json object = {{"name", database.name},
                           {"kind", database.kind},
                           {"content_hash", hash_json(database.content_hash)},
                           {"checked", database.checked},
                           {"material_hashes", hashes}};
    if (!database.skipped.empty()) {
        object["skipped"] = database.skipped;
    }
    for (const auto& part : database.databases) {
        object["databases"].push_back({{"label", part.label},
                                       {"name", part.name},
                                       {"kind", part.kind},
                                       {"content_hash", hash_json(part.content_hash)}});
    }
    return object;
}

ordered_json options_json(const Kit& kit) {
    return {{"repeats_percent", kit.plan.repeats},
            {"sentinels", kit.plan.sentinels},
            {"sentinel_pairs", kit.sentinel_pairs},
            {"random", kit.plan.random},
            {"randomise", lots_json(kit.lots)},
            {"size", kit.view.size},
            {"field_of_view", kit.view.field_of_view},
            {"lights", kit.view.lights},
            {"exposure", kit.view.exposure},
            {"background", kit.view.background},
            {"encoding", kit.view.encoding}};
}

/// The rules of a study by which a judge is invalid: those that it has.
ordered_json exclusion_json(const ordered_json& study) {
    ordered_json rules = ordered_json::object();
    for (const auto& rule : study["exclusion"].items()) {
        if (!rule.value().is_null() && rule.value() != false) {
            rules[rule.key()] = rule.value();
        }
    }
    return rules;
}

ordered_json by_material(const Kit& kit, const std::vector<std::vector<double>>& figures) {
    ordered_json object = ordered_json::object();
    const auto shown = shown_materials(kit);
    for (std::size_t m = 0; m < figures.size(); ++m) {
        object[shown[m]] = figures[m];
    }
    return object;
}

/// What kits without a study have not, but for `images`.
void add_study(const Kit& kit, ordered_json& object) {
    if (!kit.exposures.empty()) {
        object["images"] = {{"exposure", by_material(kit, kit.exposures)},
                            {"clipped", by_material(kit, kit.clipped)}};
    }
    if (!kit.post.empty()) {
        object["post"] = kit.post;
    }
    if (!kit.study.empty()) {
        const auto study = ordered_json::parse(kit.study);
        object["study_hash"] = kit.study_hash;
        object["exclusion"] = exclusion_json(study);
        object["study"] = study;
    }
    for (const auto& practice : kit.more_practice) {
        object["more_practice"].push_back(sides_json(practice));
    }
}

}  // namespace

std::vector<std::string> shown_materials(const Kit& kit) {
    std::vector<std::string> shown;
    std::set<std::string_view> known;
    for (const auto& trial : kit.trials) {
        for (const auto& material : trial.materials) {
            if (known.insert(material).second) {
                shown.push_back(material);
            }
        }
    }
    return shown;
}

ordered_json lots_json(const KitLots& lots) {
    return {{"sides", lots.sides}, {"pairs", lots.pairs}, {"order", lots.order}};
}

ordered_json kit_json(const Kit& kit) {
    ordered_json trials = ordered_json::array();
    std::ranges::transform(kit.trials, std::back_inserter(trials), trial_json);
    ordered_json object = json_head(kit.version);
    object.update(ordered_json{{"kit_hash", kit.kit_hash},
                               {"seed", kit.plan.seed},
                               {"selection_hash", kit.selection_hash},
                               {"metrics", {kit.first_metric, kit.second_metric}}});
    if (!kit.reference.empty()) {
        object["reference"] = kit.reference;
    }
    object.update(ordered_json{{"database", database_json(kit)},
                               {"warnings", kit.warnings},
                               {"options", options_json(kit)}});
    add_study(kit, object);
    object["practice"] = sides_json(kit.practice);
    object["trials"] = trials;
    return object;
}

std::string kit_text(const Kit& kit) {
    return kit_json(kit).dump(2) + "\n";
}

std::string kit_hash_of(const Kit& kit, std::span<const std::vector<std::string>> images) {
    ordered_json object = kit_json(kit);
    object["kit_hash"] = "";
    std::string all = object.dump();
    for (const auto& lights : images) {
        for (const auto& image : lights) {
            all += image;
        }
    }
    return hash_of(all);
}

Kit parse_kit(std::string_view text, const std::string& file) {
    KitFilter filter(file);
    json content;
    try {
        content = json::parse(text, std::ref(filter));
    } catch (const json::exception& error) {
        throw InputError(fmt::format("{}: is no JSON: {}", file, json_fault(error)));
    }
    const Object object(content, file);
    Kit kit;
    kit.file = file;
    std::tie(kit.first_metric, kit.second_metric) = object.two_texts("metrics");
    kit.kit_hash = object.text("kit_hash");
    kit.selection_hash = object.text("selection_hash");
    kit.trials = filter.take_trials();
    if (const auto program = object.object("program")) {
        program->read("version", kit.version);
    }
    if (const auto database = object.object("database")) {
        kit.database = read_database(*database);
    }
    if (const json* const warnings = object.find("warnings")) {
        kit.warnings = read_warnings(*warnings, object);
    }
    object.read("reference", kit.reference);
    object.read("seed", kit.plan.seed);
    if (const auto options = object.object("options")) {
        read_options(*options, kit);
    }
    if (const auto practice = object.object("practice")) {
        kit.practice = read_sides(*practice);
    }
    if (const json* const exclusion = object.find("exclusion")) {
        kit.exclusion = parse_rules(*exclusion, object.place("exclusion"));
    }
    if (const auto study = object.object("study")) {
        if (const auto timing = study->object("timing")) {
            read_timing(*timing, kit);
        }
        kit.open_questions = read_open_questions(*study);
    }
    if (!object.at("trials").is_array() || kit.trials.empty()) {
        object.fail(fmt::format("\"trials\": expected an array of 1 to {} trials", max_trials));
    }
    check_reference(kit);
    return kit;
}

}  // namespace merl::scan
