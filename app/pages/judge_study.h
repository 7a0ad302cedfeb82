#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "engine/base/error.h"

namespace merl::app {

/// What a researcher decides about a study (docs/experiment.md): every setting of the study file,
/// those that it leaves out as they are by default.
struct Study {
    nlohmann::ordered_json settings;
    std::string hash;  ///< content hash of the file; empty: there was none
};

/// The largest study file that is read.
inline constexpr std::size_t max_study_bytes = std::size_t{1} << 20U;

/// A kit without a study file.
Study default_study(bool is_reference);

/// Reads a study file, JSON in which comments may stand. `is_reference`: judges compare
/// approximations with originals. Throws InputError, which names the key, or the line of a syntax
/// error.
Study parse_study(std::string_view text, const std::string& file, bool is_reference);

/// A study file with every setting as it is by default, and what it means in comments.
std::string study_template();

/// All texts of the page, by language and key.
nlohmann::ordered_json judge_texts(const Study& study, bool is_reference);

}  // namespace merl::app
