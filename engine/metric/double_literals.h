#pragma once

#include <string>
#include <string_view>

namespace merl::engine {

/// A metric's text for its float64 functions: every floating point literal in the body of a
/// function with the suffix of a double. GLSL gives a literal without one the type float, and what
/// has only such operands (`i == 0 ? 0.1 : 0.3`, `max(0.1, x ? 0.2 : 0.3)`) is computed, and its
/// numbers are rounded, in float32 before it becomes a double. Values of constants outside
/// functions stay as they are: the compiler works those out in float64.
///
/// The text has no comments and no macros, as preprocess_shader() leaves it. Lines stay lines.
std::string with_double_literals(std::string_view text);

}  // namespace merl::engine
