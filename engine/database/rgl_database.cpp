#include "engine/database/rgl_database.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>

#include "engine/base/error.h"
#include "engine/base/file.h"
#include "engine/database/bad_files.h"
#include "engine/database/domain.h"
#include "engine/database/kept_samples.h"
#include "engine/database/rgl_file.h"

namespace merl::engine {
namespace {

using std::numbers::pi;

constexpr const char* kExtension = ".bsdf";

/// Between which two of several nodes something lies, and how far from the first to the second.
struct Place {
    std::size_t first = 0;
    std::size_t second = 0;
    double share = 0;
};

/// Among nodes that span [0, 1], the first and the last at its ends.
Place place_among(std::size_t nodes, double u) {
    const double at = std::clamp(u, 0.0, 1.0) * static_cast<double>(nodes - 1);
    const std::size_t first = std::min(static_cast<std::size_t>(at), nodes - 2);
    return {first, first + 1, at - static_cast<double>(first)};
}

/// Among ascending angles, held at their ends.
Place place_among(std::span<const float> angles, double angle) {
    const auto above = std::ranges::upper_bound(angles, angle);
    const auto second = static_cast<std::size_t>(above - angles.begin());
    if (second == 0 || second == angles.size()) {
        const std::size_t end = second == 0 ? 0 : second - 1;
        return {end, end, 0};
    }
    const double low = angles[second - 1];
    return {second - 1, second, (angle - low) / (angles[second] - low)};
}

double mix(double first, double second, double share) {
    return first + share * (second - first);
}

/// ∫ over the first `share` of an interval of length 1, of what is linear between its ends.
double integral(double first, double second, double share) {
    return share * (first + share / 2 * (second - first));
}

/// u(θ) and u(φ) of the paper, with which the arrays are indexed.
double u_of_theta(double theta) {
    return std::sqrt(2 * theta / pi);
}

double u_of_phi(double phi) {
    return phi / (2 * pi) + 0.5;
}

/// Arrays of nodes over [0, 1]² one after the other; x is the last axis.
struct Maps {
    std::size_t height = 0;
    std::size_t width = 0;
    std::vector<float> values;

    const float* map(std::size_t number) const { return values.data() + number * height * width; }

    double bilinear(std::size_t number, const Place& y, const Place& x) const {
        const float* const first = map(number) + y.first * width;
        const float* const second = map(number) + y.second * width;
        return mix(mix(first[x.first], first[x.second], x.share),
                   mix(second[x.first], second[x.second], x.share), y.share);
    }
};

/// A measured material: f·cos θ_o for any two directions (Dupuy and Jakob 2018).
class RglMaterial {
  public:
    explicit RglMaterial(const std::filesystem::path& path) {
        File file(path);
        file.settle();
        const RglFile container(file);
        if (container.find("rgb") == nullptr &&
            (container.find("spectra") != nullptr || container.find("wavelengths") != nullptr)) {
            file.fail(
                "is spectral (it has fields wavelengths and spectra); expected colours in a field "
                "rgb, as in the files NAME_rgb.bsdf of the RGL");
        }
        const auto angles = container.floats("phi_i", 1).shape[0];
        if (angles > 2) {
            file.fail(
                fmt::format("is anisotropic (phi_i has {} angles); expected an isotropic "
                            "material, with at most 2",
                            angles));
        }
        phi_i_ = read_angles(file, container.floats("phi_i", 1), -2 * pi, 2 * pi);
        theta_i_ = read_angles(file, container.floats("theta_i", 1), 0, pi / 2);
        sigma_ = read_maps(file, container.floats("sigma", 2), {}, kNotNegative);
        ndf_ = read_maps(file, container.floats("ndf", 2), {}, kNotNegative);
        const std::array<std::uint64_t, 3> slices = {phi_i_.size(), theta_i_.size(), 3};
        vndf_ =
            read_maps(file, container.floats("vndf", 4), std::span(slices).first(2), kNotNegative);
        rgb_ = read_maps(file, container.floats("rgb", 5), slices, kAny);
        integrate(file);
        file.expect(file.state());
    }

    /// What all results follow from.
    void identify(const SampleSink& sink) const {
        const auto add = [&](const auto& values) { sink(0, std::as_bytes(std::span(values))); };
        for (const auto* angles : {&phi_i_, &theta_i_}) {
            add(std::array<std::uint64_t, 1>{angles->size()});
            add(*angles);
        }
        for (const auto* maps : {&sigma_, &ndf_, &vndf_, &rgb_}) {
            add(std::array<std::uint64_t, 2>{maps->height, maps->width});
            add(maps->values);
        }
    }

    /// f·cos θ_o of light from a direction, with phi_i from -π to π, where the half vector has
    /// φ_m = 0.
    std::array<double, 3> evaluate(double theta_i, double phi_i, double u_theta_m) const {
        const double u_phi_m = u_of_phi(-phi_i);  // of φ_m - φ_i; within [0, 1]
        const auto slices = slices_at(theta_i, phi_i);
        const auto [x, y] = invert(slices, u_theta_m, u_phi_m);
        const double area = sigma_.bilinear(0, place_among(sigma_.height, u_of_phi(phi_i)),
                                            place_among(sigma_.width, u_of_theta(theta_i)));
        const double factor = ndf_.bilinear(0, place_among(ndf_.height, u_phi_m),
                                            place_among(ndf_.width, u_theta_m)) /
                              (4 * area);
        const Place at_y = place_among(rgb_.height, y);
        const Place at_x = place_among(rgb_.width, x);
        std::array<double, 3> result = {};
        for (std::size_t channel = 0; channel < 3; ++channel) {
            double value = 0;
            for (const auto& slice : slices) {
                if (slice.weight != 0) {
                    value += slice.weight * rgb_.bilinear(3 * slice.number + channel, at_y, at_x);
                }
            }
            result[channel] = std::max(0.0, value) * factor;
        }
        return result;
    }

  private:
    static constexpr double kNotNegative = 0;
    static constexpr double kAny = std::numeric_limits<double>::lowest();

    static std::vector<float> read_numbers(const File& file, const RglField& field, double least) {
        std::vector<float> values(field.bytes / sizeof(float));
        file.read(field.offset, std::as_writable_bytes(std::span(values)));
        for (std::size_t i = 0; i < values.size(); ++i) {
            if (!std::isfinite(values[i]) || values[i] < least) {
                file.fail(fmt::format("number {} of {} is {}; expected a finite number{}", i,
                                      field.text(), values[i],
                                      least == kNotNegative ? ", zero or more" : ""));
            }
        }
        return values;
    }

    /// Ascending, in radians within these limits but for a rounding: whoever has degrees learns it.
    static std::vector<float> read_angles(const File& file, const RglField& field, double least,
                                          double most) {
        if (field.bytes == 0) {
            file.fail(fmt::format("{} is empty; expected at least one angle", field.text()));
        }
        auto angles = read_numbers(file, field, kAny);
        const auto wrong = std::ranges::adjacent_find(angles, std::greater_equal());
        if (wrong != angles.end()) {
            file.fail(fmt::format("{} has {} after {}; expected ascending angles", field.text(),
                                  *std::next(wrong), *wrong));
        }
        constexpr double kRounding = 1e-4;
        for (const double angle : {angles.front(), angles.back()}) {
            if (angle < least - kRounding || angle > most + kRounding) {
                file.fail(fmt::format("{} has {}; expected radians from {:.4f} to {:.4f}",
                                      field.text(), angle, least, most));
            }
        }
        return angles;
    }

    /// `before` are the sizes of the dimensions before the last two.
    static Maps read_maps(const File& file, const RglField& field,
                          std::span<const std::uint64_t> before, double least) {
        const auto sides = std::span(field.shape).last(2);
        if (!std::ranges::equal(std::span(field.shape).first(before.size()), before) ||
            sides[0] < 2 || sides[1] < 2) {
            file.fail(
                fmt::format("{} has other sizes than expected: [{}{}y, x] with y and x at "
                            "least 2",
                            field.text(), fmt::join(before, ", "), before.empty() ? "" : ", "));
        }
        return {sides[0], sides[1], read_numbers(file, field, least)};
    }

    /// Makes the tables of ∫₀ˣ d of each row and ∫₀ʸ∫₀¹ d of each slice of the density, in units of
    /// the distance of nodes, divided by the mass of the slice.
    void integrate(const File& file) {
        const std::size_t height = vndf_.height;
        const std::size_t width = vndf_.width;
        along_x_.resize(vndf_.values.size());
        along_y_.resize(phi_i_.size() * theta_i_.size() * height);
        for (std::size_t slice = 0; slice < phi_i_.size() * theta_i_.size(); ++slice) {
            const float* const density = vndf_.map(slice);
            double* const along_x = along_x_.data() + slice * height * width;
            double* const along_y = along_y_.data() + slice * height;
            for (std::size_t y = 0; y < height; ++y) {
                double* const row = along_x + y * width;
                for (std::size_t x = 1; x < width; ++x) {
                    row[x] = row[x - 1] +
                             integral(density[y * width + x - 1], density[y * width + x], 1);
                }
                if (y > 0) {
                    along_y[y] = along_y[y - 1] + integral(row[-1], row[width - 1], 1);
                }
            }
            const double mass = along_y[height - 1];
            if (mass <= 0) {
                file.fail(
                    fmt::format("the density vndf at phi_i {} and theta_i {} (slice {}, {}) "
                                "is zero everywhere; expected some mass",
                                phi_i_[slice / theta_i_.size()], theta_i_[slice % theta_i_.size()],
                                slice / theta_i_.size(), slice % theta_i_.size()));
            }
            masses_.push_back(mass);
            std::for_each_n(along_x, height * width, [=](double& value) { value /= mass; });
            std::for_each_n(along_y, height, [=](double& value) { value /= mass; });
        }
    }

    /// One of the slices between whose parameters a direction is, and what it counts.
    struct Slice {
        std::size_t number = 0;
        double weight = 0;
    };

    std::array<Slice, 4> slices_at(double theta_i, double phi_i) const {
        const Place phi = place_among(phi_i_, phi_i);
        const Place theta = place_among(theta_i_, theta_i);
        const auto number = [&](std::size_t p, std::size_t t) { return p * theta_i_.size() + t; };
        return {Slice{number(phi.first, theta.first), (1 - phi.share) * (1 - theta.share)},
                Slice{number(phi.first, theta.second), (1 - phi.share) * theta.share},
                Slice{number(phi.second, theta.first), phi.share * (1 - theta.share)},
                Slice{number(phi.second, theta.second), phi.share * theta.share}};
    }

    /// Maps a point to the cumulative coordinates of the density between slices. Integrals of that
    /// are those of the slices, interpolated; they are divided last.
    std::array<double, 2> invert(const std::array<Slice, 4>& slices, double u_x, double u_y) const {
        const std::size_t width = vndf_.width;
        const Place x = place_among(width, u_x);
        const Place y = place_among(vndf_.height, u_y);
        double below = 0;
        double left = 0;
        double row = 0;
        for (const auto& slice : slices) {
            if (slice.weight == 0) {
                continue;
            }
            const double* const along_y = along_y_.data() + slice.number * vndf_.height;
            const auto of_row = [&](std::size_t number) {
                const std::size_t at = number * width;
                const float* const density = vndf_.map(slice.number) + at;
                const double* const along_x =
                    along_x_.data() + slice.number * vndf_.height * width + at;
                return std::pair(
                    along_x[x.first] + integral(density[x.first], density[x.second], x.share) /
                                           masses_[slice.number],
                    along_x[width - 1]);
            };
            const auto [first_left, first] = of_row(y.first);
            const auto [second_left, second] = of_row(y.second);
            below += slice.weight * (along_y[y.first] + integral(first, second, y.share));
            left += slice.weight * mix(first_left, second_left, y.share);
            row += slice.weight * mix(first, second, y.share);
        }
        return {row > 0 ? left / row : 0, below};
    }

    std::vector<float> phi_i_;
    std::vector<float> theta_i_;
    Maps sigma_;
    Maps ndf_;
    Maps vndf_;  // by phi_i, theta_i
    Maps rgb_;   // by phi_i, theta_i, channel
    std::vector<double> along_x_;
    std::vector<double> along_y_;
    std::vector<double> masses_;  // of the slices of vndf
};

class RglDatabase final : public Database {
  public:
    /// `name` is what it is called and where it is.
    RglDatabase(const std::filesystem::path& name, const char* kind,
                std::vector<MaterialFile> files, const OpenOptions& options)
        : Database(name.string(), kind,
                   std::filesystem::absolute(name).lexically_normal().string()),
          files_(std::move(files)),
          domain_(options.grid),
          kept_(options.grid, files_.size()) {
        grid_ = options.grid;
        std::vector<std::optional<RglMaterial>> measured(files_.size());
        const auto faults = faults_of(files_.size(), [&](std::size_t i) {
            measured[i].emplace(files_[i].path);
            if (options.skip_bad) {
                check(*measured[i], files_[i].path);
            }
        });
        for (std::size_t i = 0; i < files_.size(); ++i) {
            if (faults[i].empty()) {
                measured_.push_back(std::move(*measured[i]));
                materials_.push_back(files_[i].material);
            }
        }
        skipped_ = engine::skip_bad(name_, files_, faults, options);
    }

    std::string place_of(std::size_t material) const override {
        return files_.at(material).path.string();
    }

    void read(std::size_t material, VoxelRange range, std::span<double> samples,
              const SampleSink& sink) const override {
        if (sink && range.first == 0) {
            measured_.at(material).identify(sink);
        }
        try {
            kept_.read(material, range, samples, [&](VoxelRange part, std::span<double> planes) {
                compute(material, part, planes);
            });
        } catch (const InputError& error) {
            bad_.fail(*this, error,
                      [&](std::size_t other) { check(measured_[other], files_[other].path); });
        }
    }

    std::uint64_t keep(std::uint64_t bytes) const override { return kept_.keep(bytes); }

  private:
    void compute(std::size_t material, VoxelRange range, std::span<double> planes) const {
        // Isolated, because a caller's thread that waits here must not begin others of its tasks.
        tbb::this_task_arena::isolate([&] {
            tbb::parallel_for(
                tbb::blocked_range(range.first, range.last, 256), [&](const auto& part) {
                    evaluate(measured_[material], {part.begin(), part.end()}, range, planes);
                });
        });
        require_good(files_[material].path, range, planes);
    }

    /// Throws unless all samples of a material can be used; in the thread that calls it.
    void check(const RglMaterial& measured, const std::filesystem::path& path) const {
        constexpr std::uint64_t kVoxelsAtATime = 16384;
        std::vector<double> planes;
        for (std::uint64_t first = 0; first < grid_.voxels(); first += kVoxelsAtATime) {
            const VoxelRange range = {first, std::min(first + kVoxelsAtATime, grid_.voxels())};
            planes.resize(3 * range.size());
            evaluate(measured, range, range, planes);
            require_good(path, range, planes);
        }
    }

    /// A part of the voxels of a range, whose planes are given.
    void evaluate(const RglMaterial& measured, VoxelRange part, VoxelRange range,
                  std::span<double> planes) const {
        for (std::uint64_t i = part.first; i != part.last; ++i) {
            const auto f = reflectance(measured, domain_.voxel(i));
            for (std::size_t plane = 0; plane < 3; ++plane) {
                planes[plane * range.size() + i - range.first] = f[plane];
            }
        }
    }

    void require_good(const std::filesystem::path& path, VoxelRange range,
                      std::span<const double> planes) const {
        const auto good = [](double value) { return value >= 0 && value <= kMaxReflectance; };
        const auto bad = std::ranges::find_if_not(planes, good);
        if (bad != planes.end()) {
            const auto index =
                range.first + static_cast<std::uint64_t>(bad - planes.begin()) % range.size();
            throw InputError(fmt::format(
                "{}: makes voxel theta_h {}, theta_d {}, phi_d {} {}/sr; expected a finite number, "
                "at most {}; its rgb, ndf or sigma may be damaged",
                path.string(), index / grid_.phi_d / grid_.theta_d,
                index / grid_.phi_d % grid_.theta_d, index % grid_.phi_d, *bad, kMaxReflectance));
        }
    }

    /// The reciprocal f that fits f·cos θ_o and f·cos θ_i best, measured both ways; zero below the
    /// horizon.
    static std::array<double, 3> reflectance(const RglMaterial& measured, const Voxel& v) {
        if (!v.above_horizon()) {
            return {};
        }
        const double along = std::sin(v.theta_h) * std::cos(v.theta_d);
        const double across = std::cos(v.phi_d) * std::cos(v.theta_h) * std::sin(v.theta_d);
        const double aside = std::sin(v.phi_d) * std::sin(v.theta_d);
        const double u_theta_m = u_of_theta(v.theta_h);
        const auto from = [&](double x, double y, double z) {
            return measured.evaluate(std::atan2(std::hypot(x, y), z), std::atan2(y, x), u_theta_m);
        };
        const auto forth = from(along + across, aside, v.cos_theta_i);
        const auto back = from(along - across, -aside, v.cos_theta_o);
        const double norm = v.cos_theta_i * v.cos_theta_i + v.cos_theta_o * v.cos_theta_o;
        std::array<double, 3> f = {};
        for (std::size_t c = 0; c < 3; ++c) {
            f[c] = (forth[c] * v.cos_theta_o + back[c] * v.cos_theta_i) / norm;
        }
        return f;
    }

    std::vector<MaterialFile> files_;
    std::vector<RglMaterial> measured_;
    Domain domain_;
    mutable KeptSamples kept_;
    mutable BadSamples bad_;
};

}  // namespace

bool is_rgl(const std::filesystem::path& path) {
    std::error_code none;
    if (!std::filesystem::is_directory(path, none)) {
        return has_extension(path, kExtension);
    }
    bool any = false;
    for (std::filesystem::directory_iterator file(path, none), end; !none && file != end;
         file.increment(none)) {
        if (has_extension(file->path(), ".binary")) {
            return false;
        }
        any = any || has_extension(file->path(), kExtension);
    }
    return any;
}

std::unique_ptr<Database> open_rgl_directory(const std::filesystem::path& directory,
                                             const OpenOptions& options) {
    return std::make_unique<RglDatabase>(
        directory, "RGL directory", list_database_files(directory, kExtension, options.materials),
        options);
}

std::vector<MaterialFile> list_rgl_files(const std::filesystem::path& path) {
    std::error_code none;
    return std::filesystem::is_directory(path, none) ? list_material_files(path, kExtension)
                                                     : std::vector{MaterialFile(path)};
}

std::unique_ptr<Database> open_rgl_file(const std::filesystem::path& path, const Grid& grid) {
    return std::make_unique<RglDatabase>(path, "RGL file", std::vector{MaterialFile(path)},
                                         OpenOptions{.grid = grid});
}

}  // namespace merl::engine
