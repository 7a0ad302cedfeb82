#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "scan/pairs/four_materials.h"

namespace merl::scan {

/// A row of selection.csv.
struct SelectedConfiguration {
    FourMaterials materials;      ///< left: smaller under the first metric
    std::array<double, 2> first;  ///< distance of the left and of the right pair
    std::array<double, 2> second;
    double agreement;
};

/// What `scan` chose for judges.
struct SelectionFile {
    std::string file;  ///< what errors call it
    std::string first_metric;
    std::string second_metric;
    std::vector<SelectedConfiguration> configurations;  ///< rank 1, 2 ...
};

/// Reads selection.csv as write_selection (scan_tables.h) writes it. Ranks count from 1, distances
/// are finite and not negative, and the left pair has the smaller distance under the first metric
/// and the larger under the second (one may tie). Throws InputError, also for a selection of
/// nothing.
SelectionFile parse_selection(std::string_view text, const std::string& file);

}  // namespace merl::scan
