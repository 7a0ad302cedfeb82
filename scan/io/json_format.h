#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "scan/io/input.h"

namespace merl::scan {

/// What `format` is in the JSON files that are written: it grows when a reader of an older version
/// would misunderstand them. Files of before there were formats have none.
inline constexpr std::uint64_t json_format = 1;

/// What each of them begins with: its format, and the program that wrote it.
inline nlohmann::ordered_json json_head(const std::string& version) {
    return {{"format", json_format}, {"program", {{"name", "merl-scan"}, {"version", version}}}};
}

/// Throws InputError, calling the file `file`, when `content`, an object of nlohmann::json, has a
/// format that is not known here.
template <typename Json>
void expect_known_format(const Json& content, const std::string& file) {
    const auto found = content.find("format");
    if (found == content.end()) {
        return;
    }
    if (!found->is_number_unsigned() || *found == 0) {
        throw InputError(fmt::format("{}: \"format\": found {}; expected a whole number from 1",
                                     file,
                                     found->dump(-1, ' ', false, Json::error_handler_t::replace)));
    }
    if (*found > json_format) {
        throw InputError(
            fmt::format("{}: was written by a newer merl-scan, in format {}; this one "
                        "reads formats up to {}",
                        file, found->template get<std::uint64_t>(), json_format));
    }
}

/// A value as errors quote it: ASCII, of a long one the beginning. Of what JsonCheck has let pass.
template <typename Json>
std::string json_quote(const Json& value) {
    constexpr std::size_t kMost = 60;
    const auto text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
    return text.size() > kMost ? text.substr(0, kMost) + "..." : text;
}

/// For the parser of nlohmann::json, of files that strangers may have made: throws InputError for a
/// key that an object has twice, which readers take in different ways, and for what is nested so
/// deeply that the stack does not suffice to quote it.
template <typename Json>
class JsonCheck {
  public:
    explicit JsonCheck(std::string file) : file_(std::move(file)) {}

    bool operator()(int depth, typename Json::parse_event_t event, Json& parsed) {
        using Event = typename Json::parse_event_t;
        constexpr int kDeepest = 100;
        if (depth > kDeepest) {
            throw InputError(fmt::format("{}: is nested more than {} deep", file_, kDeepest));
        }
        if (event == Event::object_start) {
            keys_.emplace_back();
        } else if (event == Event::object_end) {
            keys_.pop_back();
        } else if (event == Event::key &&
                   !keys_.back().insert(parsed.template get_ref<const std::string&>()).second) {
            throw InputError(fmt::format("{}: found the key {} twice", file_, json_quote(parsed)));
        }
        return true;
    }

  private:
    std::string file_;
    std::vector<std::set<std::string>> keys_;  // of the objects that are not at their end
};

}  // namespace merl::scan
