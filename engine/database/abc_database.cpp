#include "engine/database/abc_database.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <sstream>

#include "engine/base/error.h"
#include "engine/database/abc_fits.h"

namespace merl::engine {
namespace {

using std::numbers::pi;

/// The published numbers of one material: kd and A per channel, B, C and the index of refraction.
struct AbcFit {
    std::string material;
    std::string line;  // as tabulated, for the content hash
    std::array<double, 3> kd = {};
    std::array<double, 3> a = {};
    double b = 0;
    double c = 0;
    double ior = 0;
};

AbcFit parse_fit(const std::string& line) {
    AbcFit fit;
    fit.line = line;
    std::istringstream fields(line);
    std::getline(fields, fit.material, ',');
    const std::array<double*, 9> numbers = {fit.kd.data(), &fit.kd[1], &fit.kd[2],
                                            fit.a.data(),  &fit.a[1],  &fit.a[2],
                                            &fit.b,        &fit.c,     &fit.ior};
    std::string field;
    for (double* number : numbers) {
        std::getline(fields, field, ',');
        const auto* const end = field.data() + field.size();
        const auto [stop, code] = std::from_chars(field.data(), end, *number);
        if (!fields || code != std::errc() || stop != end || !std::isfinite(*number)) {
            throw InputError(
                fmt::format("ABC figures: \"{}\" in \"{}\" is not a number; a line "
                            "is a name and nine numbers",
                            field, line));
        }
    }
    return fit;
}

/// The Fresnel term of a dielectric at `c` = cos theta_d (Löw et al. 2012).
double fresnel(double c, double ior) {
    const double g = std::sqrt(ior * ior + c * c - 1);
    const double s = (g - c) / (g + c);
    const double p = (c * (g + c) - 1) / (c * (g - c) + 1);
    return 0.5 * s * s * (1 + p * p);
}

/// The lines of a table after its header, by material.
std::vector<AbcFit> parse_fits(const std::string& csv) {
    std::vector<AbcFit> fits;
    std::istringstream lines(csv);
    std::string line;
    std::getline(lines, line);  // the header
    while (std::getline(lines, line)) {
        fits.push_back(parse_fit(line));
    }
    std::ranges::sort(fits, {}, &AbcFit::material);
    return fits;
}

std::vector<std::string> materials_of(const std::vector<AbcFit>& fits) {
    std::vector<std::string> materials(fits.size());
    std::ranges::transform(fits, materials.begin(), &AbcFit::material);
    return materials;
}

class AbcDatabase final : public Database {
  public:
    AbcDatabase(const Grid& grid, const std::string& csv)
        : Database("ABC fits of MERL (stand-in, not measured)", built_in_kind),
          domain_(grid),
          fits_(parse_fits(csv)) {
        grid_ = grid;
        materials_ = materials_of(fits_);
        for (std::uint32_t s = 0; s < grid.theta_d; ++s) {
            theta_d_.push_back(make_row(
                domain_.voxel(std::uint64_t{grid.phi_d} * s).theta_d,
                [](const AbcFit& fit, double cosine) { return fresnel(cosine, fit.ior); }));
        }
        for (std::uint32_t t = 0; t < grid.theta_h; ++t) {
            theta_h_.push_back(
                make_row(domain_.voxel(std::uint64_t{grid.phi_d} * grid.theta_d * t).theta_h,
                         [](const AbcFit& fit, double cosine) {
                             return 1 / std::pow(1 + fit.b * (1 - cosine), fit.c);
                         }));
        }
    }

    void read(std::size_t material, VoxelRange range, std::span<double> samples,
              const SampleSink& sink) const override {
        const AbcFit& fit = fits_.at(material);
        if (sink && range.first == 0) {
            sink(0, std::as_bytes(std::span(fit.line)));
        }
        for (std::uint64_t i = range.first; i < range.last; ++i) {
            const Voxel v = domain_.voxel(i);
            const Row& d = theta_d_[i / grid_.phi_d % grid_.theta_d];
            const Row& h = theta_h_[i / grid_.phi_d / grid_.theta_d];
            double lobe = 0;
            if (v.above_horizon()) {
                const double masking = std::min({1.0, 2 * h.cosine * v.cos_theta_i / d.cosine,
                                                 2 * h.cosine * v.cos_theta_o / d.cosine});
                lobe = d.factors[material] * masking * h.factors[material] /
                       (pi * v.cos_theta_i * v.cos_theta_o);
            }
            for (std::size_t plane = 0; plane < 3; ++plane) {
                samples[plane * range.size() + (i - range.first)] =
                    v.above_horizon() ? fit.kd[plane] / pi + lobe * fit.a[plane] : 0;
            }
        }
    }

  private:
    /// What depends on one of the half-difference angles alone: its cosine, and a factor of the
    /// model for each material (of theta_d the Fresnel term, of theta_h the distribution).
    struct Row {
        double cosine;
        std::vector<double> factors;
    };

    template <typename Factor>
    Row make_row(double angle, const Factor& factor) const {
        Row row = {std::cos(angle), {}};
        for (const auto& fit : fits_) {
            row.factors.push_back(factor(fit, row.cosine));
        }
        return row;
    }

    Domain domain_;
    std::vector<AbcFit> fits_;
    std::vector<Row> theta_d_;
    std::vector<Row> theta_h_;
};

}  // namespace

std::unique_ptr<Database> make_abc_database(const Grid& grid) {
    return make_abc_database(grid, kAbcFits);
}

std::unique_ptr<Database> make_abc_database(const Grid& grid, const std::string& csv) {
    return std::make_unique<AbcDatabase>(grid, csv);
}

std::vector<std::string> merl_materials() {
    return materials_of(parse_fits(kAbcFits));
}

}  // namespace merl::engine
