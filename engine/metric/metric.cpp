#include "engine/metric/metric.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "engine/base/error.h"
#include "engine/base/file.h"
#include "engine/base/number.h"
#include "engine/base/text.h"
#include "engine/metric/metric_library.h"

namespace merl::engine {
namespace {

constexpr std::string_view kExtension = ".glsl";

/// A metric is some ten lines; this is room for tables.
constexpr std::uintmax_t kMostBytes = 256ULL * 1024;

/// The defaults of every parameter.
std::vector<double> defaults(const MetricHeader& header) {
    std::vector<double> values;
    std::transform(header.parameters.begin(), header.parameters.end(), std::back_inserter(values),
                   [](const MetricParameter& p) { return p.value; });
    return values;
}

std::vector<Metric> open_built(std::span<const BuiltMetric> built) {
    std::vector<Metric> all;
    for (const auto& b : built) {
        auto& metric = all.emplace_back();
        metric.name = b.name;
        metric.file = fmt::format("{}{}", b.name, kExtension);
        metric.source = b.source;
        metric.header = parse_metric_header(metric.source, metric.file);
        metric.parameters = defaults(metric.header);
        metric.twin = b.twin;
    }
    return all;
}

/// The text as the compiler should read it: lines end in a line feed, whatever editor wrote them,
/// and a byte order mark is no part of it.
std::string plain_text(std::string_view text) {
    text = without_byte_order_mark(text);
    std::string plain;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const bool is_return = text[i] == '\r';
        if (!is_return || i + 1 == text.size() || text[i + 1] != '\n') {
            plain += is_return ? '\n' : text[i];
        }
    }
    return plain;
}

std::string read_file(const std::string& path) {
    const File file(path);
    if (file.bytes() > kMostBytes) {
        file.fail(fmt::format("has more than {} bytes: that is no metric", kMostBytes));
    }
    const std::string text = file.read_all(kMostBytes);
    if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) {
        file.fail("is UTF-16: save it as UTF-8");
    }
    if (text.find('\0') != std::string::npos) {
        file.fail("has a zero byte: that is no text");
    }
    return plain_text(text);
}

Metric open_file(const std::string& path) {
    Metric metric;
    metric.name = std::filesystem::path(path).filename().string();
    metric.file = path;
    metric.source = read_file(path);
    metric.header = parse_metric_header(metric.source, path);
    metric.parameters = defaults(metric.header);
    return metric;
}

/// With small letters: files from Windows may be called MY.GLSL.
std::string lower_case(std::string_view text) {
    std::string lower(text);
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return lower;
}

/// The end of the name in "name:a=1:b=2"; a path may have colons of its own.
std::size_t end_of_name(std::string_view text) {
    const auto extension = lower_case(text).rfind(kExtension);
    if (extension != std::string_view::npos) {
        const auto end = extension + kExtension.size();
        if (end == text.size() || text[end] == ':') {
            return end;
        }
    }
    return std::min(text.find(':'), text.size());
}

/// ":name=value" for every parameter that is not at its default.
std::string settings_text(const Metric& metric) {
    std::string text;
    for (std::size_t i = 0; i < metric.parameters.size(); ++i) {
        const auto& p = metric.header.parameters[i];
        if (metric.parameters[i] != p.value) {
            text += fmt::format(":{}={}", p.name, metric.parameters[i]);
        }
    }
    return text;
}

/// Sets a parameter from "name=value".
void set_parameter(Metric& metric, std::string_view setting, std::vector<bool>& set) {
    const auto& parameters = metric.header.parameters;
    const auto equals = setting.find('=');
    const auto name = setting.substr(0, equals);
    const auto found =
        std::find_if(parameters.begin(), parameters.end(),
                     [&](const MetricParameter& p) { return std::string_view(p.name) == name; });
    if (found == parameters.end()) {
        std::string names;
        for (const auto& p : parameters) {
            names += fmt::format("{}{}", names.empty() ? "; its parameters are: " : ", ", p.name);
        }
        throw Error(Fault::usage,
                    fmt::format("the metric {} has no parameter \"{}\"{}", metric.name, name,
                                names.empty() ? "; it has none at all" : names));
    }
    const auto index = static_cast<std::size_t>(found - parameters.begin());
    if (set[index]) {
        throw Error(Fault::usage,
                    fmt::format("the parameter {} of {} is given twice", name, metric.name));
    }
    set[index] = true;
    const auto text =
        equals == std::string_view::npos ? std::string_view() : setting.substr(equals + 1);
    const auto value = parse_finite(text);
    if (!value || *value < found->low || *value > found->high) {
        throw Error(
            Fault::usage,
            fmt::format("the parameter {} of {} is \"{}\": expected a number from {} to {} "
                        "({})",
                        name, metric.name, text, found->low, found->high, found->description));
    }
    metric.parameters[index] = *value;
}

}  // namespace

std::span<const Metric> metrics() {
    static const auto all = open_built(built_metrics());
    return all;
}

std::span<const Metric> framework_test_metrics() {
    static const auto all = open_built(built_framework_test_metrics());
    return all;
}

const Metric& find_metric(std::string_view name) {
    const auto all = metrics();
    const auto found = std::find_if(
        all.begin(), all.end(), [&](const Metric& m) { return std::string_view(m.name) == name; });
    if (found == all.end()) {
        std::string names;
        for (const auto& metric : all) {
            names += fmt::format("{}{}", names.empty() ? "" : ", ", metric.name);
        }
        throw Error(Fault::usage, fmt::format("there is no metric \"{}\"; the metrics are: {}; a "
                                              "file of your own ends in .glsl",
                                              name, names));
    }
    return *found;
}

Metric open_metric(const std::string& text) {
    const auto end = end_of_name(text);
    const std::string name = text.substr(0, end);
    Metric metric = lower_case(name).ends_with(kExtension) ? open_file(name) : find_metric(name);
    std::vector<bool> set(metric.parameters.size());
    for (std::string_view rest = std::string_view(text).substr(end); !rest.empty();) {
        rest.remove_prefix(1);  // the colon
        const auto length = std::min(rest.find(':'), rest.size());
        set_parameter(metric, rest.substr(0, length), set);
        rest.remove_prefix(length);
    }
    metric.name += settings_text(metric);
    return metric;
}

std::string text_of(const Metric& metric) {
    return metric.has_twin() ? metric.name : metric.file + settings_text(metric);
}

Metric with_parameters(Metric metric, std::span<const double> parameters) {
    metric.name.resize(metric.name.size() - settings_text(metric).size());
    metric.parameters.assign(parameters.begin(), parameters.end());
    metric.name += settings_text(metric);
    return metric;
}

}  // namespace merl::engine
