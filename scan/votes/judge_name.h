#pragma once

#include <string>

namespace merl::scan {

/// What is the same for all spellings of a judge's name: letters in upper and lower case, one by
/// one, and spaces. The page of a kit tells judges apart in this way too.
std::wstring judge_identity(const std::string& name);

}  // namespace merl::scan
