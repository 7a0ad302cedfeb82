#include "engine/reflectance/metric_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>

#include "engine/error.h"

namespace merl::reflectance {
namespace {

constexpr std::array<std::string_view, 9> kForbidden = {"layout",    "buffer",   "uniform",
                                                        "shared",    "coherent", "readonly",
                                                        "writeonly", "volatile", "main"};

constexpr std::array<std::string_view, 10> kDirectives = {
    "define", "undef", "include", "if", "ifdef", "ifndef", "else", "elif", "endif", "error"};

bool in_word(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

/// Goes through a text outside its comments.
class Words {
  public:
    Words(std::string_view text, const std::string& file) : text_(text), file_(file) {}

    void check() {
        while (at_ < text_.size()) {
            if (ahead("//")) {
                skip_to("\n");
            } else if (ahead("/*")) {
                skip_to("*/");
            } else if (text_[at_] == '#') {
                ++at_;
                check_directive();
            } else if (in_word(text_[at_])) {
                check_word(word());
            } else if (text_[at_] == '\\') {
                refuse("a backslash has no use in a metric");
            } else {
                step();
            }
        }
    }

  private:
    [[noreturn]] void refuse(const std::string& message) const {
        throw Error(Fault::input, fmt::format("{}:{}: {}", file_, line_, message));
    }

    bool ahead(std::string_view what) const { return text_.substr(at_).starts_with(what); }

    void step() {
        line_ += text_[at_] == '\n' ? 1 : 0;
        ++at_;
    }

    void skip_to(std::string_view end) {
        while (at_ < text_.size() && !ahead(end)) {
            step();
        }
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
            refuse(
                fmt::format("\"{}\" has no use in a metric, which is a transform, a weight and a "
                            "difference",
                            word));
        }
    }

    void check_directive() {
        while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t')) {
            ++at_;
        }
        const auto directive = word();
        if (std::find(kDirectives.begin(), kDirectives.end(), directive) == kDirectives.end()) {
            refuse(fmt::format("\"#{}\" has no use in a metric", directive));
        }
    }

    std::string_view text_;
    const std::string& file_;
    std::size_t at_ = 0;
    std::uint64_t line_ = 1;
};

}  // namespace

void check_metric_words(std::string_view text, const std::string& file) {
    Words(text, file).check();
}

}  // namespace merl::reflectance
