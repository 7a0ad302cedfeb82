#include "scan/vote_kit.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "scan/input.h"
#include "scan/json_format.h"

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
    json content;
    try {
        content = json::parse(text);
    } catch (const json::exception& error) {
        throw InputError(fmt::format("{}: is no JSON: {}", file, json_fault(error)));
    }
    const Object kit(content, file);
    expect_known_format(content, file);
    const auto metrics = kit.two_texts("metrics");
    VoteKit result{.file = file,
                   .kit_hash = kit.text("kit_hash"),
                   .selection_hash = kit.text("selection_hash"),
                   .first_metric = metrics.first,
                   .second_metric = metrics.second,
                   .trials = {},
                   .database_kind = {},
                   .material_hashes = {}};
    if (const json* const database = kit.find("database")) {
        read_database(Object(*database, file + ", database"), result);
    }
    const json& trials = kit.at("trials");
    if (!trials.is_array() || trials.empty() || trials.size() > max_trials) {
        kit.fail(fmt::format("\"trials\": expected an array of 1 to {} trials", max_trials));
    }
    std::set<std::pair<std::uint64_t, TrialKind>> seen;
    for (std::size_t i = 0; i < trials.size(); ++i) {
        const Object object(trials[i], fmt::format("{}, trials[{}]", file, i));
        result.trials.push_back(trial_of(object));
        const auto& trial = result.trials.back();
        if (!seen.emplace(trial.configuration, trial.kind).second) {
            object.fail(fmt::format("found configuration {} a second time as {}",
                                    trial.configuration, kind_name(trial.kind)));
        }
    }
    return result;
}

}  // namespace merl::scan
