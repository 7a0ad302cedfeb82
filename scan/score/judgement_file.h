#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "scan/score/judgements.h"

namespace merl::scan {

/// Reads judgements in any of the three formats (docs/file-formats.md): JSON when the text begins
/// with a brace, otherwise one of the two CSV tables, by its header. `indexed_names` are the names
/// that the indices of the JSON stand for. `file` is what errors call the text. `progress` is
/// called now and then with the share that is read; what it throws comes out. Throws InputError.
JudgementFile parse_judgements(std::string_view text, const std::string& file,
                               std::span<const std::string> indexed_names,
                               const std::function<void(double share)>& progress = {});

}  // namespace merl::scan
