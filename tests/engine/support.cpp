#include "tests/engine/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "engine/base/error.h"
#include "engine/database/content_hash.h"
#include "engine/database/merl_file.h"
#include "engine/device/shader_compiler.h"
#include "engine/metric/metric_header.h"
#include "engine/metric/metric_library.h"

namespace merl::test {

namespace {

std::vector<std::string> material_names(std::size_t materials) {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < materials; ++i) {
        names.push_back(fmt::format("material-{:04}", i));
    }
    return names;
}

}  // namespace

device::Context& lavapipe() {
    device::widen_lavapipe();
    static device::Context context({.device = "llvmpipe"});
    return context;
}

engine::Engines& host_engines() {
    static engine::Engines engines(lavapipe(), engine::Engines::Use::rest);
    return engines;
}

engine::Engines& shader_engines() {
    static engine::Engines engines(lavapipe());
    return engines;
}

device::Context& lavapipe_with_staging() {
    static device::Context context({.device = "llvmpipe", .force_staging = true});
    return context;
}

device::Context& lavapipe_without_float64() {
    static device::Context context({.device = "llvmpipe", .no_float64 = true});
    return context;
}

FunctionDatabase::FunctionDatabase(const engine::Grid& grid, std::size_t materials,
                                   const Sample& sample)
    : MemoryDatabase("a function", grid, material_names(materials), sample) {}

double random_sample(std::size_t material, std::uint64_t voxel, std::size_t channel) {
    // SplitMix64 (Steele et al. 2014) of the place: the same number wherever it is asked for.
    std::uint64_t x =
        (material * 3 + channel) * 0x9e3779b97f4a7c15 + voxel * 0xbf58476d1ce4e5b9 + 1;
    x = (x ^ x >> 30U) * 0xbf58476d1ce4e5b9;
    x = (x ^ x >> 27U) * 0x94d049bb133111eb;
    x ^= x >> 31U;
    const double uniform = static_cast<double>(x >> 11U) * 0x1p-53;
    return uniform < 0.02 ? -1.0 : std::pow(10.0, 6 * uniform - 3);
}

std::vector<std::uint32_t> compile(const std::string& path, const std::string& preamble) {
    std::ifstream file(path);
    const device::ShaderText shader = {path, {std::istreambuf_iterator<char>(file), {}}};
    return device::compile_shader(shader, preamble, [](std::string_view name, std::string_view) {
        const auto files = engine::shader_files();
        const auto found =
            std::find_if(files.begin(), files.end(),
                         [&](const device::ShaderText& f) { return f.name == name; });
        return found == files.end() ? nullptr : &*found;
    });
}

std::string hash_of_database(const engine::Database& database) {
    return engine::content_hash_of(database, [](double) {});
}

void expect_refused(const std::function<void()>& use, const std::string& words) {
    try {
        use();
        ADD_FAILURE() << words;
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
}

TemporaryDirectory::TemporaryDirectory() {
    std::string name = (std::filesystem::temp_directory_path() / "merl-scan-test-XXXXXX").string();
    path = ::mkdtemp(name.data());
}

TemporaryDirectory::~TemporaryDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
}

engine::Metric metric_of(const std::string& source) {
    engine::Metric metric;
    metric.name = "my.glsl";
    metric.file = "./my.glsl";
    metric.source = source;
    metric.header = engine::parse_metric_header(source, metric.file);
    for (const auto& p : metric.header.parameters) {
        metric.parameters.push_back(p.value);
    }
    return metric;
}

void write_merl_file(const std::filesystem::path& path, const engine::Database& database,
                     std::size_t material) {
    std::ofstream(path, std::ios::binary) << engine::merl_file(database, material);
}

}  // namespace merl::test
