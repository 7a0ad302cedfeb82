#include "scan/pairs/four_materials.h"

#include <gtest/gtest.h>

namespace merl::scan {
namespace {

TEST(FourMaterials, SidesAreTheSameInWhateverOrderWithinAPair) {
    const FourMaterials materials = {"a", "b", "c", "d"};
    EXPECT_TRUE(same_sides(materials, {"b", "a", "d", "c"}));
    EXPECT_FALSE(same_sides(materials, {"c", "d", "a", "b"}));
    EXPECT_FALSE(same_sides(materials, {"a", "c", "b", "d"}));
    EXPECT_EQ(swapped_sides(materials), (FourMaterials{"c", "d", "a", "b"}));
}

TEST(FourMaterials, WhatIsWrongIsNamed) {
    EXPECT_EQ(fault_of({"a", "b", "b", "c"}), "");
    EXPECT_EQ(fault_of({"a", "", "b", "c"}), "found a material without a name");
    EXPECT_NE(fault_of({"a", "b", "c", "c"}).find("\"c\" twice in a pair"), std::string::npos);
    EXPECT_NE(fault_of({"a", "b", "b", "a"}), "");
}

}  // namespace
}  // namespace merl::scan
