#include "engine/database/over_two_pi.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace merl::engine {
namespace {

class RepeatedDatabase final : public Database {
  public:
    explicit RepeatedDatabase(std::shared_ptr<const Database> over_pi)
        : Database(over_pi->name(), over_pi->kind(), over_pi->path()),
          over_pi_(std::move(over_pi)) {
        grid_ = over_pi_->grid().over_two_pi();
        materials_ = over_pi_->materials();
        skipped_ = over_pi_->skipped();
        parts_ = over_pi_->parts();
    }

    void read(std::size_t material, VoxelRange range, std::span<double> samples,
              const SampleSink& sink) const override {
        read_over_two_pi(grid_, range, samples, sink,
                         [&](VoxelRange part, std::span<double> to, const SampleSink& hash) {
                             over_pi_->read(material, part, to, hash);
                         });
    }

    std::uint64_t keep(std::uint64_t bytes) const override { return over_pi_->keep(bytes); }

    std::string place_of(std::size_t material) const override {
        return over_pi_->place_of(material);
    }

  private:
    std::shared_ptr<const Database> over_pi_;
};

}  // namespace

void read_over_two_pi(
    const Grid& over_two_pi, VoxelRange range, std::span<double> samples, const SampleSink& sink,
    const std::function<void(VoxelRange over_pi, std::span<double>, const SampleSink&)>& read) {
    const std::uint64_t width = over_two_pi.phi_d;
    const std::uint64_t half = over_two_pi.over_pi().phi_d;
    std::vector<double> rows;
    const auto take = [&](std::uint64_t first_row, std::uint64_t last_row, const SampleSink& to) {
        const VoxelRange source = {first_row * half, last_row * half};
        rows.resize(3 * source.size());
        read(source, rows, to);
        for (std::uint64_t begin = 2 * source.first; begin < 2 * source.last; begin += half) {
            // A half of a row, as far as it is in the range.
            const std::uint64_t from = std::max(begin, range.first);
            const std::uint64_t until = std::min(begin + half, range.last);
            const std::uint64_t row = begin / width - first_row;
            for (std::size_t plane = 0; plane < 3 && from < until; ++plane) {
                const double* const at =
                    rows.data() + plane * source.size() + row * half + (from - begin);
                std::copy(at, at + (until - from),
                          samples.data() + plane * range.size() + (from - range.first));
            }
        }
    };
    std::uint64_t first_row = range.first / width;
    const std::uint64_t last_row = (range.last + width - 1) / width;
    if (range.first % width != 0) {
        take(first_row, first_row + 1, {});
        ++first_row;
    }
    if (first_row < last_row) {
        take(first_row, last_row, sink);
    }
}

std::unique_ptr<Database> repeat_over_two_pi(std::shared_ptr<const Database> over_pi) {
    return std::make_unique<RepeatedDatabase>(std::move(over_pi));
}

}  // namespace merl::engine
