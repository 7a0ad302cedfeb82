#include "scan/select/scan_tables.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "scan/io/csv.h"

namespace merl::scan {
namespace {

/// Rows of a chunk: enough that handing it on costs nothing, few enough to stay in the cache.
constexpr std::size_t chunk_rows = 2048;

/// So many pairs have texts that are kept while configurations are written: some 150 MiB.
constexpr std::size_t most_kept = 1'000'000;

/// The rows from `begin` to before `end`, and their text once they are formatted.
struct Chunk {
    std::size_t begin = 0;
    std::size_t end = 0;
    std::string text;
};

/// Writes rows 0 to count-1 in order; `append` appends the text of one row, on any thread.
void write_rows(int file, std::size_t count,
                const std::function<void(std::string& text, std::size_t row)>& append,
                const Progress& progress = {}) {
    // The pipeline passes pointers into this ring: oneTBB loses what its tokens own when a filter
    // throws. A chunk is free again when its turn comes, as no more are under way than there are
    // and they leave in order.
    std::vector<Chunk> ring(2 * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()));
    std::size_t taken = 0;
    const auto take = [&](tbb::flow_control& control) -> Chunk* {
        const std::size_t begin = taken * chunk_rows;
        if (begin >= count) {
            control.stop();
            return nullptr;
        }
        Chunk& chunk = ring[taken++ % ring.size()];
        chunk.begin = begin;
        chunk.end = std::min(begin + chunk_rows, count);
        return &chunk;
    };
    const auto format = [&](Chunk* chunk) {
        chunk->text.clear();
        for (std::size_t row = chunk->begin; row < chunk->end; ++row) {
            append(chunk->text, row);
        }
        return chunk;
    };
    const auto write = [&](Chunk* chunk) {
        write_all(file, chunk->text);
        if (progress) {
            progress(static_cast<double>(chunk->end) / static_cast<double>(count));
        }
    };
    tbb::parallel_pipeline(
        ring.size(), tbb::make_filter<void, Chunk*>(tbb::filter_mode::serial_in_order, take) &
                         tbb::make_filter<Chunk*, Chunk*>(tbb::filter_mode::parallel, format) &
                         tbb::make_filter<Chunk*, void>(tbb::filter_mode::serial_in_order, write));
}

/// The fields of a pair, ready to be put into a row.
struct PairText {
    std::string names;
    std::string first;
    std::string second;
};

PairText text_of(const PairColumns& pairs, std::uint32_t index) {
    const auto [one, other] = pairs.names(index);
    PairText text{csv_field(one) + ',' + csv_field(other), {}, {}};
    append_number(text.first, pairs.first[index]);
    append_number(text.second, pairs.second[index]);
    return text;
}

PairColumns columns_of(const Distances& distances) {
    distances.validate();
    return {.first_metric = distances.first_metric,
            .second_metric = distances.second_metric,
            .first = distances.first,
            .second = distances.second,
            .names = [&distances](std::uint32_t index) -> std::array<std::string_view, 2> {
                const Pair pair = pair_at(index, distances.materials());
                return {distances.names[pair.first], distances.names[pair.second]};
            }};
}

void append_row(std::string& out, const PairText& left, const PairText& right, double agreement) {
    for (const std::string* field :
         {&left.names, &right.names, &left.first, &right.first, &left.second, &right.second}) {
        out += *field;
        out += ',';
    }
    append_number(out, agreement);
    out += '\n';
}

std::string configuration_header(const PairColumns& pairs) {
    const auto field = [](std::string_view metric, std::string_view side) {
        return csv_field(fmt::format("{}_{}", metric, side));
    };
    return fmt::format("left_1,left_2,right_1,right_2,{},{},{},{},agreement\n",
                       field(pairs.first_metric, "left"), field(pairs.first_metric, "right"),
                       field(pairs.second_metric, "left"), field(pairs.second_metric, "right"));
}

}  // namespace

void write_pairs(int file, const Distances& distances, const Progress& progress) {
    const auto& d = distances;
    const PairColumns columns = columns_of(d);
    const bool bounded = !d.first_bounds.empty() && !d.second_bounds.empty();
    std::string header =
        "material_1,material_2," + csv_field(d.first_metric) + ',' + csv_field(d.second_metric);
    for (const auto* column : {"_bound", "_precision"}) {
        for (const auto& metric : {d.first_metric, d.second_metric}) {
            header += bounded ? ',' + csv_field(metric + column) : "";
        }
    }
    write_all(file, header + '\n');
    write_rows(
        file, distances.pairs(),
        [&](std::string& text, std::size_t row) {
            const PairText pair = text_of(columns, static_cast<std::uint32_t>(row));
            text += pair.names + ',' + pair.first + ',' + pair.second;
            if (bounded) {
                for (const double bound : {d.first_bounds[row], d.second_bounds[row]}) {
                    text += ',';
                    append_number(text, bound);
                }
                for (const bool is_float64 : {d.first_is_final || d.first_bounds[row] == 0,
                                              d.second_is_final || d.second_bounds[row] == 0}) {
                    text += is_float64 ? ",float64" : ",float32";
                }
            }
            text += '\n';
        },
        progress);
}

void write_disagreements(int file, const PairColumns& pairs,
                         std::span<const Configuration> configurations, const Progress& progress) {
    write_all(file, configuration_header(pairs));

    // The text of every pair once, where it is needed more often and there is room.
    const bool keep =
        configurations.size() >= pairs.first.size() && pairs.first.size() <= most_kept;
    std::vector<PairText> texts(keep ? pairs.first.size() : 0);
    tbb::parallel_for(std::size_t{0}, texts.size(), [&](std::size_t pair) {
        texts[pair] = text_of(pairs, static_cast<std::uint32_t>(pair));
    });
    write_rows(
        file, configurations.size(),
        [&](std::string& text, std::size_t row) {
            const auto& [left, right, agreement] = configurations[row];
            if (keep) {
                append_row(text, texts[left], texts[right], agreement);
            } else {
                append_row(text, text_of(pairs, left), text_of(pairs, right), agreement);
            }
        },
        progress);
}

void write_disagreements(int file, const Distances& distances,
                         std::span<const Configuration> configurations, const Progress& progress) {
    write_disagreements(file, columns_of(distances), configurations, progress);
}

void write_selection(int file, const PairColumns& pairs,
                     std::span<const Configuration> configurations) {
    std::string text = "rank," + configuration_header(pairs);
    std::size_t rank = 0;
    for (const auto& [left, right, agreement] : configurations) {
        text += fmt::format("{},", ++rank);
        append_row(text, text_of(pairs, left), text_of(pairs, right), agreement);
    }
    write_all(file, text);
}

void write_selection(int file, const Distances& distances,
                     std::span<const Configuration> configurations) {
    write_selection(file, columns_of(distances), configurations);
}

}  // namespace merl::scan
