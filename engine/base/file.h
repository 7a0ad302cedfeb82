#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace merl {

/// Which file is behind a path, and in which state, as the system tells: whatever writes to it or
/// puts another in its place changes at least one of these.
struct FileState {
    std::uint64_t device = 0;
    std::uint64_t inode = 0;
    std::uint64_t bytes = 0;
    std::int64_t modified_ns = 0;  // the content, since 1970
    std::int64_t changed_ns = 0;   // or anything about the file; nobody can set it back

    bool operator==(const FileState&) const = default;
};

/// A regular file, open for reading until it goes. Every error is an InputError that begins with
/// the path.
class File {
  public:
    /// Throws when it cannot be opened or is no regular file; does not wait for a FIFO.
    explicit File(const std::filesystem::path& path);
    ~File();
    File(const File&) = delete;
    File& operator=(const File&) = delete;

    /// When it was opened.
    const FileState& state() const { return state_; }
    std::uint64_t bytes() const { return state_.bytes; }

    /// Throws unless the file was in this state when it was opened and still is.
    void expect(const FileState& expected) const;

    /// Waits until a change from now on has another time than the last one, and looks again: some
    /// milliseconds if the file was written just now, because the kernel's clock for files ticks
    /// slowly.
    void settle();

    /// Fills `to` from this byte on. Throws when the file ends before.
    void read(std::uint64_t offset, std::span<std::byte> to) const;

    /// All bytes. Throws when there are more than `most`.
    std::string read_all(std::uint64_t most) const;

    /// Throws what is wrong with this file.
    [[noreturn]] void fail(const std::string& what) const;

  private:
    std::filesystem::path path_;
    int descriptor_ = -1;
    FileState state_;
};

}  // namespace merl
