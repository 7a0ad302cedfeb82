#pragma once

#include <string>
#include <string_view>

namespace merl::reflectance {

/// Refuses what a metric file has no use for and could reach into the kernels with: their buffers
/// and built-in variables, directives that change the language, and the tricks of the preprocessor
/// that could hide those. `file` is what messages call it. Throws Error (input) that names the
/// line.
void check_metric_words(std::string_view text, const std::string& file);

/// The text with a count in the condition of every loop, `count_loop_() && (condition)`, so that
/// all come to an end (shaders/framework/metric.glsl). Lines stay where they are; a text without
/// loops stays as it is. Throws Error (input) for a loop that the preprocessor puts together from
/// parts.
std::string with_counted_loops(std::string_view text, const std::string& file);

}  // namespace merl::reflectance
