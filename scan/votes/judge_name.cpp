#include "scan/votes/judge_name.h"

#include <cwchar>
#include <locale>
#include <stdexcept>

namespace merl::scan {
namespace {

/// Knows the letters of Unicode and UTF-8 whatever the user's language is.
std::locale unicode() {
    try {
        return std::locale("C.UTF-8");
    } catch (const std::runtime_error&) {
        return std::locale::classic();
    }
}

/// The characters of UTF-8, or the bytes of what is something else.
std::wstring characters(const std::string& text, const std::locale& locale) {
    const auto& encoding = std::use_facet<std::codecvt<wchar_t, char, std::mbstate_t>>(locale);
    std::wstring wide(text.size(), L'\0');
    std::mbstate_t state{};
    const char* read = nullptr;
    wchar_t* written = nullptr;
    if (encoding.in(state, text.data(), text.data() + text.size(), read, wide.data(),
                    wide.data() + wide.size(), written) != std::codecvt_base::ok) {
        return {text.begin(), text.end()};
    }
    wide.resize(static_cast<std::size_t>(written - wide.data()));
    return wide;
}

}  // namespace

std::wstring judge_identity(const std::string& name) {
    static const std::locale locale = unicode();
    const auto& letters = std::use_facet<std::ctype<wchar_t>>(locale);
    std::wstring identity;
    bool space = false;
    for (const wchar_t letter : characters(name, locale)) {
        if (letters.is(std::ctype_base::space, letter)) {
            space = !identity.empty();
            continue;
        }
        if (space) {
            identity += L' ';
            space = false;
        }
        // In lower case İ is two characters, which the page of a kit does not take for its own.
        identity += letter == L'\u0130' ? letter : letters.tolower(letters.toupper(letter));
    }
    return identity;
}

}  // namespace merl::scan
