#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "engine/database/database.h"
#include "engine/database/domain.h"
#include "engine/device/context.h"
#include "engine/distance/parts/pair_list.h"
#include "engine/metric/metric.h"

namespace merl::engine {

/// Some pairs of materials, first and second in any order, under one metric with a degree.
struct Float64Pairs {
    const Metric* metric;
    std::vector<MaterialPair> pairs;
};

/// Distances of these pairs in float64, by shaders: transform, weight and power in float64, samples
/// subtracted before they are weighed, sums in one order (shaders/framework/float64_sums.comp). So
/// the bits are the same whatever the memory, the threads, the other pairs and the subgroups. Where
/// a sum falls below the range of float64 it is computed again with scaled samples
/// (float64_distances.h).
///
/// A slab's samples go to the device once, for all pairs. They and the sums stay within
/// `memory_bytes`, but one block of two materials is there in any case; each pair takes some 32
/// bytes beside. Where not all materials have room at a time each is read once with every group of
/// others.
///
/// `progress` is called with the share done, also while the device is waited for, and may throw.
/// Throws Error (input) for a metric that cannot be compiled or whose sum is no number. The device
/// must have float64 in shaders.
std::vector<std::vector<double>> vulkan_float64_distances(
    device::Context& context, const Database& database, std::span<const Float64Pairs> requests,
    VoxelSet set, const std::function<void(double)>& progress, std::uint64_t memory_bytes);

}  // namespace merl::engine
