// PEER_VARIANT and PEER_REAL come from the build. Nothing here but the loops: code for this
// processor only must not get into the rest of the program.
#include "tests/bench/peer_loops.h"

#include <cmath>

namespace merl::bench::PEER_VARIANT {
namespace {

using Real = PEER_REAL;

template <typename Difference>
void add_pairs(const Real* grid, std::size_t blocks, std::size_t materials, double* sums,
               const Difference& difference) {
    const std::size_t pairs = materials * (materials - 1) / 2;
#pragma omp parallel for schedule(dynamic) reduction(+ : sums[:pairs])
    for (std::size_t block = 0; block < blocks; ++block) {
        const Real* const samples = grid + block * materials * kPeerBlock;
        std::size_t pair = 0;
        for (std::size_t i = 0; i < materials; ++i) {
            for (std::size_t j = i + 1; j < materials; ++j) {
                const Real* const a = samples + i * kPeerBlock;
                const Real* const b = samples + j * kPeerBlock;
                Real sum = 0;
                for (std::size_t k = 0; k < kPeerBlock; ++k) {
                    sum += difference(a[k] - b[k]);
                }
                sums[pair++] += static_cast<double>(sum);
            }
        }
    }
}

}  // namespace

void cwcbrt(const Real* grid, std::size_t blocks, std::size_t materials, double* sums) {
    add_pairs(grid, blocks, materials, sums, [](Real d) { return std::cbrt(d * d); });
}

void pawcielab(const Real* grid, std::size_t blocks, std::size_t materials, double* sums) {
    add_pairs(grid, blocks, materials, sums, [](Real d) { return d * d; });
}

}  // namespace merl::bench::PEER_VARIANT
