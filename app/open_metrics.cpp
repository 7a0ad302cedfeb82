#include "app/open_metrics.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/error.h"

namespace merl::app {

std::vector<reflectance::Metric> open_metrics(const std::vector<std::string>& texts) {
    std::vector<reflectance::Metric> metrics;
    for (const auto& text : texts) {
        if (text == "all") {
            const auto library = reflectance::metrics();
            metrics.insert(metrics.end(), library.begin(), library.end());
        } else {
            metrics.push_back(reflectance::open_metric(text));
        }
    }
    for (auto m = metrics.begin(); m != metrics.end(); ++m) {
        const auto same = [&](const reflectance::Metric& other) { return other.name == m->name; };
        if (const auto other = std::find_if(metrics.begin(), m, same); other != m) {
            throw Error(Fault::usage, other->file == m->file
                                          ? fmt::format("the metric {} is named twice", m->name)
                                          : fmt::format("{} and {} would both be called {} in the "
                                                        "results: rename one",
                                                        other->file, m->file, m->name));
        }
    }
    return metrics;
}

}  // namespace merl::app
