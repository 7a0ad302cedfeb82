#include "app/votes_report.h"

#include <fmt/format.h>

#include <filesystem>
#include <set>
#include <string_view>
#include <system_error>

#include "app/page.h"
#include "app/terminal.h"
#include "app/votes_page_html.h"
#include "scan/input.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

/// A sphere is a small image; all of them are in the page.
constexpr std::size_t kMostImageBytes = std::size_t{4} << 20U;

/// The images of all materials, as the page embeds them.
ordered_json images(const scan::Votes& votes, const std::filesystem::path& directory) {
    constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
    if (!std::filesystem::is_directory(directory)) {
        throw scan::InputError(fmt::format(
            "--spheres {}: is no directory; expected one with images, MATERIAL.png, as `merl-scan "
            "render --out` makes it",
            directory.string()));
    }
    std::set<std::string> materials;
    for (const auto& configuration : votes.configurations) {
        materials.insert(configuration.materials.begin(), configuration.materials.end());
    }
    ordered_json result = ordered_json::object();
    for (const auto& material : materials) {
        const auto path = directory / (material + ".png");
        std::error_code too_long;
        // A name is the name of a file in this directory or it has no image.
        if (material.find('/') != std::string::npos || !std::filesystem::exists(path, too_long)) {
            continue;
        }
        const std::string image = scan::read_input(path.string());
        if (!image.starts_with(kSignature)) {
            throw scan::InputError(path.string() + ": found no PNG image; expected one");
        }
        if (image.size() > kMostImageBytes) {
            throw scan::InputError(fmt::format("{}: has {} bytes; expected {} or fewer",
                                               path.string(), image.size(), kMostImageBytes));
        }
        result[as_utf8(material)] = "data:image/png;base64," + base64(image);
    }
    if (result.empty()) {
        throw scan::InputError(
            fmt::format("--spheres {}: found none of the images of {} materials; expected "
                        "MATERIAL.png, like {}",
                        directory.string(), materials.size(), *materials.begin() + ".png"));
    }
    return result;
}

}  // namespace

std::string votes_report(const ordered_json& summary, const scan::Votes& votes,
                         const std::vector<scan::SurveyAnswer>& survey,
                         const std::string& spheres) {
    ordered_json data = summary;
    data["survey"] = ordered_json::array();
    for (const auto& [judge, question, answer] : survey) {
        data["survey"].push_back({as_utf8(judge), as_utf8(question), as_utf8(answer)});
    }
    data["images"] = spheres.empty() ? ordered_json::object() : images(votes, spheres);
    return filled_in(kVotesPage, "%DATA%", script_json(data));
}

}  // namespace merl::app
