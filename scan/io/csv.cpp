#include "scan/io/csv.h"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <system_error>

namespace merl::scan {

std::string csv_field(std::string_view text) {
    if (text.find_first_of(",\"\r\n") == std::string_view::npos) {
        return std::string(text);
    }
    std::string field = "\"";
    for (const char character : text) {
        field.append(character == '"' ? 2 : 1, character);
    }
    return field += '"';
}

std::string csv_free_text(std::string_view text) {
    constexpr std::string_view formula = "=+-@\t\r";
    std::string guarded;
    if (!text.empty() && formula.find(text[0]) != std::string_view::npos) {
        guarded += '\'';
    }
    return csv_field(guarded.append(text));
}

void append_number(std::string& out, double value) {
    std::array<char, 32> digits{};
    const auto result = std::to_chars(digits.data(), digits.data() + digits.size(), value);
    out.append(digits.data(), result.ptr);
}

void append_figure(std::string& out, double value) {
    out += ',';
    if (!std::isnan(value)) {
        append_number(out, value);
    }
}

void write_all(int file, std::string_view text) {
    while (!text.empty()) {
        const ssize_t written = ::write(file, text.data(), text.size());
        if (written < 0) {
            if (errno == EINTR) {
                continue;
            }
            throw std::system_error(errno, std::generic_category(), "cannot write");
        }
        text.remove_prefix(static_cast<std::size_t>(written));
    }
}

}  // namespace merl::scan
