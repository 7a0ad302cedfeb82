#include "engine/reflectance/metric.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/error.h"

namespace merl::reflectance {

std::string_view Metric::header(std::string_view key) const {
    std::string_view rest = source;
    while (rest.starts_with("// ")) {
        std::string_view line = rest.substr(3, rest.find('\n') - 3);
        if (line.starts_with(key) && line.substr(key.size()).starts_with(": ")) {
            return line.substr(key.size() + 2);
        }
        const auto end = rest.find('\n');
        rest = end == std::string_view::npos ? "" : rest.substr(end + 1);
    }
    return {};
}

const Metric& find_metric(std::string_view name) {
    const auto all = metrics();
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Metric& m) { return m.name == name; });
    if (found == all.end()) {
        std::string names;
        for (const auto& metric : all) {
            names += fmt::format("{}{}", names.empty() ? "" : ", ", metric.name);
        }
        throw Error(Fault::usage,
                    fmt::format("there is no metric \"{}\"; the metrics are: {}", name, names));
    }
    return *found;
}

}  // namespace merl::reflectance
