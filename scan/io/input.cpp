#include "scan/io/input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "engine/base/error.h"
#include "engine/base/file.h"

namespace merl::scan {
std::string stopped_run_beside(const std::string& path) {
    std::error_code code;
    const auto parent = std::filesystem::path(path).parent_path();
    for (std::filesystem::directory_iterator i(parent.empty() ? "." : parent, code), end;
         !code && i != end; i.increment(code)) {
        if (i->path().filename().string().starts_with(stopped_run_prefix)) {
            return fmt::format(
                "; a run that is at work or was stopped has results in {}, and the "
                "next one into that directory puts them into place",
                i->path().string());
        }
    }
    return "";
}

std::string_view json_fault(const std::exception& error) {
    // After "[json.exception.parse_error.101] ".
    const std::string_view text = error.what();
    return text.substr(std::min(text.find(' ') + 1, text.size()));
}

std::string read_input(const std::string& path, std::uint64_t most) {
    std::error_code code;
    if (!std::filesystem::exists(path, code) && !code) {
        throw InputError(fmt::format("{}: cannot be opened: {}{}", path, std::strerror(ENOENT),
                                     stopped_run_beside(path)));
    }
    const File file(path);
    if (file.bytes() == 0) {
        file.fail("is empty");
    }
    return file.read_all(most);
}

}  // namespace merl::scan
