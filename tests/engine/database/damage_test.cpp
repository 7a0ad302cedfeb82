#include "engine/database/damage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "engine/database/model_database.h"
#include "engine/distance/parts/slab_reader.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

constexpr Grid kGrid = {.theta_h = 30, .theta_d = 30, .phi_d = 60};
const std::uint64_t kVoxels = kGrid.voxels();

/// The samples of a made-up material as a file has them, red, green and blue: not measured below
/// the horizon.
std::vector<double> whole() {
    const Domain domain(kGrid);
    std::vector<double> samples(3 * kVoxels);
    for (std::uint64_t i = 0; i < kVoxels; ++i) {
        for (std::size_t c = 0; c < 3; ++c) {
            samples[c * kVoxels + i] = domain.voxel(i).above_horizon()
                                           ? std::abs(test::random_sample(0, i, c)) + 1e-3
                                           : -1;
        }
    }
    return samples;
}

/// What DamageCheck says of them, when they come in ranges of `step` voxels.
std::string fault_of(const std::vector<double>& samples, std::uint64_t step = 1000) {
    const Domain domain(kGrid);
    DamageCheck check(kGrid);
    ContentHash hash(1);
    std::uint64_t negative = 0;
    for (std::uint64_t first = 0; first < kVoxels; first += step) {
        const VoxelRange range = {first, std::min(first + step, kVoxels)};
        std::vector<double> part;
        for (std::size_t c = 0; c < 3; ++c) {
            const auto* const at = samples.data() + c * kVoxels + first;
            part.insert(part.end(), at, at + range.size());
            hash.update(0, c, std::as_bytes(std::span(at, range.size())));
        }
        std::vector<VoxelRun> above;
        for (std::uint64_t i = range.first; i < range.last; ++i) {
            if (domain.voxel(i).above_horizon()) {
                above.push_back({.file_index = i, .position = 0, .length = 1});
                negative +=
                    std::min({samples[i], samples[kVoxels + i], samples[2 * kVoxels + i]}) < 0;
            }
        }
        check.add(range, part, above);
    }
    return check.fault(negative, hash, 0);
}

void expect_fault(const std::vector<double>& samples, const std::string& part) {
    for (const std::uint64_t step : {std::uint64_t{77}, std::uint64_t{1000}, kVoxels}) {
        EXPECT_NE(fault_of(samples, step).find(part), std::string::npos)
            << part << ": " << fault_of(samples, step);
    }
}

/// Sets the bytes [from, to) of the file to zero, as far as they are samples.
void lose(std::vector<double>& samples, std::uint64_t from, std::uint64_t to) {
    const auto bytes = std::as_writable_bytes(std::span(samples));
    for (std::uint64_t i = std::max<std::uint64_t>(from, 12); i < to && i - 12 < bytes.size();
         ++i) {
        bytes[i - 12] = std::byte{0};
    }
}

TEST(DamageCheck, AWholeMaterialHasNoFault) {
    EXPECT_EQ(fault_of(whole()), "");
    EXPECT_EQ(fault_of(whole(), 77), "");
    EXPECT_EQ(fault_of(std::vector<double>(3 * kVoxels, 0.3)), "");  // a made-up diffuser
    const auto database = open_model("abc", kGrid);                  // zero below the horizon
    for (std::size_t m = 0; m < database->materials().size(); ++m) {
        std::vector<double> samples(3 * kVoxels);
        database->read(m, {0, kVoxels}, samples);
        EXPECT_EQ(fault_of(samples), "") << database->materials()[m];
    }
}

TEST(DamageCheck, MaterialsThatAreZeroSomewhereHaveNoFault) {
    // Clamped fits: a channel is zero over whole layers of theta_h, others are not.
    auto clamped = whole();
    const auto row = std::uint64_t{kGrid.phi_d} * kGrid.theta_d;
    std::fill_n(clamped.begin() + static_cast<std::ptrdiff_t>(2 * kVoxels + 2 * row), 600, 0.0);
    EXPECT_EQ(fault_of(clamped), "");
    // Grazing angles that were not measured, in one channel or all.
    auto grazing = whole();
    const Domain domain(kGrid);
    for (std::uint64_t i = 0; i < kVoxels; ++i) {
        const auto voxel = domain.voxel(i);
        if (std::min(voxel.cos_theta_i, voxel.cos_theta_o) < 0.2) {
            grazing[i] = grazing[2 * kVoxels + i] = -1;
        }
    }
    EXPECT_EQ(fault_of(grazing), "");
}

TEST(DamageCheck, NothingMeasured) {
    expect_fault(std::vector<double>(3 * kVoxels, -1), "nothing above the horizon was measured");
    expect_fault(std::vector<double>(3 * kVoxels, 0), "no sample above the horizon is above zero");
    auto zeros = whole();
    std::ranges::replace_if(
        zeros, [](double value) { return value > 0; }, 0.0);
    expect_fault(zeros, "no sample above the horizon is above zero");
    auto mostly = whole();
    std::fill_n(mostly.begin(), 3 * kVoxels / 4, -1.0);
    std::fill_n(mostly.begin() + static_cast<std::ptrdiff_t>(kVoxels), kVoxels / 4, 1.0);
    expect_fault(mostly, "were not measured");
}

TEST(DamageCheck, AChannelThatIsLost) {
    for (std::size_t c = 0; c < 3; ++c) {
        const char* const names[] = {"red", "green", "blue"};
        for (const double value : {0.0, -1.0}) {
            auto samples = whole();
            std::fill_n(samples.begin() + static_cast<std::ptrdiff_t>(c * kVoxels), kVoxels, value);
            expect_fault(samples, std::string(names[c]) + " is nowhere above zero");
        }
        auto constant = whole();
        std::fill_n(constant.begin() + static_cast<std::ptrdiff_t>(c * kVoxels), kVoxels, 0.25);
        expect_fault(constant, std::string(names[c]) + " is 0.25/sr everywhere");
        auto same = whole();
        std::copy_n(same.begin() + static_cast<std::ptrdiff_t>(c * kVoxels), kVoxels,
                    same.begin() + static_cast<std::ptrdiff_t>((c + 1) % 3 * kVoxels));
        expect_fault(same, "are the same number for number");
    }
}

TEST(DamageCheck, HolesOfPages) {
    const std::uint64_t end = 12 + 3 * kVoxels * sizeof(double);
    // Single pages anywhere in the file, and longer stretches.
    for (std::uint64_t page = 0; (page + 1) * 4096 < end; page += 7) {
        auto samples = whole();
        lose(samples, page * 4096, (page + 1) * 4096);
        const std::uint64_t first = (page * 4096 - 12) / sizeof(double);
        // A page over the border of two planes, or that begins with the file, may go unnoticed.
        if (page > 0 && first / kVoxels == (first + 520) / kVoxels) {
            SCOPED_TRACE(page);
            expect_fault(samples, "like a hole in the file");
        }
    }
    for (const std::uint64_t bytes : {65'536U, 300'000U}) {
        auto samples = whole();
        lose(samples, 40960, 40960 + bytes);
        expect_fault(samples, "like a hole in the file");
    }
}

TEST(DamageCheck, ATailThatWasNeverWritten) {
    // Whatever the byte is that the copy stopped at: below the horizon the others say "not
    // measured".
    const std::uint64_t end = 12 + 3 * kVoxels * sizeof(double);
    for (const std::uint64_t from : {end - 10'000, end - 200'001, end - 400'003}) {
        auto samples = whole();
        lose(samples, from, end);
        expect_fault(samples, "blue are zero where other channels are not");
    }
    auto samples = whole();
    lose(samples, end / 2, end);
    expect_fault(samples, "blue is nowhere above zero");
}

TEST(DamageCheck, CopiesAreFound) {
    const test::FunctionDatabase database({.theta_h = 6, .theta_d = 5, .phi_d = 4}, 4,
                                          [](std::size_t m, std::uint64_t v, std::size_t c) {
                                              return test::random_sample(m % 3, v, c);
                                          });
    const Domain domain(database.grid());
    const VoxelList voxels(domain, VoxelSet::above_horizon);
    SlabReader reader(database, voxels);
    reader.read(Slab(domain, voxels, 0, voxels.size()), [](std::size_t, auto, auto) {});
    const auto hashes = reader.material_hashes();
    EXPECT_EQ(hashes[0], hashes[3]);
    EXPECT_NE(hashes[0], hashes[1]);
    EXPECT_EQ(copies_among(database.materials(), hashes),
              (std::vector<std::vector<std::string>>{{"material-0000", "material-0003"}}));
}

}  // namespace
}  // namespace merl::engine
