#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "engine/database/database.h"

namespace merl::engine {

/// A material file of a MERL directory.
struct MerlEntry {
    std::string material;  // the file name without its extension
    std::filesystem::path path;
};

/// The `.binary` files of a directory (hidden files left out), sorted bytewise by material.
/// Throws Error (input) when the directory cannot be read, or when two files name one material.
std::vector<MerlEntry> list_merl_directory(const std::filesystem::path& directory);

/// A directory of MERL files, as they are now: a file that changes or is replaced later is an error
/// of Database::read(), not other content. Throws Error (input) unless it holds at least two whole
/// files, all of one grid.
std::unique_ptr<Database> open_merl_directory(const std::filesystem::path& directory);

/// The files of a directory, or the one file, that `path` is. Throws InputError when it is neither.
std::vector<MerlEntry> list_merl_files(const std::filesystem::path& path);

/// One file, as a database of one material. Throws InputError unless it is whole.
std::unique_ptr<Database> open_merl_file(const std::filesystem::path& path);

}  // namespace merl::engine
