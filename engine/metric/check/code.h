#pragma once

#include <string>
#include <vector>

#include "engine/metric/check/spirv.h"

namespace merl::engine {

/// The parameters of a user's metric are specialization constants, of this constant_id and the next
/// ones, so that the compiler computes nothing with them: its results would be out of sight.
constexpr spirv::Word kFirstParameter = 1000;

/// Makes constants of them again, whose values are those given by default.
void fix_parameters(spirv::Module& module);

/// Refuses what the compiled functions of a metric may not do: reach anything but their arguments
/// and their own variables, read a variable before it has a value, end without a result, jump back
/// other than in a loop. What is not known to be harmless is refused. `file` is what messages call
/// the file, whose text the compiler knows as `text_name`. Throws Error (input) that names the
/// line.
///
/// Gives the positions in `module.functions` of the metric's functions and of those that they call,
/// each after those that it calls itself.
std::vector<std::size_t> check_metric_code(const spirv::Module& module, const std::string& file,
                                           const std::string& text_name);

/// Changes the metric's functions (what check_metric_code() gave) so that they fail where they
/// would go wrong in silence: loops are counted, indices, shifts, integer divisors and conversions
/// are looked at, division by zero and its like give what IEEE 754 says, also on a device that does
/// not follow it, and a NaN is not lost. shaders/framework/guards.glsl has the functions that they
/// call instead, and must be in the module.
void guard_metric_code(spirv::Module& module, const std::vector<std::size_t>& functions);

}  // namespace merl::engine
