#include "engine/base/kept_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <system_error>

#include "engine/base/error.h"
#include "engine/base/file.h"
#include "engine/base/hash.h"

namespace merl {
namespace {

constexpr std::string_view kBeginning = "merl-scan cache 1\n";
constexpr std::size_t kHashDigits = 32;
constexpr std::size_t kHeader = kBeginning.size() + kHashDigits + 1;

bool write_all(int descriptor, std::string_view bytes) {
    while (!bytes.empty()) {
        const auto written = ::write(descriptor, bytes.data(), bytes.size());
        if (written <= 0) {
            return false;
        }
        bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return true;
}

}  // namespace

std::optional<std::string> read_kept(const std::filesystem::path& file, std::uint64_t most) {
    try {
        std::string bytes = File(file).read_all(kHeader + most);
        const std::string_view all = bytes;
        if (all.size() < kHeader || !all.starts_with(kBeginning) ||
            all.substr(kBeginning.size(), kHashDigits) != hash_of(all.substr(kHeader))) {
            return std::nullopt;
        }
        return bytes.substr(kHeader);
    } catch (const InputError&) {
        return std::nullopt;
    }
}

bool keep(const std::filesystem::path& file, std::string_view bytes) {
    std::error_code error;
    std::filesystem::create_directories(file.parent_path(), error);
    std::string partial = file.string() + ".XXXXXX";
    const int descriptor = ::mkostemp(partial.data(), O_CLOEXEC);
    if (descriptor < 0) {
        return false;
    }
    const bool written = write_all(descriptor, std::string(kBeginning) + hash_of(bytes) + '\n') &&
                         write_all(descriptor, bytes);
    const bool closed = ::close(descriptor) == 0;
    if (written && closed) {
        std::filesystem::rename(partial, file, error);
        if (!error) {
            return true;
        }
    }
    ::unlink(partial.c_str());
    return false;
}

}  // namespace merl
