#include "engine/database/subset_database.h"

#include <algorithm>
#include <functional>
#include <stdexcept>

namespace merl::engine {
namespace {

class SubsetDatabase final : public Database {
  public:
    SubsetDatabase(std::shared_ptr<const Database> whole, std::vector<std::size_t> places)
        : Database(whole->name(), whole->kind(), whole->path()),
          whole_(std::move(whole)),
          places_(std::move(places)) {
        grid_ = whole_->grid();
        skipped_ = whole_->skipped();
        for (const auto place : places_) {
            materials_.push_back(whole_->materials().at(place));
        }
        for (auto part : whole_->parts()) {
            const auto first = std::ranges::lower_bound(places_, part.first);
            const auto last = std::ranges::lower_bound(places_, part.first + part.materials);
            part.first = static_cast<std::size_t>(first - places_.begin());
            part.materials = static_cast<std::size_t>(last - first);
            if (part.materials > 0) {
                parts_.push_back(std::move(part));
            }
        }
    }

    void read(std::size_t material, VoxelRange range, std::span<double> samples,
              const SampleSink& sink) const override {
        whole_->read(places_.at(material), range, samples, sink);
    }

    std::uint64_t keep(std::uint64_t bytes) const override { return whole_->keep(bytes); }

    std::string place_of(std::size_t material) const override {
        return whole_->place_of(places_.at(material));
    }

  private:
    std::shared_ptr<const Database> whole_;
    std::vector<std::size_t> places_;  // of the materials in the whole
};

}  // namespace

std::unique_ptr<Database> make_subset(std::shared_ptr<const Database> whole,
                                      std::vector<std::size_t> materials) {
    if (std::ranges::adjacent_find(materials, std::greater_equal()) != materials.end() ||
        (!materials.empty() && materials.back() >= whole->materials().size())) {
        throw std::invalid_argument(
            "a subset is made of different materials of a database, ascending");
    }
    return std::make_unique<SubsetDatabase>(std::move(whole), std::move(materials));
}

}  // namespace merl::engine
