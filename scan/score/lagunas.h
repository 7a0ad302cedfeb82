#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "scan/score/judgements.h"

namespace merl::scan {

/// The order in which the JSON of Lagunas et al. 2019 counts materials: that of the files'
/// names with their extension, in which "chrome-steel.binary" comes before "chrome.binary".
std::vector<std::string> lagunas_order(std::vector<std::string> names);

/// Reads the JSON of Lagunas et al., A Similarity Measure for Material Appearance, ACM TOG 38(4),
/// 2019: an object with `answers`, rows of [reference, A, B], and `agreement`, as many rows of
/// [votes for A, votes for B] that it is more similar to the reference. Materials are indices into
/// `indexed_names`. Other keys may hold anything. `file` is what errors call it. Throws InputError.
JudgementFile parse_lagunas(std::string_view text, const std::string& file,
                            std::span<const std::string> indexed_names);

}  // namespace merl::scan
