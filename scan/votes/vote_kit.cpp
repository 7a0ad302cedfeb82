#include "scan/votes/vote_kit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <utility>

#include "engine/base/error.h"
#include "scan/io/input.h"
#include "scan/io/json_format.h"

namespace merl::scan {
namespace {

using nlohmann::json;

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

    [[noreturn]] void fail(const std::string& what) const {
        throw InputError(fmt::format("{}: {}", place_, what));
    }

  private:
    const json& value_;
    std::string place_;
};

KitTrial trial_of(const Object& object) {
    const json& number = object.at("configuration");
    if (!number.is_number_unsigned() || number.get<std::uint64_t>() == 0) {
        object.fail("\"configuration\": expected a whole number from 1");
    }
    const auto kind = kind_of(object.text("kind"));
    if (!kind) {
        object.fail("\"kind\": expected selection, repeat, sentinel or random");
    }
    const auto left = object.two_texts("left");
    const auto right = object.two_texts("right");
    KitTrial trial{.configuration = number.get<std::uint64_t>(),
                   .kind = *kind,
                   .materials = {left.first, left.second, right.first, right.second},
                   .agreement = std::nullopt};
    if (const auto fault = fault_of(trial.materials); !fault.empty()) {
        object.fail(fault);
    }
    if (*kind == TrialKind::sentinel) {
        const json& expected = object.at("expected");
        if (expected != 1 && expected != 3) {
            object.fail("\"expected\": expected 1 or 3");
        }
        trial.expected = expected.get<std::uint8_t>();
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
    static constexpr std::array<std::string_view, 6> kKeysOfKit = {
        "format", "kit_hash", "selection_hash", "metrics", "database", "trials"};
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

void read_database(const Object& database, VoteKit& kit) {
    kit.database_kind = database.text("kind");
    if (const json* const hashes = database.find("material_hashes")) {
        const Object by_material(*hashes, kit.file + ", material_hashes");
        for (const auto& [material, hash] : hashes->items()) {
            kit.material_hashes[material] = by_material.text(material.c_str());
        }
    }
}

}  // namespace

VoteKit parse_vote_kit(std::string_view text, const std::string& file) {
    KitFilter filter(file);
    json content;
    try {
        content = json::parse(text, std::ref(filter));
    } catch (const json::exception& error) {
        throw InputError(fmt::format("{}: is no JSON: {}", file, json_fault(error)));
    }
    const Object kit(content, file);
    const auto metrics = kit.two_texts("metrics");
    VoteKit result{.file = file,
                   .kit_hash = kit.text("kit_hash"),
                   .selection_hash = kit.text("selection_hash"),
                   .first_metric = metrics.first,
                   .second_metric = metrics.second,
                   .trials = filter.take_trials(),
                   .database_kind = {},
                   .material_hashes = {}};
    if (const json* const database = kit.find("database")) {
        read_database(Object(*database, file + ", database"), result);
    }
    if (!kit.at("trials").is_array() || result.trials.empty()) {
        kit.fail(fmt::format("\"trials\": expected an array of 1 to {} trials", max_trials));
    }
    return result;
}

}  // namespace merl::scan
