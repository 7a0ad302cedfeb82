#include "engine/database/blends_database.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/number.h"
#include "engine/base/widest_vectors.h"
#include "engine/database/kept_samples.h"
#include "engine/database/model_database.h"

namespace merl::engine {
namespace {

constexpr std::string_view kPrefix = "blends:";

/// Enough for the samples of all originals in the ranges that are read at a time.
constexpr std::uint64_t kMostKeptBytes = 320ULL << 20U;

/// weight of the first, and the rest of the second; of an original by itself both are that.
struct Blend {
    std::string name;
    std::size_t first = 0;
    std::size_t second = 0;
    double weight = 1;
};

/// 1/2, 1/4, 3/4, 1/8, 5/8 ...: van der Corput's sequence, whose numbers are exact.
double weight_of(std::size_t round) {
    double weight = 0;
    double digit = 0.5;
    for (std::size_t rest = round + 1; rest > 0; rest /= 2) {
        weight += static_cast<double>(rest % 2) * digit;
        digit /= 2;
    }
    return weight;
}

/// The materials, ascending by name.
std::vector<Blend> blends_of(const std::vector<std::string>& originals, std::size_t materials) {
    std::vector<Blend> blends;
    const std::size_t count = originals.size();
    const std::size_t kept = std::min(count, materials);
    for (std::size_t m = 0; m < kept; ++m) {
        const std::size_t original = m * count / kept;
        blends.push_back({originals[original], original, original});
    }
    for (std::size_t round = 0; blends.size() < materials; ++round) {
        for (std::size_t apart = 1; apart < count; ++apart) {
            for (std::size_t m = 0; m + apart < count && blends.size() < materials; ++m) {
                blends.push_back(
                    {fmt::format("blend-{:05}", blends.size()), m, m + apart, weight_of(round)});
            }
        }
    }
    std::ranges::sort(blends, {}, &Blend::name);
    return blends;
}

/// a := weight a + (1 - weight) b
MERL_SCAN_WIDEST_VECTORS void blend(double weight, double* a, const double* b, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) {
        a[i] = weight * a[i] + (1 - weight) * b[i];
    }
}

class BlendsDatabase final : public Database {
  public:
    BlendsDatabase(std::unique_ptr<Database> originals, std::size_t materials,
                   const std::string& path)
        : Database(fmt::format("{} blends of {}", materials, originals->name()), built_in_kind,
                   path),
          originals_(std::move(originals)),
          blends_(blends_of(originals_->materials(), materials)),
          kept_(originals_->grid(), originals_->materials().size(), KeptSamples::Order::last) {
        grid_ = originals_->grid();
        std::ranges::transform(blends_, std::back_inserter(materials_), &Blend::name);
    }

    void read(std::size_t material, VoxelRange range, std::span<double> samples,
              const SampleSink& sink) const override {
        const auto& [name, first, second, weight] = blends_.at(material);
        if (sink && range.first == 0) {
            identify(blends_[material], sink);
        }
        read_original(first, range, samples);
        if (first != second) {
            thread_local std::vector<double> others;
            others.resize(samples.size());
            read_original(second, range, others);
            blend(weight, samples.data(), others.data(), samples.size());
        }
    }

    std::uint64_t keep(std::uint64_t bytes) const override {
        return kept_.keep(std::min(bytes, kMostKeptBytes));
    }

  private:
    void read_original(std::size_t original, VoxelRange range, std::span<double> samples) const {
        kept_.read(original, range, samples, [&](VoxelRange part, std::span<double> planes) {
            originals_->read(original, part, planes);
        });
    }

    /// An original as in its own database; of a blend the weight and both.
    void identify(const Blend& of, const SampleSink& sink) const {
        if (of.first != of.second) {
            const auto text = fmt::format("blend {}\n", of.weight);
            sink(0, std::as_bytes(std::span(text)));
            originals_->read(of.second, {}, {}, sink);
        }
        originals_->read(of.first, {}, {}, sink);
    }

    std::unique_ptr<Database> originals_;
    std::vector<Blend> blends_;
    mutable KeptSamples kept_;  // of the originals
};

}  // namespace

bool is_blends(const std::string& name) {
    return name.starts_with(kPrefix);
}

std::unique_ptr<Database> open_blends(const std::string& name, const Grid& grid) {
    const auto materials =
        is_blends(name) ? parse_number<std::size_t>(name.substr(kPrefix.size())) : std::nullopt;
    if (!materials || *materials < 2 || *materials > kMostBlends) {
        throw InputError(
            fmt::format("{}: found no number of materials from 2 to {}; expected for "
                        "example {}1000",
                        name, kMostBlends, kPrefix));
    }
    return std::make_unique<BlendsDatabase>(open_model(kBuiltInModel, grid), *materials,
                                            fmt::format("{}{}", kPrefix, *materials));
}

}  // namespace merl::engine
