#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/device/context.h"

namespace merl::app {

/// Runs `work` in a process of its own, for work that may never end, eat all memory or crash: the
/// compilers of a hostile shader may. What it changes is lost. An Error that it throws is thrown
/// here; if it takes longer than `seconds` or more than `bytes` of memory, or crashes, an Error
/// (input) with `what` and the reason, and if somebody kills it an Error (resource). Throws
/// Interrupted when the user wants to stop.
///
/// To be called before there are other threads and before drivers are loaded, which a copy of the
/// process would have only halves of.
void run_guarded(const std::string& what, double seconds, std::uint64_t bytes,
                 const std::function<void()>& work);

/// What variables of the environment are to be; nothing: not there.
using Variables = std::map<std::string, std::optional<std::string>>;
void set_variables(const Variables& variables);

/// The same of a command of this program with these arguments, begun anew, so that it may be called
/// at any time; its answer() is returned.
std::string ask_guarded(const std::string& what, double seconds, std::uint64_t bytes,
                        const std::vector<std::string>& arguments, const Variables& variables = {});

/// The command that answers (commands/guarded.cpp); not for users.
inline constexpr const char* kGuarded = "guarded";

/// Writes the result of `work`, or what it throws, to standard output for ask_guarded().
void answer(const std::function<std::string()>& work);

/// Whether this process may have less memory than the machine has (ulimit -v, -d).
bool memory_is_limited();

/// Calls `work` with less stack than any thread of the program has, TBB's too: what reads a program
/// is recursive, and what fits here must fit wherever it is read again. For run_guarded().
void with_little_stack(const std::function<void()>& work);

/// What went wrong, and what to install if that helps.
std::string with_advice(const device::NoDriverError& error);

/// What went wrong, and what does without that device.
std::string with_advice(const device::DeviceLostError& error);

}  // namespace merl::app
