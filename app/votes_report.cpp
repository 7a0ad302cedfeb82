#include "app/votes_report.h"

#include <fmt/format.h>

#include <filesystem>
#include <set>
#include <string_view>

#include "app/page.h"
#include "app/terminal.h"
#include "app/votes_page_html.h"
#include "scan/input.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

/// A sphere is a small image; all of them are in the page.
constexpr std::uint64_t kMostImageBytes = std::uint64_t{4} << 20U;
constexpr std::uint64_t kMostPageBytes = std::uint64_t{256} << 20U;

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
    std::uint64_t bytes = 0;
    for (const auto& material : materials) {
        const auto path = directory / (material + ".png");
        // A name is the name of a file in this directory or it has no image.
        if (material.find('/') != std::string::npos || !std::filesystem::exists(path)) {
            continue;
        }
        const std::string image = scan::read_input(path.string(), kMostImageBytes);
        if (!image.starts_with(kSignature)) {
            throw scan::InputError(path.string() + ": found no PNG image; expected one");
        }
        bytes += image.size();
        if (bytes > kMostPageBytes) {
            throw scan::InputError(
                fmt::format("--spheres {}: the images have more than {} bytes, which no browser "
                            "takes in one page; expected smaller ones",
                            directory.string(), kMostPageBytes));
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
