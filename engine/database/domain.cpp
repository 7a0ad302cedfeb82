#include "engine/database/domain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace merl::engine {

using std::numbers::pi;

const char* range_name(PhiDRange range) {
    return range == PhiDRange::pi ? "pi" : "2pi";
}

std::string Grid::text() const {
    return fmt::format("{} x {} x {} (theta_h x theta_d x phi_d{})", theta_h, theta_d, phi_d,
                       phi_d_range == PhiDRange::pi ? "" : " over 2 pi");
}

Grid Grid::over_pi() const {
    return {theta_h, theta_d, phi_d_range == PhiDRange::pi ? phi_d : phi_d / 2, PhiDRange::pi};
}

Grid Grid::over_two_pi() const {
    return {theta_h, theta_d, phi_d_range == PhiDRange::pi ? 2 * phi_d : phi_d, PhiDRange::two_pi};
}

Domain::Domain(const Grid& grid)
    : grid_(grid), voxels_over_pi_(static_cast<double>(grid.over_pi().voxels())) {
    const auto fill = [](std::vector<Angle>& angles, std::uint32_t count, auto&& angle_of) {
        for (std::uint32_t i = 0; i < count; ++i) {
            const double angle = angle_of((i + 0.5) / count);
            angles.push_back({angle, std::sin(angle), std::cos(angle)});
        }
    };
    fill(phi_d_, grid.over_pi().phi_d, [](double m) { return pi * m; });
    fill(theta_d_, grid.theta_d, [](double m) { return pi / 2 * m; });
    fill(theta_h_, grid.theta_h, [](double m) { return pi / 2 * m * m; });
}

void Domain::turn(Voxel& voxel, const Angle& phi_d, const Angle& theta_d, const Angle& theta_h) {
    const double straight = theta_h.cosine * theta_d.cosine;
    const double across = phi_d.cosine * theta_h.sine * theta_d.sine;
    voxel.phi_d = phi_d.angle;
    voxel.cos_theta_i = straight - across;
    voxel.cos_theta_o = straight + across;
}

Voxel Domain::combine(const Angle& phi_d, const Angle& theta_d, const Angle& theta_h, double m_t) {
    Voxel voxel;
    voxel.theta_h = theta_h.angle;
    voxel.theta_d = theta_d.angle;
    voxel.s_merl = pi * pi * pi / 2 * m_t * 4 * theta_h.sine * theta_d.sine * theta_d.cosine;
    turn(voxel, phi_d, theta_d, theta_h);
    return voxel;
}

Voxel Domain::voxel(std::uint64_t file_index) const {
    const std::uint64_t r = file_index % grid_.phi_d % phi_d_.size();
    const std::uint64_t s = file_index / grid_.phi_d % grid_.theta_d;
    const std::uint64_t t = file_index / grid_.phi_d / grid_.theta_d;
    Voxel voxel = combine(phi_d_[r], theta_d_[s], theta_h_[t],
                          (static_cast<double>(t) + 0.5) / grid_.theta_h);
    voxel.voxels = voxels_over_pi_;
    voxel.solid_angle = 4 * pi * voxel.s_merl / voxel.voxels;
    voxel.theta_h_layer = static_cast<std::int32_t>(t);
    voxel.theta_h_layers = static_cast<std::int32_t>(grid_.theta_h);
    voxel.theta_d_layer = static_cast<std::int32_t>(s);
    voxel.theta_d_layers = static_cast<std::int32_t>(grid_.theta_d);
    return voxel;
}

void Domain::row(std::uint64_t first, std::span<Voxel> voxels) const {
    std::ranges::fill(voxels, voxel(first));
    const Angle& theta_d = theta_d_[first / grid_.phi_d % grid_.theta_d];
    const Angle& theta_h = theta_h_[first / grid_.phi_d / grid_.theta_d];
    auto phi_d = phi_d_.begin() + static_cast<std::ptrdiff_t>(first % grid_.phi_d % phi_d_.size());
    for (auto& voxel : voxels) {
        turn(voxel, *phi_d, theta_d, theta_h);
        if (++phi_d == phi_d_.end()) {  // as before, beyond pi
            phi_d = phi_d_.begin();
        }
    }
}

Voxel Domain::at(double m_r, double m_s, double m_t) {
    const auto make = [](double angle) { return Angle{angle, std::sin(angle), std::cos(angle)}; };
    return combine(make(pi * m_r), make(pi / 2 * m_s), make(pi / 2 * m_t * m_t), m_t);
}

VoxelList::VoxelList(const Domain& domain, VoxelSet set) {
    const std::uint64_t count = domain.grid().voxels();
    for (std::uint64_t i = 0; i < count; ++i) {
        if (set == VoxelSet::above_horizon && !domain.voxel(i).above_horizon()) {
            continue;
        }
        if (runs_.empty() || runs_.back().file_index + runs_.back().length != i) {
            runs_.push_back({.file_index = i, .position = size_, .length = 0});
        }
        ++runs_.back().length;
        ++size_;
    }
}

std::vector<VoxelRun> VoxelList::runs(std::uint64_t first, std::uint64_t last) const {
    std::vector<VoxelRun> cut;
    auto run = std::upper_bound(
        runs_.begin(), runs_.end(), first,
        [](std::uint64_t position, const VoxelRun& r) { return position < r.position + r.length; });
    for (; run != runs_.end() && run->position < last; ++run) {
        const std::uint64_t from = std::max(first, run->position);
        const std::uint64_t to = std::min(last, run->position + run->length);
        cut.push_back({run->file_index + (from - run->position), from, to - from});
    }
    return cut;
}

}  // namespace merl::engine
