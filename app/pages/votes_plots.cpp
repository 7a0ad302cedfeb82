#include "app/pages/votes_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "app/pages/plot.h"

namespace merl::app {
namespace {

constexpr double kWide = 720;
constexpr double kNarrow = 320;
constexpr std::size_t kMostQuestions = 100;  // that are drawn
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// For the first metric, equal, for the second.
constexpr std::array<std::string_view, 3> kSides = {"#c2410c", "#a9b4c2", "#2b6cb0"};

std::string percent(double share) {
    return fmt::format("{:.1f} %", 100 * share);
}

/// "0.0041", "2.1e−7".
std::string p_text(double p) {
    if (p >= 0.0001) {
        return fmt::format("{:.4f}", p);
    }
    const auto exponent = static_cast<int>(std::floor(std::log10(std::max(p, 1e-300))));
    return fmt::format("{:.1f}e−{}", p / std::pow(10.0, exponent), -exponent);
}

std::string configuration_text(const scan::JudgedConfiguration& c) {
    const auto& m = c.materials;
    return fmt::format("{}: {} | {} against {} | {}", c.number, m[0], m[1], m[2], m[3]);
}

// ---- votes

std::string judgement_summary(const scan::Votes& votes, const scan::OverallVotes& overall,
                              const std::string& of, double width) {
    const auto all = static_cast<double>(overall.sides.answered());
    std::vector<Bar> areas;
    for (std::size_t i = 0; i < 3; ++i) {
        const auto n = overall.sides.votes.at(i);
        const auto& metric = i == 0 ? votes.first_metric : votes.second_metric;
        areas.push_back(
            {fmt::format("option {}: {}", i + 1, i == 1 ? "equal" : fmt::format("for {}", metric)),
             static_cast<double>(n),
             all > 0 ? fmt::format("{} ({})", fmt::group_digits(n),
                                   percent(static_cast<double>(n) / all))
                     : "0",
             kSides.at(i), kNone, kNone});
    }
    return areas_svg("Votes on the selection" + of, areas, width);
}

std::string shares(const scan::Votes& votes, const scan::OverallVotes& overall,
                   const std::string& of, double width) {
    std::vector<Bar> bars;
    for (std::size_t i = 0; i < 3; ++i) {
        const auto& share = overall.shares.at(i);
        std::string text = std::isnan(share.value) ? "–" : percent(share.value);
        if (!std::isnan(share.interval.low)) {
            text += fmt::format(" [{:.1f}, {:.1f}]", 100 * share.interval.low,
                                100 * share.interval.high);
        }
        const auto& metric = i == 0 ? votes.first_metric : votes.second_metric;
        bars.push_back({i == 1 ? "equal" : metric + " is right", 100 * share.value, std::move(text),
                        kSides.at(i), 100 * share.interval.low, 100 * share.interval.high});
    }
    return bars_svg("Percent of the votes, with 95 % intervals" + of, bars, 100, width);
}

std::string p_values(const scan::Votes& votes, const scan::VoteStatistics& statistics,
                     const std::string& of, double width) {
    struct Point {
        double p;
        std::size_t side;
        std::uint32_t configuration;
    };
    std::vector<Point> points;
    for (const auto& row : statistics.configurations) {
        const auto kind = votes.configurations[row.configuration].kind;
        if (kind == scan::TrialKind::selection && !std::isnan(row.p_second)) {
            points.push_back({std::min(row.p_first, row.p_second),
                              row.p_second <= row.p_first ? 2U : 0U, row.configuration});
        }
    }
    std::ranges::stable_sort(points, {}, &Point::p);
    Picture picture(width, 300,
                    "Configuration by configuration: p-values, the smallest first" + of);
    const Frame frame = {
        .left = 64, .right = width - 16, .top = picture.top() + 22, .bottom = picture.top() + 250};
    const double needed = statistics.significance.least_p_needed;
    double least = needed / 2;
    for (const auto& point : points) {
        least = std::min(least, point.p / 2);
    }
    const Scale scale(std::log10(std::max(least, 1e-300)), 0, frame.bottom, frame.top);
    const auto at = [&](double p) { return scale.at(std::log10(std::max(p, 1e-300))); };
    for (const double exponent : scale.ticks()) {
        if (exponent == std::floor(exponent)) {
            draw_tick_upwards(picture, frame, scale.at(exponent),
                              exponent > -4 ? fmt::format("{:g}", std::pow(10.0, exponent))
                                            : fmt::format("1e−{:.0f}", -exponent));
        }
    }
    const auto room = static_cast<std::size_t>((width / 2 - 42) / kCharacter);
    double x = 12;
    for (const auto& [side, metric] :
         {std::pair(2U, votes.second_metric), {0U, votes.first_metric}}) {
        const auto text = shortened("for " + metric, room);
        picture.disc(x + 5, picture.top() + 7, 4, fmt::format(R"(fill="{}")", kSides.at(side)));
        picture.text(x + 14, picture.top() + 11, "start", text, R"(fill="#56657a")");
        x += 30 + kCharacter * static_cast<double>(characters(text));
    }
    draw_axes(picture, frame, "configurations", "p-value");
    const auto configurations = statistics.significance.configurations;
    for (const auto& [value, name] :
         {std::pair(scan::significance_level, fmt::format("{}", scan::significance_level)),
          std::pair(needed, fmt::format("{} / {}, Holm’s first", scan::significance_level,
                                        configurations))}) {
        picture.line(frame.left, at(value), frame.right, at(value),
                     R"(stroke="#1b2733" stroke-dasharray="5 4")");
        picture.text(frame.right, at(value) - 5, "end", name, R"(fill="#56657a")");
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto& point = points[i];
        const double place = (static_cast<double>(i) + 0.5) / static_cast<double>(points.size());
        picture.disc(
            frame.left + place * (frame.right - frame.left), at(point.p),
            points.size() > 300 ? 2 : 3.5, fmt::format(R"(fill="{}")", kSides.at(point.side)),
            fmt::format("{}, p {}", configuration_text(votes.configurations[point.configuration]),
                        p_text(point.p)));
    }
    return picture.svg();
}

std::string agreement(const scan::Votes& votes, const scan::VoteStatistics& statistics,
                      const std::string& of, double width) {
    double most = 0;
    bool has_random = false;
    std::vector<const scan::ConfigurationVotes*> points;
    for (const auto& row : statistics.configurations) {
        const auto& c = votes.configurations[row.configuration];
        if (c.agreement && row.sides.answered() > 0) {
            most = std::max(most, *c.agreement);
            has_random = has_random || c.kind == scan::TrialKind::random;
            points.push_back(&row);
        }
    }
    Picture picture(width, 310, "Votes against the agreement of the metrics" + of);
    const Frame frame = {.left = 64,
                         .right = width - 16,
                         .top = picture.top() + (has_random ? 32 : 8),
                         .bottom = picture.top() + 262};
    const Scale across(0, most > 0 ? 1.05 * most : 1, frame.left, frame.right);
    const Scale upwards(0, 1, frame.bottom, frame.top);
    for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
        draw_tick_upwards(picture, frame, upwards.at(share), fmt::format("{} %", 100 * share));
    }
    for (const double tick : across.ticks()) {
        draw_tick_across(picture, frame, across.at(tick), number_text(tick, across.decimals()));
    }
    draw_axes(picture, frame, "agreement of the metrics", "votes for " + votes.second_metric);
    if (has_random) {
        picture.disc(frame.left + 5, picture.top() + 9, 4,
                     R"(fill="none" stroke="#2b6cb0" stroke-width="1.5")");
        picture.text(frame.left + 14, picture.top() + 13, "start", "random disagreements",
                     R"(fill="#56657a")");
    }
    for (const auto* row : points) {
        const auto& c = votes.configurations[row->configuration];
        const auto& v = row->sides.votes;
        const double share = (static_cast<double>(v[2]) + static_cast<double>(v[1]) / 2) /
                             static_cast<double>(row->sides.answered());
        picture.disc(across.at(*c.agreement), upwards.at(share), 4,
                     c.kind == scan::TrialKind::random
                         ? R"(fill="none" stroke="#2b6cb0" stroke-width="1.5")"
                         : R"(fill="#2b6cb0" fill-opacity="0.45" stroke="#2b6cb0")",
                     configuration_text(c));
    }
    return picture.svg();
}

// ---- survey

/// A question of the kit's page, and the answers that it offers.
struct Question {
    std::string_view name;
    std::string_view text;
    std::vector<std::string_view> answers;
};

const std::vector<Question>& known_questions() {
    static const std::vector<Question> questions = {
        {"instructions_clear", "Were the instructions clear?", {"yes", "no"}},
        {"change_clear", "Was it clear which kind of change to look for?", {"yes", "no"}},
        {"look_clear", "Was it clear what to look for?", {"yes", "no"}},
        {"preferred_question",
         "Which change would you rather look for?",
         {"smaller", "larger", "either"}},
        {"frequency", "How often did the spheres change?", {"too slow", "about right", "too fast"}},
        {"sphere_size", "How large were the spheres?", {"too small", "about right", "too large"}},
        {"keys_easy",
         "The keys were easy to use: 1 strongly disagree, 5 strongly agree",
         {"1", "2", "3", "4", "5"}},
        {"vision_impairment", "Do you have a vision impairment?", {"no", "corrected", "yes"}}};
    return questions;
}

/// How many judges gave each answer, those that the page offers first.
struct Answers {
    std::string text;
    std::vector<std::pair<std::string, std::size_t>> counts;
    std::size_t none = 0;  ///< judges who gave none
};

/// Whether an answer is a step of a scale, 0 to 10.
bool is_step(const std::string& answer) {
    return (answer.size() == 1 && answer[0] >= '0' && answer[0] <= '9') || answer == "10";
}

/// The answers to a question where they can be counted: not what judges wrote in their own words.
std::optional<Answers> answers_to(const std::string& question,
                                  const std::vector<std::string_view>& given_answers) {
    const auto known = std::ranges::find(known_questions(), question, &Question::name);
    const bool is_known = known != known_questions().end();
    Answers answers;
    answers.text = question;
    std::ranges::replace(answers.text, '_', ' ');
    std::map<std::string, std::size_t> counts;
    for (const auto& answer : given_answers) {
        ++counts[std::string(answer)];
    }
    answers.none = counts[""];
    const std::size_t given = given_answers.size() - answers.none;
    counts.erase("");
    if (is_known) {
        answers.text = known->text;
        for (const auto& answer : known->answers) {
            answers.counts.emplace_back(answer, counts[std::string(answer)]);
            counts.erase(std::string(answer));
        }
    }
    const bool own_words =
        !is_known && (question == "comments" || counts.size() == given || counts.size() > 6);
    const bool steps = !counts.empty() && std::ranges::all_of(counts, [](const auto& count) {
        return is_step(count.first);
    });
    if (given == 0 || (own_words && !steps)) {
        return std::nullopt;
    }
    if (steps && !is_known) {  // also those that nobody chose
        int last = 0;
        for (const auto& count : counts) {
            last = std::max(last, std::stoi(count.first));
        }
        for (int step = counts.contains("0") ? 0 : 1; step <= last; ++step) {
            answers.counts.emplace_back(fmt::format("{}", step), counts[fmt::format("{}", step)]);
        }
        counts.clear();
    }
    answers.counts.insert(answers.counts.end(), counts.begin(), counts.end());
    return answers;
}

std::string survey_svg(const Answers& answers, const std::string& of, double width) {
    const bool steps =
        std::ranges::all_of(answers.counts, [](const auto& count) { return is_step(count.first); });
    std::vector<Bar> bars;
    for (const auto& [answer, count] : answers.counts) {
        const auto colour = steps ? kSides[2] : kPalette.at(bars.size() % kPalette.size());
        bars.push_back(
            {answer, static_cast<double>(count), fmt::format("{}", count), colour, kNone, kNone});
    }
    if (answers.none > 0) {
        bars.push_back({"no answer", static_cast<double>(answers.none),
                        fmt::format("{}", answers.none), kSides[1], kNone, kNone});
    }
    return steps ? columns_svg(answers.text + of, bars, "judges", width)
                 : pie_svg(answers.text + of, bars, width);
}

/// A name of a file, of letters that every system takes.
std::string file_name(const std::string& question) {
    std::string name = "survey-";
    for (const char c : question.substr(0, 60)) {
        const bool plain =
            (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
        name += plain ? c : '-';
    }
    return name;
}

}  // namespace

std::vector<VotesPlot> votes_plots(const scan::Votes& votes, const scan::VoteStatistics& statistics,
                                   const std::vector<scan::SurveyAnswer>& survey,
                                   const std::string& of) {
    std::vector<VotesPlot> plots;
    const auto add = [&](const std::string& name, double wide,
                         const std::function<std::string(double width)>& draw) {
        plots.push_back({name, draw(wide), draw(kNarrow)});
    };
    add("judgement-summary", kWide,
        [&](double width) { return judgement_summary(votes, statistics.selection, of, width); });
    add("shares", kWide,
        [&](double width) { return shares(votes, statistics.selection, of, width); });
    add("p-values", kWide, [&](double width) { return p_values(votes, statistics, of, width); });
    add("agreement", kWide, [&](double width) { return agreement(votes, statistics, of, width); });
    std::map<std::string_view, std::vector<std::string_view>> questions;
    std::vector<std::string_view> order;
    for (const auto& [judge, question, answer] : survey) {
        auto& answers = questions[question];
        if (answers.empty() && order.size() < kMostQuestions) {
            order.push_back(question);
        }
        answers.push_back(answer);
    }
    for (const auto question : order) {
        const std::string name(question);
        if (const auto answers = answers_to(name, questions[question])) {
            add(file_name(name), kWide / 2,
                [&](double width) { return survey_svg(*answers, of, width); });
        }
    }
    return plots;
}

}  // namespace merl::app
