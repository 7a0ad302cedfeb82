#include "engine/metric/metric_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "engine/base/error.h"
#include "engine/base/glsl_header.h"
#include "engine/base/number.h"
#include "engine/base/text.h"

namespace merl::engine {
namespace {

constexpr std::size_t kMostParameters = 16;
constexpr std::size_t kMostWindows = 32;
constexpr std::uint32_t kMostFeatures = 64;

/// Takes what comes before the first `end` off `rest`, trimmed; `found` is false without one.
std::string_view take(std::string_view& rest, std::string_view end, bool& found) {
    const auto at = rest.find(end);
    found = found && at != std::string_view::npos;
    const auto taken = rest.substr(0, at);
    rest = at == std::string_view::npos ? "" : rest.substr(at + end.size());
    return trimmed(taken);
}

/// Reads the header line by line.
class Parser {
  public:
    explicit Parser(const std::string& file) : file_(file) {}

    MetricHeader parse(std::string_view text) {
        const auto header = read_glsl_header(text);
        for (const auto& line : header.lines) {
            line_ = line.number;
            read_line(line);
        }
        line_ = header.last_line;
        require_one_kind();
        return header_;
    }

  private:
    [[noreturn]] void refuse(const std::string& message) const {
        throw InputError(fmt::format("{}:{}: {}", file_, line_, message));
    }

    void read_line(const HeaderLine& line) {
        const auto [key, value] = std::pair(line.key, line.value);
        if (key == "title") {
            set(header_.title, line);
        } else if (key == "formula") {
            set(header_.formula, line);
        } else if (key == "source") {
            set(header_.source, line);
        } else if (key == "note") {
            set(header_.note, line);
        } else if (key == "degree") {
            set(header_.degree_text, line);
            read_degree(value);
        } else if (key == "parameter") {
            read_parameter(value);
        } else if (key == "fitted") {
            read_fitted(line.text);
        } else if (key == "window") {
            read_window(line.text);
        } else if (key == "features") {
            read_features(value);
        } else {
            refuse(
                fmt::format("\"{}:\" is no key of a metric; the keys are title, formula, source, "
                            "note, degree, parameter, fitted, window and features",
                            key));
        }
    }

    void set(std::string& text, const HeaderLine& line) {
        if (!text.empty()) {
            refuse(fmt::format("a second \"{}:\"", line.key));
        }
        if (line.text.empty()) {
            refuse(fmt::format("\"{}:\" has no value", line.key));
        }
        text = line.text;
    }

    void read_degree(std::string_view value) {
        header_.degree_text = value;
        if (value == "2" || value == "1") {
            header_.degree = value[0] - '0';
        } else if (value == "2/3") {
            header_.degree = 2.0 / 3.0;
        } else {
            refuse(
                fmt::format("the degree is \"{}\": expected 2, 1 or 2/3; without a degree the "
                            "difference may be anything",
                            value));
        }
    }

    void read_parameter(std::string_view value) {
        bool found = true;
        auto rest = value;
        MetricParameter p;
        p.name = take(rest, "=", found);
        const auto number = parse_finite(take(rest, " in [", found));
        const auto low = parse_finite(take(rest, ",", found));
        const auto high = parse_finite(take(rest, "]", found));
        p.description = trimmed(rest);
        if (!found || !number || !low || !high || p.description.empty()) {
            refuse(
                fmt::format("the parameter is \"{}\": expected NAME = DEFAULT in [LOW, HIGH] "
                            "description",
                            value));
        }
        p.value = *number;
        p.low = *low;
        p.high = *high;
        if (!is_header_name(p.name)) {
            refuse(
                fmt::format("a parameter is called \"{}\": expected a lower-case letter, then "
                            "lower-case letters, digits and _, at most {} in all",
                            p.name, longest_header_name));
        }
        if (!(p.low <= p.value && p.value <= p.high)) {
            refuse(fmt::format("the parameter {} is {} by default: expected a number in [{}, {}]",
                               p.name, p.value, p.low, p.high));
        }
        require_new(p.name);
        if (header_.parameters.size() == kMostParameters) {
            refuse(fmt::format("more than {} parameters", kMostParameters));
        }
        header_.parameters.push_back(std::move(p));
    }

    void read_fitted(std::string_view value) {
        constexpr std::size_t digits = 64;
        const auto end = std::min(value.find_first_of(" \t"), value.size());
        const auto hash = value.substr(0, end);
        const auto citation = trimmed(value.substr(end));
        if (hash.size() != digits ||
            hash.find_first_not_of("0123456789abcdef") != std::string_view::npos ||
            citation.empty()) {
            refuse(
                fmt::format("what the metric was fitted to is \"{}\": expected the SHA-256 of a "
                            "file of judgements, {} lower-case hexadecimal digits as sha256sum "
                            "prints them, then a citation",
                            value, digits));
        }
        if (std::any_of(header_.fitted.begin(), header_.fitted.end(),
                        [&](const FittedTo& other) { return other.sha256 == hash; })) {
            refuse(fmt::format("a second \"fitted:\" with the SHA-256 {}", hash));
        }
        header_.fitted.push_back({std::string(hash), std::string(citation)});
    }

    void read_window(std::string_view value) {
        const auto end = std::min(value.find_first_of(" \t"), value.size());
        MetricWindow w = {.name = std::string(value.substr(0, end)),
                          .description = std::string(trimmed(value.substr(end)))};
        if (!is_header_name(w.name) || w.description.empty()) {
            refuse(
                fmt::format("the window is \"{}\": expected NAME description; a name is a "
                            "lower-case letter, then lower-case letters, digits and _, at most {} "
                            "in all",
                            value, longest_header_name));
        }
        require_new(w.name);
        if (header_.windows.size() == kMostWindows) {
            refuse(fmt::format("more than {} windows", kMostWindows));
        }
        header_.windows.push_back(std::move(w));
    }

    void read_features(std::string_view value) {
        if (header_.features != 0) {
            refuse("a second \"features:\"");
        }
        const auto number = parse_number<std::uint32_t>(value);
        if (!number || *number < 1 || *number > kMostFeatures) {
            refuse(fmt::format("the features are \"{}\": expected how many there are, 1 to {}",
                               value, kMostFeatures));
        }
        header_.features = *number;
    }

    /// Parameters and windows are constants of the same file.
    void require_new(const std::string& name) const {
        if (std::ranges::find(header_.parameters, name, &MetricParameter::name) !=
            header_.parameters.end()) {
            refuse(fmt::format("a second parameter {}", name));
        }
        if (std::ranges::find(header_.windows, name, &MetricWindow::name) !=
            header_.windows.end()) {
            refuse(fmt::format("a second window {}", name));
        }
    }

    /// After the last line: a summary has windows and features, any other metric no features.
    void require_one_kind() const {
        if (header_.features != 0 && header_.windows.empty()) {
            refuse("features without a \"// window: NAME description\" to take means of");
        }
        if (header_.features == 0 && !header_.windows.empty() && header_.degree == 0) {
            refuse("windows without \"// features: N\", how many numbers are made of their means");
        }
        if (header_.features != 0 && header_.degree != 0) {
            refuse("a degree beside features: the distance between those is always Euclidean");
        }
    }

    const std::string& file_;
    MetricHeader header_;
    std::uint64_t line_ = 0;
};

}  // namespace

MetricHeader parse_metric_header(std::string_view text, const std::string& file) {
    return Parser(file).parse(text);
}

}  // namespace merl::engine
