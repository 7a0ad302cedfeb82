#pragma once

#include <map>
#include <vector>

#include "engine/metric/check/spirv.h"

namespace merl::engine {

/// The blocks of a function that are not dead code.
std::vector<bool> reachable_blocks(const spirv::Function& function);

/// Finds variables that are read before they have a value, on any path through a function, scalar
/// by scalar: after `v.x = 1.0` only v.x has one. An index that is not constant may be any; so it
/// reads all elements, and gives a value to none.
class Assignments {
  public:
    explicit Assignments(const spirv::Module& module) : module_(module) {}

    /// The first instruction that may read what has no value; null when there is none. Every
    /// function that this one calls must have been checked before.
    const spirv::Instruction* check(const spirv::Function& function);

  private:
    /// Of a function's argument that is a pointer: an in, out or inout parameter.
    struct Argument {
        std::vector<bool> read;   // scalars that may be read before they are given a value
        std::vector<bool> given;  // scalars that have a value when it returns
    };
    using Arguments = std::vector<Argument>;

    class Flow;

    const spirv::Module& module_;
    std::map<spirv::Id, Arguments> arguments_;  // of each function that was checked
};

}  // namespace merl::engine
