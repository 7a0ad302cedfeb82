#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace merl::app {

/// An open file or directory; -1 is none.
class Descriptor {
  public:
    explicit Descriptor(int descriptor = -1) : descriptor_(descriptor) {}
    Descriptor(Descriptor&& other) noexcept;
    Descriptor& operator=(Descriptor&& other) noexcept;
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor();
    int get() const { return descriptor_; }

  private:
    int descriptor_;
};

/// The hidden directory in which results become whole, beside where they go ("the place"), so on
/// the same file system. What goes into place are entries of the place, by name: files, or one
/// directory.
///
///     PLACE/.merl-scan.partial-XXXXXXXX/
///         run       what is to go into place, and a lock as long as the run lives
///         writing/  the entries, until all of them are whole and on the disk
///         new/      the same from then on, by one rename: now they go into place
///         old/      what they replace, until all are in place
///
/// So it shows at any moment how far a run got that was killed, and the next run goes on from
/// there: finish_stopped_runs(). Two runs that write an entry of the same name exclude each other.
/// Where the file system has no locks, nobody can tell a run at work from one that was killed, so
/// nothing is removed and a person has to.
class Staging {
  public:
    /// Makes it. With `replace`, entries that are in the place already go when these come; without,
    /// they must not be there. Throws std::system_error when it cannot be made, Error (output) when
    /// another run writes one of these entries.
    Staging(const std::filesystem::path& place, bool replace, std::vector<std::string> names);

    /// Removes it, unless it holds the only copy of something that is whole.
    ~Staging();
    Staging(const Staging&) = delete;
    Staging& operator=(const Staging&) = delete;

    /// Where to write the entry of this name.
    std::filesystem::path path(const std::string& name) const;

    /// Sees to it that directories below and this are on the disk as the files are, and moves the
    /// entries into place, the last of the names last: without it a set of results is not
    /// complete, so of the old ones it goes first. When an entry cannot be moved, all that was
    /// moved is moved back. Nothing is deleted that is not safely in place. Throws Error (output)
    /// that says where the old and the new results are.
    void put_into_place();

    /// The names that were moved and not moved back: of old results, and of new ones.
    struct Moves {
        std::vector<std::string> aside;
        std::vector<std::string> placed;
    };

  private:
    void make(const std::filesystem::path& place);
    void discard();
    std::string where(const Moves& moves) const;

    std::filesystem::path place_;
    std::filesystem::path directory_;
    bool replace_;
    std::vector<std::string> names_;
    Descriptor run_;
    bool whole_ = false;  // from the moment on when there is new/
};

/// Goes on with what runs that were killed left in the place: what was going into place is put
/// there, with a line about it on standard error, and the rest is swept. What a run at work has is
/// not touched. Throws Error (output) where that fails and concerns one of `names`.
void finish_stopped_runs(const std::filesystem::path& place, const std::vector<std::string>& names);

/// Whether there is anything of that name, a dangling link too. Throws std::system_error when
/// nobody can tell.
bool is_there(const std::filesystem::path& path);

/// Only files and links are replaced: a directory may hold anything, and what else there is is
/// nobody's results. Throws Error (output).
void require_replaceable(const std::filesystem::path& path);

/// Sees to it that what was written is on the disk. Throws std::system_error.
void sync_file(int descriptor);

}  // namespace merl::app
