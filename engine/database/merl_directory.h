#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "engine/database/database.h"
#include "engine/database/material_files.h"

namespace merl::engine {

/// A directory of MERL files, as they are now: a file that changes or is replaced later is an error
/// of Database::read(), not other content. Files that are not wanted are not opened. Throws Error
/// (input) unless there is one, and all are whole and of one grid.
std::unique_ptr<Database> open_merl_directory(const std::filesystem::path& directory,
                                              const WantedMaterials& wanted = {});

/// The files of a directory, or the one file, that `path` is. Throws InputError when it is neither.
std::vector<MaterialFile> list_merl_files(const std::filesystem::path& path);

/// One file, as a database of one material. Throws InputError unless it is whole.
std::unique_ptr<Database> open_merl_file(const std::filesystem::path& path);

}  // namespace merl::engine
