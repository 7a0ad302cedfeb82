#include "engine/metric/check/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdint>

#include "engine/base/error.h"

namespace merl::engine {
namespace {

constexpr std::array<std::string_view, 11> kForbidden = {
    "layout",   "buffer",    "uniform",  "shared", "coherent", "readonly",
    "restrict", "writeonly", "volatile", "main",   "discard"};

constexpr std::size_t kDeepest = 200;

bool in_word(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

/// Goes through a text that has no comments and no macros.
class Words {
  public:
    Words(std::string_view text, const std::string& text_name, const std::string& file)
        : text_(text), text_name_(text_name), file_(file), current_(text_name) {}

    void check() {
        std::size_t depth = 0;
        while (at_ < text_.size()) {
            const char c = text_[at_];
            if (c == '#') {
                read_directive();
            } else if (in_word(c)) {
                check_word(word());
            } else if (c == '"' || c == '\\') {
                refuse(fmt::format("a {} has no use in a metric", c));
            } else {
                depth += c == '(' || c == '{' || c == '[' ? 1 : 0;
                depth -= depth > 0 && (c == ')' || c == '}' || c == ']') ? 1 : 0;
                if (depth > kDeepest) {
                    refuse(fmt::format("brackets are nested deeper than {}", kDeepest));
                }
                line_ += c == '\n' ? 1 : 0;
                ++at_;
            }
        }
    }

  private:
    [[noreturn]] void refuse(const std::string& message) const {
        throw InputError(
            fmt::format("{}:{}: {}", current_ == text_name_ ? file_ : current_, line_, message));
    }

    std::string_view word() {
        const auto first = at_;
        while (at_ < text_.size() && in_word(text_[at_])) {
            ++at_;
        }
        return text_.substr(first, at_ - first);
    }

    void check_word(std::string_view word) const {
        if (word.starts_with("gl_") ||
            std::find(kForbidden.begin(), kForbidden.end(), word) != kForbidden.end()) {
            refuse(fmt::format("\"{}\" has no use in a metric, whose functions compute numbers",
                               word));
        }
    }

    /// `#line 7 "name"` is how the preprocessor says where it is; it leaves no other that is good.
    void read_directive() {
        const auto end = std::min(text_.find('\n', at_), text_.size());
        const auto directive = text_.substr(at_, end - at_);
        constexpr std::string_view kLine = "#line ";
        const auto quote = directive.find(" \"");
        if (!directive.starts_with(kLine) || quote == std::string_view::npos) {
            refuse(fmt::format("\"{}\" has no use in a metric",
                               directive.substr(0, directive.find(' '))));
        }
        const auto number = directive.substr(kLine.size());
        std::from_chars(number.data(), number.data() + number.size(), line_);
        current_ = directive.substr(quote + 2, directive.rfind('"') - quote - 2);
        at_ = std::min(end + 1, text_.size());
    }

    std::string_view text_;
    const std::string& text_name_;
    const std::string& file_;
    std::string current_;  // the file that the text is from
    std::size_t at_ = 0;
    std::uint64_t line_ = 1;
};

}  // namespace

void check_metric_words(std::string_view text, const std::string& text_name,
                        const std::string& file) {
    Words(text, text_name, file).check();
}

}  // namespace merl::engine
