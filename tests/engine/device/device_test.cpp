#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "engine/base/error.h"
#include "engine/device/submission.h"
#include "tests/engine/device/numerics.h"
#include "tests/engine/support.h"

namespace merl::device {
namespace {

/// Floats from `low` to `high`, spread evenly over the exponents.
std::vector<float> spread(double low, double high) {
    std::vector<float> x;
    for (int i = 0; i <= 100'000; ++i) {
        x.push_back(static_cast<float>(low * std::pow(high / low, i / 100'000.0)));
    }
    return x;
}

double largest_error(Function function, double low, double high, double exponent) {
    const auto x = spread(low, high);
    const auto y = on_device(test::lavapipe(), function, x);
    double largest = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        largest =
            std::max(largest, std::abs(y[i] / std::pow(static_cast<double>(x[i]), exponent) - 1));
    }
    return largest;
}

// The bounds are those that shaders/lib/numerics.glsl states; docs/numerics.md says where they are
// from.
TEST(Numerics, CubeRoot) {
    EXPECT_LT(largest_error(kCubeRoot, 1e-30, 1e30, 1.0 / 3), 2e-7);
    EXPECT_LT(largest_error(kCubeRoot, 1, 8, 1.0 / 3), 2e-7);
    EXPECT_EQ(on_device(test::lavapipe(), kCubeRoot, {0.0F})[0], 0.0F);
    EXPECT_FLOAT_EQ(on_device(test::lavapipe(), kCubeRoot, {-8.0F})[0], -2.0F);
}

TEST(Numerics, TwoThirdsPower) {
    EXPECT_LT(largest_error(kTwoThirdsPower, 1e-30, 1e30, 2.0 / 3), 4e-7);
    EXPECT_LT(largest_error(kTwoThirdsPower, 1, 8, 2.0 / 3), 4e-7);
    const auto y = on_device(test::lavapipe(), kTwoThirdsPower, {0.0F, -8.0F});
    EXPECT_EQ(y[0], 0.0F);
    EXPECT_NEAR(y[1], 4.0F, 2e-6);
}

TEST(Buffer, BytesTravelBothWaysMappedAndStaged) {
    std::vector<float> x(1000);
    std::iota(x.begin(), x.end(), 1.0F);
    EXPECT_EQ(on_device(test::lavapipe(), kIdentity, x), x);
    EXPECT_EQ(on_device(test::lavapipe_with_staging(), kIdentity, x), x);
}

TEST(Buffer, MemoryIsCountedAndGivenBack) {
    Context context({.device = "llvmpipe", .force_staging = true});
    {
        const Buffer buffer(context, 1 << 20, Traffic::upload);
        EXPECT_GE(context.allocated_bytes(), 2U << 20U);  // the buffer and its staging copy
    }
    EXPECT_EQ(context.allocated_bytes(), 0U);
    EXPECT_GE(context.peak_allocated_bytes(), 2U << 20U);
}

TEST(Buffer, BeyondTheLimitsIsABugOfThePlanner) {
    auto& context = test::lavapipe();
    EXPECT_THROW(Buffer(context, 0, Traffic::none), std::logic_error);
    EXPECT_THROW(Buffer(context, context.limits().storage_buffer_bytes + 1, Traffic::none),
                 std::logic_error);
}

TEST(Submission, BeyondTheLimitsIsABugOfThePlanner) {
    auto& context = test::lavapipe();
    Buffer buffer(context, 256, Traffic::upload);
    Buffer other(context, 256, Traffic::download);
    const Kernel kernel(
        context, "numerics", test::compile(MERL_TEST_SHADERS "/device/numerics.comp"),
        {.bindings = {Binding::storage, Binding::storage}, .constants = {0}, .push_bytes = 4});
    Buffer* const both[] = {&buffer, &other};
    const BoundKernel bound(context, kernel, both);
    EXPECT_THROW(BoundKernel(context, kernel, std::span(both, 1)), std::logic_error);
    Submission work(context);
    work.begin();
    const std::array<std::byte, 4> push = {};
    EXPECT_THROW(work.dispatch(bound, push, context.limits().groups_x + 1, 1), std::logic_error);
    EXPECT_THROW(work.dispatch(bound, std::span(push).first(3), 1, 1), std::logic_error);
}

TEST(Submission, HasAsManyMarksAsItWasMadeFor) {
    Submission work(test::lavapipe(), 40);
    work.begin();
    for (int i = 0; i < 40; ++i) {
        work.mark();
    }
    EXPECT_THROW(work.mark(), std::logic_error);
    work.submit();
    work.wait();
    EXPECT_EQ(work.seconds().size(), 39U);
}

TEST(Context, ChoosesByIndexAndByPartOfTheName) {
    const auto devices = list_devices();
    ASSERT_FALSE(devices.empty());
    EXPECT_EQ(Context({.device = "0"}).info().name, devices[0].name);
    EXPECT_NE(Context({.device = "LLVMpipe"}).info().name.find("llvmpipe"), std::string::npos);
    EXPECT_EQ(Context().info().kind, "CPU");  // the tests see lavapipe only
    EXPECT_GE(Context().limits().subgroup_size, 4U);
}

TEST(Devices, TakeWhatATrialFound) {
    const auto device = list_devices().at(0);
    const std::vector<Trial> trials = {
        {.device = identity(device), .tiles = TileSides{.power = 2, .square = 3}}};
    EXPECT_EQ(list_devices(trials).at(0).limits.tiles, (TileSides{.power = 2, .square = 3}));
    const std::vector<Trial> failed = {{.device = identity(device), .refusal = "wrong"}};
    EXPECT_EQ(list_devices(failed).at(0).refusal, "wrong");
    const std::vector<Trial> other = {{.device = "another", .refusal = "wrong"}};
    EXPECT_EQ(list_devices(other).at(0).refusal, std::nullopt);
}

TEST(Devices, SoftwareAndWhatNobodyTestedComeLast) {
    const auto of_kind = [](const char* kind) {
        DeviceInfo info;
        info.kind = kind;
        info.limits.is_host = info.kind == "CPU";
        return info;
    };
    const auto card = of_kind("discrete GPU");
    const auto integrated = of_kind("integrated GPU");
    const auto processor = of_kind("CPU");
    auto untested = card;
    untested.is_conformant = false;
    auto software = card;
    software.limits.is_host = true;
    EXPECT_EQ(choose_device({integrated, card}, ""), 1U);
    EXPECT_EQ(choose_device({untested, integrated}, ""), 1U);
    EXPECT_EQ(choose_device({untested, processor}, ""), 1U);
    EXPECT_EQ(choose_device({software, integrated}, ""), 1U);
    EXPECT_EQ(choose_device({processor, software}, ""), 0U);
}

TEST(Context, RefusesWhatIsNotThere) {
    for (const char* wanted : {"geforce", "7", "-1"}) {
        try {
            Context context({.device = wanted});
            FAIL() << wanted;
        } catch (const Error& error) {
            EXPECT_EQ(error.fault(), Fault::device);
            EXPECT_NE(std::string(error.what()).find("llvmpipe"), std::string::npos)
                << error.what();
        }
    }
}

TEST(Context, AValidationMessageIsAnError) {
    Context context({.device = "llvmpipe"});
    // A kernel that pushes more bytes than the device has room for is against the specification.
    EXPECT_ANY_THROW({
        const Kernel kernel(context, "numerics",
                            test::compile(MERL_TEST_SHADERS "/device/numerics.comp"),
                            {.bindings = {Binding::storage, Binding::storage},
                             .constants = {0},
                             .push_bytes = 1 << 16});
        context.check_validation();
    });
}

}  // namespace
}  // namespace merl::device
