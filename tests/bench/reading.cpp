#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <filesystem>
#include <fstream>

#include "engine/database/merl_file.h"
#include "engine/distance/parts/slab_reader.h"
#include "tests/bench/bench.h"
#include "tests/bench/inputs.h"

namespace merl::bench {
namespace {

using namespace engine;

constexpr std::uint64_t kSlabVoxels = 32ULL * kBlockVoxels;

/// A number of a MERL file, read as its format says and not by the program.
double stored_number(const std::string& material, std::uint64_t voxel, std::size_t channel) {
    const auto path = std::filesystem::path(settings().database) / (material + ".binary");
    std::ifstream file(path, std::ios::binary);
    file.seekg(
        static_cast<std::streamoff>(12 + 8 * (channel * database().grid().voxels() + voxel)));
    std::array<char, 8> bytes = {};
    file.read(bytes.data(), bytes.size());
    require(file.good(), fmt::format("cannot read {}", path.string()));
    return std::max(0.0, std::bit_cast<double>(bytes) * kMerlScale[channel]);
}

/// Reads everything slab by slab, as the distance stage does; hands each slab and material to
/// `use`, from several threads.
template <typename Use>
void read_all(const Domain& domain, const VoxelList& voxels, const Use& use) {
    SlabReader reader(database(), voxels);
    for (std::uint64_t first = 0; first < voxels.size(); first += kSlabVoxels) {
        const Slab slab(domain, voxels, first, std::min(first + kSlabVoxels, voxels.size()));
        reader.read(slab, [&](std::size_t m, std::span<const BlockSamples> blocks, auto) {
            use(slab, m, blocks);
        });
    }
    benchmark::DoNotOptimize(reader.plane_hashes());
}

/// One number of every material and slab, wherever it is.
void check_reading(const Domain& domain, const VoxelList& voxels) {
    read_all(domain, voxels,
             [](const Slab& slab, std::size_t m, std::span<const BlockSamples> blocks) {
                 const auto file_index = slab.runs.front().file_index;
                 const std::size_t channel = m % 3;
                 double expected = 0;
                 if (settings().database.empty()) {
                     std::array<double, 3> rgb = {};
                     database().read(m, {file_index, file_index + 1}, rgb);
                     expected = std::max(0.0, rgb[channel]);
                 } else {
                     expected = stored_number(database().materials()[m], file_index, channel);
                 }
                 const double found = blocks[0][channel][0];
                 require(found == expected,
                         fmt::format("{}, voxel {}: {}, expected {}", database().materials()[m],
                                     file_index, found, expected));
             });
}

void read_database(benchmark::State& state) {
    const Domain domain(database().grid());
    const VoxelList voxels(domain, VoxelSet::above_horizon);
    check_once("read", [&] {
        check_reading(domain, voxels);
        return 0;
    });
    for ([[maybe_unused]] auto _ : state) {
        read_all(domain, voxels, [](const Slab&, std::size_t, std::span<const BlockSamples>) {});
    }
    const auto bytes = 24 * database().grid().voxels() * database().materials().size();
    state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes));
}

}  // namespace

void add_reading() {
    add("read", read_database).Iterations(1);
}

}  // namespace merl::bench
