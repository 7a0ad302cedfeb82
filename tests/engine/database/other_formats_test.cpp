#include "engine/database/other_formats.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/database/merl_file.h"
#include "engine/database/open_database.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

using namespace std::string_literals;

/// What the error says of a file of these bytes that is called NAME.binary.
std::string refusal_of(const std::string& bytes) {
    const test::TemporaryDirectory directory;
    const auto path = directory.path / "m.binary";
    std::ofstream(path, std::ios::binary) << bytes;
    try {
        read_merl_header(path);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

std::string header(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const std::uint32_t sizes[] = {a, b, c};
    return {reinterpret_cast<const char*>(sizes), sizeof(sizes)};
}

TEST(OtherFormats, FilesAreRecognised) {
    const std::string rest(5000, '\x55');
    const std::vector<std::pair<std::string, std::string>> known = {
        {"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 34992012\n",
         "a Git LFS pointer, not the file itself: fetch that with `git lfs pull`"},
        {"\x1f\x8b\x08\0\0\0\0\0\0\x03"s + rest, "compressed with gzip: unpack it with `gzip -d`"},
        {"\x93NUMPY\x01\0v\0{'descr': '<f8', "s + rest, "a NumPy array (.npy): write it again"},
        {"PK\x03\x04\x14\0\0\0"s + rest, "NumPy's .npz files"},
        {"tensor_file\0\x01\0"s + rest, "a file of the RGL: call it NAME.bsdf"},
        {"\x89HDF\r\n\x1a\n"s + rest, "an HDF5 file"},
        {"# theta phi red green blue\n0 0 1 1 1\n", "it is text"},
        {"short", "it is text"},
        {header(0x03000000, 0x04000000, 0x05000000) + rest.substr(0, 1440),
         "it is big-endian (3 x 4 x 5): write it again with little-endian numbers"},
        {header(0x03000000, 0x04000000, 0x05000000) + rest.substr(0, 720), "samples as float64"},
        {header(3, 4, 5) + rest.substr(0, 720), "its samples are float32"},
    };
    for (const auto& [bytes, words] : known) {
        EXPECT_NE(refusal_of(bytes).find(words), std::string::npos)
            << words << ": " << refusal_of(bytes);
    }
    // What is a MERL file, broken or not, is called nothing else.
    EXPECT_EQ(refusal_of(header(3, 4, 5) + rest.substr(0, 1440)), "");
    for (const auto& bytes : {""s, header(3, 4, 5), header(3, 4, 5) + rest.substr(0, 1439),
                              header(3, 4, 5) + rest.substr(0, 721)}) {
        for (const auto* words : {"; it is", "; its samples"}) {
            EXPECT_EQ(refusal_of(bytes).find(words), std::string::npos) << refusal_of(bytes);
        }
    }
}

TEST(OtherFormats, DirectoriesAreRecognised) {
    const test::TemporaryDirectory directory;
    const auto below = directory.path / "brdfs";
    const auto refusal = [](const std::filesystem::path& path) {
        std::vector<std::string> messages;
        for (const bool is_listing : {false, true}) {
            try {
                if (is_listing) {
                    list_database(path);
                } else {
                    open_database(path);
                }
            } catch (const InputError& error) {
                messages.emplace_back(error.what());
            }
        }
        return messages.size() == 2 ? messages[0] + messages[1] : "";
    };
    const auto count = [](const std::string& text, const std::string& part) {
        std::size_t times = 0;
        for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
            ++times;
        }
        return times;
    };
    EXPECT_EQ(count(refusal(directory.path), "; "), 2U);  // nothing is known of an empty one
    std::filesystem::create_directory(below);
    std::ofstream(below / "gold.binary") << "x";
    EXPECT_EQ(count(refusal(directory.path), "; the database may be " + below.string()), 2U);
    for (const auto* name : {"a.NPY", "b.npy", "c.txt", ".hidden"}) {
        std::ofstream(below / name) << "x";
    }
    std::filesystem::remove(below / "gold.binary");
    EXPECT_EQ(count(refusal(below), "; it has 2 .npy files: write it again"), 2U);
    EXPECT_EQ(known_as(below / "none"), "");
}

}  // namespace
}  // namespace merl::engine
