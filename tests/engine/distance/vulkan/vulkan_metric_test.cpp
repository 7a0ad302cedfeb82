#include "engine/distance/vulkan/vulkan_metric.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cfenv>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "tests/engine/device/numerics.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

constexpr std::uint64_t kMiB = 1048576;

/// The limits of lavapipe, as it reports them.
device::Limits lavapipe_limits() {
    return {.storage_buffer_bytes = 128 * kMiB,
            .texel_buffer_texels = 134'217'728,
            .allocation_bytes = 2048 * kMiB,
            .heap_bytes = 2048 * kMiB,
            .free_bytes = 1638 * kMiB,
            .groups_x = 65535,
            .groups_y = 65535,
            .subgroup_size = 8,
            .floats = {.float64 = true}};
}

const std::array<const Metric*, 2>& two_metrics() {
    static const std::array<const Metric*, 2> metrics = {&find_metric("cwcbrt"),
                                                         &find_metric("pawcielab")};
    return metrics;
}

TEST(DeviceNeeds, EveryBufferAndDispatchIsWithinTheLimits) {
    for (const std::uint32_t materials : {2U, 10U, 11U, 100U, 400U, 1000U}) {
        auto limits = lavapipe_limits();
        for (const std::uint64_t bytes : {128 * kMiB, 32 * kMiB}) {
            limits.storage_buffer_bytes = bytes;
            limits.free_bytes = bytes == 32 * kMiB ? 256 * kMiB : 1638 * kMiB;
            const auto needs = device_needs(limits, two_metrics(), PairList(materials));
            const PairList pairs(materials);
            const DeviceExtent extent = {
                .pairs = &pairs, .slab_blocks = static_cast<std::uint32_t>(needs.most_blocks)};
            EXPECT_GE(needs.most_blocks, 1U);
            EXPECT_LE(extent.samples_bytes(), bytes);
            EXPECT_LE(extent.geometry_bytes(), bytes);
            EXPECT_LE(needs.most_blocks, limits.groups_y);
            const auto up = extent.samples_bytes() + extent.geometry_bytes();
            std::uint64_t down = 0;
            std::uint64_t grid = 0;
            for (const auto* metric : two_metrics()) {
                EXPECT_LE(extent.grid_bytes(*metric), bytes);
                EXPECT_LE(extent.sums_bytes(*metric), bytes);
                down += (metric->has_slopes() ? 2 : 1) * extent.sums_bytes(*metric) +
                        extent.norms_bytes(*metric);
                grid = std::max(grid, extent.grid_bytes(*metric));
            }
            const auto on_device = 2 * (up + down) + extent.weights_bytes() + grid +
                                   extent.ranges_bytes(*two_metrics()[0]);
            EXPECT_EQ(needs.block_bytes * needs.most_blocks, on_device);
            EXPECT_LE(on_device, limits.free_bytes);
            // Copies count: what travels is there twice.
            for (const bool uploads : {false, true}) {
                for (const bool downloads : {false, true}) {
                    limits.stages_uploads = uploads;
                    limits.stages_downloads = downloads;
                    const auto staged = device_needs(limits, two_metrics(), PairList(materials));
                    EXPECT_EQ(staged.most_blocks, needs.most_blocks);
                    EXPECT_EQ(staged.block_bytes * needs.most_blocks,
                              on_device + (uploads ? 2 * up : 0) + (downloads ? 2 * down : 0));
                }
            }
            limits.stages_uploads = limits.stages_downloads = false;
        }
    }
}

TEST(DeviceNeeds, WithoutFloat64GridsTravelInsteadOfSamples) {
    auto limits = lavapipe_limits();
    limits.floats.float64 = false;
    for (const std::uint32_t materials : {2U, 13U, 100U, 400U}) {
        const PairList pairs(materials);
        const DeviceExtent block = {.pairs = &pairs, .slab_blocks = 1};
        std::uint64_t up = 0;
        std::uint64_t down = 0;
        for (const auto* metric : two_metrics()) {
            up += block.grid_bytes(*metric);
            down += (metric->has_slopes() ? 2 : 1) * block.sums_bytes(*metric) +
                    block.norms_bytes(*metric);
        }
        const auto on_device = 2 * (up + down) + block.ranges_bytes(*two_metrics()[0]);
        const auto on_host = two_metrics().size() * sizeof(BlockWeights);
        for (const bool staged : {false, true}) {
            limits.stages_uploads = limits.stages_downloads = staged;
            const auto needs = device_needs(limits, two_metrics(), PairList(materials));
            EXPECT_EQ(needs.block_bytes, on_device + on_host + (staged ? 2 * (up + down) : 0));
            EXPECT_LE(needs.most_blocks * on_device, limits.free_bytes);
            EXPECT_LE(needs.most_blocks * block.grid_bytes(*two_metrics()[0]),
                      limits.storage_buffer_bytes);
        }
    }
}

TEST(DeviceNeeds, MoreThanIsFreeIsADeviceError) {
    auto limits = lavapipe_limits();
    limits.free_bytes = 64 * kMiB;
    EXPECT_NO_THROW(device_needs(limits, two_metrics(), PairList(100)));
    EXPECT_THROW(device_needs(limits, two_metrics(), PairList(1000)), Error);
    limits.free_bytes = 0;
    EXPECT_THROW(device_needs(limits, two_metrics(), PairList(2)), Error);
}

TEST(DeviceNeeds, SmallLimitsMakeSmallSlabs) {
    auto limits = lavapipe_limits();
    limits.texel_buffer_texels = 3 * 1024 * 100 * 3 / 2;  // three blocks of samples, two a texel
    EXPECT_EQ(device_needs(limits, two_metrics(), PairList(100)).most_blocks, 3U);
    limits = lavapipe_limits();
    limits.groups_y = 200;
    EXPECT_EQ(device_needs(limits, two_metrics(), PairList(2)).most_blocks, 200U);
    // weigh.comp has sixteen groups a block along x.
    limits = lavapipe_limits();
    limits.groups_x = 100;
    EXPECT_EQ(device_needs(limits, two_metrics(), PairList(2)).most_blocks, 100U / 16);
    limits.groups_x = 15;
    EXPECT_THROW(device_needs(limits, two_metrics(), PairList(2)), Error);
}

TEST(DeviceNeeds, TooManyMaterialsAreADeviceError) {
    for (const std::uint32_t materials : {4000U, 65536U}) {
        try {
            device_needs(lavapipe_limits(), two_metrics(), PairList(materials));
            FAIL() << materials;
        } catch (const Error& error) {
            EXPECT_EQ(error.fault(), Fault::device);
        }
    }
}

/// Of 20,000 materials all pairs are out of reach, and what is listed is not.
TEST(DeviceNeeds, GrowWithThePairsThatAreListed) {
    auto limits = lavapipe_limits();
    limits.storage_buffer_bytes = limits.free_bytes = 4096 * kMiB;
    limits.texel_buffer_texels = 1U << 28U;
    EXPECT_THROW(device_needs(limits, two_metrics(), PairList(20'000)), Error);
    std::vector<MaterialPair> listed;
    for (std::uint32_t m = 0; m < 20'000; m += 2) {
        listed.emplace_back(m, m + 1);
    }
    const auto one =
        device_needs(limits, two_metrics(), PairList(20'000, std::span(listed).first(1)));
    const auto many = device_needs(limits, two_metrics(), PairList(20'000, listed));
    // Of the two metrics: differences and slopes, differences; two slabs are in flight.
    EXPECT_EQ(many.block_bytes - one.block_bytes, 9'999 * 2 * 3 * sizeof(float));
    // Totals of these, and the places of each metric's tiles.
    EXPECT_EQ(many.fixed_bytes - one.fixed_bytes, 9'999 * (3 * sizeof(double) + 2 * 8));
    limits.groups_x = 9'999;
    EXPECT_THROW(device_needs(limits, two_metrics(), PairList(20'000, listed)), Error);
}

TEST(DeviceNeeds, TotalsCountToo) {
    const std::array<const Metric*, 1> metric = {&find_metric("rmse")};
    EXPECT_GE(device_needs(lavapipe_limits(), metric, PairList(1000)).fixed_bytes,
              std::uint64_t{1000} * 999 / 2 * sizeof(double));
}

/// What add_lanes.glsl makes of numbers, one lane each, of `lanes`.
float add_lanes(device::Context& context, const std::string& preamble,
                const std::vector<float>& totals, const std::vector<float>& lost) {
    using device::Buffer;
    using device::Traffic;
    const std::uint64_t bytes = totals.size() * sizeof(float);
    Buffer total_buffer(context, bytes, Traffic::upload);
    Buffer lost_buffer(context, bytes, Traffic::upload);
    Buffer sum_buffer(context, sizeof(float), Traffic::download);
    std::ranges::copy(totals, total_buffer.host_as<float>().begin());
    std::ranges::copy(lost, lost_buffer.host_as<float>().begin());
    const device::Kernel kernel(
        context, "add_lanes",
        test::compile(MERL_TEST_SHADERS "/distance/vulkan/add_lanes.comp", preamble),
        {.bindings = std::vector(3, device::Binding::storage),
         .constants = {context.limits().subgroup_size},
         .push_bytes = 0,
         .one_subgroup = true});
    Buffer* const buffers[] = {&total_buffer, &lost_buffer, &sum_buffer};
    const device::BoundKernel bound(context, kernel, buffers);
    device::Submission work(context);
    work.begin();
    work.dispatch(bound, {}, 1, 1);
    work.submit();
    work.wait();
    context.check_validation();
    return sum_buffer.host_as<const float>()[0];
}

/// Of both forms: what they add from random numbers is within 1 + 1/8 roundings.
TEST(AddLanes, RoundsOnce) {
    for (const bool has_float64 : {true, false}) {
        auto& context = has_float64 ? test::lavapipe() : test::lavapipe_without_float64();
        const std::string preamble = has_float64
                                         ? "#define ADDS_FLOAT64\n#define ROUNDS_TO_NEAREST\n"
                                         : "#define ROUNDS_TO_NEAREST\n";
        const auto lanes = context.limits().subgroup_size;
        std::mt19937 random(1);
        const auto uniform = [&] { return std::generate_canonical<double, 32>(random); };
        for (int round = 0; round < 60; ++round) {
            // Sizes alike, or spread over up to 40 powers of two; around 1, tiny or huge.
            const double spread = round % 3 * 20;
            const double scale = std::ldexp(1.0, round % 5 == 0 ? 118 : round % 5 == 1 ? -80 : 0);
            std::vector<float> totals;
            std::vector<float> lost;
            double exact = 0;
            for (std::uint32_t lane = 0; lane < lanes; ++lane) {
                totals.push_back(
                    static_cast<float>(scale * (1 + uniform()) * std::exp2(-spread * uniform())));
                lost.push_back(static_cast<float>((uniform() - 0.5) * 0x1p-23 * totals.back()));
                exact += double{totals.back()} + double{lost.back()};
            }
            EXPECT_NEAR(add_lanes(context, preamble, totals, lost) / exact, 1, 1.125 * 0x1p-24)
                << has_float64 << " " << round;
        }
    }
}

TEST(AddLanes, OfNothingTinyAndHugeNumbersAreWhatTheyShouldBe) {
    auto& context = test::lavapipe_without_float64();
    const auto lanes = context.limits().subgroup_size;
    const auto of = [&](float every, float first, const std::string& preamble) {
        std::vector<float> totals(lanes, every);
        totals[0] = first;
        return add_lanes(context, preamble, totals, std::vector<float>(lanes));
    };
    constexpr float kLargest = std::numeric_limits<float>::max();
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const std::string nearest = "#define ROUNDS_TO_NEAREST\n";
    EXPECT_EQ(of(0, 0, nearest), 0);
    EXPECT_LE(of(1e-40F, 1e-40F, nearest), 1.01e-40F * static_cast<float>(lanes));
    EXPECT_EQ(of(0, kLargest, nearest), kLargest);
    EXPECT_EQ(of(kLargest, kLargest, nearest), kInfinity);
    EXPECT_EQ(of(1, kInfinity, nearest), kInfinity);
    EXPECT_FALSE(std::isfinite(of(1, std::nanf(""), nearest)));
    // Where what is beyond the range may be rounded to the largest number, that means infinity.
    EXPECT_EQ(of(0, kLargest, ""), kInfinity);
    EXPECT_EQ(of(1, 2, ""), static_cast<float>(lanes) + 1);
}

/// Those of two_thirds_power() of shaders/lib/numerics.glsl.
constexpr std::int32_t kSeed = 0x5486ca00;
constexpr std::array<float, 4> kPolynomial = {2.17506909F, 3.40676427F, 4.56838512F, 3.33147216F};

/// The same function. Every step is volatile: so it is rounded as the processor is told to at the
/// time.
float power_of(float x) {
    std::int32_t bits = 0;
    std::memcpy(&bits, &x, sizeof(bits));
    const volatile auto number = static_cast<float>(bits);
    const volatile float third = number * (1.0F / 3);
    const std::int32_t seed = kSeed - static_cast<std::int32_t>(third);
    float y = 0;
    std::memcpy(&y, &seed, sizeof(y));
    const volatile float xy = x * y;
    const volatile float yy = y * y;
    const volatile float e = xy * yy;
    const volatile float a = e - kPolynomial[3];
    const volatile float b = e * a;
    const volatile float c = b + kPolynomial[2];
    const volatile float d = e * c;
    const volatile float f = d - kPolynomial[1];
    const volatile float g = e * f;
    const volatile float h = g + kPolynomial[0];
    const volatile float power = xy * h;
    return power;
}

/// The largest error of the power when each operation gives either neighbour of the exact result:
/// its error without roundings, and by how much each moves it, to first order.
double error_of_either_way(float x) {
    std::int32_t bits = 0;
    std::memcpy(&bits, &x, sizeof(bits));
    double largest = 0;
    for (const double off : {-0x1p-22, 0x1p-22}) {  // of the seed: a conversion and a product
        const auto seed = kSeed - static_cast<std::int32_t>(bits * (1 + off) * double{1.0F / 3});
        float y = 0;
        std::memcpy(&y, &seed, sizeof(y));
        const double xy = double{x} * y;
        const double e = xy * y * y;
        const double a = e - double{kPolynomial[3]};
        const double b = e * a;
        const double c = b + double{kPolynomial[2]};
        const double d = e * c;
        const double f = d - double{kPolynomial[1]};
        const double g = e * f;
        const double h = g + double{kPolynomial[0]};
        const double slope = e * (f + e * (c + e * (a + e))) / h;  // of h, in relative terms
        const double moved = std::abs(1 + slope) + 2 * std::abs(slope) +
                             (std::abs(e * e * b) + std::abs(e * e * b) + std::abs(e * e * c) +
                              std::abs(e * d) + std::abs(e * f) + std::abs(g)) /
                                 h +
                             2;
        const double root = std::cbrt(double{x});
        largest = std::max(largest, std::abs(xy * h / (root * root) - 1) + moved * 0x1p-23);
    }
    return largest;
}

TEST(ShaderRoundings, ThePowerIsTheOneOfTheShader) {
    std::vector<float> x = {0, std::numeric_limits<float>::denorm_min()};
    for (std::uint32_t bits = 0x00800000; bits < 0x7f800000; bits += 500'009) {  // all normal
        x.push_back(std::bit_cast<float>(bits));
    }
    for (std::uint32_t bits = 0x3f800000; bits < 0x41000000; bits += 5003) {  // from 1 to 8
        x.push_back(std::bit_cast<float>(bits));
    }
    const auto y = device::on_device(test::lavapipe(), device::kTwoThirdsPower, x);
    for (std::size_t i = 0; i < x.size(); ++i) {
        ASSERT_EQ(std::bit_cast<std::uint32_t>(y[i]), std::bit_cast<std::uint32_t>(power_of(x[i])))
            << x[i];
    }
}

TEST(ShaderRoundings, ThePowerIsAsExactAsTheBoundSaysHoweverItIsRounded) {
    const auto nearest = shader_roundings({.float64 = true, .to_nearest = true}).power;
    const auto either = shader_roundings({.float64 = true}).power;
    for (std::uint32_t bits = 0x3f800000; bits < 0x41000000; bits += 61) {  // from 1 to 8
        float x = 0;
        std::memcpy(&x, &bits, sizeof(x));
        const double root = std::cbrt(double{x});
        for (const int mode : {FE_TONEAREST, FE_TOWARDZERO, FE_UPWARD, FE_DOWNWARD}) {
            std::fesetround(mode);
            const float power = power_of(x);
            std::fesetround(FE_TONEAREST);
            ASSERT_LT(std::abs(double{power} / (root * root) - 1),
                      mode == FE_TONEAREST ? nearest : either)
                << x << " " << mode;
        }
        ASSERT_LT(error_of_either_way(x), either) << x;
    }
}

}  // namespace
}  // namespace merl::engine
