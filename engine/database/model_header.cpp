#include "engine/database/model_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/glsl_header.h"
#include "engine/base/text.h"

namespace merl::engine {
namespace {

/// Those of models also have capitals, as in the literature.
bool is_parameter_name(const std::string& name) {
    std::string lower = name;
    std::ranges::transform(lower, lower.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return is_header_name(lower);
}

/// Takes the first word off a text.
std::string take_word(std::string_view& text) {
    const auto end = std::min(text.find_first_of(" \t"), text.size());
    std::string word(text.substr(0, end));
    text = trimmed(text.substr(end));
    return word;
}

/// "vec3 NAME description" or "float NAME description".
ModelParameter parse_parameter(const HeaderLine& line, const std::string& place) {
    std::string_view rest = line.text;
    ModelParameter parameter;
    const auto type = take_word(rest);
    parameter.name = take_word(rest);
    parameter.description = rest;
    parameter.is_rgb = type == "vec3";
    if ((type != "vec3" && type != "float") || !is_parameter_name(parameter.name) ||
        parameter.description.empty()) {
        throw InputError(
            fmt::format("{}the parameter is \"{}\": expected vec3 or float, a name of a letter, "
                        "then letters, digits and _, at most {} in all, and a description",
                        place, line.text, longest_header_name));
    }
    return parameter;
}

}  // namespace

std::vector<std::string> ModelParameter::columns() const {
    if (!is_rgb) {
        return {name};
    }
    return {name + "_red", name + "_green", name + "_blue"};
}

std::vector<std::string> ModelHeader::columns() const {
    std::vector<std::string> all;
    for (const auto& parameter : parameters) {
        for (auto& column : parameter.columns()) {
            all.push_back(std::move(column));
        }
    }
    return all;
}

ModelHeader parse_model_header(std::string_view text, const std::string& file) {
    ModelHeader header;
    const std::array<std::pair<std::string_view, std::string*>, 7> texts = {{
        {"title", &header.title},
        {"database", &header.database},
        {"formula", &header.formula},
        {"source", &header.source},
        {"table", &header.table},
        {"slow", &header.slow},
        {"note", &header.note},
    }};
    for (const auto& line : read_glsl_header(text).lines) {
        const auto place = fmt::format("{}:{}: ", file, line.number);
        if (line.key == "parameter") {
            auto parameter = parse_parameter(line, place);
            if (std::ranges::find(header.parameters, parameter.name, &ModelParameter::name) !=
                header.parameters.end()) {
                throw InputError(fmt::format("{}a second parameter {}", place, parameter.name));
            }
            header.parameters.push_back(std::move(parameter));
            continue;
        }
        const auto* const known =
            std::ranges::find(texts, line.key, &std::pair<std::string_view, std::string*>::first);
        if (known == texts.end()) {
            throw InputError(
                fmt::format("{}\"{}:\" is no key of a model; the keys are title, database, "
                            "formula, source, table, slow, note and parameter",
                            place, line.key));
        }
        if (!known->second->empty() || line.text.empty()) {
            throw InputError(fmt::format("{}{} \"{}:\"", place,
                                         line.text.empty() ? "no value of" : "a second", line.key));
        }
        *known->second = line.text;
    }
    for (const auto& [key, value] : texts) {
        if (value->empty() && key != "slow" && key != "note") {
            throw InputError(fmt::format("{}: has no \"// {}: ...\"", file, key));
        }
    }
    if (header.parameters.empty()) {
        throw InputError(fmt::format("{}: has no \"// parameter: ...\"", file));
    }
    return header;
}

}  // namespace merl::engine
