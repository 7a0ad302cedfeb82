#include "engine/database/material_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <system_error>
#include <tuple>

#include "engine/base/error.h"
#include "engine/database/other_formats.h"

namespace merl::engine {

namespace {

/// "; it is compressed" of "is compressed".
std::string in_addition(const std::string& words) {
    return words.empty() ? "" : "; it " + words;
}

}  // namespace

MaterialFile::MaterialFile(const std::filesystem::path& file)
    : material(file.stem().string()), path(file) {}

bool has_extension(const std::filesystem::path& path, std::string_view extension) {
    return std::ranges::equal(path.extension().string(), extension, {},
                              [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
}

std::vector<MaterialFile> list_material_files(const std::filesystem::path& directory,
                                              std::string_view extension) {
    std::vector<MaterialFile> files;
    try {
        for (const auto& file : std::filesystem::directory_iterator(directory)) {
            const auto& path = file.path();
            if (has_extension(path, extension) && path.filename().string().front() != '.') {
                files.emplace_back(path);
            }
        }
    } catch (const std::filesystem::filesystem_error& error) {
        std::error_code none;
        throw InputError(fmt::format(
            "{}: cannot be read as a directory of {} files: {}{}", directory.string(), extension,
            error.code().message(),
            std::filesystem::is_regular_file(directory, none) && has_extension(directory, extension)
                ? "; a database is the directory that the file is in"
                : in_addition(known_as(directory))));
    }
    std::ranges::sort(files, [](const MaterialFile& a, const MaterialFile& b) {
        return std::tie(a.material, a.path) < std::tie(b.material, b.path);
    });
    const auto twin = std::ranges::adjacent_find(files, {}, &MaterialFile::material);
    if (twin != files.end()) {
        throw InputError(fmt::format("{} and {} name the same material; material names must differ",
                                     twin->path.string(), std::next(twin)->path.string()));
    }
    return files;
}

std::vector<MaterialFile> list_database_files(const std::filesystem::path& directory,
                                              std::string_view extension,
                                              const WantedMaterials& wanted) {
    auto files = list_material_files(directory, extension);
    if (files.empty()) {
        throw InputError(fmt::format("{}: found 0 {} files; expected one a material{}",
                                     directory.string(), extension, directory_known_as(directory)));
    }
    if (!wanted) {
        return files;
    }
    std::vector<MaterialFile> some;
    for (const auto& name : *wanted) {
        const auto file = std::ranges::lower_bound(files, name, {}, &MaterialFile::material);
        if (file == files.end() || file->material != name) {
            throw InputError(fmt::format("{}: found no material \"{}\" among its {}; expected {}{}",
                                         directory.string(), name, files.size(), name, extension));
        }
        some.push_back(*file);
    }
    return some;
}

}  // namespace merl::engine
