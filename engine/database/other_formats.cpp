#include "engine/database/other_formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <span>
#include <string_view>
#include <system_error>
#include <vector>

#include "engine/base/error.h"

namespace merl::engine {
namespace {

using namespace std::string_view_literals;

constexpr const char* kWriteAgain = "write it again as docs/file-formats.md says";

/// A format, what files in it begin with, and what to do.
struct Format {
    std::string_view beginning;
    const char* what;
    const char* advice;
};

constexpr std::array kFormats = {
    Format{"version https://git-lfs"sv, "a Git LFS pointer, not the file itself",
           "fetch that with `git lfs pull` in its repository"},
    Format{"\x1f\x8b"sv, "compressed with gzip", "unpack it with `gzip -d`"},
    Format{"BZh"sv, "compressed with bzip2", "unpack it with `bzip2 -d`"},
    Format{"\xfd"
           "7zXZ\0"sv,
           "compressed with xz", "unpack it with `xz -d`"},
    Format{"\x28\xb5\x2f\xfd"sv, "compressed with zstd", "unpack it with `zstd -d`"},
    Format{"\x93NUMPY"sv, "a NumPy array (.npy)", kWriteAgain},
    Format{"PK\x03\x04"sv, "a ZIP archive, as NumPy's .npz files are", "unpack it"},
    Format{"\x89HDF\r\n\x1a\n"sv, "an HDF5 file", kWriteAgain},
    Format{"tensor_file\0"sv, "a file of the RGL", "call it NAME.bsdf, beside others like it"},
};

std::string beginning_of(const File& file) {
    std::string begin(std::min<std::uint64_t>(256, file.bytes()), '\0');
    file.read(0, std::as_writable_bytes(std::span(begin)));
    return begin;
}

/// The same for names of files in a directory.
struct Ending {
    std::string_view extension;
    const char* advice;
};

constexpr std::array kEndings = {
    Ending{".gz", "unpack them"},  Ending{".bz2", "unpack them"}, Ending{".xz", "unpack them"},
    Ending{".zst", "unpack them"}, Ending{".zip", "unpack them"}, Ending{".npy", kWriteAgain},
    Ending{".npz", kWriteAgain},   Ending{".h5", kWriteAgain},    Ending{".hdf5", kWriteAgain},
};

constexpr std::size_t kMostEntries = 10000;  // of a directory that are looked at

/// How many files of a directory have an extension, in lower case; none if it cannot be read.
std::map<std::string, std::size_t> count_endings(const std::filesystem::path& directory) {
    std::map<std::string, std::size_t> counts;
    std::error_code error;
    std::size_t seen = 0;
    for (std::filesystem::directory_iterator entry(directory, error), end;
         !error && entry != end && seen < kMostEntries; entry.increment(error), ++seen) {
        auto extension = entry->path().extension().string();
        std::ranges::transform(extension, extension.begin(),
                               [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        std::error_code none;
        if (!extension.empty() && entry->is_regular_file(none)) {
            ++counts[extension];
        }
    }
    return counts;
}

/// The first directory in this one, by name, that has files of a database; empty if none has.
std::filesystem::path database_below(const std::filesystem::path& directory) {
    std::vector<std::filesystem::path> below;
    std::error_code error;
    for (std::filesystem::directory_iterator entry(directory, error), end;
         !error && entry != end && below.size() < kMostEntries; entry.increment(error)) {
        std::error_code none;
        if (entry->is_directory(none)) {
            below.push_back(entry->path());
        }
    }
    std::ranges::sort(below);
    const auto found = std::ranges::find_if(below, [](const auto& path) {
        const auto counts = count_endings(path);
        return counts.contains(".binary") || counts.contains(".bsdf");
    });
    return found == below.end() ? std::filesystem::path() : *found;
}

}  // namespace

std::string known_as(const File& file) {
    const auto begin = beginning_of(file);
    const auto* const format = std::ranges::find_if(
        kFormats, [&](const Format& f) { return begin.starts_with(f.beginning); });
    if (format != kFormats.end()) {
        return fmt::format("is {}: {}", format->what, format->advice);
    }
    return "";
}

bool is_unknown_text(const File& file) {
    const auto begin = beginning_of(file);
    return !begin.empty() && known_as(file).empty() && std::ranges::all_of(begin, [](char c) {
        return (c >= ' ' && c <= '~') || (c >= '\t' && c <= '\r');
    });
}

std::string known_as(const std::filesystem::path& path) {
    try {
        return known_as(File(path));
    } catch (const InputError&) {
        return "";
    }
}

std::string directory_known_as(const std::filesystem::path& directory) {
    const auto below = database_below(directory);
    if (!below.empty()) {
        return fmt::format("; the database may be {}", below.string());
    }
    const auto counts = count_endings(directory);
    const auto most =
        std::ranges::max_element(counts, {}, [](const auto& count) { return count.second; });
    if (most == counts.end()) {
        return "";
    }
    const auto* const ending = std::ranges::find(kEndings, most->first, &Ending::extension);
    return fmt::format("; it has {} {} file{}{}", most->second, most->first,
                       most->second == 1 ? "" : "s",
                       ending == kEndings.end() ? "" : fmt::format(": {}", ending->advice));
}

}  // namespace merl::engine
