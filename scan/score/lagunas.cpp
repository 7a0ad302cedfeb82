#include "scan/score/lagunas.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "engine/base/error.h"
#include "scan/io/input.h"

namespace merl::scan {
namespace {

/// Rows of `width` whole numbers.
struct Table {
    const char* key;
    std::size_t width;
    std::uint64_t largest;
    bool found = false;
    std::vector<std::uint64_t> numbers = {};
};

/// Takes two tables out of a JSON text as it is parsed: no other part of it needs memory.
class Handler : public nlohmann::json_sax<nlohmann::json> {
  public:
    Handler(std::string file, std::uint64_t materials)
        : answers{"answers", 3, materials - 1},
          agreement{"agreement", 2, max_votes},
          file_(std::move(file)) {}

    Table answers;
    Table agreement;

    bool null() override { return other("null"); }
    bool boolean(bool value) override { return other(value ? "true" : "false"); }
    bool number_integer(number_integer_t value) override { return other(std::to_string(value)); }
    bool number_float(number_float_t, const string_t& text) override { return other(text); }
    bool string(string_t& text) override { return other(fmt::format("\"{}\"", text)); }
    bool binary(binary_t&) override { return other("binary"); }

    bool number_unsigned(number_unsigned_t value) override {
        if (table_ == nullptr || depth_ != 3 || value > table_->largest) {
            return other(std::to_string(value));
        }
        if (++in_row_ > table_->width) {
            return other("a longer row");
        }
        table_->numbers.push_back(value);
        return true;
    }

    bool start_object(std::size_t) override {
        if (depth_ > 0) {
            other("an object");
        }
        ++depth_;
        return true;
    }

    bool key(string_t& name) override {
        if (depth_ == 1) {
            rows_ = 0;
            table_ = name == answers.key ? &answers : name == agreement.key ? &agreement : nullptr;
            if (table_ != nullptr && std::exchange(table_->found, true)) {
                fail(fmt::format("found \"{}\" twice", name));
            }
        }
        return true;
    }

    bool end_object() override {
        --depth_;
        return true;
    }

    bool start_array(std::size_t) override {
        if (table_ != nullptr && depth_ > 2) {
            other("an array");
        }
        ++depth_;
        in_row_ = 0;
        return true;
    }

    bool end_array() override {
        --depth_;
        if (table_ != nullptr && depth_ == 2) {
            if (in_row_ != table_->width) {
                other(fmt::format("a row of {}", in_row_));
            }
            if (++rows_ > max_judgement_rows) {
                fail(fmt::format("{}: found more than {} rows", table_->key, max_judgement_rows));
            }
        }
        return true;
    }

    bool parse_error(std::size_t, const std::string&,
                     const nlohmann::json::exception& error) override {
        fail(fmt::format("is no JSON: {}", json_fault(error)));
    }

    [[noreturn]] void fail(const std::string& what) const {
        throw InputError(fmt::format("{}: {}", file_, what));
    }

  private:
    /// Anything but a number that is wanted: an error inside of a table.
    bool other(const std::string& found) const {
        if (table_ != nullptr) {
            fail(fmt::format("{}[{}]: found {}; expected rows of {} whole numbers from 0 to {}",
                             table_->key, rows_, found, table_->width, table_->largest));
        }
        return true;
    }

    std::string file_;
    Table* table_ = nullptr;  // that we are in
    std::size_t depth_ = 0;
    std::size_t rows_ = 0;  // of the table that are complete
    std::size_t in_row_ = 0;
};

}  // namespace

std::vector<std::string> lagunas_order(std::vector<std::string> names) {
    std::ranges::sort(names, {}, [](const std::string& name) { return name + ".binary"; });
    return names;
}

JudgementFile parse_lagunas(std::string_view text, const std::string& file,
                            std::span<const std::string> indexed_names) {
    Handler handler(file, indexed_names.size());
    nlohmann::json::sax_parse(text, &handler);
    for (const Table* table : {&handler.answers, &handler.agreement}) {
        if (!table->found) {
            handler.fail(fmt::format("found no \"{}\"; expected the judgements of Lagunas et al.",
                                     table->key));
        }
    }
    const auto& answers = handler.answers.numbers;
    const auto& agreement = handler.agreement.numbers;
    if (answers.size() / 3 != agreement.size() / 2) {
        handler.fail(fmt::format("found {} rows of answers and {} of agreement; expected as many",
                                 answers.size() / 3, agreement.size() / 2));
    }
    if (answers.empty()) {
        handler.fail("found no answers; expected at least one");
    }
    JudgementFile result = {
        file, "Lagunas 2019 JSON", {indexed_names.begin(), indexed_names.end()}, {}};
    for (std::size_t row = 0; row < answers.size() / 3; ++row) {
        const auto material = [&](std::size_t i) {
            return static_cast<std::uint32_t>(answers[3 * row + i]);
        };
        const auto [reference, a, b] = std::array{material(0), material(1), material(2)};
        if (reference == a || reference == b || a == b) {
            handler.fail(fmt::format("answers[{}]: found [{}, {}, {}]; expected three materials",
                                     row, reference, a, b));
        }
        result.rows.push_back(
            {reference, a, reference, b, agreement[2 * row], 0, agreement[2 * row + 1]});
    }
    return result;
}

}  // namespace merl::scan
