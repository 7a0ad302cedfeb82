#include "scan/votes/vote_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <utility>

#include "engine/base/csv_reader.h"
#include "scan/io/input.h"

namespace merl::scan {
namespace {

const std::vector<std::string> vote_header = {
    "judge",   "trial",   "configuration", "kind",        "left_1", "left_2",  "right_1",
    "right_2", "swapped", "vote",          "response_ms", "seed",   "kit_hash"};

enum Column : std::size_t {
    judge,
    trial,
    configuration,
    kind,
    left_1,
    left_2,
    right_1,
    right_2,
    swapped,
    vote,
    response_ms,
    seed,
    kit_hash
};

constexpr std::array<std::pair<TrialKind, std::string_view>, 4> kinds = {
    {{TrialKind::selection, "selection"},
     {TrialKind::repeat, "repeat"},
     {TrialKind::sentinel, "sentinel"},
     {TrialKind::random, "random"}}};

/// Turns the fields of a row into a trial.
class RowReader {
  public:
    RowReader(CsvReader& reader, const std::vector<std::string>& fields)
        : reader_(reader), fields_(fields) {}

    TrialRow read() {
        TrialRow row{
            .line = reader_.line(),
            .trial = number(trial),
            .configuration = number(configuration),
            .kind = read_kind(),
            .shown = {fields_[left_1], fields_[left_2], fields_[right_1], fields_[right_2]},
            .swapped = choice(swapped, "01", "0 or 1") == 1,
            .vote = 0,
            .response_ms = milliseconds()};
        if (!fields_[vote].empty()) {
            row.vote =
                static_cast<std::uint8_t>(choice(vote, "123", "1, 2, 3 or nothing (not answered)"));
        }
        if (const auto fault = fault_of_trial(row.shown, row.kind); !fault.empty()) {
            reader_.fail(fault);
        }
        return row;
    }

  private:
    [[noreturn]] void fail(Column column, std::string_view expected) const {
        reader_.fail(fmt::format("{}: found \"{}\"; expected {}", vote_header[column],
                                 fields_[column], expected));
    }

    std::uint64_t number(Column column) {
        const auto value = reader_.whole_number(fields_[column]);
        if (!value || *value == 0 || *value > 1'000'000'000) {
            fail(column, "a whole number from 1 to 1000000000");
        }
        return *value;
    }

    /// The digit that the field is, one of `digits`.
    int choice(Column column, std::string_view digits, std::string_view expected) {
        const auto value = reader_.whole_number(fields_[column]);
        if (!value || *value > 9 ||
            digits.find(static_cast<char>('0' + *value)) == std::string::npos) {
            fail(column, expected);
        }
        return static_cast<int>(*value);
    }

    TrialKind read_kind() const {
        const auto found = kind_of(fields_[kind]);
        if (!found) {
            fail(kind, "selection, repeat, sentinel or random");
        }
        return *found;
    }

    std::optional<double> milliseconds() {
        if (fields_[response_ms].empty()) {
            return std::nullopt;
        }
        const auto value = reader_.magnitude(fields_[response_ms]);
        if (!value) {
            fail(response_ms, "a number of milliseconds, zero or more, or nothing");
        }
        return value;
    }

    CsvReader& reader_;
    const std::vector<std::string>& fields_;
};

void expect_header(CsvReader& reader) {
    const auto header = reader.header();
    if (header != vote_header) {
        reader.fail(fmt::format(R"(found {}; expected {}, "{}")", columns_text(header),
                                vote_header.size(), fmt::join(vote_header, ",")));
    }
}

}  // namespace

std::string_view kind_name(TrialKind kind) {
    return kinds.at(static_cast<std::size_t>(kind)).second;
}

std::optional<TrialKind> kind_of(std::string_view name) {
    const auto* const found =
        std::ranges::find(kinds, name, [](const auto& k) { return k.second; });
    return found == kinds.end() ? std::nullopt : std::optional(found->first);
}

std::string fault_of_trial(const FourMaterials& m, TrialKind kind) {
    const bool left = m[0] == m[1] && (m[2] == m[0]) != (m[3] == m[0]);
    const bool right = m[2] == m[3] && (m[0] == m[2]) != (m[1] == m[2]);
    const bool has_names = std::ranges::find(m, "") == m.end();
    return kind == TrialKind::sentinel && (left || right) && has_names ? "" : fault_of(m);
}

VoteFile parse_votes(std::string_view text, const std::string& file) {
    CsvReader reader(text, file);
    expect_header(reader);
    VoteFile result{.file = file, .judge = {}, .kit_hash = {}, .rows = {}};
    std::string first_seed;
    std::set<std::uint64_t> numbers;
    std::set<std::pair<std::uint64_t, TrialKind>> trials;
    std::vector<std::string> fields;
    while (reader.next(fields)) {
        if (result.rows.size() == max_trials) {
            reader.fail(fmt::format("found more than {} trials", max_trials));
        }
        if (result.rows.empty()) {
            result.judge = fields[judge];
            result.kit_hash = fields[kit_hash];
            first_seed = fields[seed];
        }
        for (const auto& [column, first] :
             {std::pair(judge, &result.judge), {kit_hash, &result.kit_hash}, {seed, &first_seed}}) {
            if (fields[column] != *first) {
                reader.fail(
                    fmt::format("{}: found \"{}\"; expected \"{}\", as in the first row (a "
                                "file has the votes of one judge on one kit)",
                                vote_header[column], fields[column], *first));
            }
        }
        if (result.judge.empty()) {
            reader.fail("judge: found no name; expected one");
        }
        const TrialRow row = RowReader(reader, fields).read();
        if (!numbers.insert(row.trial).second) {
            reader.fail(fmt::format("found trial {} a second time", row.trial));
        }
        if (!trials.emplace(row.configuration, row.kind).second) {
            reader.fail(fmt::format("found configuration {} a second time as {}", row.configuration,
                                    kind_name(row.kind)));
        }
        result.rows.push_back(row);
    }
    if (result.rows.empty()) {
        reader.fail("found no row after the header; expected a trial");
    }
    return result;
}

}  // namespace merl::scan
