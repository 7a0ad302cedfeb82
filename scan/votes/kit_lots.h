#pragma once

#include <boost/random/uniform_int_distribution.hpp>
#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace merl::scan {

/// What is drawn for; each has numbers of its own, so that one option does not change another's.
enum class Purpose : std::uint32_t { sentinels = 1, random = 2, repeats = 3 };

/// What a kit draws by lot: the same for the same seed on every machine.
class Lots {
  public:
    Lots(std::uint64_t seed, Purpose purpose) {
        std::seed_seq sequence{static_cast<std::uint32_t>(seed),
                               static_cast<std::uint32_t>(seed >> 32U),
                               static_cast<std::uint32_t>(purpose)};
        random_.seed(sequence);
    }

    /// 0 to count - 1. The standard library's distribution may differ from one to the next.
    std::size_t draw(std::size_t count) {
        return boost::random::uniform_int_distribution<std::size_t>(0, count - 1)(random_);
    }

    template <typename T>
    void shuffle(std::vector<T>& list) {
        for (std::size_t left = list.size(); left > 1; --left) {
            std::swap(list[left - 1], list[draw(left)]);
        }
    }

  private:
    std::mt19937_64 random_;
};

/// How often a disagreement is drawn at most.
inline constexpr std::uint64_t most_draws = 10'000'000;

/// 0 for the smallest of the distances; equal ones in their order.
std::vector<std::uint32_t> places_in_order(const std::vector<double>& values);

/// The indices of so many of the smallest keys; equal ones in their order.
std::vector<std::uint32_t> smallest(const std::vector<std::uint32_t>& keys, std::size_t count);

/// Keys that are the smaller the farther something is under both metrics: by the smaller of its two
/// ranks (places_in_order).
std::vector<std::uint32_t> farness(const std::vector<std::uint32_t>& first,
                                   const std::vector<std::uint32_t>& second);

}  // namespace merl::scan
