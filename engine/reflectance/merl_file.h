#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "engine/reflectance/database.h"
#include "engine/reflectance/domain.h"

namespace merl::reflectance {

/// The MERL file format (`NAME.binary`): three little-endian int32, the sizes of theta_h, theta_d
/// and phi_d, then three planes (red, green, blue) of little-endian float64.

/// Reflectance in 1/sr of a stored number 1, per channel (Matusik et al. 2003).
constexpr std::array<double, 3> kMerlScale = {1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0};

/// What `NAME.binary` holds for a voxel that was not measured.
constexpr double kMerlNotMeasured = -1.0;

/// Reads and checks the header against the size of the file. Throws Error (input) on everything
/// that is not a whole MERL file: missing, not a regular file, empty, truncated, over-long, sizes
/// that are zero, negative or too large.
Grid read_merl_header(const std::filesystem::path& path);

/// As Database::read. The header is checked again to be still `grid`.
void read_merl_samples(
    const std::filesystem::path& path, const Grid& grid, VoxelRange range,
    std::span<double> samples,
    const std::function<void(std::size_t plane, std::span<const std::byte>)>& raw);

/// One material of a database as the bytes of a MERL file. Voxels below the horizon are stored as
/// not measured.
std::string merl_file(const Database& database, std::size_t material);

}  // namespace merl::reflectance
