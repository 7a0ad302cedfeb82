#include "engine/database/damage.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

namespace merl::engine {
namespace {

constexpr std::array<const char*, 3> kChannels = {"red", "green", "blue"};

/// A page of 4 KiB that was lost leaves so many zeros at least, and fewer may be measured.
constexpr std::uint64_t kHole = 511;

/// A hole has at least one of so many numbers in it, and at least as many before or after that.
constexpr std::uint64_t kStride = 255;

// Samples begin 12 bytes into the file, so the borders of pages are inside a number: half of it is
// lost with the page, and what remains of the first is zero or next to nothing.
constexpr std::uint64_t kPageNumbers = 4096 / sizeof(double);

/// Whether a zero may be in a hole: some numbers before or after it are zero too. What is beyond
/// the range counts as zero. This looks at few, so that short stretches of zeros cost next to
/// nothing.
bool may_be_hole(std::span<const double> plane, std::uint64_t at) {
    constexpr std::uint64_t kStep = 15;
    bool before = true;
    bool after = true;
    for (std::uint64_t i = kStep; i <= kStride && (before || after); i += kStep) {
        before = before && (at < i || plane[at - i] == 0);
        after = after && (at + i >= plane.size() || plane[at + i] == 0);
    }
    return before || after;
}

bool begins_page(std::uint64_t number) {
    return (number + 1) % kPageNumbers == 0 || (number + 2) % kPageNumbers == 0;
}

bool ends_page(std::uint64_t number, std::uint64_t all) {
    return number == all || (number + 2) % kPageNumbers == 0;
}

}  // namespace

void DamageCheck::add(VoxelRange range, std::span<const double> samples,
                      std::span<const VoxelRun> above_horizon) {
    for (const auto& run : above_horizon) {
        const double* const at = samples.data() + (run.file_index - range.first);
        add_above_horizon({at, at + range.size(), at + 2 * range.size()}, run.length);
    }
    add_range(range, samples);
}

void DamageCheck::look_at(std::array<const double*, 3> planes, std::uint64_t length) {
    for (std::size_t c = 0; c < planes.size(); ++c) {
        auto& channel = channels_[c];
        for (std::uint64_t i = 0; i < length && !(channel.positive && channel.varies); ++i) {
            const double value = planes[c][i];
            if (value >= 0) {
                channel.positive |= value > 0;
                channel.varies |= channel.first && *channel.first != value;
                channel.first = channel.first.value_or(value);
            }
        }
    }
    settled_ = std::ranges::all_of(channels_, [](const auto& c) { return c.positive && c.varies; });
}

void DamageCheck::add_range(VoxelRange range, std::span<const double> samples) {
    for (std::size_t c = 0; c < channels_.size(); ++c) {
        const auto plane = samples.subspan(c * range.size(), range.size());
        const auto end_of_zeros = [&](std::uint64_t from) {
            const auto end = std::find_if(plane.begin() + static_cast<std::ptrdiff_t>(from),
                                          plane.end(), [](double value) { return value != 0; });
            return static_cast<std::uint64_t>(end - plane.begin());
        };
        std::uint64_t done = 0;
        if (open_[c].length > 0) {
            done = end_of_zeros(0);
            extend(c, range, samples, 0, done);
            if (done == range.size()) {
                continue;
            }
            close(c);
        }
        // The last number is looked at too: zeros may go on in the next range.
        for (std::uint64_t probe = done; probe < range.size();
             probe = probe + 1 < range.size() ? std::min(probe + kStride, range.size() - 1)
                                              : range.size()) {
            if (plane[probe] != 0 || !may_be_hole(plane, probe)) {
                continue;
            }
            std::uint64_t first = probe;
            while (first > done && plane[first - 1] == 0) {
                --first;
            }
            const std::uint64_t end = end_of_zeros(probe);
            if (end == range.size() || end - first >= kHole) {
                extend(c, range, samples, first, end);
            }
            if (end == range.size()) {
                break;
            }
            close(c);
            done = probe = end;
        }
    }
}

/// Zeros [from, to) of a range, which go on from the open ones if there are any.
void DamageCheck::extend(std::size_t channel, VoxelRange range, std::span<const double> samples,
                         std::uint64_t from, std::uint64_t to) {
    auto& zeros = open_[channel];
    if (zeros.length == 0) {
        zeros.first = range.first + from;
    }
    zeros.length += to - from;
    const double* const one = samples.data() + (channel + 1) % 3 * range.size();
    const double* const other = samples.data() + (channel + 2) % 3 * range.size();
    for (std::uint64_t i = from; i < to; ++i) {
        zeros.contrast += one[i] != 0 || other[i] != 0 ? 1U : 0U;
        zeros.unmeasured |= one[i] < 0 || other[i] < 0;
    }
}

/// Decides whether the zeros that have ended are a hole: where a channel is zero and another "not
/// measured", or from page to page while other channels go on.
void DamageCheck::close(std::size_t channel) {
    const Zeros zeros = std::exchange(open_[channel], {});
    const std::uint64_t first = channel * grid_.voxels() + zeros.first;
    const bool pages = begins_page(first) && ends_page(first + zeros.length, 3 * grid_.voxels());
    if (zeros.length >= kHole &&
        (zeros.unmeasured || (pages && zeros.contrast >= zeros.length / 2))) {
        first_hole_[channel] = holes_[channel] == 0 ? zeros.first : first_hole_[channel];
        holes_[channel] += zeros.length;
    }
}

std::string DamageCheck::fault(std::uint64_t negative_above_horizon, const ContentHash& hash,
                               std::size_t material) const {
    if (above_ == 0) {
        return "";  // a grid of a few voxels
    }
    if (std::ranges::none_of(channels_, &Channel::positive)) {
        return std::ranges::none_of(channels_, [](const auto& c) { return c.first.has_value(); })
                   ? "nothing above the horizon was measured: all samples are negative"
                   : "no sample above the horizon is above zero";
    }
    for (std::size_t c = 0; c < channels_.size(); ++c) {
        if (!channels_[c].positive) {
            return fmt::format("{} is nowhere above zero above the horizon, other channels are",
                               kChannels[c]);
        }
    }
    const bool all_constant = std::ranges::none_of(channels_, &Channel::varies);
    for (std::size_t c = 0; c < channels_.size(); ++c) {
        if (!channels_[c].varies && !all_constant) {
            return fmt::format("{} is {:.6g}/sr everywhere above the horizon, other channels vary",
                               kChannels[c], *channels_[c].first);
        }
    }
    auto last = *this;
    for (std::size_t c = 0; c < channels_.size(); ++c) {
        last.close(c);
        if (last.holes_[c] > 0) {
            const std::uint64_t at = last.first_hole_[c];
            return fmt::format(
                "{} of {} are zero where other channels are not, from voxel theta_h {}, theta_d "
                "{}, phi_d {} on, like a hole in the file",
                fmt::group_digits(last.holes_[c]), kChannels[c], at / grid_.phi_d / grid_.theta_d,
                at / grid_.phi_d % grid_.theta_d, at % grid_.phi_d);
        }
    }
    if (2 * negative_above_horizon > above_) {
        return fmt::format("{} of {} samples above the horizon were not measured",
                           fmt::group_digits(negative_above_horizon), fmt::group_digits(above_));
    }
    const auto same = [&](std::size_t a, std::size_t b) {
        return hash.same_planes(material, a, b);
    };
    for (std::size_t c = 0; c < channels_.size(); ++c) {
        const std::size_t next = (c + 1) % 3;
        if (same(c, next) && !same(next, (c + 2) % 3)) {
            return fmt::format("{} and {} are the same number for number, {} is not", kChannels[c],
                               kChannels[next], kChannels[(c + 2) % 3]);
        }
    }
    return "";
}

std::vector<std::vector<std::string>> copies_among(std::span<const std::string> materials,
                                                   std::span<const std::string> hashes) {
    std::map<std::string, std::vector<std::string>> by_content;
    for (std::size_t m = 0; m < materials.size(); ++m) {
        by_content[hashes[m]].push_back(materials[m]);
    }
    std::vector<std::vector<std::string>> copies;
    for (auto& [hash, same] : by_content) {
        if (same.size() > 1) {
            copies.push_back(std::move(same));
        }
    }
    return copies;
}

}  // namespace merl::engine
