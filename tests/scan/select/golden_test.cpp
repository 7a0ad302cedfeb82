#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

#include "scan/pairs/count.h"
#include "scan/select/disagreement_search.h"
#include "scan/select/disagreements.h"
#include "scan/select/selection.h"
#include "tests/scan/support.h"

// The built-in database under CWCbrt and PAWCIELAB, by an independent float64 program.

namespace merl::scan {
namespace {

Distances read_golden() {
    Distances distances;
    distances.first_metric = "cwcbrt";
    distances.second_metric = "pawcielab";
    std::ifstream file(MERL_GOLDEN_CSV);
    std::string material_1;
    std::string material_2;
    std::string first;
    std::string second;
    std::getline(file, first);  // header
    while (std::getline(file, material_1, ',') && std::getline(file, material_2, ',') &&
           std::getline(file, first, ',') && std::getline(file, second)) {
        if (distances.names.empty()) {
            distances.names.push_back(material_1);
        }
        if (material_1 == distances.names.front()) {
            distances.names.push_back(material_2);
        }
        distances.first.push_back(std::stod(first));
        distances.second.push_back(std::stod(second));
    }
    return distances;
}

class Golden : public ::testing::Test {
  protected:
    const Distances distances_ = read_golden();
};

TEST_F(Golden, Counts) {
    ASSERT_EQ(distances_.materials(), 100U);
    const Census census = count_disagreements(distances_);
    EXPECT_TRUE(census.streamed);
    EXPECT_EQ(census.counts.configurations, 12'248'775U);
    EXPECT_EQ(census.counts.disagreements(), 4'289'737U);
}

TEST_F(Golden, ListSearchAndSelection) {
    const std::vector<Configuration> all = all_disagreements(distances_);
    ASSERT_EQ(all.size(), 4'289'737U);
    EXPECT_TRUE(std::ranges::is_sorted(all, StrongerFirst()));
    EXPECT_TRUE(std::ranges::adjacent_find(all) == all.end());
    for (const auto& [left, right, value] : all) {
        const double d1l = distances_.first[left];
        const double d1r = distances_.first[right];
        const double d2l = distances_.second[left];
        const double d2r = distances_.second[right];
        ASSERT_LT(d1l, d1r);
        ASSERT_GT(d2l, d2r);
        ASSERT_EQ(value, std::min(d1l * d2r, d1r * d2l) / std::max(d1l * d2r, d1r * d2l));
    }

    DisagreementSearch search(distances_);
    for (std::size_t i = 0; i < 100'000; ++i) {
        ASSERT_EQ(search.next(), all[i]) << "row " << i;
    }
    EXPECT_EQ(strongest_disagreements(distances_, 1000),
              (std::vector<Configuration>(all.begin(), all.begin() + 1000)));

    for (const auto& [select, per_material] : {std::pair{100U, 10U}, {1000U, 10U}, {50U, 2U}}) {
        EXPECT_EQ(select_configurations(distances_, select, per_material),
                  testing::plain_selection(distances_, all, select, per_material));
    }
}

}  // namespace
}  // namespace merl::scan
