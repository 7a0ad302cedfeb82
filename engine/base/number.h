#pragma once

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace merl {

/// The whole text as a decimal number (std::from_chars); none for any other text.
template <typename Number>
std::optional<Number> parse_number(std::string_view text) {
    Number value = 0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    return error == std::errc() && stop == end ? std::optional(value) : std::nullopt;
}

/// A finite number.
inline std::optional<double> parse_finite(std::string_view text) {
    const auto value = parse_number<double>(text);
    return value && std::isfinite(*value) ? value : std::nullopt;
}

/// A finite number, zero or more.
inline std::optional<double> parse_magnitude(std::string_view text) {
    const auto value = parse_finite(text);
    return value && *value >= 0 ? value : std::nullopt;
}

}  // namespace merl
