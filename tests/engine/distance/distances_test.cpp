#include "engine/distance/distances.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>

#include "engine/database/model_database.h"
#include "engine/database/subset_database.h"
#include "engine/distance/float64_distances.h"
#include "tests/engine/other_device.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

using test::FunctionDatabase;

/// Metrics of every degree, and without one; below the horizon only those whose weight means
/// something there.
std::vector<const Metric*> some_metrics(VoxelSet voxels = VoxelSet::above_horizon) {
    std::vector<const Metric*> all;
    if (voxels == VoxelSet::all) {
        return {&find_metric("rmse"), &framework_test_metrics()[0]};
    }
    for (const char* name : {"cosine-rmse", "cwcbrt", "pawcielab", "rmse"}) {
        all.push_back(&find_metric(name));
    }
    for (const auto& metric : framework_test_metrics()) {
        all.push_back(&metric);
    }
    return all;
}

std::vector<MaterialPair> all_pairs(std::size_t materials) {
    std::vector<MaterialPair> pairs;
    for (std::uint32_t i = 0; i < materials; ++i) {
        for (std::uint32_t j = i + 1; j < materials; ++j) {
            pairs.emplace_back(i, j);
        }
    }
    return pairs;
}

/// Distances against the float64 twins, at sizes that divide nothing.
void expect_as_reference(Engines& engines, const Grid& grid, std::size_t materials,
                         VoxelSet voxels) {
    const FunctionDatabase database(grid, materials, test::random_sample);
    const auto chosen = some_metrics(voxels);
    const auto pairs = all_pairs(materials);
    const auto result = compute_distances(engines, database, chosen, {.voxels = voxels});
    for (std::size_t m = 0; m < chosen.size(); ++m) {
        const auto expected = float64_distances(database, *chosen[m], pairs, voxels);
        ASSERT_EQ(result.distances[m].values.size(), pairs.size());
        for (std::size_t p = 0; p < pairs.size(); ++p) {
            EXPECT_NEAR(result.distances[m].values[p] / expected[p], 1, 2e-6)
                << chosen[m]->name << " " << pairs[p].first << " " << pairs[p].second << " of "
                << materials << ", " << grid.text() << ", " << result.engines.front().engine.engine;
        }
    }
}

TEST(Distances, AgreeWithTheReferenceAtAwkwardSizes) {
    const Grid small = {.theta_h = 7, .theta_d = 5, .phi_d = 3};
    const Grid middle = {
        .theta_h = 13, .theta_d = 11, .phi_d = 17};  // several blocks, the last cut
    for (const auto voxels : {VoxelSet::above_horizon, VoxelSet::all}) {
        for (const std::size_t materials : {2U, 10U, 13U, 21U}) {
            for (const bool in_shaders : {false, true}) {
                expect_as_reference(test::engines(in_shaders), small, materials, voxels);
                expect_as_reference(test::engines(in_shaders), middle, materials, voxels);
            }
        }
    }
}

/// A library metric as if it were a user's: its grids are made on the device.
Metric without_twin(Metric metric) {
    metric.twin = {};
    return metric;
}

/// Of the whole library, or of copies of it as users' files.
void expect_library_as_reference(Engines& engines, bool of_a_user = false) {
    // Enough layers of theta_h for the windows of summaries, and no colours whose hues are
    // opposite: there CIEDE2000 jumps, and a user's copy of it would be refused.
    const auto database = open_model("abc", {.theta_h = 24, .theta_d = 11, .phi_d = 22});
    std::vector<Metric> library(metrics().begin(), metrics().end());
    library.push_back(open_metric("sun-log2:epsilon=0.5"));
    library.push_back(open_metric("ngan:largest_angle=80"));
    std::vector<Metric> computed;
    std::vector<const Metric*> chosen;
    for (const auto& metric : library) {
        computed.push_back(of_a_user ? without_twin(metric) : metric);
    }
    for (const auto& metric : computed) {
        chosen.push_back(&metric);
    }
    const auto result = compute_distances(engines, *database, chosen);
    const auto pairs = all_pairs(100);
    std::vector<MaterialPair> some;
    for (std::size_t p = 0; p < pairs.size(); p += 97) {
        some.push_back(pairs[p]);
    }
    for (std::size_t m = 0; m < chosen.size(); ++m) {
        const auto expected = float64_distances(*database, library[m], some);
        // Without a degree the difference is what float32 and the device's functions make of it.
        const double allowed = chosen[m]->is_summary()  ? 1e-12
                               : chosen[m]->has_bound() ? 2e-6
                                                        : 1e-4;
        for (std::size_t p = 0; p < some.size(); ++p) {
            EXPECT_NEAR(result.distances[m].values[97 * p] / expected[p], 1, allowed)
                << chosen[m]->name << " " << p;
        }
    }
}

TEST(Distances, OfTheWholeLibraryAgreeWithItsTwinsOnTheHost) {
    Engines host({.device = kHost});
    expect_library_as_reference(host);
}

TEST(Distances, OfTheWholeLibraryAgreeWithItsTwinsInShaders) {
    expect_library_as_reference(test::shader_engines());
}

TEST(Distances, OfTheWholeLibraryAgreeWithItsTwinsWithoutFloat64InShaders) {
    Engines engines(test::lavapipe_without_float64());
    expect_library_as_reference(engines);
}

TEST(Distances, OfTheWholeLibraryAgreeWithItsTwinsAsUsersFiles) {
    expect_library_as_reference(test::host_engines(), true);
}

/// In float32, with the same bits whatever the slabs and however many threads.
TEST(Distances, OfAMetricWithoutADegreeAreNearFloat64OnTheHost) {
    const FunctionDatabase database({.theta_h = 13, .theta_d = 11, .phi_d = 17}, 9,
                                    test::random_sample);
    const auto& metric = find_metric("paw-ciede2000");
    const Metric* const one[] = {&metric};
    Engines host({.device = kHost});
    const auto exact = float64_distances(database, metric, all_pairs(9));
    std::vector<double> found;
    for (const std::uint64_t memory : {3'000'000U, 100'000'000U}) {
        for (const int threads : {1, 4}) {
            tbb::task_arena arena(threads);
            const auto result = arena.execute(
                [&] { return compute_distances(host, database, one, {.memory_bytes = memory}); });
            const auto& values = result.distances[0].values;
            ASSERT_EQ(values.size(), exact.size());
            for (std::size_t p = 0; p < exact.size(); ++p) {
                EXPECT_NEAR(values[p] / exact[p], 1, 1e-5);
            }
            found = found.empty() ? values : found;
            EXPECT_EQ(values, found);
            EXPECT_EQ(result.distances[0].bounds,
                      std::vector<double>(36, std::numeric_limits<double>::infinity()));
            EXPECT_TRUE(result.warnings.empty());
        }
    }
}

TEST(Engines, ShareByTheRule) {
    const auto user = without_twin(find_metric("rmse"));
    const std::vector<const Metric*> metrics = {
        &find_metric("cwcbrt"), &user, &find_metric("paw-ciede2000"), &find_metric("rmse")};
    std::vector<std::string> warnings;
    const auto by_rule = test::host_engines().share(metrics, warnings);
    ASSERT_EQ(by_rule.size(), 2U);
    EXPECT_EQ(by_rule[0].engine->description().engine, "vulkan");
    EXPECT_EQ(by_rule[0].metrics, (std::vector<std::size_t>{1}));
    EXPECT_EQ(by_rule[1].engine->description().engine, "host");
    EXPECT_EQ(by_rule[1].metrics, (std::vector<std::size_t>{0, 2, 3}));
    const auto on_device = test::shader_engines().share(metrics, warnings);
    ASSERT_EQ(on_device.size(), 1U);
    EXPECT_EQ(on_device[0].metrics.size(), 4U);
    EXPECT_TRUE(warnings.empty());
    Engines host({.device = kHost});
    try {
        host.share(metrics, warnings);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.fault(), Fault::usage);
        EXPECT_NE(std::string(error.what()).find(user.file), std::string::npos) << error.what();
    }
}

TEST(Engines, AUsersMetricNeedsFloat64InShaders) {
    const auto user = without_twin(find_metric("rmse"));
    const Metric* const both[] = {&find_metric("cwcbrt"), &user};
    std::vector<std::string> warnings;
    for (const auto use : {Engines::Use::rest, Engines::Use::everything}) {
        Engines engines(test::lavapipe_without_float64(), use);
        try {
            engines.share(both, warnings);
            FAIL();
        } catch (const Error& error) {
            EXPECT_EQ(error.fault(), Fault::device);
            // The machine has a device with float64, which is this one as it is.
            for (const auto& part : {user.file, std::string("float64"), std::string("llvmpipe"),
                                     std::string("--device 0 (llvmpipe")}) {
                EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
            }
        }
        EXPECT_EQ(engines.share(std::span(both, 1), warnings).size(), 1U);
    }
}

TEST(Distances, AgreeWithTheReferenceWithoutFloat64InShaders) {
    Engines engines(test::lavapipe_without_float64());
    for (const auto voxels : {VoxelSet::above_horizon, VoxelSet::all}) {
        expect_as_reference(engines, {.theta_h = 7, .theta_d = 5, .phi_d = 3}, 2, voxels);
        expect_as_reference(engines, {.theta_h = 13, .theta_d = 11, .phi_d = 17}, 13, voxels);
    }
}

TEST(Distances, AgreeWithTheReferenceThroughStagingBuffers) {
    Engines staging(test::lavapipe_with_staging());
    expect_as_reference(staging, {.theta_h = 13, .theta_d = 11, .phi_d = 17}, 13,
                        VoxelSet::above_horizon);
}

TEST(Distances, ASingleVoxelIsEnough) {
    for (const bool in_shaders : {false, true}) {
        expect_as_reference(test::engines(in_shaders), {.theta_h = 1, .theta_d = 1, .phi_d = 1}, 2,
                            VoxelSet::all);
    }
}

TEST(Distances, DoNotDependOnSlabSizeStagingOrThreads) {
    const FunctionDatabase database({.theta_h = 40, .theta_d = 30, .phi_d = 36}, 13,
                                    test::random_sample);
    auto chosen = some_metrics();
    const Metric of_a_user = without_twin(find_metric("cwcbrt"));
    chosen.push_back(&of_a_user);
    for (const auto use : {Engines::Use::rest, Engines::Use::everything}) {
        Engines mapped(test::lavapipe(), use);
        Engines staging(test::lavapipe_with_staging(), use);
        const auto whole = compute_distances(mapped, database, chosen);
        ASSERT_GT(whole.slabs, 1U);
        EXPECT_EQ(whole.engines.size(), use == Engines::Use::rest ? 2U : 1U);
        for (const std::uint64_t memory : {8'000'000U, 10'000'000U}) {
            for (const std::size_t threads : {1U, 2U, 5U}) {
                const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                                  threads);
                const auto cut = compute_distances(threads == 2 ? staging : mapped, database,
                                                   chosen, {.memory_bytes = memory});
                EXPECT_NE(cut.slabs, whole.slabs);
                EXPECT_EQ(cut.distances, whole.distances) << memory;
                EXPECT_EQ(cut.content_hash, whole.content_hash);
            }
        }
    }
}

TEST(Distances, DoNotDependOnSlabSizeOrThreadsWithoutFloat64InShaders) {
    const FunctionDatabase database({.theta_h = 40, .theta_d = 30, .phi_d = 36}, 13,
                                    test::random_sample);
    const auto chosen = some_metrics();
    Engines engines(test::lavapipe_without_float64());
    const auto whole = compute_distances(engines, database, chosen);
    EXPECT_EQ(whole.engines.front().engine.grids, "host");
    for (const std::size_t threads : {1U, 5U}) {
        const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
        const auto cut = compute_distances(engines, database, chosen, {.memory_bytes = 8'000'000});
        EXPECT_NE(cut.slabs, whole.slabs);
        EXPECT_EQ(cut.distances, whole.distances);
    }
}

/// Random pairs of these materials, as a list of pairs has to be.
std::vector<MaterialPair> some_pairs(std::uint32_t materials, std::size_t count) {
    auto pairs = all_pairs(materials);
    std::mt19937 random(static_cast<std::uint32_t>(count));
    std::vector<MaterialPair> some;
    std::ranges::sample(pairs, std::back_inserter(some), static_cast<std::ptrdiff_t>(count),
                        random);
    return some;
}

/// The distances of a list of pairs, taken from those of all.
MetricDistances picked(const MetricDistances& all, std::span<const MaterialPair> pairs,
                       std::uint32_t materials) {
    MetricDistances result = {.values = {}, .bounds = {}, .means = all.means};
    const PairList places(materials);
    for (const auto& [first, second] : pairs) {
        const auto place = places.begin_of(first) + second - first - 1;
        result.values.push_back(all.values[place]);
        result.bounds.push_back(all.bounds[place]);
    }
    return result;
}

void expect_listed_as_among_all(Engines& engines, std::span<const Metric* const> chosen) {
    // As above: enough layers, and no colours whose hues are opposite.
    constexpr std::uint32_t kMaterials = 30;
    std::vector<std::size_t> first(kMaterials);
    std::iota(first.begin(), first.end(), std::size_t{0});
    const auto database =
        make_subset(open_model("abc", {.theta_h = 24, .theta_d = 11, .phi_d = 22}), first);
    const auto all = compute_distances(engines, *database, chosen);
    for (const std::size_t count : {1U, 40U, 300U}) {
        const auto listed = some_pairs(kMaterials, count);
        const auto some = compute_distances(engines, *database, chosen, {.pairs = listed});
        for (std::size_t m = 0; m < chosen.size(); ++m) {
            EXPECT_EQ(some.distances[m], picked(all.distances[m], listed, kMaterials))
                << chosen[m]->name << ", " << count << " pairs";
        }
        EXPECT_EQ(some.content_hash, all.content_hash);
        EXPECT_EQ(some.material_hashes, all.material_hashes);
        EXPECT_EQ(some.warnings, all.warnings);
    }
}

/// Rectangles of the matrix of all pairs, larger and smaller than a tile of the engines, and with a
/// single material on either side.
void expect_rectangles_as_among_all(Engines& engines, std::span<const Metric* const> chosen) {
    constexpr std::uint32_t kMaterials = 30;
    std::vector<std::size_t> first(kMaterials);
    std::iota(first.begin(), first.end(), std::size_t{0});
    const auto database =
        make_subset(open_model("abc", {.theta_h = 24, .theta_d = 11, .phi_d = 22}), first);
    const auto all = compute_distances(engines, *database, chosen);
    for (const std::uint32_t rows : {1U, 23U}) {
        std::vector<MaterialPair> pairs;
        PairList::between(rows, kMaterials - rows)
            .each([&](std::size_t, std::uint32_t a, std::uint32_t b) { pairs.emplace_back(a, b); });
        const auto some = compute_distances(engines, *database, chosen, {.rows = rows});
        for (std::size_t m = 0; m < chosen.size(); ++m) {
            EXPECT_EQ(some.distances[m], picked(all.distances[m], pairs, kMaterials))
                << chosen[m]->name << ", " << rows << " rows";
        }
        EXPECT_EQ(some.content_hash, all.content_hash);
    }
}

/// Degrees of 2/3, 1 and 2, none, and summaries; and the same as users' files.
TEST(Distances, OfSomePairsAreThoseAmongAll) {
    std::vector<Metric> list;
    for (const char* name :
         {"cwcbrt", "pawcielab", "paw-ciede2000", "gloss-contrast", "nielsen-log"}) {
        list.push_back(find_metric(name));
    }
    list.push_back(framework_test_metrics()[1]);
    const std::size_t of_library = list.size();
    std::vector<const Metric*> with_twin;
    std::vector<const Metric*> chosen;
    for (std::size_t m = 0; m < of_library; ++m) {
        list.push_back(without_twin(list[m]));
    }
    list.push_back(
        test::metric_of("// degree: 1\n"
                        "vec3 transform(vec3 f, Voxel v) { return log2(1.0 + f); }\n"
                        "float weight(Voxel v) { return v.cos_theta_i; }\n"
                        "float difference(float d) { return abs(d); }\n"));
    for (std::size_t m = 0; m < list.size(); ++m) {
        chosen.push_back(&list[m]);
        if (m < of_library && !list[m].is_summary()) {
            with_twin.push_back(&list[m]);
        }
    }
    const auto expect_as_among_all = [](Engines& engines, std::span<const Metric* const> of) {
        expect_listed_as_among_all(engines, of);
        expect_rectangles_as_among_all(engines, of);
    };
    for (const bool in_shaders : {false, true}) {
        expect_as_among_all(test::engines(in_shaders), chosen);
    }
    Engines host({.device = kHost});
    expect_as_among_all(host, with_twin);
    Engines staging(test::lavapipe_with_staging());
    expect_as_among_all(staging, with_twin);
    Engines without_float64(test::lavapipe_without_float64());
    expect_as_among_all(without_float64, with_twin);
}

/// Sums of all pairs that do not fit: then square after square, to the same bits, hashes, counts
/// and warnings, each material read once for each square that it is in.
TEST(Distances, OfMorePairsThanFitIntoTheMemoryAreTheSame) {
    const test::FunctionDatabase database(
        {.theta_h = 6, .theta_d = 5, .phi_d = 8}, 301,
        [](std::size_t m, std::uint64_t v, std::size_t c) {
            return v == 7 && m % 50 == 0 ? -1 : test::random_sample(m % 300, v, c);
        });
    constexpr std::uint64_t kMemory = 8'000'000;
    const Metric* const chosen[] = {&find_metric("cwcbrt"), &find_metric("pawcielab")};
    for (const bool in_shaders : {false, true}) {
        auto& engines = test::engines(in_shaders);
        const auto whole = compute_distances(engines, database, chosen);
        EXPECT_EQ(whole.passes, 1U);
        double last = 0;
        const auto cut = compute_distances(engines, database, chosen,
                                           {.memory_bytes = kMemory, .progress = [&](double share) {
                                                EXPECT_GE(share, last);
                                                last = share;
                                            }});
        EXPECT_DOUBLE_EQ(last, 1);
        EXPECT_GT(cut.passes, 1U);
        EXPECT_EQ(cut.distances, whole.distances);
        EXPECT_EQ(cut.content_hash, whole.content_hash);
        EXPECT_EQ(cut.material_hashes, whole.material_hashes);
        EXPECT_EQ(cut.warnings, whole.warnings);
        EXPECT_EQ(cut.voxels, whole.voxels);
        for (std::size_t m = 0; m < whole.counts.size(); ++m) {
            EXPECT_EQ(cut.counts[m].negative, whole.counts[m].negative);
        }
        if (!in_shaders) {  // a device says the most that it ever held
            EXPECT_LE(cut.engines.front().peak_bytes, kMemory);
        }
    }
    EXPECT_THROW(compute_distances(test::host_engines(), database, chosen, {.rows = 301}),
                 std::invalid_argument);
    EXPECT_THROW(compute_distances(test::host_engines(), database, chosen, {.memory_bytes = 1000}),
                 MemoryError);
}

/// One of the materials is another one whenever it is read, as if somebody wrote to its file.
class ChangingDatabase final : public MemoryDatabase {
  public:
    explicit ChangingDatabase(std::vector<std::string> names)
        : MemoryDatabase("changing", {.theta_h = 6, .theta_d = 5, .phi_d = 8}, std::move(names),
                         test::random_sample) {}

    void read(std::size_t material, VoxelRange range, std::span<double> samples,
              const SampleSink& sink) const override {
        const bool changes = material == 250 && range.first == 0;
        MemoryDatabase::read(material, range, samples, changes ? SampleSink() : sink);
        if (changes) {
            samples[0] = static_cast<double>(++reads_);
            sink(0, std::as_bytes(samples.first(1)));
        }
    }

  private:
    mutable std::atomic<std::size_t> reads_ = 0;
};

TEST(Distances, SquareAfterSquareNoticesWhatChanges) {
    std::vector<std::string> names;
    for (int m = 1000; m < 1300; ++m) {
        names.push_back(std::to_string(m));
    }
    const ChangingDatabase database(names);
    const Metric* const one[] = {&find_metric("cwcbrt")};
    test::expect_refused(
        [&] {
            compute_distances(test::host_engines(), database, one, {.memory_bytes = 4'000'000});
        },
        "found other samples than when it was read before");
}

/// Material m is m everywhere; three are worth a remark, whichever of a pair they are.
TEST(Distances, OfListedPairsAreCheckedAndNoOthers) {
    const FunctionDatabase database({.theta_h = 7, .theta_d = 5, .phi_d = 3}, 8,
                                    [](std::size_t material, std::uint64_t, std::size_t) {
                                        return 1.0 + static_cast<double>(material);
                                    });
    const auto metric_with = [](const std::string& difference) {
        return test::metric_of(
            "vec3 transform(vec3 f, Voxel v) { return f; }\n"
            "float weight(Voxel v) { return 1.0; }\n"
            "float difference(vec3 a, vec3 b) { " +
            difference + " }\n");
    };
    // Materials 3 and 6 differ from themselves.
    const auto same = metric_with(
        "return distance(a, b) + ((a.x == 4.0 && b.x == 4.0) || (a.x == 7.0 && b.x == 7.0) ? 1.0 : "
        "0.0);");
    const auto warnings = [&](const std::vector<MaterialPair>& pairs) {
        const Metric* const one[] = {&same};
        return compute_distances(test::shader_engines(), database, one, {.pairs = pairs}).warnings;
    };
    EXPECT_TRUE(warnings({{0, 1}, {2, 7}, {4, 5}}).empty());
    for (const auto& pairs : {std::vector<MaterialPair>{{0, 3}, {1, 2}}, {{0, 1}, {3, 5}}}) {
        ASSERT_EQ(warnings(pairs).size(), 1U);
        EXPECT_NE(warnings(pairs)[0].find("a material differs from itself"), std::string::npos);
    }
    // Materials 2 and 5 have no difference.
    const auto negative =
        metric_with("return a.x + b.x == 9.0 && abs(a.x - b.x) == 3.0 ? -1.0 : distance(a, b);");
    const Metric* const one[] = {&negative};
    const std::vector<MaterialPair> good = {{0, 2}, {0, 5}, {3, 4}};
    EXPECT_EQ(compute_distances(test::shader_engines(), database, one, {.pairs = good})
                  .distances[0]
                  .values.size(),
              3U);
    const std::vector<MaterialPair> bad = {{0, 2}, {2, 5}, {3, 4}};
    test::expect_refused(
        [&] { compute_distances(test::shader_engines(), database, one, {.pairs = bad}); },
        "expected zero or more");
}

/// Sums of all pairs of 2,000 materials would take some 80 MB.
TEST(Distances, OfListedPairsTakeMemoryForTheseAlone) {
    const FunctionDatabase database({.theta_h = 1, .theta_d = 1, .phi_d = 2}, 2000,
                                    test::random_sample);
    const std::vector<MaterialPair> listed = {{0, 1}, {5, 1999}, {700, 701}};
    const Metric* const chosen[] = {&find_metric("cwcbrt"), &find_metric("paw-ciede2000")};
    Engines host({.device = kHost});
    const DistanceOptions options = {
        .memory_bytes = 120'000'000, .voxels = VoxelSet::all, .pairs = listed};
    const auto some = compute_distances(host, database, chosen, options);
    const auto expected = float64_distances(database, *chosen[0], listed, VoxelSet::all);
    for (std::size_t p = 0; p < listed.size(); ++p) {
        EXPECT_NEAR(some.distances[0].values[p] / expected[p], 1, 2e-6);
    }
    const auto peak = std::ranges::max(some.engines, {}, &EngineUse::peak_bytes).peak_bytes;
    EXPECT_LT(peak, 80'000'000U);  // samples, grids and their ranges, and next to nothing for pairs
}

TEST(Distances, AListOfPairsIsLookedAt) {
    const FunctionDatabase database({.theta_h = 1, .theta_d = 1, .phi_d = 2}, 3,
                                    test::random_sample);
    const Metric* const one[] = {&find_metric("rmse")};
    const std::vector<MaterialPair> bad = {{0, 3}};
    EXPECT_THROW(compute_distances(test::host_engines(), database, one, {.pairs = bad}),
                 std::invalid_argument);
}

/// A database that would keep all that it may, and says how much that was and how often it was
/// read.
class KeepingDatabase final : public MemoryDatabase {
  public:
    explicit KeepingDatabase(bool keeps)
        : MemoryDatabase("keeping", {.theta_h = 20, .theta_d = 20, .phi_d = 40}, names(),
                         test::random_sample),
          keeps_(keeps) {}

    std::uint64_t keep(std::uint64_t bytes) const override {
        most = std::max(most, bytes);
        return keeps_ ? bytes : 0;
    }
    void read(std::size_t material, VoxelRange range, std::span<double> samples,
              const SampleSink& sink) const override {
        ++reads;
        MemoryDatabase::read(material, range, samples, sink);
    }

    mutable std::uint64_t most = 0;
    mutable std::atomic<int> reads = 0;

  private:
    static std::vector<std::string> names() {
        std::vector<std::string> names;
        for (char name = 'a'; name <= 'z'; ++name) {
            names.emplace_back(1, name);
        }
        return names;
    }
    bool keeps_;
};

TEST(Distances, LeaveAPartOfTheMemoryToTheDatabase) {
    const Metric* const one[] = {&find_metric("cwcbrt")};
    Engines host({.device = kHost});
    const KeepingDatabase large(true);
    compute_distances(host, large, one, {.memory_bytes = 100'000'000});
    EXPECT_EQ(large.most, 50'000'000U);
    const KeepingDatabase small(true);
    compute_distances(host, small, one, {.memory_bytes = 1'000'000});
    EXPECT_LT(small.most, 500'000U);  // slabs come first
    // Refining goes by what is left: with half of the memory materials are read more often.
    const Float64Request request = {one[0], all_pairs(26)};
    const auto reads = [&](bool keeps, std::uint64_t memory) {
        const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 1);
        const KeepingDatabase database(keeps);
        float64_distances(database, {&request, 1}, VoxelSet::above_horizon, {}, memory);
        EXPECT_EQ(database.most, memory / 2);
        return database.reads.load();
    };
    EXPECT_EQ(reads(true, 2'000'000), reads(false, 1'000'000));
    EXPECT_GT(reads(true, 2'000'000), reads(false, 2'000'000));
}

TEST(Distances, StayWithinTheMemoryTheyMayTake) {
    constexpr std::uint64_t kMemory = 10'000'000;
    const FunctionDatabase database({.theta_h = 30, .theta_d = 20, .phi_d = 24}, 30,
                                    test::random_sample);
    struct Way {
        Engines::Use use;
        bool no_float64;
    };
    for (const auto way : {Way{Engines::Use::rest, false}, Way{Engines::Use::everything, false},
                           Way{Engines::Use::everything, true}}) {
        device::Context context({.device = "llvmpipe", .no_float64 = way.no_float64});
        Engines engines(context, way.use);
        const auto result =
            compute_distances(engines, database, some_metrics(), {.memory_bytes = kMemory});
        std::uint64_t bytes = 0;
        for (const auto& engine : result.engines) {
            EXPECT_GT(engine.peak_bytes, 0U);
            bytes += engine.peak_bytes;
        }
        EXPECT_LE(bytes, kMemory + 64 * 1024);  // alignment
        EXPECT_EQ(context.allocated_bytes(), 0U);
    }
}

TEST(Distances, OfOneMaterialWithItselfAreZero) {
    const FunctionDatabase database(
        {.theta_h = 24, .theta_d = 5, .phi_d = 3}, 3,
        [](std::size_t material, std::uint64_t voxel, std::size_t channel) {
            return test::random_sample(material == 2 ? 1 : material, voxel, channel);
        });
    std::vector<const Metric*> all;
    for (const auto& metric : metrics()) {
        all.push_back(&metric);
    }
    for (const bool in_shaders : {false, true}) {
        const auto result = compute_distances(test::engines(in_shaders), database, all);
        for (std::size_t m = 0; m < all.size(); ++m) {
            const auto& d = result.distances[m].values;
            EXPECT_EQ(d[2], 0) << all[m]->name;     // 1 and its copy
            EXPECT_EQ(d[0], d[1]) << all[m]->name;  // 0 to either
            EXPECT_GT(d[0], 0) << all[m]->name;
        }
    }
}

TEST(Distances, OfTwoConstantMaterialsHaveAClosedForm) {
    // White against black under PAWCIELAB: 100 times the root of the weights' mean (Ryman 2018,
    // table 4.2: exact midpoint sum 0.886257 at the grid of MERL).
    const FunctionDatabase database(Grid{}, 2,
                                    [](std::size_t material, std::uint64_t, std::size_t) {
                                        return material == 0 ? 0.0 : 100.0;
                                    });
    const Metric* const one[] = {&find_metric("pawcielab")};
    EXPECT_NEAR(compute_distances(test::host_engines(), database, one).distances[0].values[0],
                88.6257, 1e-4);
}

TEST(Distances, NegativeSamplesCountAsZeroAndAreCounted) {
    const Grid grid = {.theta_h = 6, .theta_d = 6, .phi_d = 6};
    const auto with = [&](double stand_in) {
        return FunctionDatabase(
            grid, 2, [=](std::size_t material, std::uint64_t voxel, std::size_t channel) {
                const bool hole =
                    material == 1 && voxel % 7 == 0 && (channel == 1 || voxel % 2 == 0);
                return hole ? stand_in : 0.5 + static_cast<double>(voxel % 5 + material);
            });
    };
    const auto chosen = some_metrics();
    const auto holes = compute_distances(test::host_engines(), with(-1), chosen);
    const auto zeros = compute_distances(test::host_engines(), with(0), chosen);
    EXPECT_EQ(holes.distances, zeros.distances);
    EXPECT_EQ(holes.counts[0].negative, 0U);
    EXPECT_EQ(holes.counts[1].negative, 31U);  // multiples of 7 below 216
    EXPECT_GT(holes.counts[1].negative_above_horizon, 0U);
    EXPECT_LT(holes.counts[1].negative_above_horizon, 31U);
    EXPECT_EQ(zeros.counts[1].negative, 0U);
}

TEST(Distances, TheDeviceIsTimedHoweverManyMetricsThereAre) {
    const FunctionDatabase database({.theta_h = 13, .theta_d = 11, .phi_d = 17}, 5,
                                    test::random_sample);
    const std::vector<const Metric*> many(17, &find_metric("rmse"));
    const auto result = compute_distances(test::shader_engines(), database, many);
    EXPECT_GT(result.seconds.difference, 0);
    EXPECT_GT(result.seconds.transform, 0);
}

TEST(Distances, ProgressReachesOneAndItsExceptionEndsTheWork) {
    const FunctionDatabase database({.theta_h = 30, .theta_d = 20, .phi_d = 24}, 3,
                                    test::random_sample);
    const Metric* const one[] = {&find_metric("rmse")};
    double last = 0;
    compute_distances(test::host_engines(), database, one, {.progress = [&](double share) {
                          EXPECT_GT(share, last);
                          last = share;
                      }});
    EXPECT_DOUBLE_EQ(last, 1);
    EXPECT_THROW(
        compute_distances(test::host_engines(), database, one,
                          {.progress = [](double) { throw std::runtime_error("enough"); }}),
        std::runtime_error);
    EXPECT_EQ(compute_distances(test::host_engines(), database, one).distances[0].values.size(),
              3U);  // still works
}

TEST(Distances, ProgressIsHeardWhileADeviceWorks) {
    const FunctionDatabase database({.theta_h = 7, .theta_d = 5, .phi_d = 3}, 3,
                                    test::random_sample);
    const Metric* const one[] = {&find_metric("rmse")};
    const auto context = test::other_device("kind=discrete hang-at=1");
    Engines engines(*context);
    double last = 0;
    EXPECT_THROW(compute_distances(engines, database, one,
                                   {.progress =
                                        [&](double share) {
                                            if (share == last) {
                                                throw std::runtime_error("enough");
                                            }
                                            last = share;
                                        }}),
                 std::runtime_error);
    EXPECT_EQ(last, 1);
}

/// One sample of one material is large, and only such samples differ from themselves.
TEST(Distances, WarnOfAMaterialThatDiffersFromItself) {
    const FunctionDatabase database({.theta_h = 6, .theta_d = 5, .phi_d = 8}, 12,
                                    [](std::size_t material, std::uint64_t voxel, std::size_t) {
                                        return (material == 11 && voxel == 37 ? 2000.0 : 200.0) +
                                               static_cast<double>(material);
                                    });
    const std::string rest =
        "vec3 transform(vec3 f, Voxel v) { return f; }\n"
        "float weight(Voxel v) { return 1.0; }\n";
    const auto good =
        test::metric_of(rest + "float difference(vec3 a, vec3 b) { return distance(a, b); }\n");
    auto bad =
        test::metric_of(rest +
                        "float difference(vec3 a, vec3 b) {\n"
                        "    return distance(a, b) + (min(a.x, b.x) > 1000.0 ? 0.25 : 0.0);\n}\n");
    bad.name = "bad.glsl";
    const Metric* const both[] = {&good, &bad};
    const auto result = compute_distances(test::host_engines(), database, both);
    ASSERT_EQ(result.warnings.size(), 1U);
    for (const char* part :
         {"bad.glsl: difference(a, a) is 0.25", "at voxel 37 ", "material \"material-0011\""}) {
        EXPECT_NE(result.warnings[0].find(part), std::string::npos) << result.warnings[0];
    }
    const Metric* const one[] = {&good};
    EXPECT_TRUE(compute_distances(test::host_engines(), database, one).warnings.empty());
}

}  // namespace
}  // namespace merl::engine
