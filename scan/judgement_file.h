#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "scan/judgements.h"

namespace merl::scan {

/// The materials of a file of judgements, numbered as they first occur.
class MaterialNumbers {
  public:
    /// The number of a material, or `max_materials` when there is no room for one more.
    std::uint32_t number(const std::string& name);

    /// The names by number.
    std::vector<std::string> names() &&;

  private:
    std::unordered_map<std::string, std::uint32_t> numbers_;
    std::vector<std::string> names_;
};

/// Reads judgements in any of the three formats (docs/file-formats.md): JSON when the text begins
/// with a brace, otherwise one of the two CSV tables, by its header. `indexed_names` are the names
/// that the indices of the JSON stand for. `file` is what errors call the text. `progress` is
/// called now and then with the share that is read; what it throws comes out. Throws InputError.
JudgementFile parse_judgements(std::string_view text, const std::string& file,
                               std::span<const std::string> indexed_names,
                               const std::function<void(double share)>& progress = {});

}  // namespace merl::scan
