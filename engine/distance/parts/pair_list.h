#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace merl::engine {

using MaterialPair = std::pair<std::uint32_t, std::uint32_t>;

/// The pairs of materials of which distances are computed, in their order: all of them, (0,1),
/// (0,2) … (1,2) …, those of a list, or a rectangle of the matrix of all.
class PairList {
  public:
    /// Of so many materials, those of the list, which outlives this; without one all, as of a list
    /// of all. Throws std::invalid_argument unless the list's are pairs of these materials,
    /// first < second, ascending and each there once.
    explicit PairList(std::uint32_t materials, std::span<const MaterialPair> listed = {});

    /// A rectangle: each of the first `rows` materials with each of the `columns` that follow them,
    /// row by row. Throws std::invalid_argument unless there are both.
    static PairList between(std::uint32_t rows, std::uint32_t columns);

    std::uint32_t materials() const { return static_cast<std::uint32_t>(starts_.size()) - 1; }
    std::size_t size() const { return starts_.back(); }
    bool is_all() const { return listed_.empty() && rows_ == 0; }
    std::uint32_t rows() const { return rows_; }  // of a rectangle; otherwise 0
    std::span<const MaterialPair> listed() const { return listed_; }

    /// The places of the pairs whose first material is this one: [begin, end).
    std::size_t begin_of(std::uint32_t first) const { return starts_[first]; }
    std::size_t end_of(std::uint32_t first) const { return starts_[first + 1]; }

    /// The second material of the pair at a place, whose first one is known.
    std::uint32_t second(std::uint32_t first, std::size_t place) const {
        const auto in_row = static_cast<std::uint32_t>(place - starts_[first]);
        return is_all() ? first + 1 + in_row : rows_ > 0 ? rows_ + in_row : listed_[place].second;
    }

    /// The materials that are in a pair, ascending.
    std::vector<std::uint32_t> paired() const;

    /// Some of the pairs, in which is each material that is in any: at most as many as there are of
    /// these.
    std::vector<MaterialPair> covering() const;

    /// Calls what(place, first, second) for every pair, in their order.
    template <typename What>
    void each(const What& what) const {
        for (std::uint32_t first = 0; first < materials(); ++first) {
            for (std::size_t place = begin_of(first); place < end_of(first); ++place) {
                what(place, first, second(first, place));
            }
        }
    }

  private:
    std::span<const MaterialPair> listed_;  // empty: all, or a rectangle
    std::uint32_t rows_ = 0;
    std::vector<std::size_t> starts_;  // of each first material, and the end
};

}  // namespace merl::engine
