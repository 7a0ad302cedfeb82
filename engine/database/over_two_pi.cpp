#include "engine/database/over_two_pi.h"

#include <algorithm>
#include <vector>

namespace merl::engine {

void read_over_two_pi(
    const Grid& over_two_pi, VoxelRange range, std::span<double> samples, const SampleSink& sink,
    const std::function<void(VoxelRange over_pi, std::span<double>, const SampleSink&)>& read) {
    const std::uint64_t width = over_two_pi.phi_d;
    const std::uint64_t half = over_two_pi.over_pi().phi_d;
    std::vector<double> rows;
    const auto take = [&](std::uint64_t first_row, std::uint64_t last_row, const SampleSink& to) {
        const VoxelRange source = {first_row * half, last_row * half};
        rows.resize(3 * source.size());
        read(source, rows, to);
        for (std::uint64_t begin = 2 * source.first; begin < 2 * source.last; begin += half) {
            // A half of a row, as far as it is in the range.
            const std::uint64_t from = std::max(begin, range.first);
            const std::uint64_t until = std::min(begin + half, range.last);
            const std::uint64_t row = begin / width - first_row;
            for (std::size_t plane = 0; plane < 3 && from < until; ++plane) {
                const double* const at =
                    rows.data() + plane * source.size() + row * half + (from - begin);
                std::copy(at, at + (until - from),
                          samples.data() + plane * range.size() + (from - range.first));
            }
        }
    };
    std::uint64_t first_row = range.first / width;
    const std::uint64_t last_row = (range.last + width - 1) / width;
    if (range.first % width != 0) {
        take(first_row, first_row + 1, {});
        ++first_row;
    }
    if (first_row < last_row) {
        take(first_row, last_row, sink);
    }
}

}  // namespace merl::engine
