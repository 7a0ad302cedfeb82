#include "scan/votes/votes.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/text.h"
#include "scan/io/input.h"
#include "scan/votes/judge_name.h"

namespace merl::scan {
namespace {

using Trial = std::pair<std::uint64_t, bool>;  // number of a configuration, whether it is repeated

std::string text_of(const FourMaterials& m) {
    return fmt::format("{} | {} against {} | {}", m[0], m[1], m[2], m[3]);
}

/// The configurations and trials of the experiment, as they become known.
class Experiment {
  public:
    Experiment(const SelectionFile& selection, const Kit* kit) : selection_(selection), kit_(kit) {
        for (std::size_t i = 0; i < selection.configurations.size() && kit == nullptr; ++i) {
            const auto& row = selection.configurations[i];
            add({.number = i + 1,
                 .kind = TrialKind::selection,
                 .materials = row.materials,
                 .agreement = row.agreement,
                 .expected = 0},
                false);
        }
        if (kit != nullptr) {
            add_kit(*kit);
        }
    }

    /// Takes a row of a judge's file; without a kit it may bring a new configuration.
    void take(const VoteFile& file, const TrialRow& row) {
        const auto fail = [&](const std::string& what) {
            throw InputError(fmt::format("{}, line {}: {}", file.file, row.line, what));
        };
        const bool repeat = row.kind == TrialKind::repeat;
        const FourMaterials materials = row.swapped ? swapped_sides(row.shown) : row.shown;
        if (kit_ == nullptr && !repeat && row.kind != TrialKind::selection &&
            row.configuration > selection_.configurations.size()) {
            add({.number = row.configuration,
                 .kind = row.kind,
                 .materials = materials,
                 .agreement = std::nullopt,
                 .expected = 0},
                false);
        }
        const auto found = configurations_.find(row.configuration);
        if (found == configurations_.end() || (!repeat && found->second.kind != row.kind)) {
            fail(fmt::format("configuration: found {} as {}; expected one of {}", row.configuration,
                             kind_name(row.kind), kit_ != nullptr ? kit_->file : selection_.file));
        }
        if (kit_ != nullptr && !trials_.contains({row.configuration, repeat})) {
            fail(fmt::format("found a {} of configuration {}, which {} does not have",
                             kind_name(row.kind), row.configuration, kit_->file));
        }
        if (!same_sides(materials, found->second.materials)) {
            fail(fmt::format("found {} with swapped {}; expected configuration {}, {}",
                             text_of(row.shown), row.swapped ? 1 : 0, row.configuration,
                             text_of(found->second.materials)));
        }
        trials_.emplace(row.configuration, repeat);
    }

    const std::set<Trial>& trials() const { return trials_; }

    std::vector<JudgedConfiguration> configurations() const {
        std::vector<JudgedConfiguration> list;
        for (const bool of_selection : {true, false}) {
            for (const auto& [number, configuration] : configurations_) {
                if ((configuration.kind == TrialKind::selection) == of_selection) {
                    list.push_back(configuration);
                }
            }
        }
        return list;
    }

  private:
    void add(const JudgedConfiguration& configuration, bool repeat) {
        configurations_.emplace(configuration.number, configuration);
        trials_.emplace(configuration.number, repeat);
    }

    void add_kit(const Kit& kit) {
        const auto fail = [&](std::uint64_t number, std::string_view what) {
            throw InputError(fmt::format("{}: configuration {} {}", kit.file, number, what));
        };
        for (const auto& trial : kit.trials) {
            if (trial.kind == TrialKind::repeat) {
                continue;
            }
            if (configurations_.contains(trial.configuration)) {
                fail(trial.configuration, "is there as two kinds; expected one");
            }
            if (trial.kind == TrialKind::selection &&
                (trial.configuration > selection_.configurations.size() ||
                 !same_sides(trial.materials,
                             selection_.configurations[trial.configuration - 1].materials))) {
                fail(trial.configuration, fmt::format("is not that of {}", selection_.file));
            }
            add({.number = trial.configuration,
                 .kind = trial.kind,
                 .materials = trial.materials,
                 .agreement = trial.agreement,
                 .expected = trial.expected},
                false);
            if (trial.kind == TrialKind::selection) {
                configurations_.at(trial.configuration).agreement =
                    selection_.configurations[trial.configuration - 1].agreement;
            }
        }
        for (const auto& trial : kit.trials) {
            if (trial.kind == TrialKind::repeat) {
                const auto known = configurations_.find(trial.configuration);
                if (known == configurations_.end() ||
                    !same_sides(trial.materials, known->second.materials)) {
                    fail(trial.configuration, "is repeated, but is not that of another trial");
                }
                trials_.emplace(trial.configuration, true);
            }
        }
    }

    const SelectionFile& selection_;
    const Kit* kit_;
    std::map<std::uint64_t, JudgedConfiguration> configurations_;
    std::set<Trial> trials_;
};

void check_kit(const SelectionFile& selection, const std::string& selection_hash, const Kit& kit) {
    if (kit.first_metric != as_utf8(selection.first_metric) ||
        kit.second_metric != selection.second_metric) {
        throw InputError(
            fmt::format("{}: found the metrics {} and {}; expected {} and {}, as in {}", kit.file,
                        kit.first_metric, kit.second_metric, selection.first_metric,
                        selection.second_metric, selection.file));
    }
    if (kit.selection_hash != selection_hash) {
        throw InputError(
            fmt::format("{}: was made from a selection with the hash {}; expected {}, "
                        "that of {}",
                        kit.file, kit.selection_hash, selection_hash, selection.file));
    }
}

/// Whether one of two saves of a judge has an answer that the other has not. Throws InputError
/// where both have a trial and it is not the same.
bool has_more(const VoteFile& one, const VoteFile& other) {
    std::map<std::pair<std::uint64_t, TrialKind>, const TrialRow*> trials;
    for (const auto& row : other.rows) {
        trials[{row.configuration, row.kind}] = &row;
    }
    bool more = false;
    for (const auto& row : one.rows) {
        const auto found = trials.find({row.configuration, row.kind});
        if (found == trials.end()) {
            more = more || row.vote != 0;
            continue;
        }
        const auto& same = *found->second;
        const bool contrary = row.vote != 0 && same.vote != 0 &&
                              (row.vote != same.vote || row.response_ms != same.response_ms);
        if (contrary || row.trial != same.trial || row.swapped != same.swapped ||
            row.shown != same.shown) {
            throw InputError(fmt::format(
                "{}, line {}: is not what {}, line {}, says of the same trial of \"{}\"; expected "
                "one judge's votes once: give only the last save, or two judges two names",
                one.file, row.line, other.file, same.line, other.judge));
        }
        more = more || (row.vote != 0 && same.vote == 0);
    }
    return more;
}

/// The files of the same kit, one a judge; says in `warnings` which others there were.
std::vector<const VoteFile*> counted_files(const Kit* kit, std::span<const VoteFile> files,
                                           std::vector<std::string>& warnings) {
    std::vector<const VoteFile*> counted;
    std::map<std::wstring, std::size_t> judges;  // where in `counted`
    for (const auto& file : files) {
        const std::string& expected = kit != nullptr ? kit->kit_hash : files[0].kit_hash;
        if (file.kit_hash != expected) {
            throw InputError(fmt::format(
                "{}: found votes on the kit {}; expected {}, as in {} (votes on different kits "
                "cannot be put together)",
                file.file, file.kit_hash, expected, kit != nullptr ? kit->file : files[0].file));
        }
        const auto [place, added] = judges.emplace(judge_identity(file.judge), counted.size());
        if (added) {
            counted.push_back(&file);
            continue;
        }
        const VoteFile*& other = counted[place->second];
        const bool more = has_more(file, *other);
        const bool less = has_more(*other, file);
        if (more && less) {
            throw InputError(fmt::format(
                "{}: has answers of \"{}\" that {} has not, and lacks some that it has; expected "
                "one judge's votes once: give the save that has all",
                file.file, file.judge, other->file));
        }
        const auto& kept = more ? file : *other;
        const auto& dropped = more ? *other : file;
        warnings.push_back(
            more || less ? fmt::format("{}: is an earlier save of the votes of \"{}\", all of "
                                       "which {} has; only that one is counted",
                                       dropped.file, dropped.judge, kept.file)
                         : fmt::format("{}: has the same votes of \"{}\" as {}; they are counted "
                                       "once",
                                       dropped.file, dropped.judge, kept.file));
        other = &kept;
    }
    return counted;
}

/// Of judges whose screen was checked, whether it failed. Of several saves that count as one the
/// page's one file alone says so, whichever is counted.
std::map<std::wstring, bool> failed_calibrations(std::span<const VoteFile> files) {
    std::map<std::wstring, bool> failed;
    for (const auto& file : files) {
        if (file.calibration_failed) {
            failed.emplace(judge_identity(file.judge), *file.calibration_failed);
        }
    }
    return failed;
}

}  // namespace

std::string compare_with_scan(const Kit& kit, const ScannedMaterials& scanned) {
    const auto& shown = kit.database;
    if (!shown.kind.empty() && shown.kind != scanned.kind) {
        throw InputError(
            fmt::format("{}: its spheres are of a {}, and the scan was of a {}, as {} says: these "
                        "judges saw other materials",
                        kit.file, shown.kind, scanned.kind, scanned.file));
    }
    if (shown.material_hashes.empty() || scanned.hashes.empty()) {
        return fmt::format(
            "{}: was written before contents were recorded; whether its spheres show what was "
            "scanned was not checked",
            shown.material_hashes.empty() ? kit.file : scanned.file);
    }
    for (const auto& [material, hash] : shown.material_hashes) {
        const auto found = scanned.hashes.find(material);
        if (found == scanned.hashes.end() || found->second != hash) {
            throw InputError(
                fmt::format("{}: the sphere of \"{}\" has other content than what was scanned, as "
                            "{} says: these judges saw other materials",
                            kit.file, material, scanned.file));
        }
    }
    return {};
}

Votes gather_votes(const SelectionFile& selection, const std::string& selection_hash,
                   const Kit* kit, std::span<const VoteFile> files) {
    if (files.empty()) {
        throw InputError("found no votes; expected at least one judge's file");
    }
    if (kit != nullptr) {
        check_kit(selection, selection_hash, *kit);
    }
    std::vector<std::string> warnings;
    const auto counted = counted_files(kit, files, warnings);
    Experiment experiment(selection, kit);
    for (const auto* file : counted) {
        for (const auto& row : file->rows) {
            experiment.take(*file, row);
        }
    }
    Votes votes{.first_metric = selection.first_metric,
                .second_metric = selection.second_metric,
                .reference = kit != nullptr ? kit->reference : "",
                .kit_hash = files[0].kit_hash,
                .with_kit = kit != nullptr,
                .configurations = experiment.configurations(),
                .judges = {},
                .trials = experiment.trials().size(),
                .warnings = std::move(warnings),
                .seconds_to_see = kit != nullptr ? kit->seconds_to_see : std::nullopt};
    std::map<std::uint64_t, std::uint32_t> index;
    for (std::uint32_t k = 0; k < votes.configurations.size(); ++k) {
        index[votes.configurations[k].number] = k;
    }
    const auto failed = failed_calibrations(files);
    for (const auto* file : counted) {
        Judge judge{.name = file->judge, .file = file->file, .ballots = {}};
        if (const auto found = failed.find(judge_identity(file->judge)); found != failed.end()) {
            judge.calibration_failed = found->second;
        }
        std::set<Trial> missing = experiment.trials();
        auto rows = file->rows;
        std::ranges::sort(rows, {}, &TrialRow::trial);
        for (const auto& row : rows) {
            const bool repeat = row.kind == TrialKind::repeat;
            missing.erase({row.configuration, repeat});
            judge.ballots.push_back({.configuration = index.at(row.configuration),
                                     .repeat = repeat,
                                     .swapped = row.swapped,
                                     .shown = row.vote,
                                     .response_ms = row.response_ms});
        }
        for (const auto& [number, repeat] : missing) {
            judge.ballots.push_back({.configuration = index.at(number),
                                     .repeat = repeat,
                                     .swapped = false,
                                     .shown = 0,
                                     .response_ms = std::nullopt});
        }
        votes.judges.push_back(std::move(judge));
    }
    return votes;
}

}  // namespace merl::scan
