#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "engine/base/file.h"
#include "engine/database/database.h"
#include "engine/database/domain.h"

namespace merl::engine {

/// The MERL file format (`NAME.binary`): three little-endian int32, the sizes of theta_h, theta_d
/// and phi_d, then three planes (red, green, blue) of little-endian float64.

/// Reflectance in 1/sr of a stored number 1, per channel (Matusik et al. 2003).
constexpr std::array<double, 3> kMerlScale = {1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0};

/// What `NAME.binary` holds for a voxel that was not measured.
constexpr double kMerlNotMeasured = -1.0;

/// What is known of a MERL file before its samples are read.
struct MerlHeader {
    Grid grid;
    FileState state;
};

/// Whether a file with these sizes is taken for one over [0, 2 pi): four times as many phi_d as
/// theta_d, like 90 x 90 x 360, which nothing but its sizes tells from one over [0, pi).
bool is_over_all_of_phi_d(const Grid& grid);

/// Reads and checks the header against the size of the file; `range` is where phi_d ends, if it is
/// known. Throws Error (input) on everything that is not a whole MERL file: missing, not a regular
/// file, empty, truncated, over-long, sizes that are zero, negative or too large, an odd number of
/// phi_d over 2 pi, another format.
///
/// Waits some milliseconds if the file was written just now: the kernel's clock for files ticks
/// slowly, and what is written after this returns has to get another time.
MerlHeader read_merl_header(const std::filesystem::path& path, std::optional<PhiDRange> range = {});

/// As Database::read, of a file whose header was read before. Throws Error (input) when it is not
/// that file any more, or not in that state, before or after reading.
void read_merl_samples(const std::filesystem::path& path, const MerlHeader& header,
                       VoxelRange range, std::span<double> samples, const SampleSink& sink = {});

/// Reads all samples and throws what read_merl_samples() throws.
void check_merl_samples(const std::filesystem::path& path, const MerlHeader& header);

/// One material of a database as the bytes of a MERL file, with the same reflectances. Where it is
/// black below the horizon, as models are, nothing was measured.
std::string merl_file(const Database& database, std::size_t material);

}  // namespace merl::engine
