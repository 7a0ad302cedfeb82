#include <gtest/gtest.h>

#include <fstream>
#include <stdexcept>

#include "app/pipeline/metrics.h"
#include "app/pipeline/pair_distances.h"
#include "app/pipeline/refine.h"
#include "app/pipeline/scan.h"
#include "app/pipeline/score.h"
#include "app/pipeline/spheres.h"
#include "engine/database/memory_database.h"
#include "engine/database/model_database.h"
#include "engine/database/subset_database.h"
#include "engine/distance/float64_distances.h"
#include "scan/score/judgement_file.h"
#include "tests/engine/support.h"

namespace merl::pipeline {
namespace {

const std::array<const engine::Metric*, 2>& two_metrics() {
    static const std::array metrics = {&engine::find_metric("cwcbrt"),
                                       &engine::find_metric("pawcielab")};
    return metrics;
}

std::unique_ptr<engine::Database> coarse_database() {
    return engine::open_model("abc", {.theta_h = 9, .theta_d = 9, .phi_d = 18});
}

PairDistances distances_of(const engine::Database& database, const Control& control = {}) {
    engine::Engines engines({.device = engine::kHost});
    return compute_pair_distances(engines, database, two_metrics(), 1ULL << 30U, control);
}

TEST(Pipeline, DistancesSayWhereTheyAreFrom) {
    const auto database = coarse_database();
    const auto result = distances_of(*database);
    engine::Engines engines({.device = engine::kHost});
    const auto computed = engine::compute_distances(engines, *database, two_metrics());
    ASSERT_EQ(result.table.metrics.size(), 2U);
    EXPECT_EQ(result.table.names, database->materials());
    for (std::size_t m = 0; m < 2; ++m) {
        EXPECT_EQ(result.table.metrics[m].values, computed.distances[m].values);
        EXPECT_EQ(result.table.metrics[m].bounds, computed.distances[m].bounds);
    }
    const auto& p = result.provenance;
    EXPECT_FALSE(p.version.empty());
    ASSERT_TRUE(p.database);
    EXPECT_FALSE(p.table);
    EXPECT_EQ(p.database->content_hash, computed.content_hash);
    EXPECT_EQ(p.database->grid, database->grid());
    EXPECT_EQ(p.database->materials.size(), 100U);
    EXPECT_EQ(p.database->materials[3].content_hash, computed.material_hashes[3]);
    ASSERT_EQ(p.engines.size(), 1U);
    EXPECT_EQ(p.engines[0].engine.engine, "host");
    EXPECT_EQ(p.engines[0].metrics, (std::vector<std::string>{"cwcbrt", "pawcielab"}));
    EXPECT_EQ(p.metrics[1].name, "pawcielab");
    EXPECT_EQ(p.metrics[1].parameters.size(), two_metrics()[1]->parameters.size());
}

const std::vector<scan::Pair>& three_pairs() {
    static const std::vector<scan::Pair> pairs = {{0, 7}, {3, 99}, {41, 42}};
    return pairs;
}

ListedPairDistances listed_distances_of(const engine::Database& database) {
    engine::Engines engines({.device = engine::kHost});
    return compute_listed_distances(engines, database, two_metrics(), three_pairs());
}

TEST(Pipeline, ListedDistancesAreThoseAmongAll) {
    const auto database = coarse_database();
    const auto all = distances_of(*database);
    const auto some = listed_distances_of(*database);
    EXPECT_EQ(some.table.names, all.table.names);
    EXPECT_EQ(some.table.pairs, three_pairs());
    ASSERT_EQ(some.table.metrics.size(), 2U);
    for (std::size_t m = 0; m < 2; ++m) {
        const auto& column = some.table.metrics[m];
        const auto& of_all = all.table.metrics[m];
        EXPECT_EQ(column.metric, of_all.metric);
        ASSERT_EQ(column.values.size(), 3U);
        for (std::size_t p = 0; p < 3; ++p) {
            const auto place = scan::pair_index(three_pairs()[p], 100);
            EXPECT_EQ(column.values[p], of_all.values[place]);
            EXPECT_EQ(column.bounds[p], of_all.bounds[place]);
        }
    }
    EXPECT_EQ(some.provenance.database->content_hash, all.provenance.database->content_hash);
    EXPECT_EQ(some.provenance.database->materials.size(), 100U);
    engine::Engines engines({.device = engine::kHost});
    for (const auto& pairs : {std::vector<scan::Pair>{}, {{3, 1}}, {{1, 2}, {0, 3}}, {{1, 100}}}) {
        EXPECT_THROW(compute_listed_distances(engines, *database, two_metrics(), pairs),
                     std::invalid_argument);
    }
}

TEST(Pipeline, EntriesOfListedDistancesAreMadeExact) {
    const auto database = coarse_database();
    const auto before = listed_distances_of(*database).table;
    auto table = before;
    const std::vector<std::vector<std::uint32_t>> entries = {{0, 2}, {}};
    make_exact(table, *database, two_metrics(), entries, 1ULL << 30U, {});
    const std::vector<engine::MaterialPair> replaced = {{0, 7}, {41, 42}};
    const auto exact = engine::float64_distances(*database, *two_metrics()[0], replaced);
    EXPECT_EQ(table.metrics[0].values,
              (std::vector<double>{exact[0], before.metrics[0].values[1], exact[1]}));
    EXPECT_NE(table.metrics[0].values, before.metrics[0].values);
    EXPECT_EQ(table.metrics[0].bounds, (std::vector<double>{0, before.metrics[0].bounds[1], 0}));
    EXPECT_EQ(table.metrics[1].values, before.metrics[1].values);
    EXPECT_EQ(table.metrics[1].bounds, before.metrics[1].bounds);
    const std::array swapped = {two_metrics()[1], two_metrics()[0]};
    EXPECT_THROW(make_exact(table, *database, swapped, entries, 1ULL << 30U, {}),
                 std::invalid_argument);
    EXPECT_THROW(
        make_exact(table, *database, two_metrics(), std::span(entries).first(1), 1ULL << 30U, {}),
        std::invalid_argument);
}

TEST(Pipeline, ListedDistancesAreTakenOutOfATable) {
    const test::TemporaryDirectory directory;
    const auto file = (directory.path / "t.csv").string();
    std::ofstream(file) << "material_a,material_b,x,y\na,b,1,2\na,c,2,1\nb,c,3,4\n";
    const auto table = read_listed_distances(file);
    EXPECT_EQ(table.table.pairs, (std::vector<scan::Pair>{{0, 1}, {0, 2}, {1, 2}}));
    EXPECT_EQ(table.provenance.table->file, file);
    const std::vector<scan::Pair> two = {{0, 1}, {1, 2}};
    const auto picked = pick_distances(table, two);
    EXPECT_EQ(picked.table.pairs, two);
    EXPECT_EQ(picked.table.metrics[0].values, (std::vector<double>{1, 3}));
    EXPECT_EQ(picked.table.metrics[1].values, (std::vector<double>{2, 4}));
    const std::vector<scan::Pair> more = {{0, 1}, {0, 2}};
    test::expect_refused([&] { pick_distances(picked, more); },
                         R"(1 of 2 pairs that are needed; add the others, such as "a" and "c")");
}

TEST(Pipeline, ProgressGrowsAndEndsTheWork) {
    const auto database = coarse_database();
    std::vector<std::pair<std::string, double>> seen;
    distances_of(*database, {.progress = [&](std::string_view stage, double share) {
        seen.emplace_back(stage, share);
    }});
    ASSERT_FALSE(seen.empty());
    double last = 0;
    for (const auto& [stage, share] : seen) {
        EXPECT_EQ(stage, "distances");
        EXPECT_GT(share, last);
        last = share;
    }
    EXPECT_DOUBLE_EQ(last, 1);
    EXPECT_THROW(
        distances_of(*database, {.progress = [](std::string_view,
                                                double) { throw std::runtime_error("enough"); }}),
        std::runtime_error);
    std::stop_source source;
    source.request_stop();
    EXPECT_THROW(distances_of(*database, {.stop = source.get_token()}), Cancelled);
}

TEST(Pipeline, AScanIsRefinedAndCounted) {
    const auto database = coarse_database();
    const auto distances = distances_of(*database);
    const auto exact = scan_distances(distances.table, database.get(), two_metrics(),
                                      {.select = 10, .disagreements = 5});
    EXPECT_TRUE(exact.exact);
    EXPECT_EQ(exact.selection.size(), 10U);
    EXPECT_EQ(exact.disagreements.size(), 5U);
    ASSERT_TRUE(exact.strongest);
    EXPECT_EQ(exact.disagreements.front().agreement, exact.strongest->agreement);
    EXPECT_EQ(exact.census.counts.configurations, 12'248'775U);
    const auto counted = exact.census.counts.disagreements();
    EXPECT_EQ(exact.bounded, (scan::BoundedCount{counted, 0}));
    std::uint64_t announced = 0;
    const auto fast =
        scan_distances(distances.table, database.get(), two_metrics(),
                       {.select = 10,
                        .disagreements = 0,
                        .fast = true,
                        .before_refining = [&](std::uint64_t wanted, std::uint64_t of) {
                            announced += wanted;
                            EXPECT_EQ(of, 2U * 4950U);
                        }});
    EXPECT_FALSE(fast.exact);
    EXPECT_TRUE(fast.selection_is_exact);
    EXPECT_EQ(fast.selection, exact.selection);
    EXPECT_GT(announced, 0U);
    EXPECT_EQ(fast.refined.first + fast.refined.second, announced);
    EXPECT_LT(announced, exact.refined.first + exact.refined.second);
    EXPECT_EQ(fast.undecided, exact.undecided);
    EXPECT_LE(fast.bounded.least, counted);
    EXPECT_GE(fast.bounded.greatest(), counted);
}

TEST(Pipeline, ATableIsTakenAsExact) {
    const test::TemporaryDirectory directory;
    const auto file = (directory.path / "t.csv").string();
    std::ofstream(file) << "material_1,material_2,x,y\na,b,1,2\na,c,2,1\nb,c,3,3\n";
    const auto distances = read_pair_distances(file);
    ASSERT_TRUE(distances.provenance.table);
    EXPECT_EQ(distances.provenance.table->file, file);
    EXPECT_TRUE(distances.provenance.engines.empty());
    const auto result = scan_distances(distances.table, nullptr, {});
    EXPECT_TRUE(result.exact);
    EXPECT_EQ(result.census.counts.disagreements(), 1U);
    EXPECT_THROW(read_pair_distances((directory.path / "none.csv").string()), InputError);
}

TEST(Pipeline, WhatDoesNotBelongTogetherIsRefused) {
    const std::shared_ptr<const engine::Database> database = coarse_database();
    const auto distances = distances_of(*database);
    const auto& both = two_metrics();
    const std::array swapped = {both[1], both[0]};
    const auto some = engine::make_subset(database, {0, 1, 2});
    const scan::JudgementFile judgements =
        scan::parse_judgements("reference,a,b,votes_a,votes_b\nalumina-oxide,nickel,nylon,3,1\n",
                               "j", distances.table.names);
    const auto refused = [&](const engine::Database& from,
                             std::span<const engine::Metric* const> metrics) {
        EXPECT_THROW(scan_distances(distances.table, &from, metrics), std::invalid_argument);
        auto table = distances.table;
        EXPECT_THROW(score_distances(table, judgements, &from, metrics), std::invalid_argument);
    };
    refused(*database, {});
    refused(*database, std::span(both).first(1));
    refused(*database, swapped);
    refused(*some, both);
    auto one = distances.table;
    one.metrics.pop_back();
    EXPECT_THROW(scan_distances(one, database.get(), std::span(both).first(1)),
                 std::invalid_argument);
    EXPECT_THROW(scan_distances(one, nullptr, {}), std::invalid_argument);
    // Without the database what is open stays open, and is said to.
    const auto open = scan_distances(distances.table, nullptr, {}, {.disagreements = 0});
    EXPECT_GT(open.undecided, 0U);
    EXPECT_FALSE(open.exact);
    EXPECT_FALSE(open.selection_is_exact);
    EXPECT_EQ(open.bounded.undecided, open.undecided);
    // A single material has no distance.
    EXPECT_THROW(distances_of(*engine::make_subset(database, {7})), InputError);
    EXPECT_THROW(distances_of(*engine::make_subset(database, {})), InputError);
}

TEST(Pipeline, AScanIsOfTheFirstTwoMetrics) {
    const auto database = coarse_database();
    const std::array three = {two_metrics()[0], two_metrics()[1], &engine::find_metric("rmse")};
    engine::Engines engines({.device = engine::kHost});
    const auto distances = compute_pair_distances(engines, *database, three);
    const auto result =
        scan_distances(distances.table, database.get(), three, {.disagreements = 0});
    const auto two = scan_distances(distances_of(*database).table, database.get(), two_metrics(),
                                    {.disagreements = 0});
    EXPECT_TRUE(result.exact);
    EXPECT_EQ(result.census.counts.disagreements(), two.census.counts.disagreements());
    EXPECT_EQ(result.refined.first, two.refined.first);
    double last = 0;
    scan_distances(distances.table, database.get(), three, {},
                   {.progress = [&](std::string_view, double share) { last = share; }});
    EXPECT_EQ(last, 1);
}

TEST(Pipeline, MetricsAreOpenedByNameAndNotTwice) {
    const std::vector<std::string> names = {"rmse", "pawcielab:white=80"};
    const auto metrics = open_metrics(names);
    EXPECT_EQ(metrics[1].name, "pawcielab:white=80");
    const std::vector<std::string> twice = {"rmse", "all"};
    EXPECT_THROW(open_metrics(twice), Error);
}

TEST(Pipeline, SpheresAreShown) {
    const engine::MemoryDatabase database(
        "grey", {.theta_h = 4, .theta_d = 4, .phi_d = 8}, {"a", "b"},
        [](std::size_t material, std::uint64_t, std::size_t) { return material == 0 ? 0.0 : 0.3; });
    const std::vector<std::size_t> both = {0, 1};
    std::vector<float> middles;
    const SphereView view = {.sphere = {.size = 16}, .background = 0};
    render_spheres(database, both, view, {.device = "llvmpipe"},
                   [&](const engine::SphereImage&, const Image& linear) {
                       middles.push_back(displayed(linear, view).at(8, 8)[1]);
                   });
    ASSERT_EQ(middles.size(), 2U);
    EXPECT_EQ(middles[0], 0);
    EXPECT_GT(middles[1], 0.3F);
}

}  // namespace
}  // namespace merl::pipeline
