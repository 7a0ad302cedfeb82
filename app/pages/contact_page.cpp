#include "app/pages/contact_page.h"

#include <fmt/format.h>

#include <string_view>

#include "app/pages/page.h"
#include "engine/base/text.h"

namespace merl::app {
namespace {

constexpr std::string_view kHead = R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; img-src 'self' file: data:">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<title>Spheres</title>
<style>
body { margin: 16px; background: #808080; color: #000; font: 14px/1.3 system-ui, sans-serif; }
h1 { font-size: 1.2rem; overflow-wrap: anywhere; }
main { display: grid; grid-template-columns: repeat(auto-fill, minmax(120px, 1fr)); gap: 12px; }
figure { margin: 0; text-align: center; overflow-wrap: anywhere; }
img { display: block; width: 100%; aspect-ratio: 1; }
</style>
</head>
<body>
)";

/// The name of a file as a relative address: every byte that could mean something else as %XX.
std::string address(std::string_view file) {
    constexpr std::string_view kPlain =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";
    std::string text = "./";
    for (const char c : file) {
        text += kPlain.find(c) != std::string_view::npos
                    ? std::string(1, c)
                    : fmt::format("%{:02X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    }
    return text;
}

}  // namespace

std::string contact_page(const std::string& title, const std::vector<ContactImage>& images) {
    std::string page(kHead);
    page += fmt::format("<h1>{}</h1>\n<main>\n", markup_text(printable(title)));
    for (const auto& [file, name] : images) {
        const std::string text = markup_text(printable(name));
        page += fmt::format(
            "<figure><img src=\"{}\" alt=\"\" "
            "loading=\"lazy\"><figcaption>{}</figcaption></figure>\n",
            address(file + ".png"), text);
    }
    return page + "</main>\n</body>\n</html>\n";
}

}  // namespace merl::app
