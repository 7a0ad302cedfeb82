#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/database/database.h"
#include "engine/database/domain.h"
#include "engine/distance/parts/pair_list.h"
#include "engine/distance/parts/pair_totals.h"
#include "engine/distance/parts/slab.h"
#include "engine/distance/parts/summary.h"
#include "engine/metric/metric.h"

namespace merl::engine {

// What computes distances. An engine computes whole metrics, from samples to distances; a
// computation may use several, all fed by one reader. To add one: implement Engine and EngineWork
// in a folder beside vulkan/ and host/, and say in engines.cpp when it is used.

/// What an engine is, for the user.
struct EngineDescription {
    std::string engine;  // "host" or "vulkan"
    std::string grids;   // who makes them: "host" or "device"
    std::string name;    // of the device, as its driver has it
    std::string kind;    // "CPU", "discrete GPU" ...
    std::string driver;  // with its version; empty for the host
    std::string vulkan;  // its version; empty for the host

    bool operator==(const EngineDescription&) const = default;
};

/// What an engine needs for its metrics.
struct EngineNeeds {
    static constexpr std::uint64_t kUnbounded = std::numeric_limits<std::uint64_t>::max();

    std::uint64_t fixed_bytes = 0;           // of memory, however large the slabs are
    std::uint64_t block_bytes = 0;           // for each block of a slab
    std::uint64_t most_blocks = kUnbounded;  // of a slab, at least 1
    bool cached = false;  // it works from the processor's caches, which slabs should not outgrow
};

/// The size of a computation.
struct Extent {
    const PairList* pairs = nullptr;  // that are computed; outlives the work
    std::uint32_t slab_blocks = 0;    // the most blocks of a slab
    std::uint64_t grid_voxels = 0;    // |K|, also those below the horizon
    bool is_trial = false;            // of a user's metric: a window may be empty

    std::uint32_t materials() const { return pairs->materials(); }
};

/// Seconds spent in the parts of a computation; reading and a device's work overlap.
struct DistanceSeconds {
    double opening = 0;     // a device
    double kernels = 0;     // compiling the kernels and making the buffers
    double reading = 0;     // host: reading, converting, hashing; grids of the host
    double transform = 0;   // device: grids and norms
    double difference = 0;  // grids to partial sums
    double waiting = 0;     // host: waiting for the device
    double adding = 0;      // host: adding partial sums in float64
    double total = 0;       // from start to end

    double without_opening() const { return total - opening; }
};

/// What an engine's work may look at and adds to. All of it outlives the work.
struct WorkSite {
    const Database& database;
    const VoxelList& voxels;
    DistanceSeconds& seconds;
    std::vector<std::string>& warnings;  // one line each, for the user
    /// To be called every now and then while work is waited for; what it throws ends the work.
    const std::function<void()>& meanwhile;
};

/// One computation: some metrics of one database, slab by slab, in the order of the voxels.
class EngineWork {
  public:
    virtual ~EngineWork() = default;

    /// The next slab, which lives until compute() returns.
    virtual void begin(const Slab& slab) = 0;

    /// The samples of one material in its blocks, and what was not measured of them where a metric
    /// is a summary (block_reader.h), for each material once. Any thread may call it.
    virtual void take(std::size_t material, std::span<const BlockSamples> blocks,
                      std::span<const BlockGaps> gaps) = 0;

    /// After all materials: computes the slab, or starts to. Throws Error (input) for what is wrong
    /// with a user's metric, now or at the next call.
    virtual void compute() = 0;

    /// After the last slab: the distances of each metric, in the order of the pairs.
    virtual std::vector<MetricDistances> distances() = 0;

    /// The most memory held so far.
    virtual std::uint64_t peak_bytes() const = 0;
};

/// Something that computes distances.
class Engine {
  public:
    virtual ~Engine() = default;

    virtual EngineDescription description() const = 0;

    /// Throws Error (device) when there are more materials or pairs than it can work on.
    virtual EngineNeeds needs(std::span<const Metric* const> metrics,
                              const PairList& pairs) const = 0;

    /// What evaluates the features of a summary that this engine computes: distances under other
    /// parameters, which no window depends on, come from means that are known. The metric outlives
    /// it, and `meanwhile`, which is called while a device is waited for. Throws Error (input) when
    /// a user's metric cannot be compiled.
    virtual Features features(const Metric& metric, const std::function<void()>& meanwhile) = 0;

    /// Begins a computation. Throws Error (input) when a user's metric cannot be compiled.
    virtual std::unique_ptr<EngineWork> start(std::span<const Metric* const> metrics,
                                              const Extent& extent, const WorkSite& site) = 0;
};

}  // namespace merl::engine
