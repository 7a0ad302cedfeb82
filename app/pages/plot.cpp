#include "app/pages/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "app/pages/page.h"
#include "engine/base/text.h"

namespace merl::app {
namespace {

constexpr std::string_view kSoft = R"(fill="#56657a")";
constexpr double kTitleLine = 20;
constexpr double kTitleCharacter = 8.9;

/// A text as it stands in XML, which has no place for U+FFFE and U+FFFF.
std::string harmless(const std::string& text) {
    std::string result = markup_text(printable(text));
    for (const std::string_view none : {"\xef\xbf\xbe", "\xef\xbf\xbf"}) {
        for (auto at = result.find(none); at != std::string::npos; at = result.find(none, at)) {
            result.replace(at, none.size(), "\xef\xbf\xbd");
        }
    }
    return result;
}

std::string tooltip_text(const std::string& tooltip) {
    return tooltip.empty() ? "" : fmt::format("<title>{}</title>", harmless(tooltip));
}

/// The words of a text in lines of at most so many characters, unless a word is longer.
std::vector<std::string> lines_of(const std::string& text, std::size_t most) {
    std::vector<std::string> lines;
    std::istringstream words(text);
    for (std::string word; words >> word;) {
        word = shortened(word, std::max<std::size_t>(most, 1));
        if (!lines.empty() && characters(lines.back()) + 1 + characters(word) <= most) {
            lines.back() += " " + word;
        } else {
            lines.push_back(word);
        }
    }
    return lines;
}

std::size_t fits(double width, double of_one = kCharacter) {
    return static_cast<std::size_t>(std::max(4.0, width / of_one));
}

double largest(const std::vector<Bar>& bars) {
    double most = 0;
    for (const auto& bar : bars) {
        most = std::max(most, std::isnan(bar.value) ? 0 : bar.value);
    }
    return most;
}

std::string filled(std::string_view colour) {
    return fmt::format(R"(fill="{}")", colour);
}

}  // namespace

std::size_t characters(std::string_view utf8) {
    return static_cast<std::size_t>(
        std::ranges::count_if(utf8, [](char c) { return (c & '\xc0') != '\x80'; }));
}

std::string shortened(const std::string& utf8, std::size_t most) {
    if (characters(utf8) <= most) {
        return utf8;
    }
    std::string text;
    std::size_t taken = 0;
    for (const char c : utf8) {
        taken += (c & '\xc0') != '\x80' ? 1 : 0;
        if (taken == most) {
            break;
        }
        text += c;
    }
    return text + "…";
}

std::string number_text(double value, int decimals) {
    const std::string digits = fmt::format("{:.{}f}", std::abs(value), decimals);
    return (value < 0 ? "−" : "") + digits;
}

Scale::Scale(double low, double high, double from, double to, double margin)
    : low_(low), high_(high), from_(from), to_(to) {
    const double room = margin > 0 ? std::max(margin * (high - low), 1e-6) : 0;
    low_ -= room;
    high_ += room;
    const double rough = (high_ - low_) / 4;
    const double power = std::pow(10.0, std::floor(std::log10(rough)));
    const double digit = rough / power;
    step_ = power * (digit > 7 ? 10 : digit > 3.5 ? 5 : digit > 1.5 ? 2 : 1);
}

double Scale::at(double value) const {
    return from_ + (to_ - from_) * (std::clamp(value, low_, high_) - low_) / (high_ - low_);
}

std::vector<double> Scale::ticks() const {
    std::vector<double> ticks;
    for (double k = std::ceil(low_ / step_ - 1e-9); k * step_ <= high_ + 1e-9 * step_; ++k) {
        ticks.push_back(k * step_ + 0.0);
    }
    return ticks;
}

int Scale::decimals() const {
    return std::clamp(static_cast<int>(-std::floor(std::log10(step_))), 0, 9);
}

Picture::Picture(double width, double height, const std::string& title)
    : width_(width), height_(height), title_(title) {
    for (const auto& line : lines_of(printable(title), fits(width - 24, kTitleCharacter))) {
        top_ += kTitleLine;
        text(12, top_ - 3, "start", line, R"(font-size="15" font-weight="600")");
    }
    top_ += 6;
    height_ += top_;
}

void Picture::line(double x1, double y1, double x2, double y2, std::string_view style) {
    content_ += fmt::format(R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" {}/>)", x1, y1,
                            x2, y2, style);
}

void Picture::box(double x, double y, double width, double height, std::string_view style,
                  const std::string& tooltip) {
    content_ +=
        fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" {}>{}</rect>)", x,
                    y, width, height, style, tooltip_text(tooltip));
}

void Picture::disc(double x, double y, double radius, std::string_view style,
                   const std::string& tooltip) {
    content_ += fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{:.2f}" {}>{}</circle>)", x, y,
                            radius, style, tooltip_text(tooltip));
}

void Picture::sector(double x, double y, double radius, double from, double to,
                     std::string_view style, const std::string& tooltip) {
    if (to - from > 1 - 1e-9) {
        disc(x, y, radius, style, tooltip);
        return;
    }
    const auto point = [&](double share) {
        const double angle = 2 * std::numbers::pi * share;
        return fmt::format("{:.2f} {:.2f}", x + radius * std::sin(angle),
                           y - radius * std::cos(angle));
    };
    content_ += fmt::format(R"(<path d="M{:.2f} {:.2f}L{}A{:.2f} {:.2f} 0 {} 1 {}Z" {}>{}</path>)",
                            x, y, point(from), radius, radius, to - from > 0.5 ? 1 : 0, point(to),
                            style, tooltip_text(tooltip));
}

void Picture::text(double x, double y, std::string_view anchor, const std::string& text,
                   std::string_view style) {
    content_ += fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="{}" {}>{}</text>)", x, y,
                            anchor, style, harmless(text));
}

void Picture::text_upwards(double x, double y, const std::string& text) {
    content_ += fmt::format(
        R"svg(<text transform="translate({:.1f} {:.1f}) rotate(-90)" text-anchor="middle" {}>{}</text>)svg",
        x, y, kSoft, harmless(text));
}

std::string Picture::svg() const {
    return fmt::format(
        R"svg(<svg xmlns="http://www.w3.org/2000/svg" role="img" width="{0:.0f}" height="{1:.0f}" )svg"
        R"svg(viewBox="0 0 {0:.0f} {1:.0f}" font-family="system-ui, -apple-system, 'Segoe UI', )svg"
        R"svg('DejaVu Sans', sans-serif" font-size="13" fill="#1b2733"><title>{2}</title>)svg"
        R"svg(<rect width="{0:.0f}" height="{1:.0f}" fill="#fff"/>{3}</svg>)svg",
        width_, height_, harmless(title_), content_);
}

void draw_axes(Picture& picture, const Frame& frame, const std::string& across,
               const std::string& upwards) {
    constexpr std::string_view kAxis = R"(stroke="#8896a8")";
    picture.line(frame.left, frame.top, frame.left, frame.bottom, kAxis);
    picture.line(frame.left, frame.bottom, frame.right, frame.bottom, kAxis);
    const double middle = (frame.left + frame.right) / 2;
    picture.text(middle, frame.bottom + 38, "middle",
                 shortened(across, fits(frame.right - frame.left)), kSoft);
    picture.text_upwards(16, (frame.top + frame.bottom) / 2,
                         shortened(upwards, fits(frame.bottom - frame.top)));
}

void draw_tick_across(Picture& picture, const Frame& frame, double x, const std::string& label) {
    picture.line(x, frame.bottom, x, frame.bottom + 4, R"(stroke="#8896a8")");
    picture.text(x, frame.bottom + 18, "middle", label, kSoft);
}

void draw_tick_upwards(Picture& picture, const Frame& frame, double y, const std::string& label) {
    picture.line(frame.left, y, frame.right, y, R"(stroke="#e4e8ed")");
    picture.text(frame.left - 7, y + 4.5, "end", label, kSoft);
}

std::string bars_svg(const std::string& title, const std::vector<Bar>& bars, double most,
                     double width) {
    constexpr double kRow = 50;
    Picture picture(width, kRow * static_cast<double>(bars.size()) + 34, title);
    const Frame frame = {.left = 12,
                         .right = width - 16,
                         .top = picture.top(),
                         .bottom = picture.top() + kRow * static_cast<double>(bars.size())};
    const Scale scale(0, most, frame.left, frame.right);
    for (const double tick : scale.ticks()) {
        picture.line(scale.at(tick), frame.top, scale.at(tick), frame.bottom,
                     R"(stroke="#e4e8ed")");
        picture.text(scale.at(tick), frame.bottom + 18, tick == 0 ? "start" : "middle",
                     number_text(tick, scale.decimals()), kSoft);
    }
    double y = frame.top;
    for (const auto& bar : bars) {
        const std::size_t room = fits(frame.right - frame.left) - characters(bar.text);
        picture.text(frame.left, y + 16, "start",
                     shortened(bar.label, std::max<std::size_t>(room, 8)));
        picture.text(frame.right, y + 16, "end", bar.text, kSoft);
        const double middle = y + 33;
        if (!std::isnan(bar.value)) {
            picture.box(frame.left, middle - 9, scale.at(bar.value) - frame.left, 18,
                        filled(bar.colour), bar.label + ": " + bar.text);
        }
        if (!std::isnan(bar.low)) {
            picture.line(scale.at(bar.low), middle, scale.at(bar.high), middle,
                         R"(stroke="#fff" stroke-width="5")");
            picture.line(scale.at(bar.low), middle, scale.at(bar.high), middle,
                         R"(stroke="#1b2733" stroke-width="2.5")");
            for (const double end : {bar.low, bar.high}) {
                picture.line(scale.at(end), middle - 5, scale.at(end), middle + 5,
                             R"(stroke="#1b2733" stroke-width="2")");
            }
        }
        y += kRow;
    }
    return picture.svg();
}

std::string columns_svg(const std::string& title, const std::vector<Bar>& bars,
                        const std::string& upwards, double width) {
    constexpr double kHeight = 170;
    Picture picture(width, kHeight + 44, title);
    const Frame frame = {.left = 52,
                         .right = width - 16,
                         .top = picture.top() + 22,
                         .bottom = picture.top() + kHeight};
    const Scale scale(0, std::max(1.0, largest(bars)), frame.bottom, frame.top);
    for (const double tick : scale.ticks()) {
        if (tick == std::floor(tick)) {
            draw_tick_upwards(picture, frame, scale.at(tick), number_text(tick, 0));
        }
    }
    draw_axes(picture, frame, "", upwards);
    const double each = (frame.right - frame.left) / static_cast<double>(bars.size());
    double x = frame.left + each / 2;
    for (const auto& bar : bars) {
        const double top = scale.at(bar.value);
        const double half = std::min(0.36 * each, 45.0);
        picture.box(x - half, top, 2 * half, frame.bottom - top, filled(bar.colour),
                    bar.label + ": " + bar.text);
        if (bar.value > 0) {
            picture.text(x, top - 4, "middle", bar.text);
        }
        double y = frame.bottom + 18;
        for (const auto& line : lines_of(bar.label, fits(each))) {
            picture.text(x, y, "middle", line, kSoft);
            y += 15;
        }
        x += each;
    }
    return picture.svg();
}

std::string pie_svg(const std::string& title, const std::vector<Bar>& parts, double width) {
    constexpr double kLine = 24;
    const double radius = std::min(70.0, width / 6);
    const double height = std::max(2 * radius, kLine * static_cast<double>(parts.size())) + 20;
    Picture picture(width, height, title);
    double all = 0;
    for (const auto& part : parts) {
        all += part.value;
    }
    const double x = 16 + radius;
    const double middle = picture.top() + height / 2 - 4;
    double begin = 0;
    double y = middle - kLine * static_cast<double>(parts.size()) / 2 + 16;
    const double left = x + radius + 24;
    for (const auto& part : parts) {
        const double end = begin + part.value / std::max(all, 1.0);
        if (part.value > 0) {
            picture.sector(
                x, middle, radius, begin, end,
                fmt::format(R"(fill="{}" stroke="#fff" stroke-width="1.5")", part.colour),
                part.label + ": " + part.text);
        }
        picture.box(left, y - 11, 13, 13, filled(part.colour));
        picture.text(left + 20, y, "start",
                     shortened(part.label, fits(width - left - 36) - characters(part.text) - 2) +
                         ": " + part.text);
        begin = end;
        y += kLine;
    }
    return picture.svg();
}

std::string areas_svg(const std::string& title, const std::vector<Bar>& areas, double width) {
    const double each = width / static_cast<double>(std::max<std::size_t>(areas.size(), 1));
    const double radius = std::min(each / 2 - 8, 96.0);
    Picture picture(width, 2 * radius + 74, title);
    const double most = largest(areas);
    const double middle = picture.top() + radius;
    double x = each / 2;
    for (const auto& area : areas) {
        if (area.value > 0) {
            picture.disc(x, middle, radius * std::sqrt(area.value / most), filled(area.colour),
                         area.label + ": " + area.text);
        }
        double y = middle + radius + 22;
        picture.text(x, y, "middle", area.text, R"(font-size="15" font-weight="600")");
        for (const auto& line : lines_of(area.label, fits(each - 6))) {
            y += 16;
            picture.text(x, y, "middle", line, kSoft);
        }
        x += each;
    }
    return picture.svg();
}

}  // namespace merl::app
