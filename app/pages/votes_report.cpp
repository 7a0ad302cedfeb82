#include "app/pages/votes_report.h"

#include <fmt/format.h>

#include <filesystem>
#include <set>
#include <string_view>
#include <system_error>

#include "app/cli/sphere_options.h"
#include "app/output/image_file.h"
#include "app/pages/page.h"
#include "app/pages/votes_page_html.h"
#include "engine/base/error.h"
#include "engine/base/text.h"
#include "engine/database/database.h"
#include "scan/io/input.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

/// A sphere is a small image; all of them are in the page.
constexpr std::uint64_t kMostImageBytes = std::uint64_t{4} << 20U;
constexpr std::uint64_t kMostPageBytes = std::uint64_t{256} << 20U;

/// Throws InputError when an image shows other content than the hash says, if there is one.
/// Otherwise whether that could be told.
bool shows(const std::string& image, const std::string& path, const std::string& hash) {
    const auto shown = content_hash_in(png_comment(image));
    if (!shown.empty() && shown != hash) {
        throw InputError(
            fmt::format("{}: shows other content than what was scanned or judged: its content hash "
                        "is {}, expected {}; `merl-scan render --selection` makes the right images",
                        path, shown, hash));
    }
    return !shown.empty();
}

ordered_json plots_json(const std::vector<VotesPlot>& plots) {
    ordered_json list = ordered_json::array();
    for (const auto& [name, wide, narrow] : plots) {
        list.push_back({{"name", name}, {"wide", wide}, {"narrow", narrow}});
    }
    return list;
}

}  // namespace

ordered_json sphere_images(const scan::Votes& votes, const std::string& spheres,
                           const std::map<std::string, std::string>& material_hashes,
                           std::vector<std::string>& warnings) {
    if (spheres.empty()) {
        return ordered_json::object();
    }
    const std::filesystem::path directory = spheres;
    constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
    if (!std::filesystem::is_directory(directory)) {
        throw InputError(fmt::format(
            "--spheres {}: is no directory; expected one with images, MATERIAL.png, as `merl-scan "
            "render --out` makes it",
            directory.string()));
    }
    std::set<std::string> materials;
    for (const auto& configuration : votes.configurations) {
        materials.insert(configuration.materials.begin(), configuration.materials.end());
    }
    ordered_json result = ordered_json::object();
    std::size_t unknown = 0;
    std::string example;
    std::uint64_t bytes = 0;
    for (const auto& material : materials) {
        const auto path = directory / (engine::file_stem(material) + ".png");
        std::error_code too_long;
        if (!std::filesystem::exists(path, too_long)) {
            continue;
        }
        const std::string image = scan::read_input(path.string(), kMostImageBytes);
        if (!image.starts_with(kSignature)) {
            throw InputError(path.string() + ": found no PNG image; expected one");
        }
        bytes += image.size();
        if (bytes > kMostPageBytes) {
            throw InputError(
                fmt::format("--spheres {}: the images have more than {} bytes, which no browser "
                            "takes in one page; expected smaller ones",
                            directory.string(), kMostPageBytes));
        }
        const auto expected = material_hashes.find(material);
        if (expected != material_hashes.end() && !shows(image, path.string(), expected->second)) {
            ++unknown;
            example = path.string();
        }
        result[as_utf8(material)] = "data:image/png;base64," + base64(image);
    }
    if (result.empty()) {
        throw InputError(fmt::format(
            "--spheres {}: found none of the images of {} materials; expected "
            "MATERIAL.png, like {}",
            directory.string(), materials.size(), engine::file_stem(*materials.begin()) + ".png"));
    }
    if (unknown > 0) {
        warnings.push_back(fmt::format(
            "--spheres {}: {} of {} images, like {}, do not say what they show; whether it is what "
            "was scanned was not checked",
            spheres, unknown, result.size(), example));
    }
    return result;
}

std::string votes_report(const ordered_json& summary, const std::vector<scan::SurveyAnswer>& survey,
                         const ordered_json& images, const std::vector<VotesPlot>& plots,
                         const std::vector<VotesPlot>& kept_plots) {
    ordered_json data = summary;
    data["plots"] = {{"all", plots_json(plots)}, {"kept", plots_json(kept_plots)}};
    data["survey"] = ordered_json::array();
    for (const auto& [judge, question, answer] : survey) {
        data["survey"].push_back({as_utf8(judge), as_utf8(question), as_utf8(answer)});
    }
    data["images"] = images;
    return page_of(kVotesPage, data);
}

}  // namespace merl::app
