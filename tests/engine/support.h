#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "engine/database/memory_database.h"
#include "engine/device/context.h"
#include "engine/distance/engines.h"
#include "engine/metric/metric.h"

namespace merl::test {

/// The lavapipe context all tests share, so that the driver stays loaded.
device::Context& lavapipe();

/// The same device, but every copy goes through staging buffers, as on a discrete GPU.
device::Context& lavapipe_with_staging();

/// The same device, but as if its shaders had no float64: the host makes its grids.
device::Context& lavapipe_without_float64();

/// Where distances are computed: by the host engine, with lavapipe for what it cannot do well; or
/// all of it in lavapipe's shaders.
engine::Engines& host_engines();
engine::Engines& shader_engines();
inline engine::Engines& engines(bool in_shaders) {
    return in_shaders ? shader_engines() : host_engines();
}

/// A database whose samples come from a function of material, file index and channel.
class FunctionDatabase final : public engine::MemoryDatabase {
  public:
    FunctionDatabase(const engine::Grid& grid, std::size_t materials, const Sample& sample);
};

/// Reproducible numbers that look like reflectance: from 1e-3 to 1e3 1/sr, some not measured.
double random_sample(std::size_t material, std::uint64_t voxel, std::size_t channel);

/// The SPIR-V of a shader of the tests, which may include those of shaders/.
std::vector<std::uint32_t> compile(const std::string& path, const std::string& preamble = "");

/// A metric of these lines, as if it was a user's file my.glsl, with its parameters at their
/// defaults.
engine::Metric metric_of(const std::string& source);

/// Writes a material of a database as a MERL file.
void write_merl_file(const std::filesystem::path& path, const engine::Database& database,
                     std::size_t material);

std::string hash_of_database(const engine::Database& database);

/// Expects an InputError with these words.
void expect_refused(const std::function<void()>& use, const std::string& words);

/// A directory that is removed at the end of the test.
class TemporaryDirectory {
  public:
    TemporaryDirectory();
    ~TemporaryDirectory();
    std::filesystem::path path;
};

}  // namespace merl::test
