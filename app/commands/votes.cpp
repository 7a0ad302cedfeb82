#include "scan/votes/votes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/cli/control.h"
#include "app/cli/exit_status.h"
#include "app/cli/interrupt.h"
#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/output/json.h"
#include "app/output/output_directory.h"
#include "app/output/scan_record.h"
#include "app/output/votes_json.h"
#include "app/pages/votes_plots.h"
#include "app/pages/votes_report.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/text.h"
#include "engine/database/model_database.h"
#include "scan/io/csv.h"
#include "scan/io/input.h"
#include "scan/votes/exclusion.h"
#include "scan/votes/exclusion_rules.h"
#include "scan/votes/judge_file.h"
#include "scan/votes/judge_name.h"
#include "scan/votes/kit_file.h"
#include "scan/votes/reference_kit_plan.h"
#include "scan/votes/survey_file.h"
#include "scan/votes/vote_statistics.h"
#include "scan/votes/vote_tables.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

struct Options {
    std::vector<std::string> files;
    std::string selection;
    std::string kit;
    std::vector<std::string> survey;
    std::vector<std::string> exclude;
    std::string spheres;
    std::string out = "merl-scan-votes";
    scan::BootstrapOptions bootstrap{.replicates = 10'000};
    bool thesis = false;
    bool force = false;
    bool quiet = false;
};

/// What was read.
struct Inputs {
    scan::Votes votes;
    std::vector<scan::SurveyAnswer> survey;
    std::optional<ScanRecord> scanned;                   // what the selection is of
    std::map<std::string, std::string> material_hashes;  // of it, or of the kit; may be empty
    std::vector<scan::StatedRule> rules;                 // of exclusion, as the kit has them
    std::set<std::string> open_questions;                // Kit::open_questions
    std::vector<std::string> warnings;
};

/// The name of the built-in database if that was judged: whatever is published has to say so.
std::string stand_in_of(const Inputs& inputs) {
    return inputs.scanned ? inputs.scanned->stand_in() : "";
}

/// `sources` gets the names and hashes of the files.
Inputs read_inputs(const Options& options, ordered_json& sources) {
    Inputs inputs;
    const auto read = [](const std::string& path, ordered_json& place) {
        std::string text = scan::read_input(path, scan::max_trials_bytes);
        place = {{"file", as_utf8(path)}, {"content_hash", hash_of(text)}};
        return text;
    };
    const auto selection =
        scan::parse_selection(read(options.selection, sources["selection"]), options.selection);
    const auto selection_hash = sources["selection"]["content_hash"].get<std::string>();
    std::optional<scan::Kit> kit;
    if (!options.kit.empty()) {
        kit = scan::parse_kit(read(options.kit, sources["kit"]), options.kit);
        inputs.rules = kit->exclusion;
        inputs.open_questions = kit->open_questions;
    }
    auto found = find_scan_record(options.selection, "selection.csv", selection_hash, &selection);
    inputs.scanned = std::move(found.record);
    if (inputs.scanned) {
        inputs.material_hashes = inputs.scanned->material_hashes;
    }
    if (kit && !inputs.scanned) {
        inputs.warnings.push_back(
            fmt::format("{}: whether the spheres of {} show what was scanned was not checked",
                        found.why_not, kit->file));
    }
    if (kit && inputs.scanned && inputs.scanned->has_database()) {
        const auto unchecked = scan::compare_with_scan(
            *kit, {inputs.scanned->summary, inputs.scanned->kind, inputs.scanned->material_hashes});
        if (!unchecked.empty()) {
            inputs.warnings.push_back(unchecked);
        }
    }
    if (kit && inputs.material_hashes.empty()) {
        inputs.material_hashes = kit->database.material_hashes;
    }
    if (!options.spheres.empty() && inputs.material_hashes.empty()) {
        inputs.warnings.push_back(
            fmt::format("whether the images of {} show what was judged was not checked: neither a "
                        "summary beside {} nor a kit has hashes of materials",
                        options.spheres, options.selection));
    }
    std::vector<scan::VoteFile> files;
    sources["votes"] = ordered_json::array();
    for (const auto& path : options.files) {
        ordered_json source;
        const std::string text = read(path, source);
        if (scan::is_survey(text)) {
            throw InputError(
                fmt::format("{}: found {}; expected votes: a survey belongs to --survey", path,
                            scan::survey_columns));
        }
        if (scan::is_judge_file(text)) {
            auto judge = scan::parse_judge_file(text, path);
            files.push_back(std::move(judge.votes));
            inputs.survey.insert(inputs.survey.end(), judge.survey.begin(), judge.survey.end());
        } else {
            files.push_back(scan::parse_votes(text, path));
        }
        sources["votes"].push_back(source);
        throw_if_interrupted();
    }
    inputs.votes = scan::gather_votes(selection, selection_hash, kit ? &*kit : nullptr, files);
    if (!kit && inputs.scanned) {  // as `judge` has it
        inputs.votes.reference = inputs.scanned->reference;
    }
    if (!inputs.votes.reference.empty()) {
        scan::expect_reference(selection, inputs.votes.reference);
    }
    for (const auto& path : options.survey) {
        ordered_json source;
        scan::parse_survey(read(path, source), path, inputs.survey);
        sources["survey"].push_back(source);
    }
    inputs.warnings.insert(inputs.warnings.end(), inputs.votes.warnings.begin(),
                           inputs.votes.warnings.end());
    if (const auto repeated = scan::drop_repeated_answers(inputs.survey); repeated > 0) {
        inputs.warnings.push_back(
            fmt::format("--survey: {} of the same judge's, in several saves; shown once",
                        counted(repeated, "answer")));
    }
    if (const auto contrary = scan::contrary_answers(inputs.survey); contrary > 0) {
        inputs.warnings.push_back(
            fmt::format("--survey: {} beside another one of the same judge to the same question; "
                        "the pictures count every one: give only the last save",
                        counted(contrary, "answer")));
    }
    return inputs;
}

std::string p_text(double p) {
    return std::isnan(p) ? "-" : fmt::format("{:.2g}", p);
}

/// What intervals have for clusters beside judges.
std::string clusters_text(const scan::Votes& votes) {
    return votes.reference.empty() ? "materials" : "originals";
}

/// How often each label was taken for the original, alone and beside each other one.
void print_approximations(const scan::OverallVotes& o) {
    for (const auto& row : o.approximations) {
        print_result("",
                     fmt::format("{:<24}chosen {}, equal {}, not {}: {} in {}",
                                 row.other.empty() ? row.label : row.label + " beside " + row.other,
                                 fmt::group_digits(row.votes[0]), fmt::group_digits(row.votes[1]),
                                 fmt::group_digits(row.votes[2]), estimate_text(row.share),
                                 counted(row.configurations, "configuration")));
    }
}

void print_overall(const std::string& name, const scan::Votes& votes, const scan::OverallVotes& o) {
    const auto line = [&](const std::string& side, std::size_t option) {
        print_result(
            "", fmt::format("{:<24}{:>8}  {}", side, fmt::group_digits(o.sides.votes.at(option)),
                            estimate_text(o.shares.at(option))));
    };
    print_result(name, fmt::format("{} votes, {} missing", fmt::group_digits(o.sides.answered()),
                                   fmt::group_digits(o.sides.missing)));
    line(votes.first_metric + " right", 0);
    line("equal", 1);
    line(votes.second_metric + " right", 2);
    print_result("", fmt::format("majorities: {} {}, {} {}", votes.first_metric, o.first_right,
                                 votes.second_metric, o.second_right));
    print_result(
        "", fmt::format("overall p {} (judges and {} as clusters); judges {} to "
                        "{}, sign test p {}",
                        o.lead.too_few.empty() ? p_text(o.p_value) : "[too few]",
                        clusters_text(votes), o.judges_first, o.judges_second, p_text(o.judges_p)));
    if (!o.lead.too_few.empty()) {
        print_result("", fmt::format("too few for intervals: {}", o.lead.too_few));
    }
    print_approximations(o);
}

void print_significance(const scan::Votes& votes, const scan::Significance& s) {
    const auto counts = [&](const std::array<std::uint64_t, 2>& significant) {
        return fmt::format("{} {}, {} {}", votes.second_metric, significant[1], votes.first_metric,
                           significant[0]);
    };
    print_result("significant", fmt::format("of {} judged at {}, one by one: {}",
                                            counted(s.judged, "configuration"),
                                            scan::significance_level, counts(s.alone)));
    print_result(
        "", fmt::format("with Holm's correction for all {}: {}", s.configurations, counts(s.holm)));
    if (s.fewest_judges[0] && s.fewest_judges[1]) {
        print_result("",
                     fmt::format("which takes {} judges or more who all say the same, {} if one "
                                 "of them says equal",
                                 *s.fewest_judges[0], *s.fewest_judges[1]));
    }
}

void print_judges(const scan::Votes& votes, const scan::VoteStatistics& statistics) {
    const auto& shown = statistics.bias.shown.votes;
    print_result("screen sides",
                 statistics.bias.swapped == 0
                     ? fmt::format("left {}, equal {}, right {}; sides were not exchanged, so a "
                                   "side bias cannot be told from the metrics",
                                   shown[0], shown[1], shown[2])
                     : fmt::format("left {}, equal {}, right {}; sign test p {}", shown[0],
                                   shown[1], shown[2], p_text(statistics.bias.p_value)));
    if (statistics.repeats.answered > 0) {
        print_result("repeats", fmt::format("{} of {} as the first time, {}; {} the opposite",
                                            statistics.repeats.passed, statistics.repeats.answered,
                                            estimate_text(statistics.repeats.share()),
                                            statistics.repeats.opposite));
    }
    if (!statistics.sentinels_known) {
        print_result("sentinels", "their answers are in kit.json: give it with --kit");
    } else if (statistics.sentinels.answered > 0) {
        print_result("sentinels",
                     fmt::format("{} of {} failed, {} passed",
                                 statistics.sentinels.answered - statistics.sentinels.passed,
                                 statistics.sentinels.answered,
                                 estimate_text(statistics.sentinels.share())));
    }
    print_result("agreement",
                 fmt::format("Krippendorff's alpha {} (ordinal)", estimate_text(statistics.alpha)));
    if (statistics.times.count > 0) {
        print_result("response", fmt::format("median {:.1f} s, quartiles {:.1f} and {:.1f} s",
                                             statistics.times.quartiles[1] / 1000,
                                             statistics.times.quartiles[0] / 1000,
                                             statistics.times.quartiles[2] / 1000));
    }
    for (std::size_t j = 0; j < votes.judges.size(); ++j) {
        const auto& judge = statistics.judges[j];
        if (judge.trials.missing > 0) {
            print_result("missing", fmt::format("{}: {} of {} trials", votes.judges[j].name,
                                                judge.trials.missing, votes.trials));
        }
    }
}

/// All figures of some judges' votes.
void print_figures(const scan::Votes& votes, const scan::VoteStatistics& statistics) {
    print_overall("selection", votes, statistics.selection);
    if (statistics.random) {
        print_overall("random", votes, *statistics.random);
    }
    print_significance(votes, statistics.significance);
    print_judges(votes, statistics);
}

/// What was made of the votes.
struct Results {
    scan::VoteStatistics all;
    scan::Exclusion exclusion;
    bool has_rules = false;     // of exclusion, stated beforehand
    scan::Votes kept_votes;     // without the excluded judges
    scan::VoteStatistics kept;  // the figures of these

    bool excludes_all() const {
        return has_rules && exclusion.excluded() == exclusion.judges.size();
    }
};

std::string rules_text(const scan::Exclusion& exclusion) {
    std::vector<std::string> texts;
    std::ranges::transform(exclusion.rules, std::back_inserter(texts), [](const auto& rule) {
        return scan::text_of(rule) + (rule.of_kit ? " (kit.json)" : "");
    });
    return fmt::format("{}", fmt::join(texts, ", "));
}

/// What looks wrong about judges, whatever the rules are.
void print_doubts(const scan::Votes& votes, const scan::VoteStatistics& statistics) {
    std::string_view name = "looks wrong";
    for (std::size_t j = 0; j < votes.judges.size(); ++j) {
        for (const auto& doubt : statistics.judges[j].doubts) {
            print_result(name, fmt::format("{} {}", votes.judges[j].name, doubt));
            name = "";
        }
    }
}

/// Who falls under which rule, and the figures without them.
void print_exclusion(const scan::Votes& votes, const Results& results) {
    const auto& exclusion = results.exclusion;
    print_result("excluded", fmt::format("{} of {}, by {}", exclusion.excluded(),
                                         counted(votes.judges.size(), "judge"),
                                         exclusion.rules.empty() ? "no rule that can be applied"
                                                                 : rules_text(exclusion)));
    for (std::size_t j = 0; j < votes.judges.size(); ++j) {
        for (const auto& finding : exclusion.judges[j]) {
            print_result("", fmt::format("{}: {} ({})", votes.judges[j].name, finding.text,
                                         scan::name_of(finding.rule)));
        }
    }
    for (const auto& text : exclusion.not_assessed) {
        print_result("", text);
    }
    if (exclusion.excluded() > 0 && !results.excludes_all()) {
        print_result(
            "without them",
            fmt::format("the figures of {}", counted(results.kept_votes.judges.size(), "judge")));
        print_figures(results.kept_votes, results.kept);
    }
}

void print_summary(const Options& options, const Inputs& inputs, const Results& results) {
    const auto& votes = inputs.votes;
    print_result("judges", fmt::format("{}, {} trials each{}", votes.judges.size(),
                                       fmt::group_digits(votes.trials),
                                       votes.with_kit ? "" : "; not checked against a kit"));
    if (const auto stand_in = stand_in_of(inputs); !stand_in.empty()) {
        print_result("database", stand_in);
    }
    print_result("metrics", fmt::format("{}, {}", votes.first_metric, votes.second_metric));
    if (!votes.reference.empty()) {
        print_result("question", reference_question(votes.reference));
    }
    print_figures(votes, results.all);
    print_doubts(votes, results.all);
    if (results.has_rules) {
        print_exclusion(votes, results);
    }
    print_result("intervals",
                 fmt::format("95 %, judges and {} as clusters; of alpha: {} bootstrap "
                             "samples, seed {}",
                             clusters_text(votes), fmt::group_digits(options.bootstrap.replicates),
                             options.bootstrap.seed));
    print_result("results", options.out + ": open votes.html in a browser");
}

/// Applies the rules, and computes all figures with and without whom they exclude. `inputs` gets a
/// warning for each rule that could not be applied.
Results results_of(Inputs& inputs, const std::vector<scan::StatedRule>& of_command_line,
                   const scan::BootstrapOptions& bootstrap, const pipeline::Control& control) {
    Results results;
    const auto rules = scan::merge_rules(inputs.rules, of_command_line);
    results.has_rules = !rules.empty();
    results.all = scan::vote_statistics(inputs.votes, bootstrap, control.stage("bootstrap"));
    results.exclusion = scan::apply_rules(inputs.votes, results.all, rules);
    for (const auto& text : results.exclusion.not_applied) {
        inputs.warnings.push_back("cannot be applied: the rule " + text);
    }
    results.kept_votes = scan::without_excluded(inputs.votes, results.exclusion);
    results.kept = results.exclusion.excluded() == 0
                       ? results.all
                       : scan::vote_statistics(results.kept_votes, bootstrap,
                                               control.stage("bootstrap without the excluded"));
    return results;
}

/// Throws InputError where nobody is left: there are no figures without the excluded judges.
void expect_judges(const Results& results) {
    if (results.excludes_all()) {
        throw InputError(fmt::format(
            "every judge falls under a rule of exclusion ({}), so that there are no figures "
            "without them; expected one judge or more who does not",
            rules_text(results.exclusion)));
    }
}

/// The answers that there are pictures of: what judges wrote themselves might say who they are.
std::vector<scan::SurveyAnswer> drawn_answers(const Inputs& inputs) {
    auto survey = inputs.survey;
    std::erase_if(survey, [&](const scan::SurveyAnswer& answer) {
        return inputs.open_questions.contains(answer.question);
    });
    return survey;
}

/// The pictures without the excluded judges, if there are any of either.
std::vector<VotesPlot> kept_plots(const Inputs& inputs, const Results& results) {
    if (results.exclusion.excluded() == 0 || results.excludes_all()) {
        return {};
    }
    std::set<std::wstring> excluded;
    for (std::size_t j = 0; j < inputs.votes.judges.size(); ++j) {
        if (results.exclusion.is_excluded(j)) {
            excluded.insert(scan::judge_identity(inputs.votes.judges[j].name));
        }
    }
    auto survey = drawn_answers(inputs);
    std::erase_if(survey, [&](const scan::SurveyAnswer& answer) {
        return excluded.contains(scan::judge_identity(answer.judge));
    });
    return votes_plots(results.kept_votes, results.kept, survey,
                       fmt::format(" ({} of {})", results.kept_votes.judges.size(),
                                   counted(inputs.votes.judges.size(), "judge")));
}

int print_thesis(const Options& options, const std::vector<scan::StatedRule>& rules) {
    ordered_json sources;
    auto inputs = read_inputs(options, sources);
    const auto results = results_of(inputs, rules, {.replicates = 0}, {});
    std::ranges::for_each(inputs.warnings, print_warning);
    print_lines(scan::thesis_table(inputs.votes, results.all));
    if (results.has_rules) {
        const auto& exclusion = results.exclusion;
        print_lines(fmt::format("\nwithout {} of {}, by {}\n{}", exclusion.excluded(),
                                counted(inputs.votes.judges.size(), "judge"), rules_text(exclusion),
                                scan::thesis_table(results.kept_votes, results.kept)));
    }
    expect_judges(results);
    return kSuccess;
}

int run(const Options& options) {
    std::vector<scan::StatedRule> rules;
    std::ranges::transform(options.exclude, std::back_inserter(rules), scan::parse_rule);
    if (options.thesis) {
        return print_thesis(options, rules);
    }
    std::vector<std::filesystem::path> read = {options.selection, options.kit};
    read.insert(read.end(), options.files.begin(), options.files.end());
    read.insert(read.end(), options.survey.begin(), options.survey.end());
    Inputs inputs;
    Results results;
    ordered_json images;
    ordered_json summary = program_json();
    OutputDirectory out(
        options.out, options.force,
        {{.name = "configurations.csv",
          .write =
              [&](int file) {
                  scan::write_configuration_votes(file, inputs.votes, results.all,
                                                  results.has_rules ? &results.kept : nullptr);
              }},
         {.name = "judges.csv",
          .write =
              [&](int file) {
                  scan::write_judge_votes(file, inputs.votes, results.all, results.exclusion);
              }},
         {.name = "judgements.csv",
          .write = [&](int file) { scan::write_judgements(file, inputs.votes, results.all); },
          .is_read_again = true},
         {.name = "judgements_kept.csv",
          .write = [&](int file) { scan::write_judgements(file, inputs.votes, results.kept); },
          .is_read_again = true},
         {.name = "survey.csv",
          .write = [&](int file) { scan::write_survey(file, inputs.survey); }},
         {.name = "votes.html",
          .write =
              [&](int file) {
                  ordered_json shown = summary;
                  shown["stand_in"] = stand_in_of(inputs);
                  scan::write_all(file, votes_report(shown, inputs.survey, images,
                                                     votes_plots(inputs.votes, results.all,
                                                                 drawn_answers(inputs)),
                                                     kept_plots(inputs, results)));
              }},
         {.name = "summary.json",
          .write =
              [&](int file) {
                  if (inputs.scanned) {  // not for the page: where the database is concerns nobody
                                         // else
                      summary.update(inputs.scanned->source);
                  }
                  summary["files"] = texts_json(out.hashes());
                  scan::write_all(file, json_text(summary));
              }}},
        read);
    inputs = read_inputs(options, summary);
    images = sphere_images(inputs.votes, options.spheres, inputs.material_hashes, inputs.warnings);
    TerminalControl terminal(options.quiet);
    results = results_of(inputs, rules, options.bootstrap, terminal.control());
    terminal.clear();
    std::ranges::for_each(inputs.warnings, print_warning);
    summary["warnings"] = texts_json(inputs.warnings);
    summary["kit_hash"] = as_utf8(inputs.votes.kit_hash);
    summary["bootstrap"] = {{"replicates", options.bootstrap.replicates},
                            {"seed", options.bootstrap.seed},
                            {"interval", "percentile, 95 %"},
                            {"of", "krippendorff_alpha"}};
    summary["figures"] = votes_json(inputs.votes, results.all);
    summary["exclusion"] = ordered_json();
    if (results.has_rules) {
        summary["exclusion"] = exclusion_json(inputs.votes, results.exclusion);
        summary["exclusion"]["figures"] = votes_json(results.kept_votes, results.kept);
    }
    out.finish();
    if (!options.quiet) {
        print_summary(options, inputs, results);
    }
    expect_judges(results);
    return kSuccess;
}

}  // namespace

void add_votes(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<Options>();
    auto* command = program.add_subcommand("votes", "What the votes of judges prove");
    command
        ->add_option("files", options->files, "The votes that the kit's page saved, a file a judge")
        ->required()
        ->transform(not_empty());
    add_selection_option(*command, options->selection, "that was judged")->required();
    command
        ->add_option(
            "--kit", options->kit,
            "kit.json of the kit: what every judge was to be shown, and what the answers to "
            "sentinels are")
        ->transform(not_empty());
    command
        ->add_option("--survey", options->survey,
                     "The survey answers that the page saved, a file a judge")
        ->transform(not_empty());
    command
        ->add_option("--spheres", options->spheres,
                     "A directory of sphere images, MATERIAL.png, to show in the report")
        ->transform(not_empty());
    command
        ->add_option("--exclude", options->exclude,
                     "RULE=VALUE, more than once: report every figure also without the judges who "
                     "fall under one of these rules, beside those of kit.json: "
                     "sentinels_failed=N or more, "
                     "repeats_below=FRACTION answered as the first time, "
                     "median_time_below=SECONDS, same_key_above=FRACTION of the answers, "
                     "calibration_failed=true")
        ->transform(not_empty());
    auto* out = add_output_options(*command, options->out, options->force);
    command
        ->add_flag("--thesis", options->thesis, "Print the table of the thesis and write nothing")
        ->excludes(out);
    add_bootstrap_options(*command, options->bootstrap);
    add_quiet_option(*command, options->quiet, "No summary");
    command->footer(
        "Writes configurations.csv, judges.csv, judgements.csv (for score --judgements), "
        "judgements_kept.csv\n"
        "(the same without the excluded judges), survey.csv, votes.html and summary.json "
        "(docs/experiment.md).\n"
        "Where rules exclude every judge that is an error (exit status 3); all files are written "
        "first.\n"
        "\n"
        "Examples:\n"
        "  merl-scan votes kit-votes/votes-*.csv --selection results/selection.csv --kit "
        "kit/kit.json \\\n"
        "      --exclude sentinels_failed=2 --exclude median_time_below=1.5\n"
        "  merl-scan votes kit-votes/votes-*.csv --selection results/selection.csv --thesis");
    command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace merl::app
