#pragma once

#include <string>
#include <string_view>

namespace merl::reflectance {

/// Refuses what a metric file has no use for and could reach into the kernels with: their buffers
/// and built-in variables, directives that change the language, and the tricks of the preprocessor
/// that could hide those. `file` is what messages call it. Throws Error (input) that names the
/// line.
void check_metric_words(std::string_view text, const std::string& file);

}  // namespace merl::reflectance
