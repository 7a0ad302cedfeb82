#pragma once

#include <string>
#include <string_view>

namespace merl::engine {

/// Refuses words that a metric file has no use for, which would say something about the kernels
/// around it: storage, built-in variables, directives. `text` is what the preprocessor leaves of
/// the file, which it calls `text_name`; `file` is what messages call it. Nesting is bounded too:
/// what reads programs is recursive. Throws Error (input) that names the line.
void check_metric_words(std::string_view text, const std::string& text_name,
                        const std::string& file);

}  // namespace merl::engine
