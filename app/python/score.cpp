#include "app/pipeline/score.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "app/python/call.h"
#include "app/python/handles.h"
#include "app/python/text.h"
#include "engine/database/model_database.h"
#include "scan/io/input.h"
#include "scan/score/judgement_file.h"
#include "scan/score/lagunas.h"

namespace py = pybind11;

namespace merl::python {
namespace {

using namespace py::literals;
using Rows = py::array_t<std::uint64_t, py::array::c_style | py::array::forcecast>;

constexpr py::ssize_t kColumns = 7;  // of NamedVotes

py::dict read_judgements(const py::str& file, const py::dict& call) {
    const auto path = from_python(file);
    scan::JudgementFile result;
    run(call_options(call), [&](const pipeline::Control& control) {
        // The published indices are those of the 100 MERL materials.
        const auto merl = scan::lagunas_order(engine::merl_materials());
        result = scan::parse_judgements(scan::read_input(path), path, merl,
                                        control.stage("reading judgements"));
    });
    Rows rows({static_cast<py::ssize_t>(result.rows.size()), kColumns});
    std::uint64_t* to = rows.mutable_data();
    for (const auto& r : result.rows) {
        for (const std::uint64_t number :
             {std::uint64_t{r.left_1}, std::uint64_t{r.left_2}, std::uint64_t{r.right_1},
              std::uint64_t{r.right_2}, r.votes_left, r.votes_equal, r.votes_right}) {
            *to++ = number;
        }
    }
    return py::dict("file"_a = to_python(result.file), "format"_a = result.format,
                    "names"_a = to_python(result.names), "rows"_a = rows);
}

/// Rows as read_judgements() gives them, or as somebody made them up.
scan::JudgementFile judgements_of(const py::str& file, const py::str& format,
                                  const py::sequence& names, const py::object& array) {
    scan::JudgementFile result = {
        from_python(file), from_python(format), from_python_list(names), {}};
    const auto rows = Rows::ensure(array);
    if (!rows) {
        throw py::type_error("rows of judgements: expected an array of numbers");
    }
    auto sorted = result.names;
    std::ranges::sort(sorted);
    if (std::ranges::adjacent_find(sorted) != sorted.end()) {
        throw std::invalid_argument("rows of judgements: a name is there twice");
    }
    if (rows.ndim() != 2 || rows.shape(1) != kColumns) {
        throw std::invalid_argument("rows of judgements: expected an array of shape (rows, 7)");
    }
    for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
        const auto* const r = rows.data(i, 0);
        for (int k = 0; k < 4; ++k) {
            if (r[k] >= result.names.size()) {
                throw std::invalid_argument("rows of judgements: no name has the index " +
                                            std::to_string(r[k]));
            }
        }
        for (int k = 4; k < kColumns; ++k) {
            if (r[k] > scan::max_votes) {
                throw std::invalid_argument("rows of judgements: found " + std::to_string(r[k]) +
                                            " votes; expected at most " +
                                            std::to_string(scan::max_votes));
            }
        }
        if ((r[0] == r[1] || r[2] == r[3]) || (r[0] == r[2] && r[1] == r[3]) ||
            (r[0] == r[3] && r[1] == r[2])) {
            throw std::invalid_argument("rows of judgements: row " + std::to_string(i) +
                                        " is not of two different pairs of different materials");
        }
        const auto index = [&](int k) { return static_cast<std::uint32_t>(r[k]); };
        result.rows.push_back({index(0), index(1), index(2), index(3), r[4], r[5], r[6]});
    }
    return result;
}

/// (value, low, high) of a figure.
py::tuple figure(const scan::Estimate& estimate) {
    return py::make_tuple(estimate.value, estimate.interval.low, estimate.interval.high);
}

py::dict score(const py::sequence& names, const py::sequence& columns, const py::object& database,
               const py::sequence& metrics, const py::tuple& judgements, const py::dict& call) {
    auto table = table_of(names, columns);
    const auto source = source_of(database, metrics);
    const auto file = judgements_of(judgements[0], judgements[1], judgements[2], judgements[3]);
    const auto options = call_options(call);
    pipeline::ScoreResult result;
    run(options, [&](const pipeline::Control& control) {
        result = pipeline::score_distances(table, file, source.database.get(), source.pointers(),
                                           options.memory_bytes, control);
    });
    py::list of_metrics;
    for (const auto& m : result.score.metrics) {
        of_metrics.append(py::dict("metric"_a = to_python(m.name),
                                   "majorities"_a = figure(m.majorities),
                                   "votes"_a = figure(m.votes), "slope"_a = figure(m.slope),
                                   "log_likelihood"_a = figure(m.log_likelihood), "ties"_a = m.ties,
                                   "undecided"_a = m.undecided));
    }
    py::list of_pairs;
    for (const auto& p : result.score.pairs) {
        of_pairs.append(py::dict("first"_a = to_python(result.score.metrics[p.first].name),
                                 "second"_a = to_python(result.score.metrics[p.second].name),
                                 "first_right"_a = p.first_right, "second_right"_a = p.second_right,
                                 "difference"_a = figure(p.difference), "p_holm"_a = p.p_holm));
    }
    py::list unknown;
    for (const auto& u : result.judgements.unknown) {
        unknown.append(to_python(u.name));
    }
    return py::dict("columns"_a = columns_of(table.metrics), "metrics"_a = of_metrics,
                    "pairs"_a = of_pairs, "judgements"_a = result.score.judgements,
                    "untied"_a = result.score.untied, "votes"_a = result.score.votes,
                    "ceiling"_a = figure(result.score.ceiling),
                    "too_few"_a = to_python(result.score.clusters.too_few), "unknown"_a = unknown);
}

}  // namespace

void bind_score(py::module_& module) {
    module.def("read_judgements", read_judgements);
    module.def("score", score);
}

}  // namespace merl::python
