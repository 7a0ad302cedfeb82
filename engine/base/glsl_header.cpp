#include "engine/base/glsl_header.h"

#include <algorithm>
#include <cctype>

#include "engine/base/text.h"

namespace merl {
namespace {

bool is_letter(char c) {
    return std::islower(static_cast<unsigned char>(c)) != 0;
}

}  // namespace

GlslHeader read_glsl_header(std::string_view text) {
    GlslHeader header;
    bool continues = false;  // whether the line before has a key, or continues one that has
    while (text.starts_with("//")) {
        ++header.last_line;
        const auto end = std::min(text.find('\n'), text.size());
        auto line = text.substr(2, end - 2);
        text.remove_prefix(std::min(end + 1, text.size()));
        if (continues && line.starts_with("  ")) {
            auto& value = header.lines.back().text;
            value += value.empty() ? "" : " ";
            value += trimmed(line);
            continue;
        }
        line = trimmed(line);
        const auto colon = line.find(':');
        continues = colon != std::string_view::npos && is_header_name(line.substr(0, colon));
        if (continues) {
            const auto value = trimmed(line.substr(colon + 1));
            header.lines.push_back(
                {line.substr(0, colon), value, std::string(value), header.last_line});
        }
    }
    return header;
}

bool is_header_name(std::string_view text) {
    return !text.empty() && text.size() <= longest_header_name && is_letter(text[0]) &&
           std::ranges::all_of(text, [](char c) {
               return is_letter(c) || std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '_';
           });
}

}  // namespace merl
