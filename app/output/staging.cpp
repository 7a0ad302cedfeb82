#include "app/output/staging.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <random>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "app/cli/interrupt.h"
#include "engine/base/error.h"
#include "engine/base/text.h"
#include "scan/io/csv.h"
#include "scan/io/input.h"

namespace merl::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRun = "run";
constexpr const char* kWriting = "writing";
constexpr const char* kNew = "new";
constexpr const char* kOld = "old";

[[noreturn]] void throw_errno() {
    throw std::system_error(errno, std::generic_category());
}

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
    throw Error(Fault::output, fmt::format("{}: {}", path.string(), what));
}

void say(const std::string& text) {
    std::fprintf(stderr, "merl-scan: %s\n", printable(text).c_str());
}

std::string reason(const std::exception& error) {
    const auto* system = dynamic_cast<const std::system_error*>(&error);
    return system != nullptr ? system->code().message() : error.what();
}

void sync_directory(const fs::path& path) {
    const Descriptor directory(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (directory.get() >= 0) {
        sync_file(directory.get());
    } else if (errno != EACCES) {  // one may be allowed to write into it and not to read it
        throw_errno();
    }
}

[[noreturn]] void fail_occupied(const std::string& name) {
    throw Error(Fault::output, fmt::format("somebody else put {} there", name));
}

/// Moves it where nothing is.
void move_new(const fs::path& from, const fs::path& to) {
    if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) {
        return;
    }
    const bool can_look_and_move_at_once = errno != EINVAL && errno != ENOSYS;
    if (errno == EEXIST || (!can_look_and_move_at_once && is_there(to))) {
        fail_occupied(to.filename().string());
    }
    if (can_look_and_move_at_once) {
        throw_errno();
    }
    fs::rename(from, to);
}

enum class Lock { had, held_by_another, unknown };

Lock try_lock(const Descriptor& file) {
    return ::flock(file.get(), LOCK_EX | LOCK_NB) == 0 ? Lock::had
           : errno == EWOULDBLOCK                      ? Lock::held_by_another
                                                       : Lock::unknown;
}

/// Of two runs that start at once, one finds the other, and not each the other. Best effort: a
/// person's script may hold this lock all the time, and NFS has none on directories.
Descriptor lock_for_a_moment(const fs::path& place) {
    using namespace std::chrono_literals;
    Descriptor directory(::open(place.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    for (int i = 0; i < 200 && try_lock(directory) == Lock::held_by_another; ++i) {
        std::this_thread::sleep_for(10ms);
    }
    return directory;
}

/// What a staging directory holds, from outside.
struct Found {
    fs::path place;
    fs::path directory;
    Descriptor run;
    Lock lock = Lock::unknown;
    bool ours = false;  // belongs to this user
    bool replace = false;
    std::vector<std::string> names;
    std::vector<std::string> replaced;  // identity_of() what was to be replaced, of each name

    bool concerns(const std::vector<std::string>& others) const {
        return std::ranges::any_of(names, [&](const auto& name) {
            return std::ranges::find(others, name) != others.end();
        });
    }
};

/// What a message calls these results.
std::string called(const fs::path& place, const std::vector<std::string>& names) {
    return (names.size() == 1 ? place / names.front() : place).string();
}

std::string entries_text(bool replace, const std::vector<std::string>& names) {
    std::string text = replace ? "replace" : "keep";
    for (const auto& name : names) {
        (text += '\0') += name;
    }
    return text += '\0';
}

/// Tells a file from another that a person has put in its place.
std::string identity_of(const fs::path& path) {
    struct stat status = {};
    return ::lstat(path.c_str(), &status) != 0
               ? "none"
               : fmt::format("{} {} {} {}.{:09}", status.st_dev, status.st_ino, status.st_size,
                             status.st_mtim.tv_sec, status.st_mtim.tv_nsec);
}

std::vector<std::string> identities_of(const fs::path& place,
                                       const std::vector<std::string>& names) {
    std::vector<std::string> identities(names.size());
    std::ranges::transform(names, identities.begin(),
                           [&](const auto& name) { return identity_of(place / name); });
    return identities;
}

/// Comes after the entries when they are about to go into place: what is there of each.
std::string replaced_text(const std::vector<std::string>& identities) {
    std::string text(1, '\0');
    for (const auto& identity : identities) {
        (text += identity) += '\0';
    }
    return text;
}

void read_entries(Found& found) {
    constexpr std::size_t kMost = 1U << 24U;  // anybody may have made this file
    std::string text;
    std::array<char, 4096> buffer = {};
    while (text.size() < kMost) {
        const auto count =
            ::pread(found.run.get(), buffer.data(), buffer.size(), static_cast<off_t>(text.size()));
        if (count <= 0) {
            break;
        }
        text.append(buffer.data(), static_cast<std::size_t>(count));
    }
    found.replace = text.starts_with("replace");
    auto at = std::min(text.find('\0'), text.size() - 1) + 1;
    bool names_end = false;
    for (std::size_t end = 0; (end = text.find('\0', at)) != std::string::npos; at = end + 1) {
        const auto entry = text.substr(at, end - at);
        if (names_end) {
            found.replaced.push_back(entry);
        } else if (entry.empty()) {
            names_end = true;
        } else if (entry.find('/') == std::string::npos && entry != "..") {
            found.names.push_back(entry);  // it may come from an archive
        }
    }
}

/// All staging directories of a place but `own`.
std::vector<Found> staging_directories(const fs::path& place, const fs::path& own = {}) {
    std::vector<Found> all;
    std::error_code code;
    for (fs::directory_iterator i(place, code); !code && i != fs::directory_iterator();
         i.increment(code)) {
        Found found;
        found.place = place;
        found.directory = i->path();
        struct stat status = {};
        if (!i->path().filename().string().starts_with(scan::stopped_run_prefix) ||
            i->path() == own || ::lstat(i->path().c_str(), &status) != 0 ||
            !S_ISDIR(status.st_mode)) {
            continue;
        }
        found.ours = status.st_uid == ::geteuid();
        const auto run = found.directory / kRun;
        constexpr int kFlags = O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
        found.run = Descriptor(::open(run.c_str(), O_RDWR | kFlags));  // NFS locks only these
        if (found.run.get() < 0) {
            found.run = Descriptor(::open(run.c_str(), O_RDONLY | kFlags));
        }
        if (found.run.get() >= 0) {
            found.lock = try_lock(found.run);
            read_entries(found);
        }
        all.push_back(std::move(found));
    }
    return all;
}

/// At any moment what is left looks like what it is. The file with the lock, `run`, goes last:
/// without it nobody could tell whose the rest is. It is closed before, for NFS keeps open files.
void remove_staging(const fs::path& directory, Descriptor& run) {
    for (const auto* part : {kOld, kNew, kWriting}) {
        fs::remove_all(directory / part);
    }
    run = Descriptor();
    fs::remove(directory / kRun);
    fs::remove(directory);
}

/// Moves what is in new/ into place, and what it replaces to old/, which is what `replaced` says of
/// each name. It does not matter how far this got before.
void move(const fs::path& place, const fs::path& directory, bool replace,
          const std::vector<std::string>& names, const std::vector<std::string>& replaced,
          Staging::Moves& moves) {
    for (auto name = names.rbegin(); name != names.rend(); ++name) {
        if (!is_there(directory / kNew / *name) || !is_there(place / *name)) {
            continue;
        }
        const auto number = static_cast<std::size_t>(names.rend() - name) - 1;
        if (!replace || is_there(directory / kOld / *name) || number >= replaced.size() ||
            replaced[number] != identity_of(place / *name)) {
            fail_occupied(*name);
        }
        require_replaceable(place / *name);
        fs::rename(place / *name, directory / kOld / *name);
        moves.aside.push_back(*name);
    }
    for (const auto& name : names) {
        if (is_there(directory / kNew / name)) {
            move_new(directory / kNew / name, place / name);
            moves.placed.push_back(name);
        }
    }
}

/// Throws Error (output) unless all that is new is in place, and something where the old was: a
/// person may have moved things by hand.
void require_nothing_lost(const Found& found) {
    const auto each = [&](const char* part, const auto& check) {
        if (is_there(found.directory / part)) {
            for (const auto& entry : fs::directory_iterator(found.directory / part)) {
                check(entry.path().filename());
            }
        }
    };
    each(kNew, [](const fs::path& name) {
        throw Error(Fault::output, fmt::format("{} is none of them", name.string()));
    });
    each(kOld, [&](const fs::path& name) {
        if (!is_there(found.place / name)) {
            throw Error(Fault::output, fmt::format("{} is missing", name.string()));
        }
    });
}

/// Undoes it, the last first. Throws where that is impossible too.
void move_back(const fs::path& place, const fs::path& directory, Staging::Moves& moves) {
    for (; !moves.placed.empty(); moves.placed.pop_back()) {
        move_new(place / moves.placed.back(), directory / kNew / moves.placed.back());
    }
    for (; !moves.aside.empty(); moves.aside.pop_back()) {
        move_new(directory / kOld / moves.aside.back(), place / moves.aside.back());
    }
}

}  // namespace

Descriptor::Descriptor(Descriptor&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)) {}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
    const Descriptor old(std::exchange(descriptor_, std::exchange(other.descriptor_, -1)));
    return *this;
}

Descriptor::~Descriptor() {
    if (descriptor_ >= 0) {
        ::close(descriptor_);
    }
}

bool is_there(const fs::path& path) {
    return fs::exists(fs::symlink_status(path));
}

void require_replaceable(const fs::path& path) {
    const auto status = fs::symlink_status(path);
    if (fs::exists(status) && !fs::is_regular_file(status) && !fs::is_symlink(status)) {
        fail(path, fmt::format("is a {} where a result has to go; move it away",
                               fs::is_directory(status) ? "directory" : "special file"));
    }
}

void sync_file(int descriptor) {
    // Some file systems cannot be told to.
    if (::fsync(descriptor) != 0 && errno != EINVAL && errno != ENOTSUP && errno != ENOSYS) {
        throw_errno();
    }
}

Staging::Staging(const fs::path& place, bool replace, std::vector<std::string> names)
    : place_(place), replace_(replace), names_(std::move(names)) {
    const auto moment = lock_for_a_moment(place);
    try {
        make(place);
        for (const auto& other : staging_directories(place, directory_)) {
            if (!other.concerns(names_)) {
                continue;
            }
            if (other.lock == Lock::held_by_another) {
                fail(called(place, other.names),
                     "another run is writing this; wait for it, or choose another --out");
            }
            if (other.lock == Lock::unknown) {
                fail(called(place, other.names),
                     fmt::format("another run is writing this, or was stopped: this file system "
                                 "cannot tell; when none is at work, look into {} and move it away",
                                 other.directory.string()));
            }
            if (is_there(other.directory / kNew)) {
                fail(called(place, other.names),
                     fmt::format("a run that was stopped left its results in {}; {}",
                                 other.directory.string(),
                                 other.ours ? "try again" : "it belongs to another user"));
            }
        }
    } catch (...) {
        if (!directory_.empty()) {
            discard();
        }
        throw;
    }
}

void Staging::make(const fs::path& place) {
    std::random_device random;
    for (int attempt = 0; attempt < 100; ++attempt) {
        const auto directory = place / fmt::format("{}{:08x}", scan::stopped_run_prefix, random());
        if (::mkdir(directory.c_str(), 0777) != 0) {
            if (errno == EEXIST) {
                continue;
            }
            throw_errno();
        }
        directory_ = directory;
        set_unfinished(directory);
        run_ = Descriptor(
            ::open((directory / kRun).c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
        if (run_.get() < 0 && errno != ENOENT) {
            throw_errno();
        }
        struct stat status = {};
        if (run_.get() < 0 || try_lock(run_) == Lock::held_by_another ||
            (::fstat(run_.get(), &status) == 0 && status.st_nlink == 0)) {
            continue;  // another run took it, without a lock yet, for that of a dead one
        }
        scan::write_all(run_.get(), entries_text(replace_, names_));
        fs::create_directory(directory / kWriting);
        fs::create_directory(directory / kOld);
        return;
    }
    throw std::system_error(std::make_error_code(std::errc::file_exists));
}

Staging::~Staging() {
    if (!whole_) {
        discard();
    }
}

void Staging::discard() {
    try {
        remove_staging(directory_, run_);
    } catch (const std::exception& error) {
        say(fmt::format("{} cannot be removed: {}; it holds nothing whole", directory_.string(),
                        reason(error)));
    }
}

fs::path Staging::path(const std::string& name) const {
    return directory_ / kWriting / name;
}

void Staging::put_into_place() {
    const auto what = called(place_, names_);
    const auto replaced = identities_of(place_, names_);
    try {
        scan::write_all(run_.get(), replaced_text(replaced));
        for (const auto& name : names_) {
            if (fs::is_directory(path(name))) {
                sync_directory(path(name));
            }
        }
        sync_file(run_.get());
        sync_directory(directory_ / kWriting);
        sync_directory(directory_);
        sync_directory(place_);
        fs::rename(directory_ / kWriting, directory_ / kNew);
    } catch (const std::system_error& error) {
        fail(what, fmt::format("cannot be put into place: {}", reason(error)));
    }
    whole_ = true;
    Moves moves;
    try {
        sync_directory(directory_);
        move(place_, directory_, replace_, names_, replaced, moves);
    } catch (const std::exception& error) {
        try {
            move_back(place_, directory_, moves);
        } catch (const std::exception&) {  // then the message says where everything is
        }
        fail(what, fmt::format("cannot be put into place: {}; {}", reason(error), where(moves)));
    }
    try {
        sync_directory(place_);
    } catch (const std::system_error& error) {
        fail(what, fmt::format("may not be on the disk yet: {}; what was replaced is in {}",
                               reason(error), (directory_ / kOld).string()));
    }
    try {
        remove_staging(directory_, run_);
    } catch (const std::exception& error) {
        say(fmt::format("{} cannot be removed: {}; all that is in it was replaced",
                        directory_.string(), reason(error)));
    }
}

std::string Staging::where(const Moves& moves) const {
    const auto ready = directory_ / kNew;
    std::string text = fmt::format(
        "the new results are in {}",
        (names_.size() == 1 && moves.placed.empty() ? ready / names_.front() : ready).string());
    if (!moves.placed.empty()) {
        text += fmt::format(" and {}", place_.string());
    }
    if (!moves.aside.empty()) {
        text += fmt::format(", the old ones in {}", (directory_ / kOld).string());
        if (std::ranges::any_of(names_, [&](const auto& name) {
                std::error_code none;
                return std::ranges::find(moves.placed, name) == moves.placed.end() &&
                       fs::exists(fs::symlink_status(place_ / name, none));
            })) {
            text += fmt::format(" and {}", place_.string());
        }
    } else if (replace_) {
        text += ", the old ones as they were";
    }
    return text;
}

void finish_stopped_runs(const fs::path& place, const std::vector<std::string>& names) {
    for (auto& found : staging_directories(place)) {
        if (found.run.get() < 0) {
            // Empty: a run is just making or removing it, or was stopped then.
            if (::rmdir(found.directory.c_str()) == 0 || errno != ENOTEMPTY ||
                ::access((found.directory / kRun).c_str(), F_OK) == 0) {
                continue;
            }
            // A run that ended in haste may have removed only half of it.
            if (!found.ours || ::access((found.directory / kWriting).c_str(), F_OK) != 0) {
                say(
                    fmt::format("{} is of another user or version and may hold results; look into "
                                "it and move it away",
                                found.directory.string()));
                continue;
            }
        } else if (!found.ours || found.lock != Lock::had) {
            continue;
        }
        try {
            const Finishing until_done;
            const bool is_whole = is_there(found.directory / kNew);
            if (is_whole) {
                Staging::Moves moves;
                move(place, found.directory, found.replace, found.names, found.replaced, moves);
                sync_directory(place);
            }
            require_nothing_lost(found);
            if (is_whole) {
                say(
                    fmt::format("{}: a run was stopped while its results went into place; they are "
                                "all there now",
                                called(place, found.names)));
            }
            remove_staging(found.directory, found.run);
        } catch (const std::exception& error) {
            const auto what = fmt::format(
                "{}: a run was stopped while its results went into place, and they still cannot "
                "go there: {}; look into {}: the new ones are in {}, what they replace in {}",
                called(place, found.names), reason(error), found.directory.string(), kNew, kOld);
            if (found.concerns(names)) {
                throw Error(Fault::output, what);
            }
            say(what);
        }
    }
}

}  // namespace merl::app
