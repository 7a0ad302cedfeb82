#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "tests/bench/bench.h"
#include "tests/bench/inputs.h"
#include "tests/bench/peer_loops.h"
#include "tests/engine/support.h"

namespace merl::bench {
namespace {

using namespace engine;

/// Some blocks of voxels, spread over all that are visited: slow programs work on a share.
struct Subset {
    std::size_t materials = 0;
    std::size_t blocks = 0;
    double share = 0;           // of the visited voxels
    std::vector<double> grid;   // transformed, weight folded in: [block][material][number]
    std::vector<float> grid32;  // rounded
    std::vector<double> sums;   // of every pair, by the float64 twin with the weight apart
};

/// The samples of one block of all materials.
std::vector<BlockSamples> read_block(const VoxelList& list, std::uint64_t first,
                                     std::uint64_t last) {
    std::vector<BlockSamples> samples(database().materials().size());
    std::vector<double> run_samples;
    for (const auto& run : list.runs(first, last)) {
        run_samples.resize(3 * run.length);
        for (std::size_t m = 0; m < samples.size(); ++m) {
            database().read(m, {run.file_index, run.file_index + run.length}, run_samples);
            for (std::size_t i = 0; i < run_samples.size(); ++i) {
                samples[m][i / run.length][run.position - first + i % run.length] =
                    std::max(0.0, run_samples[i]);
            }
        }
    }
    return samples;
}

/// Prepares block number `block` of the subset: voxels [first, last) of the visited ones.
void fill_block(Subset& subset, std::size_t block, const Metric& metric, const Domain& domain,
                const VoxelList& list, std::uint64_t first, std::uint64_t last,
                std::span<double> sums) {
    auto samples = read_block(list, first, last);
    std::array<Voxel, kBlockVoxels> voxels = {};
    for (const auto& run : list.runs(first, last)) {
        for (std::uint64_t i = 0; i < run.length; ++i) {
            voxels[run.position - first + i] = domain.voxel(run.file_index + i);
        }
    }
    BlockWeights weights = {};
    metric.twin.weigh(metric.parameters, voxels, weights);
    std::fill(weights.begin() + static_cast<std::ptrdiff_t>(last - first), weights.end(), 0.0);
    auto transformed = std::make_unique<BlockSamples>();
    for (auto& material : samples) {
        metric.twin.transform(metric.parameters, voxels, material, *transformed);
        material = *transformed;
    }
    std::size_t pair = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        for (std::size_t j = i + 1; j < samples.size(); ++j) {
            sums[pair++] += metric.twin.sum(metric.parameters, samples[i], samples[j], weights);
        }
    }
    double* number = subset.grid.data() + block * subset.materials * kPeerBlock;
    for (const auto& material : samples) {
        for (const auto& channel : material) {
            for (std::size_t k = 0; k < kBlockVoxels; ++k) {
                *number++ = weights[k] == 0
                                ? 0
                                : std::pow(weights[k], 1 / metric.header.degree) * channel[k];
            }
        }
    }
}

/// About one block of `every`, at least two.
Subset make_subset(const Metric& metric, std::uint64_t every) {
    const Domain domain(database().grid());
    const VoxelList list(domain, VoxelSet::above_horizon);
    const std::uint64_t all = (list.size() + kBlockVoxels - 1) / kBlockVoxels;
    every = std::clamp<std::uint64_t>(every, 1, std::max<std::uint64_t>(1, all / 2));
    Subset subset;
    subset.materials = database().materials().size();
    subset.blocks = all / every;
    subset.grid.resize(subset.blocks * subset.materials * kPeerBlock);
    std::uint64_t voxels = 0;
    const auto pairs = scan::pair_count(subset.materials);
    std::vector<std::vector<double>> sums(subset.blocks, std::vector<double>(pairs));
    tbb::parallel_for(std::size_t{0}, subset.blocks, [&](std::size_t block) {
        const auto first = (block * every + every / 2) * kBlockVoxels;
        fill_block(subset, block, metric, domain, list, first,
                   std::min<std::uint64_t>(first + kBlockVoxels, list.size()), sums[block]);
    });
    subset.sums.resize(pairs);
    for (std::size_t block = 0; block < subset.blocks; ++block) {
        const auto first = (block * every + every / 2) * kBlockVoxels;
        voxels += std::min<std::uint64_t>(kBlockVoxels, list.size() - first);
        std::ranges::transform(subset.sums, sums[block], subset.sums.begin(), std::plus<>());
    }
    subset.share = static_cast<double>(voxels) / static_cast<double>(list.size());
    subset.grid32.assign(subset.grid.begin(), subset.grid.end());
    return subset;
}

const Subset& subset_of(const Metric& metric, std::uint64_t every) {
    static std::map<std::pair<const Metric*, std::uint64_t>, Subset> made;
    const auto key = std::pair(&metric, every);
    auto found = made.find(key);
    if (found == made.end()) {
        found = made.emplace(key, make_subset(metric, every)).first;
    }
    return found->second;
}

/// Throws unless every distance is that of the twin; returns the largest relative error.
double check_sums(std::span<const double> sums, const Subset& subset, double allowed) {
    require(sums.size() == subset.sums.size(), fmt::format("{} sums", sums.size()));
    double largest = 0;
    for (std::size_t p = 0; p < sums.size(); ++p) {
        const double expected = std::sqrt(subset.sums[p]);
        const double difference = std::abs(std::sqrt(sums[p]) - expected);
        const double error = difference == 0 ? 0 : difference / expected;
        require(error <= allowed, fmt::format("pair {}: {} is off by {:.1e}, allowed {:.0e}", p,
                                              std::sqrt(sums[p]), error, allowed));
        largest = std::max(largest, error);
    }
    return largest;
}

/// `whole_s`: what the time would be for all visited voxels.
void report(benchmark::State& state, const Subset& subset, double error) {
    state.counters["error"] = error;
    state.counters["share"] = subset.share;
    state.counters["whole_s"] = {
        subset.share, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert};
}

template <typename Real>
void time_loop(benchmark::State& state, const std::string& name, const Subset& subset,
               std::span<const Real> grid, PeerLoop<Real> loop, double allowed) {
    std::vector<double> sums(subset.sums.size());
    const double error = check_once(name, [&] {
        loop(grid.data(), subset.blocks, subset.materials, sums.data());
        return check_sums(sums, subset, allowed);
    });
    for ([[maybe_unused]] auto _ : state) {
        loop(grid.data(), subset.blocks, subset.materials, sums.data());
        benchmark::ClobberMemory();
    }
    report(state, subset, error);
}

/// A Python that has NumPy and SciPy; empty where there is none.
const std::string& python() {
    static const std::string found = [] {
        for (const char* const name : {"python3", "/usr/bin/python3"}) {
            if (std::system(
                    (std::string(name) + " -c 'import numpy, scipy' 2> /dev/null").c_str()) == 0) {
                return std::string(name);
            }
        }
        return std::string();
    }();
    return found;
}

template <typename Number>
void write_file(const std::filesystem::path& path, const std::vector<Number>& numbers) {
    std::ofstream file(path, std::ios::binary);
    const auto bytes = std::as_bytes(std::span(numbers));
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    require(file.flush().good(), fmt::format("cannot write {}", path.string()));
}

void time_python(benchmark::State& state, const std::string& way, const std::string& real,
                 const Subset& subset, double allowed) {
    const test::TemporaryDirectory directory;
    const auto grid = directory.path / "grid";
    const auto out = directory.path / "sums";
    real == "float32" ? write_file(grid, subset.grid32) : write_file(grid, subset.grid);
    const auto command = fmt::format("{} -B '{}' {} '{}' {} {} '{}'", python(), MERL_BENCH_PEERS,
                                     way, grid.string(), real, subset.materials, out.string());
    const auto run = [&] {
        const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
        double seconds = 0;
        require(pipe && std::fscanf(pipe.get(), "%lf", &seconds) == 1, "no answer from " + command);
        return seconds;
    };
    const double error = check_once(way + real, [&] {
        run();
        std::vector<double> sums(subset.sums.size());
        std::ifstream file(out, std::ios::binary);
        file.read(reinterpret_cast<char*>(sums.data()),
                  static_cast<std::streamsize>(sums.size() * sizeof(double)));
        require(file.good(), "too few sums from " + command);
        return check_sums(sums, subset, allowed);
    });
    for ([[maybe_unused]] auto _ : state) {
        state.SetIterationTime(run());
    }
    report(state, subset, error);
}

/// One program on every so manieth block of the samples of a metric.
template <typename Real>
benchmark::internal::Benchmark& add_loop(const std::string& program, const Metric& metric,
                                         std::uint64_t every, PeerLoop<Real> loop, double allowed) {
    const auto name = fmt::format("peer/{}/{}", program, metric.name);
    return add(name, [=, &metric](benchmark::State& state) {
        const auto& subset = subset_of(metric, every);
        if constexpr (std::is_same_v<Real, double>) {
            time_loop<double>(state, name, subset, subset.grid, loop, allowed);
        } else {
            time_loop<float>(state, name, subset, subset.grid32, loop, allowed);
        }
    });
}

void add_python(const std::string& program, const Metric& metric, std::uint64_t every,
                const std::string& real, double allowed) {
    add(
        fmt::format("peer/{}-{}/{}", program, real, metric.name),
        [=, &metric](benchmark::State& state) {
            time_python(state, program + "-" + metric.name, real, subset_of(metric, every),
                        allowed);
        },
        Clock::manual)
        .Iterations(1);
}

}  // namespace

void add_peers() {
    // Of the blocks, so that each takes about a second on two cores.
    constexpr std::uint64_t kMany = 16;
    constexpr std::uint64_t kFew = 66;
    constexpr std::uint64_t kFewest = 256;
    // What a sum of three million numbers may lose in each precision.
    constexpr double kFloat64 = 1e-12;
    constexpr double kFloat32 = 1e-5;
    const Metric& cwcbrt = *two_metrics()[0];
    const Metric& pawcielab = *two_metrics()[1];
    add_loop("openmp-float64-O3", cwcbrt, kFew, float64_o3::cwcbrt, kFloat64).Iterations(1);
    add_loop("openmp-float64-Ofast", cwcbrt, kMany, float64_ofast::cwcbrt, kFloat64);
    add_loop("openmp-float32-Ofast", cwcbrt, kMany, float32_ofast::cwcbrt, kFloat32);
    add_loop("openmp-float64-O3", pawcielab, kMany, float64_o3::pawcielab, kFloat64);
    add_loop("openmp-float64-Ofast", pawcielab, kMany, float64_ofast::pawcielab, kFloat64);
    add_loop("openmp-float32-Ofast", pawcielab, kMany, float32_ofast::pawcielab, kFloat32);
    if (python().empty()) {
        fmt::print(stderr,
                   "no Python here has NumPy and SciPy (python3-numpy, python3-scipy): left out\n");
        return;
    }
    add_python("numpy", cwcbrt, kFew, "float32", kFloat32);
    add_python("scipy", cwcbrt, kFewest, "float64", kFloat64);
    add_python("numpy", pawcielab, kFew, "float32", kFloat32);
    add_python("scipy", pawcielab, kFew, "float64", kFloat64);
}

}  // namespace merl::bench
