// Part of the build: makes the C++ file of a library metric from its GLSL file, and that of a model
// from its GLSL file and the table beside it. "single" is the second file of a metric, its sum in
// float32, which is empty where nobody needs it.
//     make_twin metric NAME.glsl INCLUDE_NAME OUTPUT.cpp TEMPLATE SUMMARY_TEMPLATE
//     make_twin single NAME.glsl INCLUDE_NAME OUTPUT.cpp TEMPLATE
//     make_twin model NAME.glsl INCLUDE_NAME OUTPUT.cpp TEMPLATE
#include <fmt/format.h>

#include <cctype>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "engine/database/model_header.h"
#include "engine/metric/metric_header.h"

namespace {

std::string read(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        throw std::runtime_error(path + ": cannot be opened");
    }
    return {std::istreambuf_iterator<char>(file), {}};
}

std::string replaced(std::string text, const std::string& key, const std::string& value) {
    for (auto at = text.find(key); at != std::string::npos;
         at = text.find(key, at + value.size())) {
        text.replace(at, key.size(), value);
    }
    return text;
}

/// A name as a part of an identifier: "sun-log2" as "sun_log2".
std::string identifier(std::string name) {
    for (char& c : name) {
        c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
    }
    return name;
}

/// What stands for each @KEY@ of a template, in the order in which they are replaced.
using Values = std::vector<std::pair<std::string, std::string>>;

std::string filled(std::string text, const Values& values) {
    for (const auto& [key, value] : values) {
        const std::string placeholder = "@" + key + "@";
        text = replaced(std::move(text), placeholder, value);
    }
    return text;
}

/// What the files of metrics and of models have in common.
Values common_values(const std::string& path, const std::string& include_name,
                     const std::string& text) {
    const auto name = std::filesystem::path(path).stem().string();
    return {{"ID", identifier(name)},
            {"NAME", name},
            {"FILE", include_name},
            {"TEXT", "R\"glsl(" + text + ")glsl\""}};
}

/// Whether the host sums a metric in float32 by its own text (MetricTwin::sum_in_float32).
bool is_summed_in_float32(const merl::engine::MetricHeader& header) {
    return header.degree == 0 && header.features == 0;
}

std::string make_metric(const std::string& path, const std::string& include_name,
                        const std::string& text_template, const std::string& summary_template) {
    const std::string text = read(path);
    const auto header = merl::engine::parse_metric_header(text, path);
    std::string members;  // the parameters, in the order of the header; float as the file has it
    std::string parameters;
    std::string singles;
    for (std::size_t i = 0; i < header.parameters.size(); ++i) {
        members += fmt::format("    float {};\n", header.parameters[i].name);
        parameters += fmt::format("parameters[{}], ", i);
        singles += fmt::format("static_cast<float>(parameters[{}]), ", i);
    }
    std::string windows;
    for (std::size_t w = 0; w < header.windows.size(); ++w) {
        windows += fmt::format("    [[maybe_unused]] static constexpr int {} = {};\n",
                               header.windows[w].name, w);
    }
    const std::string single = "sum_in_float32_" + identifier(std::filesystem::path(path).stem());
    const bool has_single = is_summed_in_float32(header);
    const std::string declaration =
        has_single ? fmt::format(
                         "double {}(std::span<const double>, const BlockScalars&, const "
                         "BlockScalars&, const SingleWeights&);\n",
                         single)
                   : "";
    Values values = {{"MEMBERS", members},
                     {"VALUES", parameters},
                     {"SINGLES", singles},
                     {"WINDOWS", windows},
                     {"IN_FLOAT32", has_single ? single : "nullptr"},
                     {"DECLARATION", declaration},
                     {"WINDOW", header.windows.empty()
                                    ? "nullptr"
                                    : "window_" + identifier(std::filesystem::path(path).stem())},
                     {"WINDOW_COUNT", std::to_string(header.windows.size())}};
    const auto common = common_values(path, include_name, text);
    values.insert(values.end(), common.begin(), common.end());
    return filled(read(header.features > 0 ? summary_template : text_template), values);
}

std::string make_single(const std::string& path, const std::string& include_name,
                        const std::string& text_template) {
    return is_summed_in_float32(merl::engine::parse_metric_header(read(path), path))
               ? make_metric(path, include_name, text_template, "")
               : "// " + include_name + " has a degree, or is a summary.\n";
}

std::string make_model(const std::string& path, const std::string& include_name,
                       const std::string& text_template) {
    const std::string text = read(path);
    const auto header = merl::engine::parse_model_header(text, path);
    std::string members;  // the parameters, in the order of the header
    std::string parameters;
    std::size_t column = 0;
    for (const auto& parameter : header.parameters) {
        members +=
            fmt::format("    {} {};\n", parameter.is_rgb ? "vec3" : "double", parameter.name);
        parameters +=
            fmt::format(fmt::runtime(parameter.is_rgb ? "vec3(values[{}], values[{}], values[{}]), "
                                                      : "values[{}], "),
                        column, column + 1, column + 2);
        column += parameter.columns().size();
    }
    Values values = {{"MEMBERS", members}, {"VALUES", parameters}};
    const auto common = common_values(path, include_name, text);
    values.insert(values.end(), common.begin(), common.end());
    values.emplace_back(
        "TABLE",
        "R\"csv(" + read(std::filesystem::path(path).replace_extension(".csv")) + ")csv\"");
    return filled(read(text_template), values);
}

}  // namespace

int main(int argc, char** argv) {
    try {
        const std::vector<std::string> words(argv + 1, argv + argc);
        const bool is_metric = words.size() == 6 && words[0] == "metric";
        const bool is_single = words.size() == 5 && words[0] == "single";
        if (!is_metric && !is_single && !(words.size() == 5 && words[0] == "model")) {
            throw std::runtime_error(
                "expected metric, single or model, NAME.glsl INCLUDE_NAME OUTPUT.cpp TEMPLATE, and "
                "of a "
                "metric SUMMARY_TEMPLATE");
        }
        std::ofstream out(words[3], std::ios::binary);
        out << (is_metric   ? make_metric(words[1], words[2], words[4], words[5])
                : is_single ? make_single(words[1], words[2], words[4])
                            : make_model(words[1], words[2], words[4]));
        out.close();
        if (!out) {
            throw std::runtime_error(fmt::format("{}: cannot be written", words[3]));
        }
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "make_twin: %s\n", error.what());
        return 1;
    }
}
