#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "engine/database/database.h"
#include "engine/database/material_files.h"

namespace merl::engine {

/// A directory of MERL files, as they are now: a file that changes or is replaced later is an error
/// of Database::read(), not other content. All have one grid, but for phi_d: where some files go to
/// 2 pi, the grid does, and those that end at pi are repeated, f(phi_d + pi) = f(phi_d). Files that
/// are not wanted are not opened. Throws Error (input) unless one can be used, and without skip_bad
/// all that are wanted; of several bad ones BadFilesError, here and when samples are read.
std::unique_ptr<Database> open_merl_directory(const std::filesystem::path& directory,
                                              const OpenOptions& options = {});

/// The files of a directory, or the one file, that `path` is. Throws InputError when it is neither,
/// or a directory without any.
std::vector<MaterialFile> list_merl_files(const std::filesystem::path& path);

/// One file, as a database of one material. Throws InputError unless it is whole.
std::unique_ptr<Database> open_merl_file(const std::filesystem::path& path,
                                         const OpenOptions& options = {});

}  // namespace merl::engine
