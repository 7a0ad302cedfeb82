#pragma once

#include <string_view>

namespace merl::scan {

/// A material of joined databases, "label/name". No label has a slash, and a material without one
/// has no label.
struct Labelled {
    std::string_view label;
    std::string_view name;
};

/// The parts of a material's name, which must outlive them.
constexpr Labelled labelled(std::string_view material) {
    const auto slash = material.find('/');
    return slash == std::string_view::npos
               ? Labelled{{}, material}
               : Labelled{material.substr(0, slash), material.substr(slash + 1)};
}

}  // namespace merl::scan
