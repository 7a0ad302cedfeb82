#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace merl::engine {

/// Where phi_d ends; it begins at 0. What is reciprocal, f(phi_d + pi) = f(phi_d), needs no more
/// than pi. Published approximations that are not go to 2 pi (docs/numerics.md).
enum class PhiDRange { pi, two_pi };

/// "pi" or "2pi", as options and summaries have it.
const char* range_name(PhiDRange range);

/// Sizes of a sampled BRDF in the MERL domain (Matusik et al. 2003). MERL itself is 90 × 90 × 180,
/// over pi.
struct Grid {
    std::uint32_t theta_h = 90;
    std::uint32_t theta_d = 90;
    std::uint32_t phi_d = 180;  // over all of the range; over 2 pi an even number
    PhiDRange phi_d_range = PhiDRange::pi;

    bool operator==(const Grid&) const = default;

    /// |K|, the number of voxels. At most kMaxVoxels for every grid that passed a reader.
    std::uint64_t voxels() const { return std::uint64_t{theta_h} * theta_d * phi_d; }

    /// "90 x 90 x 180 (theta_h x theta_d x phi_d)"; over 2 pi with "over 2 pi" behind phi_d. Hashes
    /// of contents begin with it.
    std::string text() const;

    /// The part of it with phi_d below pi: itself, or half of a grid over 2 pi.
    Grid over_pi() const;

    /// It and what comes after pi, on as fine a grid: itself, or twice one over pi.
    Grid over_two_pi() const;
};

/// The most voxels a database may have: 256 times the grid of MERL.
constexpr std::uint64_t kMaxVoxels = 256ULL * 90 * 90 * 180;

/// The most voxels along one side of a grid, of which Domain keeps the angles.
constexpr std::uint64_t kMaxSide = 65536;

/// What a metric may know about a voxel, at its centre. Angles in radians. Kernels read the same
/// numbers in the same order (shaders/framework/geometry.glsl).
///
/// A voxel beyond pi has the two directions of the one at phi_d - pi, exchanged, and is described
/// by the very same numbers: those of Grid::over_pi(). So no metric can weigh the halves of a grid
/// over 2 pi differently, and what repeats after pi has the same distances there as over pi.
struct Voxel {
    double theta_h = 0;  // half-difference angles (Rusinkiewicz 1998)
    double theta_d = 0;
    double phi_d = 0;        // below pi
    double s_merl = 0;       // MERL scale factor, docs/numerics.md
    double cos_theta_i = 0;  // Ryman 2018, 4.5
    double cos_theta_o = 0;  // Ryman 2018, 4.6
    /// dω_i dω_o of the voxel in sr², with its rotations about the normal and its mirror image:
    /// 4π·s_merl/|K|. Zero at points that are no voxel's centre.
    double solid_angle = 0;
    double voxels = 0;  // |K|, of the whole grid over pi; likewise
    /// The layer of its grid, from 0, and how many there are; likewise. With these a metric decides
    /// in whole numbers on which side of a border the centre is (shaders/lib/windows.glsl).
    std::int32_t theta_h_layer = 0;
    std::int32_t theta_h_layers = 0;
    std::int32_t theta_d_layer = 0;
    std::int32_t theta_d_layers = 0;

    bool above_horizon() const { return cos_theta_i > 0 && cos_theta_o > 0; }
};

/// The voxels of a grid, in the order of MERL files: phi_d runs fastest, theta_h slowest.
class Domain {
  public:
    explicit Domain(const Grid& grid);

    const Grid& grid() const { return grid_; }

    /// The voxel with file index `phi_d + n_phi_d · (theta_d + n_theta_d · theta_h)`.
    Voxel voxel(std::uint64_t file_index) const;

    /// As many voxels as there is room for, from this one on, in one row: they share theta_h and
    /// theta_d.
    void row(std::uint64_t first, std::span<Voxel> voxels) const;

    /// At any point of the domain, not only at voxel centres; m_r, m_s, m_t in [0, 1].
    static Voxel at(double m_r, double m_s, double m_t);

  private:
    struct Angle {
        double angle, sine, cosine;
    };
    /// Sets what depends on phi_d.
    static void turn(Voxel& voxel, const Angle& phi_d, const Angle& theta_d, const Angle& theta_h);
    static Voxel combine(const Angle& phi_d, const Angle& theta_d, const Angle& theta_h,
                         double m_t);

    Grid grid_;
    double voxels_over_pi_;
    std::vector<Angle> phi_d_, theta_d_, theta_h_;  // phi_d below pi
};

/// Which voxels a computation visits.
enum class VoxelSet {
    above_horizon,  // both cosines positive: what every metric sees
    all,            // the framework test with g = 1
};

/// Visited voxels that follow each other both in the file and in the list of visited voxels.
struct VoxelRun {
    std::uint64_t file_index = 0;  // of the first voxel
    std::uint64_t position = 0;    // of the first voxel in the list of visited voxels
    std::uint64_t length = 0;
};

/// The voxels that a computation visits, in file order. A slab is a range of positions in it.
class VoxelList {
  public:
    VoxelList(const Domain& domain, VoxelSet set);

    std::uint64_t size() const { return size_; }

    /// The runs that make up positions [first, last), cut at both ends.
    std::vector<VoxelRun> runs(std::uint64_t first, std::uint64_t last) const;

  private:
    std::vector<VoxelRun> runs_;
    std::uint64_t size_ = 0;
};

}  // namespace merl::engine
