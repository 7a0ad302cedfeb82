#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "engine/database/database.h"

namespace merl::engine {

/// A file that has one material of a database.
struct MaterialFile {
    explicit MaterialFile(const std::filesystem::path& file);

    std::string material;  // the file name without its extension
    std::filesystem::path path;
};

/// Whether a name ends so (like ".binary"), in any case.
bool has_extension(const std::filesystem::path& path, std::string_view extension);

/// The files of a directory with this extension (hidden ones left out), sorted bytewise by
/// material. Throws InputError when the directory cannot be read, or when two files name one
/// material.
std::vector<MaterialFile> list_material_files(const std::filesystem::path& directory,
                                              std::string_view extension);

/// The same of a directory that is a database, of which only some may be wanted. Throws InputError
/// also when there is none, or one that is wanted is not there.
std::vector<MaterialFile> list_database_files(const std::filesystem::path& directory,
                                              std::string_view extension,
                                              const WantedMaterials& wanted = {});

}  // namespace merl::engine
