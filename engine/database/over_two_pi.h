#pragma once

#include <functional>
#include <memory>
#include <span>

#include "engine/database/database.h"

namespace merl::engine {

/// Reads as Database::read() does, on a grid over 2 pi, what `read` has on the same grid over pi:
/// f(phi_d + pi) = f(phi_d), number for number. `read` is called as Database::read() is, for ranges
/// of whole rows of phi_d. The sink gets what `read` hands it, once for each row when it begins.
void read_over_two_pi(
    const Grid& over_two_pi, VoxelRange range, std::span<double> samples, const SampleSink& sink,
    const std::function<void(VoxelRange over_pi, std::span<double>, const SampleSink&)>& read);

/// A database over pi as one over 2 pi, f(phi_d + pi) = f(phi_d).
std::unique_ptr<Database> repeat_over_two_pi(std::shared_ptr<const Database> over_pi);

}  // namespace merl::engine
