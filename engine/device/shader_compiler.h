#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace merl::device {

/// A GLSL file: what messages call it, and its text.
struct ShaderText {
    std::string name;
    std::string text;
};

/// What the compiler says of a shader that it refuses: lines of `ERROR: name:line: message`.
class ShaderRefused : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// Finds the file that `#include "name"` in the file `includer` means; null when there is none.
/// This is all that an include can reach: no file is ever opened.
using IncludeResolver =
    std::function<const ShaderText*(std::string_view name, std::string_view includer)>;

/// A text as the preprocessor leaves it: without macros and comments, with what it includes, and
/// with
/// `#line` where a file begins or goes on. Throws ShaderRefused.
std::string preprocess_shader(const ShaderText& text, const IncludeResolver& resolve);

/// What becomes of functions that nothing calls. Those of float64 need a device that has it.
enum class Uncalled { kept, dropped };

/// The SPIR-V of a compute shader for Vulkan 1.2, with OpLine. `preamble` is compiled before the
/// first line, `rest` after the last. Throws ShaderRefused. Calls from several threads take turns.
std::vector<std::uint32_t> compile_shader(const ShaderText& shader, const std::string& preamble,
                                          const IncludeResolver& resolve,
                                          std::span<const ShaderText> rest = {},
                                          Uncalled uncalled = Uncalled::kept);

}  // namespace merl::device
