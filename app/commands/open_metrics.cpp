#include "app/commands/open_metrics.h"

#include <fmt/format.h>

#include <cstdint>

#include "app/cli/guard.h"
#include "app/pipeline/metrics.h"

namespace merl::app {

std::vector<engine::Metric> open_metrics(const std::vector<std::string>& texts,
                                         const std::string& device) {
    constexpr double kSeconds = 60;
    constexpr std::uint64_t kBytes = 4ULL << 30U;
    auto metrics = pipeline::open_metrics(texts);
    for (const auto& metric : metrics) {
        if (!metric.has_twin()) {
            run_guarded(fmt::format("{}: compiling and trying it", metric.file), kSeconds, kBytes,
                        [&] { pipeline::try_metric(metric, device); });
        }
    }
    return metrics;
}

}  // namespace merl::app
