#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/output/staging.h"

namespace merl::app {

/// A file of results: its name, and what writes it to a descriptor. A file without a writer is one
/// of many that are written as they come (OutputDirectory::write).
struct OutputFile {
    std::string name;
    std::function<void(int descriptor)> write = {};
    bool is_read_again = false;  // by other commands, which its hash tells that it is the same
};

/// A directory of results: whatever happens, the old results are there whole, or the new ones are,
/// or an error says where they are. After a kill or a power cut the next run into the directory
/// restores that.
///
/// A command states all its files here, once: which files are its own, what is replaced and what is
/// rolled back follows from that. They are written into a hidden directory (Staging) beside the
/// target, or in it if it exists. finish() puts them into place, and of an existing directory
/// replaces the files of these names and no other. Without finish() nothing is left.
class OutputDirectory {
  public:
    /// The last of the files is the one that says that they are complete. `inputs`: files that this
    /// run reads, which it must not replace. Throws Error (output) when `target` exists without
    /// `force`, or cannot be made, when another run is writing one of these files, or when one of
    /// them cannot be replaced: it is a directory, or an input, or the summary of another command's
    /// results.
    OutputDirectory(const std::filesystem::path& target, bool force, std::vector<OutputFile> files,
                    const std::vector<std::filesystem::path>& inputs = {});

    /// For single files in a directory that may hold others: it may exist, and without `force` the
    /// files must not.
    static OutputDirectory for_files(const std::filesystem::path& directory, bool force,
                                     std::vector<OutputFile> files);

    /// Writes a file that was stated without a writer. Throws Error (output) that names the file.
    void write(const std::string& name, std::string_view bytes);

    /// Writes all files that have a writer, in their order, each to the disk, and puts everything
    /// into place; files without one must be written. A signal that is noted before ends it, one
    /// that is noted while they go into place waits. Throws Error (output) that names the file, or
    /// says where the old and the new files are; Interrupted; and what a writer throws.
    void finish();

    /// The hashes of the files so far that are read again, by name.
    const std::vector<std::pair<std::string, std::string>>& hashes() const { return hashes_; }

  private:
    enum class Existing { refuse, replace, add };
    OutputDirectory(const std::filesystem::path& target, Existing existing,
                    std::vector<OutputFile> files,
                    const std::vector<std::filesystem::path>& inputs);

    void stage_in_existing(Existing existing, const std::vector<std::string>& names,
                           const std::vector<std::filesystem::path>& inputs);
    void write_file(const OutputFile& file, const std::function<void(int descriptor)>& write);

    /// Where a file of this name is until everything is in place.
    std::filesystem::path path(const std::string& name) const;

    std::filesystem::path target_;
    std::vector<OutputFile> files_;
    std::set<std::string> written_;
    std::string directory_;  // the name of the directory that is to be made, or empty
    std::vector<std::pair<std::string, std::string>> hashes_;
    std::unique_ptr<Staging> staging_;
};

/// Whether a finish() succeeded: what goes wrong later does not touch the results.
bool results_are_in_place();

}  // namespace merl::app
