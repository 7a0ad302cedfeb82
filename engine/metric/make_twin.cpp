// Part of the build: makes the C++ file of a library metric from its GLSL file.
//     make_twin TEMPLATE SUMMARY_TEMPLATE METRIC.glsl INCLUDE_NAME OUTPUT.cpp
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

std::string make_twin(const std::string& text_template, const std::string& summary_template,
                      const std::string& path, const std::string& include_name) {
    const std::string text = read(path);
    const auto header = merl::engine::parse_metric_header(text, path);
    std::string members;  // the parameters, in the order of the header; float as the file has it
    std::string values;
    for (std::size_t i = 0; i < header.parameters.size(); ++i) {
        members += fmt::format("    float {};\n", header.parameters[i].name);
        values += fmt::format("parameters[{}], ", i);
    }
    std::string windows;
    for (std::size_t w = 0; w < header.windows.size(); ++w) {
        windows += fmt::format("    [[maybe_unused]] static constexpr int {} = {};\n",
                               header.windows[w].name, w);
    }
    const auto name = std::filesystem::path(path).stem().string();
    std::string result = read(header.features > 0 ? summary_template : text_template);
    for (const auto& [key, value] :
         {std::pair<std::string, std::string>{"@METRIC_ID@", identifier(name)},
          {"@METRIC_NAME@", name},
          {"@METRIC_FILE@", include_name},
          {"@METRIC_MEMBERS@", members},
          {"@METRIC_VALUES@", values},
          {"@METRIC_WINDOWS@", windows},
          {"@METRIC_WINDOW@", header.windows.empty() ? "nullptr" : "window_" + identifier(name)},
          {"@METRIC_WINDOW_COUNT@", std::to_string(header.windows.size())},
          {"@METRIC_TEXT@", "R\"glsl(" + text + ")glsl\""}}) {
        result = replaced(std::move(result), key, value);
    }
    return result;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        if (argc != 6) {
            throw std::runtime_error(
                "expected TEMPLATE SUMMARY_TEMPLATE METRIC.glsl INCLUDE_NAME OUTPUT.cpp");
        }
        std::ofstream out(argv[5], std::ios::binary);
        out << make_twin(argv[1], argv[2], argv[3], argv[4]);
        out.close();
        if (!out) {
            throw std::runtime_error(fmt::format("{}: cannot be written", argv[5]));
        }
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "make_twin: %s\n", error.what());
        return 1;
    }
}
