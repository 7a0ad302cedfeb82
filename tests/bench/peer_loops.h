#pragma once

#include <cstddef>

namespace merl::bench {

/// What a plain program does with samples that are transformed and weighted already: for every pair
/// of materials the sum of |a - b|^(2/3) (cwcbrt) or (a - b)^2 (pawcielab) over all its numbers,
/// added to `sums`. `grid` is [block][material][number].
template <typename Real>
using PeerLoop = void (*)(const Real* grid, std::size_t blocks, std::size_t materials,
                          double* sums);

// peer_loops.cpp, compiled three times: CMakeLists.txt has the flags.
namespace float64_o3 {
void cwcbrt(const double* grid, std::size_t blocks, std::size_t materials, double* sums);
void pawcielab(const double* grid, std::size_t blocks, std::size_t materials, double* sums);
}  // namespace float64_o3
namespace float64_ofast {
void cwcbrt(const double* grid, std::size_t blocks, std::size_t materials, double* sums);
void pawcielab(const double* grid, std::size_t blocks, std::size_t materials, double* sums);
}  // namespace float64_ofast
namespace float32_ofast {
void cwcbrt(const float* grid, std::size_t blocks, std::size_t materials, double* sums);
void pawcielab(const float* grid, std::size_t blocks, std::size_t materials, double* sums);
}  // namespace float32_ofast

/// Numbers of a block: voxels times channels.
constexpr std::size_t kPeerBlock = std::size_t{3} * 1024;

}  // namespace merl::bench
