#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace merl::app {

// Pictures of numbers as SVG that needs nothing else: no style sheet, no font, no script. All
// lengths are pixels. Texts of users go through text() and tooltips, which make them harmless.

/// About the width of a character of text in a picture.
inline constexpr double kCharacter = 7;

/// Colours that people with any colour vision tell apart (Okabe and Ito).
inline constexpr std::array<std::string_view, 6> kPalette = {"#0072B2", "#E69F00", "#009E73",
                                                             "#CC79A7", "#56B4E9", "#D55E00"};

/// How many characters a text has.
std::size_t characters(std::string_view utf8);

/// The first `most` characters, the last of them an ellipsis when some are missing.
std::string shortened(const std::string& utf8, std::size_t most);

/// A number as print has it.
std::string number_text(double value, int decimals);

/// Where numbers from `low` to `high` are between two places, and which of them have a tick.
/// Numbers beyond are at the end.
class Scale {
  public:
    /// With a share of the range as a margin at either end.
    Scale(double low, double high, double from, double to, double margin = 0);

    double at(double value) const;
    std::vector<double> ticks() const;
    int decimals() const;  ///< of the ticks

  private:
    double low_;
    double high_;
    double from_;
    double to_;
    double step_;
};

/// What is drawn in a picture, one after another.
class Picture {
  public:
    /// With the title on top, in lines as long as there is room.
    Picture(double width, double height, const std::string& title);

    double width() const { return width_; }

    /// Below the title.
    double top() const { return top_; }

    // `style` is attributes of SVG: fill="#fff" ...

    void line(double x1, double y1, double x2, double y2, std::string_view style);
    void box(double x, double y, double width, double height, std::string_view style,
             const std::string& tooltip = {});
    void disc(double x, double y, double radius, std::string_view style,
              const std::string& tooltip = {});
    /// A sector of a disc between two shares of the turn, clockwise from the top.
    void sector(double x, double y, double radius, double from, double to, std::string_view style,
                const std::string& tooltip = {});
    /// `anchor`: start, middle or end.
    void text(double x, double y, std::string_view anchor, const std::string& text,
              std::string_view style = {});

    /// Text upwards, its middle at a place.
    void text_upwards(double x, double y, const std::string& text);

    std::string svg() const;

  private:
    double width_;
    double height_;
    double top_ = 10;
    std::string title_;
    std::string content_;
};

/// The room of a plot within a picture.
struct Frame {
    double left;
    double right;
    double top;
    double bottom;
};

/// The two axes, with their names.
void draw_axes(Picture& picture, const Frame& frame, const std::string& across,
               const std::string& upwards);

/// A tick of the axis below, or of the one on the left with a line across the plot.
void draw_tick_across(Picture& picture, const Frame& frame, double x, const std::string& label);
void draw_tick_upwards(Picture& picture, const Frame& frame, double y, const std::string& label);

/// One bar of a bar chart.
struct Bar {
    std::string label;
    double value;      ///< not a number: there is none
    std::string text;  ///< the value as one reads it
    std::string_view colour;
    double low;  ///< of its interval; not a number: there is none
    double high;
};

/// Bars from 0 to the right, one below the other, with their intervals, on a scale up to `most`.
std::string bars_svg(const std::string& title, const std::vector<Bar>& bars, double most,
                     double width);

/// Bars upwards, side by side, that count something.
std::string columns_svg(const std::string& title, const std::vector<Bar>& bars,
                        const std::string& upwards, double width);

/// A pie of counts, each with its label and count beside it.
std::string pie_svg(const std::string& title, const std::vector<Bar>& parts, double width);

/// Discs side by side whose areas are as their values.
std::string areas_svg(const std::string& title, const std::vector<Bar>& areas, double width);

}  // namespace merl::app
