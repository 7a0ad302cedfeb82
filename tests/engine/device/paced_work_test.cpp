#include "engine/device/paced_work.h"

#include <gtest/gtest.h>

#include <vector>

namespace merl::device {
namespace {

TEST(CutGroups, CoversEveryGroupOnceAndKeepsToTheLimit) {
    for (const std::uint32_t x : {1U, 2U, 7U, 30U}) {
        for (const std::uint32_t y : {1U, 2U, 5U, 16U}) {
            for (const std::uint64_t most :
                 {std::uint64_t{1}, std::uint64_t{3}, std::uint64_t{7}, std::uint64_t{29},
                  std::uint64_t{30}, std::uint64_t{61}, WorkBudget::kUnlimited}) {
                std::vector<int> times(std::size_t{x} * y);
                const auto ranges = cut_groups(x, y, most);
                for (const auto& range : ranges) {
                    EXPECT_LE(std::uint64_t{range.groups_x} * range.groups_y, most);
                    for (auto j = range.first_y; j < range.first_y + range.groups_y; ++j) {
                        for (auto i = range.first_x; i < range.first_x + range.groups_x; ++i) {
                            ++times.at(std::size_t{j} * x + i);
                        }
                    }
                }
                EXPECT_EQ(times, std::vector<int>(times.size(), 1)) << x << " " << y << " " << most;
                if (most >= std::uint64_t{x} * y) {
                    EXPECT_EQ(ranges.size(), 1U);
                }
            }
        }
    }
}

TEST(CutGroups, CutsRowsOnlyWhereOneIsTooMuch) {
    EXPECT_EQ(cut_groups(10, 7, 29).size(), 4U);  // two rows each
    EXPECT_EQ(cut_groups(10, 7, 29)[0].groups_x, 10U);
    EXPECT_EQ(cut_groups(10, 7, 6).size(), 14U);
}

DeviceInfo device_of(const char* kind) {
    DeviceInfo device;
    device.kind = kind;
    device.limits.is_host = device.kind == "CPU";
    return device;
}

TEST(WorkBudget, IsUnlimitedOnAProcessor) {
    WorkBudget budget(device_of("CPU"), 1e6);
    EXPECT_EQ(budget.units(), WorkBudget::kUnlimited);
    budget.measured(1, 100);
    EXPECT_EQ(budget.units(), WorkBudget::kUnlimited);
}

TEST(WorkBudget, BeginsWithLessOnSlowerKinds) {
    const auto units = [](const char* kind) { return WorkBudget(device_of(kind), 1e6).units(); };
    EXPECT_EQ(units("integrated GPU"), 1000U);
    EXPECT_EQ(units("virtual GPU"), 1000U);
    EXPECT_EQ(units("other"), 1000U);
    EXPECT_EQ(units("discrete GPU"), 4000U);
    EXPECT_EQ(WorkBudget(device_of("integrated GPU"), 1e300).units(), 1U);
}

TEST(WorkBudget, BecomesATenthOfASecondsWorth) {
    WorkBudget budget(device_of("integrated GPU"), 1e6);
    budget.measured(8000, 0);  // no timestamps
    EXPECT_EQ(budget.units(), 1000U);
    budget.measured(8000, 0.25);
    EXPECT_EQ(budget.units(), 3200U);
    budget.measured(8000, 1e-6);  // no faster than fourfold
    EXPECT_EQ(budget.units(), 12800U);
    budget.measured(8000, 80);
    EXPECT_EQ(budget.units(), 10U);
    budget.measured(1, 80);
    EXPECT_EQ(budget.units(), 1U);
    for (int slab = 0; slab < 200; ++slab) {
        budget.measured(1e300, 1e-9);
    }
    EXPECT_LT(budget.units(), WorkBudget::kUnlimited);
}

}  // namespace
}  // namespace merl::device
