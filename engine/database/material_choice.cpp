#include "engine/database/material_choice.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <string_view>

#include "engine/base/error.h"
#include "engine/base/file.h"

namespace merl::engine {
namespace {

constexpr std::uint64_t kMostListBytes = 1U << 20U;

/// A name without its label.
std::string_view own_name(std::string_view name) {
    return name.substr(name.find('/') + 1);
}

/// The lines of a text, without a byte order mark, carriage returns and empty lines.
std::vector<std::string> lines_of(std::string_view text) {
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
    if (text.starts_with(kByteOrderMark)) {
        text.remove_prefix(kByteOrderMark.size());
    }
    std::vector<std::string> lines;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        auto line = text.substr(0, end);
        if (line.ends_with('\r')) {
            line.remove_suffix(1);
        }
        if (!line.empty()) {
            lines.emplace_back(line);
        }
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return lines;
}

/// What matches is marked.
class Materials {
  public:
    Materials(std::span<const std::string> names, const std::string& database)
        : names_(names), database_(database) {}

    std::vector<bool> matching(const std::vector<std::string>& texts) const {
        std::vector<bool> marked(names_.size());
        for (const auto& text : texts) {
            if (mark_if(marked, [&](const auto& name) { return is_name(text, name); })) {
                continue;
            }
            for (std::size_t begin = 0; begin <= text.size();) {
                const std::size_t end = std::min(text.find(',', begin), text.size());
                mark_item(marked, text.substr(begin, end - begin));
                begin = end + 1;
            }
        }
        return marked;
    }

  private:
    static bool is_name(const std::string& text, const std::string& name) {
        return text == name || text == own_name(name);
    }

    static bool matches(const std::string& pattern, const std::string& name) {
        if (is_name(pattern, name)) {
            return true;
        }
        return pattern.find('/') == std::string::npos
                   ? fnmatch(pattern.c_str(), std::string(own_name(name)).c_str(), 0) == 0
                   : fnmatch(pattern.c_str(), name.c_str(), FNM_PATHNAME) == 0;
    }

    bool mark_if(std::vector<bool>& marked, const auto& condition) const {
        bool any = false;
        for (std::size_t m = 0; m < names_.size(); ++m) {
            if (condition(names_[m])) {
                marked[m] = true;
                any = true;
            }
        }
        return any;
    }

    void mark_item(std::vector<bool>& marked, const std::string& item) const {
        if (!item.starts_with('@')) {
            mark_matching(marked, item, "");
            return;
        }
        const std::string path = item.substr(1);
        const File file(path);
        const std::string text = file.read_all(kMostListBytes);
        if (text.find('\0') != std::string::npos) {
            file.fail("found a zero byte; expected text");
        }
        const auto patterns = lines_of(text);
        if (patterns.empty()) {
            file.fail("found no line; expected names or patterns of materials, one a line");
        }
        for (const auto& pattern : patterns) {
            mark_matching(marked, pattern, path + ": ");
        }
    }

    void mark_matching(std::vector<bool>& marked, const std::string& pattern,
                       const std::string& where) const {
        if (!mark_if(marked, [&](const auto& name) { return matches(pattern, name); })) {
            throw Error(Fault::usage,
                        fmt::format("{}\"{}\" matches none of the {} materials of {}; `merl-scan "
                                    "database info` lists them",
                                    where, pattern, names_.size(), database_));
        }
    }

    std::span<const std::string> names_;
    const std::string& database_;
};

}  // namespace

std::vector<std::size_t> choose_materials(std::span<const std::string> names,
                                          const MaterialChoice& choice,
                                          const std::string& database) {
    const Materials materials(names, database);
    const auto included = materials.matching(choice.materials);
    const auto excluded = materials.matching(choice.exclude);
    std::vector<std::size_t> chosen;
    for (std::size_t m = 0; m < names.size(); ++m) {
        if ((choice.materials.empty() || included[m]) && !excluded[m]) {
            chosen.push_back(m);
        }
    }
    if (chosen.empty()) {
        throw Error(Fault::usage, fmt::format("none of the {} materials of {} is left: what is "
                                              "chosen is excluded too",
                                              names.size(), database));
    }
    return chosen;
}

}  // namespace merl::engine
