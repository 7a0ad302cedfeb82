#pragma once

#include <filesystem>
#include <string>

#include "engine/base/file.h"

namespace merl::engine {

// What people have where a database should be, in words for errors; nothing where that is not
// known.

/// What a file is that was refused, by its first bytes: "is compressed with gzip: unpack it ...".
std::string known_as(const File& file);

/// Whether a file that known_as() does not know begins with text.
bool is_unknown_text(const File& file);

/// The same of a path, whatever it is.
std::string known_as(const std::filesystem::path& path);

/// What a directory is that has no file that could be read: one above that of a database, or one of
/// files in another format. For the end of an error: "; the database may be DIRECTORY/brdfs".
std::string directory_known_as(const std::filesystem::path& directory);

}  // namespace merl::engine
