#include "engine/database/kept_samples.h"

#include <algorithm>

namespace merl::engine {
namespace {

/// Voxels that are computed and kept together: as many as readers ask for at a time.
constexpr std::uint64_t kChunkVoxels = 16384;

std::uint64_t bytes_of(VoxelRange range) {
    return 3 * range.size() * sizeof(double);
}

/// Copies the part of three planes of one range that is in another.
void copy_planes(VoxelRange from_range, std::span<const double> from, VoxelRange to_range,
                 std::span<double> to) {
    const std::uint64_t first = std::max(from_range.first, to_range.first);
    const std::uint64_t size = std::min(from_range.last, to_range.last) - first;
    for (std::size_t plane = 0; plane < 3; ++plane) {
        std::ranges::copy(
            from.subspan(plane * from_range.size() + first - from_range.first, size),
            to.subspan(plane * to_range.size() + first - to_range.first, size).begin());
    }
}

}  // namespace

KeptSamples::KeptSamples(const Grid& grid, std::size_t materials, Order order)
    : voxels_(grid.voxels()),
      chunks_((voxels_ + kChunkVoxels - 1) / kChunkVoxels),
      all_bytes_(materials * bytes_of({0, voxels_})),
      order_(order),
      kept_(materials * chunks_) {}

std::uint64_t KeptSamples::keep(std::uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    most_bytes_ = std::max(most_bytes_, bytes);
    return std::min(most_bytes_, all_bytes_);
}

VoxelRange KeptSamples::chunk(std::uint64_t number) const {
    return {number * kChunkVoxels, std::min((number + 1) * kChunkVoxels, voxels_)};
}

/// Whether so many can be kept, if need be in the place of others.
bool KeptSamples::has_room(std::uint64_t bytes) const {
    return bytes + (order_ == Order::first ? kept_bytes_ : 0) <= most_bytes_;
}

/// A whole chunk, kept before or from now on; null where there is no room for it.
KeptSamples::Planes KeptSamples::obtain(std::size_t material, std::uint64_t number,
                                        const Compute& compute) {
    const VoxelRange range = chunk(number);
    const std::size_t index = material * chunks_ + number;
    Planes& place = kept_[index];
    {
        const std::lock_guard lock(mutex_);
        if (place || !has_room(bytes_of(range))) {
            return place;
        }
    }
    const auto computed = std::make_shared<std::vector<double>>(3 * range.size());
    compute(range, *computed);
    const std::lock_guard lock(mutex_);
    if (!place && has_room(bytes_of(range))) {  // no other thread was quicker
        while (kept_bytes_ + bytes_of(range) > most_bytes_) {
            kept_[places_.front()].reset();
            kept_bytes_ -= bytes_of(chunk(places_.front() % chunks_));
            places_.pop_front();
        }
        place = computed;
        kept_bytes_ += bytes_of(range);
        if (order_ == Order::last) {
            places_.push_back(index);
        }
    }
    return computed;
}

void KeptSamples::read(std::size_t material, VoxelRange range, std::span<double> samples,
                       const Compute& compute) {
    std::vector<double> computed;
    for (std::uint64_t first = range.first; first < range.last;) {
        const std::uint64_t number = first / kChunkVoxels;
        const VoxelRange whole = chunk(number);
        const VoxelRange part = {first, std::min(range.last, whole.last)};
        if (const auto planes = obtain(material, number, compute)) {
            copy_planes(whole, *planes, range, samples);
        } else {
            computed.resize(3 * part.size());
            compute(part, computed);
            copy_planes(part, computed, range, samples);
        }
        first = part.last;
    }
}

}  // namespace merl::engine
