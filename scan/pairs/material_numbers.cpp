#include "scan/pairs/material_numbers.h"

#include <fmt/format.h>

#include "scan/pairs/pairs.h"

namespace merl::scan {

std::uint32_t MaterialNumbers::number(const std::string& name, const CsvReader& reader) {
    const auto next = static_cast<std::uint32_t>(names_.size());
    const auto [place, added] = numbers_.try_emplace(name, next);
    if (added) {
        if (next == max_materials) {
            reader.fail(fmt::format("\"{}\" is one material more than the {} that are possible",
                                    name, max_materials));
        }
        names_.push_back(name);
    }
    return place->second;
}

}  // namespace merl::scan
