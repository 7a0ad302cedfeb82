#include "app/commands/try_metrics.h"

#include <fmt/format.h>

#include <cstdint>

#include "app/cli/guard.h"
#include "app/pipeline/metrics.h"

namespace merl::app {

void try_metrics(std::span<const engine::Metric* const> metrics,
                 const device::ContextOptions& device) {
    constexpr double kSeconds = 60;
    constexpr std::uint64_t kBytes = 4ULL << 30U;
    for (const auto* metric : metrics) {
        if (!metric->has_twin()) {
            run_guarded(fmt::format("{}: compiling and trying it", metric->file), kSeconds, kBytes,
                        [&] { with_little_stack([&] { pipeline::try_metric(*metric, device); }); });
        }
    }
}

}  // namespace merl::app
