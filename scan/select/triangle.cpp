#include "scan/select/triangle.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <mutex>
#include <string>

#include "scan/io/csv.h"
#include "scan/pairs/count.h"

namespace merl::scan {
namespace {

/// The distances as a square, so that those of a material are beside each other.
std::vector<double> square_of(std::span<const double> distances, std::uint32_t materials) {
    std::vector<double> square(std::size_t{materials} * materials);
    std::size_t pair = 0;
    for (std::size_t a = 0; a < materials; ++a) {
        for (std::size_t c = a + 1; c < materials; ++c) {
            square[a * materials + c] = square[c * materials + a] = distances[pair++];
        }
    }
    return square;
}

/// (ac - (ab + bc)) / (ab + bc), whose sign is exact: what the sum loses is known (D. E. Knuth,
/// TAOCP 2, 4.2.2, theorem B), and a difference of two doubles is 0 only where they are equal. Not
/// a number where all are 0, or where the sum is too large for a double and so larger than ac.
double excess_of(double ab, double bc, double ac) {
    const double sum = ab + bc;
    const double of_bc = sum - ab;
    const double lost = (ab - (sum - of_bc)) + (bc - of_bc);
    return ((ac - sum) - lost) / sum;
}

/// What the triples of one material a say.
struct Row {
    std::uint64_t violations = 0;
    std::optional<Triple> worst;
};

Row check_row(std::span<const double> square, std::uint32_t materials, std::uint32_t a) {
    Row row;
    double most = -2;  // below every excess
    const double* from_a = &square[std::size_t{a} * materials];
    for (std::uint32_t c = a + 1; c < materials; ++c) {
        const double* from_c = &square[std::size_t{c} * materials];
        const double ac = from_a[c];
        for (std::uint32_t b = 0; b < materials; ++b) {
            const double excess = excess_of(from_a[b], from_c[b], ac);
            if (!(excess > 0 || excess > most) || b == a || b == c) {
                continue;
            }
            row.violations += excess > 0 ? 1 : 0;
            if (excess > most) {
                most = excess;
                row.worst = {a, b, c, from_a[b], from_c[b], ac, excess};
            }
        }
    }
    return row;
}

}  // namespace

std::vector<TriangleCheck> check_triangles(const DistanceTable& table,
                                           std::span<const std::size_t> metrics,
                                           const std::function<void(double share)>& progress) {
    const std::uint32_t materials = table.materials();
    const std::uint64_t triples = materials < 3 ? 0 : table.pairs() * (materials - 2);
    std::vector<TriangleCheck> checks;
    for (const std::size_t metric : metrics) {
        checks.push_back({metric, triples, {}, {}});
    }
    if (checks.empty() || triples > max_streamed / checks.size()) {
        return checks;
    }
    std::mutex mutex;
    std::uint64_t done = 0;  // pairs, of all checks
    for (auto& check : checks) {
        const auto square = square_of(table.metrics[check.metric].values, materials);
        std::vector<Row> rows(materials);
        tbb::parallel_for(std::uint32_t{0}, materials, [&](std::uint32_t a) {
            rows[a] = check_row(square, materials, a);
            const std::scoped_lock lock(mutex);
            done += materials - 1 - a;
            if (progress) {
                progress(static_cast<double>(done) /
                         static_cast<double>(table.pairs() * checks.size()));
            }
        });
        check.violations = 0;
        for (const auto& row : rows) {
            *check.violations += row.violations;
            if (row.worst && (!check.worst || row.worst->excess > check.worst->excess)) {
                check.worst = row.worst;
            }
        }
    }
    return checks;
}

void write_triangles(int file, const DistanceTable& table, std::span<const TriangleCheck> checks) {
    std::string text =
        "metric,triples,violations,a,b,c,distance_ab,distance_bc,distance_ac,ratio,excess\n";
    for (const auto& check : checks) {
        text +=
            fmt::format("{},{},{}", csv_field(table.metrics[check.metric].metric), check.triples,
                        check.violations ? std::to_string(*check.violations) : "");
        if (!check.worst) {
            text += ",,,,,,,,\n";
            continue;
        }
        const auto& w = *check.worst;
        for (const auto material : {w.a, w.b, w.c}) {
            text += ',' + csv_field(table.names[material]);
        }
        for (const double number : {w.ab, w.bc, w.ac, w.ratio(), w.excess}) {
            append_figure(text, number);
        }
        text += '\n';
    }
    write_all(file, text);
}

}  // namespace merl::scan
