#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/output/staging.h"

namespace merl::app {

/// A directory of results: whatever happens, the old results are there whole, or the new ones are,
/// or an error says where they are. After a kill or a power cut the next run into the directory
/// restores that.
///
/// Files are written into a hidden directory (Staging) beside the target, or in it if it exists.
/// commit() puts them into place, and of an existing directory replaces the files of these names
/// and no other. Without commit() nothing is left.
class OutputDirectory {
  public:
    /// `names`: all files that will be written; the last is the one that says that they are
    /// complete. `inputs`: files that this run reads, which it must not replace. Throws Error
    /// (output) when `target` exists without `force`, or cannot be made, when another run is
    /// writing one of these files, or when one of them cannot be replaced: it is a directory, or an
    /// input, or the summary of another command's results.
    OutputDirectory(const std::filesystem::path& target, bool force, std::vector<std::string> names,
                    const std::vector<std::filesystem::path>& inputs = {});

    /// For single files in a directory that may hold others: it may exist, and without `force` the
    /// files must not.
    static OutputDirectory for_files(const std::filesystem::path& directory, bool force,
                                     std::vector<std::string> names);

    /// Opens a file of this name, which is one of `names`, calls `write` with its descriptor, sees
    /// to it that it is on the disk, closes it. Throws Error (output) that names the file when any
    /// of it fails.
    void write(const std::string& name, const std::function<void(int descriptor)>& write);

    /// Where a file of this name is until commit().
    std::filesystem::path path(const std::string& name) const;

    /// Puts the files into place; all must be written. A signal that is noted meanwhile waits.
    /// Throws Error (output) that says where the old and the new files are.
    void commit();

  private:
    enum class Existing { refuse, replace, add };
    OutputDirectory(const std::filesystem::path& target, Existing existing,
                    std::vector<std::string> names,
                    const std::vector<std::filesystem::path>& inputs);

    void stage_in_existing(Existing existing, const std::vector<std::filesystem::path>& inputs);
    std::filesystem::path target_;
    std::vector<std::string> missing_;  // the names that are not written yet
    std::string directory_;             // the name of the directory that is to be made, or empty
    std::unique_ptr<Staging> staging_;
};

/// Whether a commit() succeeded: what goes wrong later does not touch the results.
bool results_are_in_place();

}  // namespace merl::app
