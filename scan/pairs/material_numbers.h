#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/base/csv_reader.h"
#include "engine/base/error.h"

namespace merl::scan {

/// The materials of a file, numbered as they first occur.
class MaterialNumbers {
  public:
    /// The number of a material. Throws InputError, at the reader's row, when it is one more than
    /// `max_materials`.
    std::uint32_t number(const std::string& name, const CsvReader& reader);

    /// The names by number.
    const std::vector<std::string>& names() const { return names_; }

  private:
    std::unordered_map<std::string, std::uint32_t> numbers_;
    std::vector<std::string> names_;
};

}  // namespace merl::scan
