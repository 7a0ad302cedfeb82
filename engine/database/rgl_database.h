#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "engine/database/database.h"
#include "engine/database/material_files.h"

namespace merl::engine {

/// Whether a path means files of the RGL material database (Dupuy and Jakob, ACM TOG 37(6), 2018):
/// a `.bsdf` file, or a directory with such and without MERL files.
bool is_rgl(const std::filesystem::path& path);

/// A directory of isotropic RGL `.bsdf` files in RGB, evaluated at the voxel centres of any grid
/// as docs/file-formats.md says. Nothing is ever "not measured", and below the horizon it is zero.
/// Files that are wanted are read whole here, and not again. Throws InputError unless one can be
/// used, and without skip_bad all that are wanted; of several bad ones BadFilesError. To skip bad
/// ones everything is evaluated once.
std::unique_ptr<Database> open_rgl_directory(const std::filesystem::path& directory,
                                             const OpenOptions& options = {});

/// The files of a directory, or the one file, that `path` is. Throws InputError when the directory
/// cannot be read.
std::vector<MaterialFile> list_rgl_files(const std::filesystem::path& path);

/// One file, as a database of one material. Throws InputError unless it is whole.
std::unique_ptr<Database> open_rgl_file(const std::filesystem::path& path, const Grid& grid = {});

}  // namespace merl::engine
