#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace merl::app {

/// A directory of results that appears complete or not at all.
///
/// Files are written into a hidden directory beside the target; commit() renames it into place. If
/// the target exists and `force` is given, the hidden directory is inside, which is always the same
/// file system. commit() then replaces the files named in `owned`, one by one, the last of `owned`
/// last, and touches no other file; when one of them cannot be replaced, it puts the old ones back.
/// Without commit() everything is removed.
class OutputDirectory {
  public:
    /// Throws Error (output) when `target` exists without `force`, or cannot be made, or has a
    /// directory under one of the names in `owned`.
    OutputDirectory(const std::filesystem::path& target, bool force,
                    std::vector<std::string> owned);
    ~OutputDirectory();
    OutputDirectory(const OutputDirectory&) = delete;
    OutputDirectory& operator=(const OutputDirectory&) = delete;

    /// Where to write a file of this name before commit().
    std::filesystem::path path(const std::string& name) const { return partial_ / name; }

    /// Opens a file of this name, calls `write` with its descriptor, closes it. Throws Error
    /// (output) that names the file when any of it fails.
    void write(const std::string& name, const std::function<void(int descriptor)>& write) const;

    /// The message of an error in which the hidden directory is called as the target.
    std::string with_target(std::string message) const;

    void commit();

  private:
    void replace() const;

    std::filesystem::path target_;
    std::filesystem::path partial_;
    bool replace_ = false;
    std::vector<std::string> owned_;
};

}  // namespace merl::app
