#include "app/pages/judge_study.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>
#include <vector>

#include "app/pages/judge_texts_json.h"
#include "engine/base/hash.h"
#include "engine/base/text.h"
#include "scan/io/input.h"
#include "scan/io/json_format.h"
#include "scan/votes/exclusion_rules.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

enum class Kind {
    format,
    flag,
    whole,
    number,
    choice,
    text,       ///< for judges: a text for all languages, or an object with one for each
    language,   ///< the tag of one that is offered
    languages,  ///< tags
    texts,      ///< by language, by key of judge_texts.json
    questions,
};

/// A key of the study file. One whose value is null by default may be null.
struct Setting {
    std::string_view path;      ///< section and key, or a key
    Kind kind;                  //
    std::string_view fallback;  ///< JSON
    double least = 0;
    double most = 0;
    std::string_view choices = {};  ///< "|this|that|"
    std::string_view meaning = {};
};

constexpr std::string_view kFields =
    "Told to the judge with the consent; null: true where there is a consent text, otherwise "
    "false.";

constexpr std::array kSettings = {
    Setting{"format", Kind::format, "1", 1, 1, "", "Of this file."},
    Setting{"title", Kind::text, "null", 0, 0, "",
            "What stands above everything. Texts for judges are one text, or an object with one "
            "for each language: {\"en\": \"...\", \"sv\": \"...\"}. null: the question of the "
            "experiment."},
    Setting{"languages", Kind::languages, R"(["en", "sv"])", 0, 0, "",
            "Those that judges can choose. One other than en and sv needs all of \"texts\"."},
    Setting{"language", Kind::language, "null", 0, 0, "",
            "The one to begin with. null: the browser's if it is offered, otherwise the first."},
    Setting{"instructions", Kind::choice, "\"kit\"", 0, 0, "|kit|thesis|",
            "\"thesis\": those of Ryman 2018 word for word, which are in English and for pairs."},
    Setting{"consent", Kind::text, "null", 0, 0, "",
            "What a judge has to agree to before anything is recorded, with a tick; an empty line "
            "between paragraphs. The list of what is recorded follows it, and every screen then "
            "has a way to withdraw, which erases. null: nobody is asked."},
    Setting{"debrief", Kind::text, "null", 0, 0, "", "What judges read when they are done."},
    Setting{"texts", Kind::texts, "{}", 0, 0, "",
            "Any text of the page, by language and key: {\"en\": {\"begin\": \"Start now\"}}. All "
            "keys and what they are by default are at the end of this file."},
    Setting{"before", Kind::questions, "[]", 0, 0, "",
            "Questions before the practice. Each is an object with \"name\" (small letters, digits "
            "and _: what it is called in the files), \"kind\" (\"text\", \"number\", \"scale\" or "
            "\"choice\"), \"text\" and, where it must be answered, \"required\": true. A number "
            "has \"least\" and \"most\"; a scale these, whole, and \"low\" and \"high\" for the "
            "words at its ends; a choice \"choices\": [{\"answer\": \"no\", \"text\": \"No\"}]."},
    Setting{"after", Kind::questions, "null", 0, 0, "",
            "Questions afterwards, likewise. null: those of the kit; []: none."},
    Setting{"surround", Kind::choice, "\"light\"", 0, 0, "|light|grey|",
            "\"grey\": all screens are as grey as what is around the spheres, so that eyes stay "
            "adapted."},
    Setting{"timing.period_ms", Kind::whole, "1000", 200, 10000, "",
            "How long each material of a side is shown, of a kit of pairs."},
    Setting{"timing.earliest_ms", Kind::whole, "null", 250, 600000, "",
            "No answer before a configuration has been seen so long. null: period_ms and 250 more, "
            "which is the least for pairs, or 500 for approximations."},
    Setting{"timing.latest_ms", Kind::whole, "null", 500, 600000, "",
            "Whoever has not answered by then goes on; the configuration comes again at the end. "
            "null: there is no such limit."},
    Setting{"timing.between", Kind::choice, "\"nothing\"", 0, 0, "|nothing|blank|mask|",
            "What is shown before each configuration."},
    Setting{"timing.between_ms", Kind::whole, "500", 100, 10000, "", "And how long."},
    Setting{"timing.break_every", Kind::whole, "0", 0, 100000, "",
            "A break after so many answers; 0: none."},
    Setting{"timing.break_seconds", Kind::whole, "0", 0, 3600, "", "How long it is at least."},
    Setting{"practice.trials", Kind::whole, "1", 1, 20, "",
            "Practice configurations, whose right answer is plain."},
    Setting{"practice.pass", Kind::whole, "0", 0, 20, "",
            "How many of them must be answered rightly before the experiment begins."},
    Setting{"practice.attempts", Kind::whole, "0", 0, 100, "",
            "Whoever does not pass in so many attempts takes no part; 0: any number."},
    Setting{"spheres.unit", Kind::choice, "\"window\"", 0, 0, "|window|pixels|degrees|",
            "Spheres are as large as the window has room for (and never larger than their images), "
            "or have a diameter in CSS pixels or in degrees of the field of view, which needs "
            "calibration.card. Where the window has no room the page asks for a larger one."},
    Setting{"spheres.diameter", Kind::number, "null", 0.1, 10000, "", "In that unit."},
    Setting{"spheres.exposure", Kind::choice, "\"fixed\"", 0, 0, "|fixed|by image|",
            "\"fixed\": --exposure for all. \"by image\": each so that a hundredth of its pixels "
            "is clipped, and --exposure on top; brightness can then not be compared any more."},
    Setting{"exclusion.sentinels_failed", Kind::whole, "null", 1, 1000, "",
            "Who is an invalid judge, stated before anybody takes part: `merl-scan votes` says who "
            "is, and all figures with and without. So many failed sentinels or more;"},
    Setting{"exclusion.repeats_below", Kind::number, "null", 0, 1, "",
            "a smaller share of repeats, above 0, answered like the first time;"},
    Setting{"exclusion.median_time_below", Kind::number, "null", 0, 600, "",
            "a smaller median response time, above 0, in seconds;"},
    Setting{"exclusion.same_key_above", Kind::number, "null", 0, 1, "",
            "a larger share of answers, below 1, given with one key;"},
    Setting{"exclusion.calibration_failed", Kind::flag, "false", 0, 0, "",
            "whose screen failed the check of calibration.gamma."},
    Setting{"calibration.card", Kind::flag, "false", 0, 0, "",
            "The size of the screen, by a bank card held against it, and the distance to it."},
    Setting{"calibration.gamma", Kind::flag, "false", 0, 0, "",
            "The brightness of the screen, by matching a grey with stripes, twice."},
    Setting{"calibration.gamma_least", Kind::number, "1.8", 0.5, 5, "",
            "A screen with a smaller gamma fails,"},
    Setting{"calibration.gamma_most", Kind::number, "2.6", 0.5, 5, "", "and one with a larger."},
    Setting{"calibration.colour_vision", Kind::flag, "false", 0, 0, "",
            "Is it normal, and which test was it found with?"},
    Setting{"calibration.window_width", Kind::whole, "0", 0, 20000, "",
            "CSS pixels; nobody begins in a smaller window,"},
    Setting{"calibration.window_height", Kind::whole, "0", 0, 20000, "", "or a lower one."},
    Setting{"record.clock", Kind::flag, "null", 0, 0, "", kFields},
    Setting{"record.browser", Kind::flag, "null"},
    Setting{"record.language", Kind::flag, "null"},
    Setting{"record.screen", Kind::flag, "null"},
    Setting{"record.time_zone", Kind::flag, "null"},
    Setting{"record.forced_colors", Kind::flag, "null"},
    Setting{"record.prefers_color_scheme", Kind::flag, "null"},
    Setting{"record.panel", Kind::flag, "null", 0, 0, "",
            "PROLIFIC_PID, STUDY_ID and SESSION_ID of the page's address."},
};

const ordered_json& built_in_texts() {
    static const auto texts = ordered_json::parse(kJudgeTexts);
    return texts;
}

bool is_empty(const ordered_json& text) {
    return text.get_ref<const std::string&>().empty();
}

std::string found_text(const ordered_json& value) {
    auto text = value.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
    constexpr std::size_t kMost = 60;
    if (text.size() > kMost) {
        auto end = kMost;
        while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) {
            --end;
        }
        text = fmt::format("{}...", text.substr(0, end));
    }
    return text;
}

/// Whether text is a BCP 47 tag as far as a page needs to know.
bool is_language_tag(const std::string& text) {
    if (text.size() < 2 || text.size() > 35 || text.starts_with('-') || text.ends_with('-')) {
        return false;
    }
    return std::isalpha(static_cast<unsigned char>(text[0])) != 0 &&
           std::isalpha(static_cast<unsigned char>(text[1])) != 0 &&
           std::ranges::all_of(text, [](char c) {
               return c == '-' || std::isalnum(static_cast<unsigned char>(c)) != 0;
           });
}

/// The {names} of values that a text has.
std::set<std::string> places_in(const std::string& text) {
    std::set<std::string> places;
    for (auto begin = text.find('{'); begin != std::string::npos; begin = text.find('{', begin)) {
        const auto end = text.find('}', ++begin);
        if (end == std::string::npos) {
            break;
        }
        places.insert(text.substr(begin, end - begin));
    }
    return places;
}

/// The texts of a language without those of a study; none if it is not built in. Those of
/// `thesis` are for pairs.
ordered_json texts_of(const std::string& language, bool is_reference, bool thesis) {
    const auto& all = built_in_texts();
    if (!all["languages"].contains(language)) {
        return nullptr;
    }
    ordered_json texts = all["languages"][language];
    if (is_reference) {
        texts.update(all["reference"][language]);
    }
    if (thesis) {
        texts.update(all["thesis"][language]);
    }
    return texts;
}

class StudyReader {
  public:
    StudyReader(std::string file, bool is_reference)
        : file_(std::move(file)), is_reference_(is_reference) {}

    ordered_json read(const ordered_json& content) {
        if (!content.is_object()) {
            fail("", content, "an object");
        }
        scan::expect_known_format(content, file_);
        check_keys(content);
        // What texts are checked against comes first.
        read_languages(content);
        ordered_json settings;
        for (const auto& setting : kSettings) {
            const auto path = std::string(setting.path);
            const auto dot = path.find('.');
            const ordered_json* given = nullptr;
            if (dot == std::string::npos) {
                given = content.contains(path) ? &content[path] : nullptr;
            } else if (const auto section = content.find(path.substr(0, dot));
                       section != content.end() && section->contains(path.substr(dot + 1))) {
                given = &(*section)[path.substr(dot + 1)];
            }
            auto value = given == nullptr ? ordered_json::parse(setting.fallback)
                                          : read_value(setting, *given);
            if (dot == std::string::npos) {
                settings[path] = std::move(value);
            } else {
                settings[path.substr(0, dot)][path.substr(dot + 1)] = std::move(value);
            }
        }
        complete(settings);
        check(settings);
        return settings;
    }

  private:
    [[noreturn]] void fail(const std::string& path, const std::string& what) const {
        throw InputError(
            fmt::format("{}: {}{}", file_, path.empty() ? "" : fmt::format("{}: ", path), what));
    }

    [[noreturn]] void fail(const std::string& path, const ordered_json& found,
                           const std::string& expected) const {
        fail(path, fmt::format("found {}; expected {}", found_text(found), expected));
    }

    void check_keys(const ordered_json& content) const {
        std::vector<std::string> known;
        std::set<std::string> sections;
        for (const auto& setting : kSettings) {
            const auto path = std::string(setting.path);
            const auto dot = path.find('.');
            const auto first = path.substr(0, dot);
            if (dot != std::string::npos && !sections.insert(first).second) {
                continue;
            }
            known.push_back(first);
        }
        expect_known(content, "", known);
        for (const auto& section : sections) {
            if (!content.contains(section)) {
                continue;
            }
            if (!content[section].is_object()) {
                fail(section, content[section], "an object");
            }
            std::vector<std::string> keys;
            for (const auto& setting : kSettings) {
                if (setting.path.starts_with(section + ".")) {
                    keys.emplace_back(setting.path.substr(section.size() + 1));
                }
            }
            expect_known(content[section], section, keys);
        }
    }

    void expect_known(const ordered_json& object, const std::string& path,
                      const std::vector<std::string>& known) const {
        for (const auto& item : object.items()) {
            if (std::ranges::find(known, item.key()) == known.end()) {
                fail(path.empty() ? item.key() : path + "." + item.key(),
                     fmt::format("is no key that is known here; there are {}",
                                 fmt::join(known, ", ")));
            }
        }
    }

    void read_languages(const ordered_json& content) {
        languages_ = content.contains("languages") ? read_tags(content["languages"])
                                                   : std::vector<std::string>{"en", "sv"};
        const auto style = content.find("instructions");
        thesis_ = style != content.end() && *style == "thesis";
        if (thesis_ && !content.contains("languages")) {
            languages_ = {"en"};
        }
    }

    std::vector<std::string> read_tags(const ordered_json& value) const {
        if (!value.is_array() || value.empty() || value.size() > 50) {
            fail("languages", value, "one to 50 languages");
        }
        std::vector<std::string> tags;
        for (std::size_t i = 0; i < value.size(); ++i) {
            const auto path = fmt::format("languages[{}]", i);
            if (!value[i].is_string() || !is_language_tag(value[i].get<std::string>())) {
                fail(path, value[i], R"(a language, as in "en" or "pt-BR")");
            }
            const auto tag = value[i].get<std::string>();
            if (std::ranges::find(tags, tag) != tags.end()) {
                fail(path, fmt::format("found {} a second time", tag));
            }
            tags.push_back(tag);
        }
        return tags;
    }

    ordered_json read_value(const Setting& setting, const ordered_json& value) const {
        const std::string path(setting.path);
        if (value.is_null() && setting.fallback == "null") {
            return value;
        }
        switch (setting.kind) {
            case Kind::format:
                return value;
            case Kind::flag:
                if (!value.is_boolean()) {
                    fail(path, value, "true or false");
                }
                return value;
            case Kind::whole:
                return read_number(path, value, setting.least, setting.most, true);
            case Kind::number:
                return read_number(path, value, setting.least, setting.most, false);
            case Kind::choice:
                return read_choice(path, value, setting.choices);
            case Kind::text:
                return read_text(path, value);
            case Kind::language:
                if (!value.is_string() ||
                    std::ranges::find(languages_, value.get<std::string>()) == languages_.end()) {
                    fail(path, value, fmt::format("one of {}", fmt::join(languages_, ", ")));
                }
                return value;
            case Kind::languages:
                return languages_;
            case Kind::texts:
                return read_texts(value);
            case Kind::questions:
                return read_questions(path, value);
        }
        return value;
    }

    ordered_json read_number(const std::string& path, const ordered_json& value, double least,
                             double most, bool whole) const {
        if (!value.is_number() || value.get<double>() < least || value.get<double>() > most ||
            (whole && value.get<double>() != std::floor(value.get<double>()))) {
            fail(path, value,
                 fmt::format("a {} from {} to {}", whole ? "whole number" : "number", least, most));
        }
        // 1e3 is a whole number, too.
        return whole ? ordered_json(static_cast<std::int64_t>(value.get<double>())) : value;
    }

    ordered_json read_choice(const std::string& path, const ordered_json& value,
                             std::string_view choices) const {
        const auto wanted =
            value.is_string() ? fmt::format("|{}|", value.get<std::string>()) : std::string();
        if (wanted.size() < 3 || value.get<std::string>().find('|') != std::string::npos ||
            choices.find(wanted) == std::string_view::npos) {
            std::string list;
            for (std::size_t begin = 1; begin < choices.size();) {
                const auto end = choices.find('|', begin);
                list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ",
                                    choices.substr(begin, end - begin));
                begin = end + 1;
            }
            fail(path, value, fmt::format("one of {}", list));
        }
        return value;
    }

    std::string text_at(const std::string& path, const ordered_json& value) const {
        if (!value.is_string() || trimmed(value.get_ref<const std::string&>()).empty()) {
            fail(path, value, "a text");
        }
        return value.get<std::string>();
    }

    /// By language.
    ordered_json read_text(const std::string& path, const ordered_json& value) const {
        ordered_json texts = ordered_json::object();
        if (value.is_string()) {
            for (const auto& language : languages_) {
                texts[language] = text_at(path, value);
            }
            return texts;
        }
        if (!value.is_object()) {
            fail(path, value, "a text, or an object with one for each language");
        }
        expect_known(value, path, languages_);
        for (const auto& language : languages_) {
            if (!value.contains(language)) {
                fail(path,
                     fmt::format(R"(has no text for "{}", which "languages" offers)", language));
            }
            texts[language] = text_at(fmt::format("{}.{}", path, language), value[language]);
        }
        return texts;
    }

    ordered_json read_texts(const ordered_json& value) const {
        if (!value.is_object()) {
            fail("texts", value, "an object");
        }
        expect_known(value, "texts", languages_);
        const auto known = texts_of("en", is_reference_, false);
        for (const auto& of_language : value.items()) {
            const auto path = fmt::format("texts.{}", of_language.key());
            if (!of_language.value().is_object()) {
                fail(path, of_language.value(), "an object");
            }
            for (const auto& item : of_language.value().items()) {
                const auto place = path + "." + item.key();
                if (!known.contains(item.key())) {
                    fail(place, "is no text of the page; --study-template lists them");
                }
                if (!item.value().is_string()) {
                    fail(place, item.value(), "a text");
                }
                const auto places = places_in(known[item.key()].get<std::string>());
                for (const auto& name : places_in(item.value().get<std::string>())) {
                    if (!places.contains(name) && name != "count") {
                        fail(place,
                             fmt::format("found {{{}}}, which this text has no value for", name));
                    }
                }
            }
        }
        return value;
    }

    ordered_json read_questions(const std::string& path, const ordered_json& value) const {
        if (!value.is_array() || value.size() > 200) {
            fail(path, value, "an array of at most 200 questions");
        }
        ordered_json questions = ordered_json::array();
        for (std::size_t i = 0; i < value.size(); ++i) {
            questions.push_back(read_question(fmt::format("{}[{}]", path, i), value[i]));
        }
        return questions;
    }

    ordered_json read_question(const std::string& path, const ordered_json& value) const {
        if (!value.is_object()) {
            fail(path, value, "an object");
        }
        for (const auto* key : {"name", "kind", "text"}) {
            if (!value.contains(key)) {
                fail(path, fmt::format("\"{}\" is missing", key));
            }
        }
        const auto kind = read_choice(path + ".kind", value["kind"], "|text|number|scale|choice|")
                              .get<std::string>();
        std::vector<std::string> known = {"name", "kind", "text", "required"};
        if (kind == "number" || kind == "scale") {
            known.insert(known.end(), {"least", "most"});
        }
        if (kind == "scale") {
            known.insert(known.end(), {"low", "high"});
        }
        if (kind == "choice") {
            known.emplace_back("choices");
        }
        expect_known(value, path, known);
        ordered_json question = {{"name", read_name(path + ".name", value["name"])},
                                 {"kind", kind},
                                 {"text", read_text(path + ".text", value["text"])},
                                 {"required", false}};
        if (value.contains("required")) {
            if (!value["required"].is_boolean()) {
                fail(path + ".required", value["required"], "true or false");
            }
            question["required"] = value["required"];
        }
        if (kind == "number" || kind == "scale") {
            read_range(path, value, kind == "scale", question);
        }
        for (const auto* end : {"low", "high"}) {
            if (kind == "scale") {
                question[end] = value.contains(end)
                                    ? read_text(fmt::format("{}.{}", path, end), value[end])
                                    : ordered_json();
            }
        }
        if (kind == "choice") {
            question["choices"] = read_choices(path, value);
        }
        return question;
    }

    std::string read_name(const std::string& path, const ordered_json& value) const {
        auto name = value.is_string() ? value.get<std::string>() : "";
        // Objects of JavaScript have keys of their own that begin like this.
        if (name.empty() || name.size() > 60 || name[0] == '_' ||
            !std::ranges::all_of(name, [](char c) {
                return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
            })) {
            fail(path, value, "1 to 60 of the characters a to z, 0 to 9 and _, not _ first");
        }
        return name;
    }

    void read_range(const std::string& path, const ordered_json& value, bool scale,
                    ordered_json& question) const {
        constexpr double kMost = 1e9;
        constexpr double kMostSteps = 11;
        question["least"] = value.contains("least") ? read_number(path + ".least", value["least"],
                                                                  scale ? 0 : -kMost, kMost, scale)
                                                    : ordered_json(scale ? 1 : 0);
        question["most"] = value.contains("most") ? read_number(path + ".most", value["most"],
                                                                scale ? 0 : -kMost, kMost, scale)
                                                  : (scale ? ordered_json(5) : ordered_json(kMost));
        const auto steps = question["most"].get<double>() - question["least"].get<double>();
        if (steps <= 0) {
            fail(path + ".most", question["most"],
                 fmt::format("more than least, {}", question["least"].dump()));
        }
        if (scale && steps >= kMostSteps) {
            fail(path + ".most", question["most"],
                 fmt::format("a scale of at most {} steps", kMostSteps));
        }
    }

    ordered_json read_choices(const std::string& path, const ordered_json& value) const {
        const auto list = path + ".choices";
        if (!value.contains("choices")) {
            fail(path, "\"choices\" is missing");
        }
        const auto& choices = value["choices"];
        if (!choices.is_array() || choices.size() < 2 || choices.size() > 100) {
            fail(list, choices, "an array of 2 to 100 choices");
        }
        ordered_json result = ordered_json::array();
        std::set<std::string> answers;
        for (std::size_t i = 0; i < choices.size(); ++i) {
            const auto place = fmt::format("{}[{}]", list, i);
            const bool plain = choices[i].is_string();
            if (!plain && !choices[i].is_object()) {
                fail(place, choices[i], R"(a text, or an object with "answer" and "text")");
            }
            if (!plain) {
                expect_known(choices[i], place, {"answer", "text"});
                for (const auto* key : {"answer", "text"}) {
                    if (!choices[i].contains(key)) {
                        fail(place, fmt::format("\"{}\" is missing", key));
                    }
                }
            }
            const auto answer = text_at(plain ? place : place + ".answer",
                                        plain ? choices[i] : choices[i]["answer"]);
            if (!answers.insert(answer).second) {
                fail(place, fmt::format("found the answer \"{}\" a second time", answer));
            }
            result.push_back({{"answer", answer},
                              {"text", plain ? read_text(place, choices[i])
                                             : read_text(place + ".text", choices[i]["text"])}});
        }
        return result;
    }

    /// Puts in what other settings decide.
    void complete(ordered_json& settings) const {
        settings["languages"] = languages_;
        for (const auto& item : settings["record"].items()) {
            if (item.value().is_null()) {
                item.value() = !settings["consent"].is_null();
            }
        }
        auto& earliest = settings["timing"]["earliest_ms"];
        if (earliest.is_null()) {
            earliest = least_earliest(settings);
        }
    }

    std::int64_t least_earliest(const ordered_json& settings) const {
        return is_reference_ ? kGlances : settings["timing"]["period_ms"].get<int>() + kGlance;
    }

    void check(const ordered_json& settings) const {
        const auto& timing = settings["timing"];
        if (!is_reference_ &&
            timing["earliest_ms"].get<std::int64_t>() < least_earliest(settings)) {
            fail("timing.earliest_ms", timing["earliest_ms"],
                 fmt::format("{} or more, period_ms and {}: both materials have to be seen",
                             least_earliest(settings), kGlance));
        }
        if (!timing["latest_ms"].is_null() &&
            timing["latest_ms"].get<std::int64_t>() <
                timing["earliest_ms"].get<std::int64_t>() + kGlance) {
            fail("timing.latest_ms", timing["latest_ms"],
                 fmt::format("{} more than earliest_ms, {}", kGlance,
                             timing["earliest_ms"].get<std::int64_t>()));
        }
        const auto& practice = settings["practice"];
        if (practice["pass"].get<int>() > practice["trials"].get<int>()) {
            fail("practice.pass", practice["pass"],
                 fmt::format("no more than practice.trials, {}", practice["trials"].get<int>()));
        }
        check_spheres(settings);
        const auto& calibration = settings["calibration"];
        if (calibration["gamma_least"].get<double>() >= calibration["gamma_most"].get<double>()) {
            fail("calibration.gamma_most", calibration["gamma_most"],
                 fmt::format("more than gamma_least, {}", calibration["gamma_least"].dump()));
        }
        check_exclusion(settings["exclusion"]);
        if (settings["exclusion"]["calibration_failed"] == true && calibration["gamma"] == false) {
            fail("exclusion.calibration_failed", "needs calibration.gamma");
        }
        for (const auto& item : settings["record"].items()) {
            if (item.value() == true && settings["consent"].is_null()) {
                fail("record." + item.key(),
                     "is about a person, and needs a \"consent\" that says so");
            }
        }
        if (thesis_ && is_reference_) {
            fail("instructions", "those of the thesis are for pairs, not for approximations");
        }
        if (thesis_ && languages_ != std::vector<std::string>{"en"}) {
            fail("languages", "the instructions of the thesis are known in English, [\"en\"]");
        }
        check_names(settings);
        check_languages(settings);
    }

    /// `votes` has to take what goes into kit.json when everybody has taken part.
    void check_exclusion(const ordered_json& exclusion) const {
        for (const auto& rule : exclusion.items()) {
            if (!rule.value().is_null()) {
                nlohmann::json one = nlohmann::json::object();
                one[rule.key()] = rule.value();
                (void)scan::parse_rules(one, file_ + ": exclusion");
            }
        }
    }

    void check_spheres(const ordered_json& settings) const {
        const auto& spheres = settings["spheres"];
        const bool free = spheres["unit"] == "window";
        if (free != spheres["diameter"].is_null()) {
            fail("spheres.diameter", spheres["diameter"],
                 free ? "null, as spheres.unit is \"window\""
                      : fmt::format("a number of {}", spheres["unit"].get<std::string>()));
        }
        constexpr double kWidest = 90;
        if (spheres["unit"] == "degrees" && spheres["diameter"].get<double>() > kWidest) {
            fail("spheres.diameter", spheres["diameter"],
                 fmt::format("at most {} degrees", kWidest));
        }
        if (spheres["unit"] == "degrees" && settings["calibration"]["card"] == false) {
            fail("spheres.unit", "degrees need calibration.card");
        }
    }

    void check_names(const ordered_json& settings) const {
        std::set<std::string> names;
        for (const auto* list : {"before", "after"}) {
            for (std::size_t i = 0; i < settings[list].size(); ++i) {
                const auto name = settings[list][i]["name"].get<std::string>();
                if (!names.insert(name).second) {
                    fail(fmt::format("{}[{}].name", list, i),
                         fmt::format("found \"{}\" a second time", name));
                }
            }
        }
        if (!settings["after"].is_null()) {
            return;
        }
        for (const auto* own :
             {"instructions_clear", "change_clear", "look_clear", "preferred_question", "frequency",
              "sphere_size", "keys_easy", "vision_impairment", "comments"}) {
            if (names.contains(own)) {
                fail("before", fmt::format("found \"{}\", which the kit asks afterwards", own));
            }
        }
    }

    void check_languages(const ordered_json& settings) const {
        const auto& given = settings["texts"];
        const auto known = texts_of("en", is_reference_, false);
        for (const auto& language : languages_) {
            if (built_in_texts()["languages"].contains(language)) {
                continue;
            }
            std::vector<std::string> missing;
            for (const auto& item : known.items()) {
                // Nothing stands there.
                if (!is_empty(item.value()) &&
                    !(given.contains(language) && given[language].contains(item.key()))) {
                    missing.push_back(item.key());
                }
            }
            if (!missing.empty()) {
                constexpr std::size_t kShown = 10;
                const auto all = missing.size();
                missing.resize(std::min(all, kShown));
                fail("texts." + language,
                     fmt::format("{} of {} texts are missing: {}{}", all, known.size(),
                                 fmt::join(missing, ", "), all > kShown ? " ..." : ""));
            }
        }
    }

    static constexpr int kGlance = 250;   // milliseconds, as the page has it
    static constexpr int kGlances = 500;  // for approximations

    std::string file_;
    bool is_reference_;
    bool thesis_ = false;
    std::vector<std::string> languages_;
};

/// Parses JSON with comments; throws InputError, of a syntax error with the line.
ordered_json parse_with_comments(std::string_view text, const std::string& file) {
    try {
        return ordered_json::parse(without_byte_order_mark(text),
                                   scan::JsonCheck<ordered_json>(file), true, true);
    } catch (const ordered_json::exception& error) {
        throw InputError(fmt::format("{}: is no JSON: {}", file, scan::json_fault(error)));
    }
}

/// A text in lines of comments of at most 100 characters.
std::string comment(std::string_view text, std::string_view indent) {
    constexpr std::size_t kWidth = 96;
    std::string lines;
    while (!text.empty()) {
        auto end = text.size();
        if (end > kWidth) {
            end = text.rfind(' ', kWidth);
            end = end == std::string_view::npos ? text.size() : end;
        }
        lines += fmt::format("{}// {}\n", indent, text.substr(0, end));
        text = trimmed(text.substr(end));
    }
    return lines;
}

}  // namespace

Study default_study(bool is_reference) {
    return {.settings = StudyReader("", is_reference).read(ordered_json::object()), .hash = {}};
}

Study parse_study(std::string_view text, const std::string& file, bool is_reference) {
    return {.settings = StudyReader(file, is_reference).read(parse_with_comments(text, file)),
            .hash = hash_of(text)};
}

std::string study_template() {
    std::string text = comment(
        "A study file: merl-scan judge --study FILE. JSON in which comments may stand; "
        "what is left out is as it is here.",
        "");
    text += "{\n";
    std::string section;
    for (std::size_t i = 0; i < kSettings.size(); ++i) {
        const auto& setting = kSettings.at(i);
        const std::string path(setting.path);
        const auto dot = path.find('.');
        const auto first = dot == std::string::npos ? std::string() : path.substr(0, dot);
        if (first != section) {
            text += section.empty() ? "" : "  },\n";
            text += first.empty() ? "" : fmt::format("  \"{}\": {{\n", first);
            section = first;
        }
        const std::string_view indent = section.empty() ? "  " : "    ";
        text += comment(setting.meaning, indent);
        std::string range;
        if (setting.most > setting.least) {
            range = fmt::format("  // {} to {}", setting.least, setting.most);
        } else if (!setting.choices.empty()) {
            range = fmt::format("  // {}", setting.choices.substr(1, setting.choices.size() - 2));
            std::ranges::replace(range, '|', ',');
        }
        const bool last =
            i + 1 == kSettings.size() ||
            (!section.empty() && !kSettings.at(i + 1).path.starts_with(section + "."));
        text += fmt::format("{}\"{}\": {}{}{}\n", indent,
                            dot == std::string::npos ? path : path.substr(dot + 1),
                            setting.fallback, last ? "" : ",", range);
    }
    text += "  }\n}\n\n";
    text += comment(
        "All texts of the page in English, for \"texts\". Words in braces are filled in.", "");
    const auto& all = built_in_texts();
    const auto list = [&text](const ordered_json& texts) {
        for (const auto& item : texts.items()) {
            if (!is_empty(item.value())) {
                text += fmt::format("//   {}: {}\n", ordered_json(item.key()).dump(),
                                    item.value().dump());
            }
        }
    };
    list(all["languages"]["en"]);
    text += comment("Where approximations are compared with originals these are others:", "");
    list(all["reference"]["en"]);
    return text;
}

ordered_json judge_texts(const Study& study, bool is_reference) {
    const auto& settings = study.settings;
    ordered_json texts = ordered_json::object();
    for (const auto& language : settings["languages"]) {
        const auto tag = language.get<std::string>();
        auto own = texts_of(tag, is_reference, settings["instructions"] == "thesis");
        if (own.is_null()) {
            own = texts_of("en", is_reference, false);
        }
        if (settings["texts"].contains(tag)) {
            own.update(settings["texts"][tag]);
        }
        for (const auto* key : {"title", "consent", "debrief"}) {
            if (!settings[key].is_null()) {
                own[key] = settings[key][tag];
            }
        }
        texts[tag] = std::move(own);
    }
    return texts;
}

}  // namespace merl::app
