#include "scan/votes/judge_file.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>

#include "engine/base/text.h"
#include "scan/io/input.h"
#include "scan/io/json_format.h"

namespace merl::scan {
namespace {

using nlohmann::json;

/// A value of the file, and how errors call it.
class Value {
  public:
    Value(const json& value, std::string place) : value_(value), place_(std::move(place)) {}

    Value at(const std::string& key) const {
        if (!value_.is_object()) {
            fail("an object");
        }
        const auto found = value_.find(key);
        if (found == value_.end()) {
            throw InputError(fmt::format("{}: \"{}\" is missing", place_, key));
        }
        return {*found, fmt::format("{}, {}", place_, key)};
    }

    std::vector<Value> elements(std::size_t least, std::size_t most) const {
        if (!value_.is_array() || value_.size() < least || value_.size() > most) {
            fail(fmt::format("an array of {}", least == most
                                                   ? fmt::format("{}", least)
                                                   : fmt::format("{} to {}", least, most)));
        }
        std::vector<Value> list;
        for (std::size_t i = 0; i < value_.size(); ++i) {
            list.emplace_back(value_[i], fmt::format("{}[{}]", place_, i));
        }
        return list;
    }

    std::string text() const {
        if (!value_.is_string()) {
            fail("a text");
        }
        return value_.get<std::string>();
    }

    std::uint64_t whole(std::uint64_t least, std::uint64_t most) const {
        if (!value_.is_number_unsigned() || value_.get<std::uint64_t>() < least ||
            value_.get<std::uint64_t>() > most) {
            fail(fmt::format("a whole number from {} to {}", least, most));
        }
        return value_.get<std::uint64_t>();
    }

    double magnitude() const {
        if (!value_.is_number() || value_.get<double>() < 0) {
            fail("a number, zero or more");
        }
        return value_.get<double>();
    }

    bool flag() const {
        if (!value_.is_boolean()) {
            fail("true or false");
        }
        return value_.get<bool>();
    }

    bool is_null() const { return value_.is_null(); }
    const json& get() const { return value_; }

    [[noreturn]] void fail(const std::string& expected) const {
        throw InputError(
            fmt::format("{}: found {}; expected {}", place_, json_quote(value_), expected));
    }

    const std::string& place() const { return place_; }

  private:
    const json& value_;
    std::string place_;
};

std::pair<std::string, std::string> materials_of(const Value& side) {
    const auto both = side.elements(2, 2);
    return {both[0].text(), both[1].text()};
}

TrialRow row_of(const Value& trial, std::uint64_t number) {
    constexpr std::uint64_t kMost = 1'000'000'000;
    const auto kind = kind_of(trial.at("kind").text());
    if (!kind) {
        trial.at("kind").fail("selection, repeat, sentinel or random");
    }
    const auto left = materials_of(trial.at("left"));
    const auto right = materials_of(trial.at("right"));
    TrialRow row{.line = number,
                 .trial = trial.at("trial").whole(1, kMost),
                 .configuration = trial.at("configuration").whole(1, kMost),
                 .kind = *kind,
                 .shown = {left.first, left.second, right.first, right.second},
                 .swapped = trial.at("swapped").whole(0, 1) == 1,
                 .vote = 0,
                 .response_ms = std::nullopt};
    if (const auto vote = trial.at("vote"); !vote.is_null()) {
        row.vote = static_cast<std::uint8_t>(vote.whole(1, 3));
    }
    if (const auto time = trial.at("response_ms"); !time.is_null()) {
        row.response_ms = time.magnitude();
    }
    if (const auto fault = fault_of_trial(row.shown, row.kind); !fault.empty()) {
        throw InputError(fmt::format("{}: {}", trial.place(), fault));
    }
    return row;
}

}  // namespace

bool is_judge_file(std::string_view text) {
    return trimmed(without_byte_order_mark(text)).starts_with('{');
}

JudgeFile parse_judge_file(std::string_view text, const std::string& file) {
    json content;
    std::vector<std::string> questions;  // in the order of the page, which `content` does not keep
    bool in_survey = false;
    JsonCheck<json> check(file);
    const auto watch = [&](int depth, json::parse_event_t event, json& parsed) {
        if (event == json::parse_event_t::key && depth == 1) {
            in_survey = parsed == "survey";
        } else if (event == json::parse_event_t::key && depth == 2 && in_survey) {
            questions.push_back(parsed.get<std::string>());
        }
        return check(depth, event, parsed);
    };
    try {
        content = json::parse(without_byte_order_mark(text), watch);
    } catch (const json::exception& error) {
        throw InputError(fmt::format("{}: is no JSON: {}", file, json_fault(error)));
    }
    const Value value(content, file);
    if (value.at("format").get() != "merl-scan judge") {
        value.at("format").fail("\"merl-scan judge\", which the page of a kit saves");
    }
    if (value.at("version").get() != 1) {
        value.at("version").fail("1; it may be of a newer merl-scan");
    }
    JudgeFile result;
    result.votes = {.file = file,
                    .judge = value.at("judge").text(),
                    .kit_hash = value.at("kit_hash").text(),
                    .rows = {}};
    if (result.votes.judge.empty()) {
        value.at("judge").fail("a name");
    }
    std::set<std::uint64_t> numbers;
    std::set<std::pair<std::uint64_t, TrialKind>> trials;
    for (const auto& trial : value.at("trials").elements(1, max_trials)) {
        auto row = row_of(trial, result.votes.rows.size() + 1);
        if (!numbers.insert(row.trial).second) {
            throw InputError(
                fmt::format("{}: found trial {} a second time", trial.place(), row.trial));
        }
        if (!trials.emplace(row.configuration, row.kind).second) {
            throw InputError(fmt::format("{}: found configuration {} a second time as {}",
                                         trial.place(), row.configuration, kind_name(row.kind)));
        }
        result.votes.rows.push_back(std::move(row));
    }
    const auto survey = value.at("survey");
    if (!survey.get().is_object() || survey.get().size() > max_answers) {
        survey.fail(fmt::format("an object of at most {} answers", max_answers));
    }
    for (const auto& question : questions) {
        result.survey.push_back({.judge = result.votes.judge,
                                 .question = question,
                                 .answer = survey.at(question).text()});
    }
    if (const auto calibration = value.at("calibration"); !calibration.is_null()) {
        if (const auto passed = calibration.at("passed"); !passed.is_null()) {
            result.votes.calibration_failed = !passed.flag();
        }
    }
    return result;
}

}  // namespace merl::scan
