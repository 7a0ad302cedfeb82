#include "scan/select/compare_metrics.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>
#include <span>
#include <stdexcept>

#include "scan/io/csv.h"
#include "scan/pairs/bounded_count.h"
#include "scan/pairs/count.h"
#include "scan/select/selection.h"

namespace merl::scan {
namespace {

/// Up to so many pairs, comparisons are made beside each other. Of more each has threads enough for
/// itself, and takes some 36 bytes a pair.
constexpr std::uint64_t kMostBeside = 1U << 20U;

bool all_finite(std::span<const double> bounds) {
    return std::ranges::all_of(bounds, [](double bound) { return std::isfinite(bound); });
}

/// The progress of several works of the same size that are done at once.
class SharedProgress {
  public:
    SharedProgress(std::size_t works, const Progress& progress)
        : shares_(works), progress_(progress) {}

    /// That of one of them.
    Progress of(std::size_t work) {
        if (!progress_) {
            return {};
        }
        return [this, work](double share) {
            const std::scoped_lock lock(mutex_);
            shares_[work] = std::max(shares_[work], share);
            progress_(std::accumulate(shares_.begin(), shares_.end(), 0.0) /
                      static_cast<double>(shares_.size()));
        };
    }

  private:
    std::mutex mutex_;
    std::vector<double> shares_;
    const Progress& progress_;
};

Comparison compare_two(const DistanceTable& table, std::size_t first, std::size_t second,
                       std::uint32_t strongest, bool stream, const Progress& progress) {
    const DistancesView distances = table.view(first, second);
    Comparison result = {first, second, {}, {}, {}, {}};
    const auto counting = part_of(progress, 0, 0.3);
    result.counts = stream ? count_disagreements(distances, counting).counts
                           : count_by_inversions(distances, counting);
    result.tau_b = kendall_tau_b(result.counts);
    if (all_finite(distances.first_bounds) && all_finite(distances.second_bounds)) {
        result.undecided = count_undecided(distances, part_of(progress, 0.3, 0.4));
    }
    result.strongest = select_configurations(distances, strongest, 1, part_of(progress, 0.7, 0.3));
    return result;
}

}  // namespace

std::optional<double> kendall_tau_b(const Counts& counts) {
    const std::uint64_t ordered_by_both = counts.configurations - counts.tied_both;
    const auto in_first = static_cast<double>(ordered_by_both - counts.tied_first_only);
    const auto in_second = static_cast<double>(ordered_by_both - counts.tied_second_only);
    if (in_first == 0 || in_second == 0) {
        return std::nullopt;
    }
    const double difference =
        static_cast<double>(counts.concordant()) - static_cast<double>(counts.discordant);
    return difference / std::sqrt(in_first * in_second);  // exactly 1 or -1 without ties
}

ComparisonResult compare_metrics(const DistanceTable& table, std::uint32_t strongest,
                                 const std::function<void(double share)>& progress) {
    ComparisonResult result;
    auto& comparisons = result.comparisons;
    for (std::size_t first = 0; first < table.metrics.size(); ++first) {
        for (std::size_t second = first + 1; second < table.metrics.size(); ++second) {
            comparisons.push_back({first, second, {}, {}, {}, {}});
        }
    }
    const std::uint64_t configurations = configuration_count(table.pairs());
    result.streamed = comparisons.empty() || configurations <= max_streamed / comparisons.size();
    SharedProgress shared(comparisons.size(), progress);
    const auto compare = [&](std::size_t i) {
        const auto of_this = shared.of(i);
        comparisons[i] = compare_two(table, comparisons[i].first, comparisons[i].second, strongest,
                                     result.streamed, of_this);
        if (of_this) {
            of_this(1);
        }
    };
    if (table.pairs() <= kMostBeside) {
        tbb::parallel_for(std::size_t{0}, comparisons.size(), compare);
    } else {
        for (std::size_t i = 0; i < comparisons.size(); ++i) {
            compare(i);
        }
    }
    return result;
}

void write_comparisons(int file, const DistanceTable& table,
                       const std::vector<Comparison>& comparisons) {
    std::string text =
        "metric_1,metric_2,configurations,disagreements,rate,tau_b,concordant,discordant,"
        "tied_in_first_only,tied_in_second_only,tied_in_both,undecided,left_1,left_2,right_1,"
        "right_2,agreement\n";
    for (const auto& c : comparisons) {
        const auto& n = c.counts;
        text += fmt::format("{},{},{},{},", csv_field(table.metrics[c.first].metric),
                            csv_field(table.metrics[c.second].metric), n.configurations,
                            n.disagreements());
        append_number(text, n.disagreement_rate());
        text += ',';
        if (c.tau_b) {
            append_number(text, *c.tau_b);
        }
        text += fmt::format(",{},{},{},{},{},{}", n.concordant(), n.discordant, n.tied_first_only,
                            n.tied_second_only, n.tied_both,
                            c.undecided ? std::to_string(*c.undecided) : "");
        if (c.strongest.empty()) {
            text += ",,,,,\n";
            continue;
        }
        for (const auto index : {c.strongest.front().left, c.strongest.front().right}) {
            const Pair pair = pair_at(index, table.materials());
            text += ',' + csv_field(table.names[pair.first]) + ',' +
                    csv_field(table.names[pair.second]);
        }
        text += ',';
        append_number(text, c.strongest.front().agreement);
        text += '\n';
    }
    write_all(file, text);
}

}  // namespace merl::scan
