#include "engine/database/bad_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <system_error>
#include <thread>
#include <utility>

namespace merl::engine {
BadFilesError::BadFilesError(const std::string& database, std::size_t files,
                             const std::vector<BadMaterial>& bad)
    : InputError(bad.size() == 1 ? bad.front().reason
                                 : fmt::format("{}: {} of {} files cannot be used: {}", database,
                                               bad.size(), files, fmt::join(reasons(bad), "; "))) {}

BadFilesError::BadFilesError(const std::vector<std::string>& of_databases)
    : InputError(fmt::format("{}", fmt::join(of_databases, "; "))) {}

NoGoodFileError::NoGoodFileError(const std::string& database, std::vector<BadMaterial> bad)
    : BadFilesError({fmt::format("{}: none of {} files can be used: {}", database, bad.size(),
                                 fmt::join(reasons(bad), "; "))}),
      bad_(std::move(bad)) {}

std::vector<std::string> reasons(const std::vector<BadMaterial>& bad) {
    constexpr std::size_t kMost = 20;
    std::vector<std::string> lines;
    for (const auto& material : bad) {
        if (lines.size() == kMost) {
            lines.push_back(fmt::format("and {} more", bad.size() - kMost));
            break;
        }
        lines.push_back(material.reason);
    }
    return lines;
}

std::vector<std::string> faults_of(std::size_t count, const std::function<void(std::size_t)>& use) {
    std::vector<std::string> faults(count);
    std::atomic<std::size_t> next = 0;
    std::mutex other_mutex;
    std::exception_ptr other;
    const auto work = [&] {
        for (std::size_t i = next++; i < count; i = next++) {
            try {
                use(i);
            } catch (const InputError& error) {
                faults[i] = error.what();
            } catch (...) {
                const std::scoped_lock lock(other_mutex);
                other = std::current_exception();
                next = count;
            }
        }
    };
    {
        // Not TBB's: its threads would stay, and what opens a database may copy its process later.
        const auto most =
            tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
        std::vector<std::jthread> threads;
        for (std::size_t i = 1; i < std::min(count, most); ++i) {
            try {
                threads.emplace_back(work);
            } catch (const std::system_error&) {
                break;  // there can be no more; fewer do
            }
        }
        work();
    }
    if (other) {
        std::rethrow_exception(other);
    }
    return faults;
}

std::vector<BadMaterial> skip_bad(const std::string& database, std::vector<MaterialFile>& files,
                                  const std::vector<std::string>& faults,
                                  const OpenOptions& options) {
    std::vector<BadMaterial> bad;
    std::vector<MaterialFile> good;
    for (std::size_t i = 0; i < files.size(); ++i) {
        if (faults[i].empty()) {
            good.push_back(files[i]);
        } else {
            bad.push_back({files[i].material, faults[i]});
        }
    }
    if (!options.skip_bad && !bad.empty()) {
        throw BadFilesError(database, files.size(), bad);
    }
    if (good.empty() && !bad.empty()) {
        throw NoGoodFileError(database, std::move(bad));
    }
    files = std::move(good);
    return bad;
}

std::vector<std::string> skipped_lines(const Database& database) {
    const auto& skipped = database.skipped();
    std::vector<std::string> lines;
    if (!skipped.empty()) {
        lines.push_back(
            skipped.size() == 1
                ? fmt::format("{}: a file cannot be used and is left out", database.name())
                : fmt::format("{}: {} files cannot be used and are left out", database.name(),
                              skipped.size()));
        for (const auto& reason : reasons(skipped)) {
            lines.push_back("left out: " + reason);
        }
    }
    return lines;
}

void BadSamples::fail(const Database& database, const InputError& first,
                      const std::function<void(std::size_t)>& check) {
    std::call_once(looked_, [&] {
        error_ = std::make_exception_ptr(InputError(first.what()));
        const auto& materials = database.materials();
        const auto faults = faults_of(materials.size(), check);
        std::vector<BadMaterial> bad;
        for (std::size_t m = 0; m < materials.size(); ++m) {
            if (!faults[m].empty()) {
                bad.push_back({materials[m], faults[m]});
            }
        }
        if (!bad.empty()) {
            error_ = std::make_exception_ptr(BadFilesError(database.name(), materials.size(), bad));
        }
    });
    std::rethrow_exception(error_);
}

}  // namespace merl::engine
