#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

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

}  // namespace merl::scan
