#include "engine/metric/double_literals.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <utility>

namespace merl::engine {
namespace {

bool is_digit(char c) {
    return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

bool in_word(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

/// The end of the digits that begin at `at`.
std::size_t end_of_digits(std::string_view text, std::size_t at) {
    while (at < text.size() && is_digit(text[at])) {
        ++at;
    }
    return at;
}

/// The end of a decimal number that begins at `at`, without its suffix: that of 10 in "10u".
/// Whether it has a point or an exponent is the second.
std::pair<std::size_t, bool> end_of_number(std::string_view text, std::size_t at) {
    bool is_floating = false;
    auto end = end_of_digits(text, at);
    if (end < text.size() && text[end] == '.') {
        is_floating = true;
        end = end_of_digits(text, end + 1);
    }
    if (end < text.size() && (text[end] == 'e' || text[end] == 'E')) {
        const bool has_sign =
            end + 1 < text.size() && (text[end + 1] == '+' || text[end + 1] == '-');
        const auto digits = end + (has_sign ? 2 : 1);
        if (digits < text.size() && is_digit(text[digits])) {
            is_floating = true;
            end = end_of_digits(text, digits);
        }
    }
    return {end, is_floating};
}

}  // namespace

std::string with_double_literals(std::string_view text) {
    std::string result;
    std::size_t depth = 0;  // of braces
    bool in_function = false;
    char before = ' ';  // what is before a brace, but for spaces
    for (std::size_t at = 0; at < text.size();) {
        const char c = text[at];
        const auto first = at;
        if (c == '#') {
            at = std::min(text.find('\n', at), text.size());
        } else if (is_digit(c) || (c == '.' && at + 1 < text.size() && is_digit(text[at + 1]))) {
            const auto [end, is_floating] = end_of_number(text, at);
            auto suffix = end;
            while (suffix < text.size() && in_word(text[suffix])) {
                ++suffix;
            }
            const auto letters = text.substr(end, suffix - end);
            at = suffix;
            if (is_floating && in_function &&
                (letters.empty() || letters == "f" || letters == "F")) {
                result += text.substr(first, end - first);
                result += "lf";
                continue;
            }
        } else if (in_word(c)) {
            while (at < text.size() && in_word(text[at])) {
                ++at;
            }
        } else {
            if (c == '{') {
                in_function = in_function || (depth == 0 && before == ')');
                ++depth;
            } else if (c == '}') {
                depth -= depth > 0 ? 1 : 0;
                in_function = in_function && depth > 0;
            }
            ++at;
        }
        if (std::isspace(static_cast<unsigned char>(c)) == 0 && c != '#') {
            before = text[at - 1];
        }
        result += text.substr(first, at - first);
    }
    return result;
}

}  // namespace merl::engine
