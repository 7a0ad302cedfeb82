#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace merl::engine {

/// Which materials of a database are meant, as --materials and --exclude say it.
///
/// Each text is the name of a material or, if there is none like it, shell patterns (fnmatch(3))
/// with commas between them, where @FILE stands for the patterns in a file, one a line. A pattern
/// with a slash is of "label/name"; one without is of the name, whatever the label.
struct MaterialChoice {
    std::vector<std::string> materials = {};  // none: all
    std::vector<std::string> exclude = {};    // of those

    bool is_all() const { return materials.empty() && exclude.empty(); }
};

/// The indices, ascending, of the materials that are meant; at least one. `database` is what errors
/// call them. Throws Error (usage) for a pattern that matches nothing, and where nothing is left;
/// InputError for a file that cannot be read or has no pattern.
std::vector<std::size_t> choose_materials(std::span<const std::string> names,
                                          const MaterialChoice& choice,
                                          const std::string& database);

}  // namespace merl::engine
