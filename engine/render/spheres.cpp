#include "engine/render/spheres.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "engine/base/error.h"
#include "engine/database/content_hash.h"
#include "engine/device/buffer.h"
#include "engine/device/kernel.h"
#include "engine/device/paced_work.h"
#include "engine/device/shader_compiler.h"
#include "engine/device/submission.h"
#include "engine/metric/metric_library.h"

namespace merl::engine {
namespace {

using device::Binding;
using device::BoundKernel;
using device::Buffer;
using device::Context;
using device::Kernel;
using device::PacedWork;
using device::Submission;
using device::Texels;
using device::Traffic;
using device::WorkBudget;

using Texel = std::array<float, 4>;

constexpr double kFill = 0.9;       // of half the image's height
constexpr std::uint32_t kSide = 8;  // of a workgroup, as in the shader

/// What a pixel takes, in float32 operations: 16 samples where the silhouette crosses it, of some
/// 500 each (eight texels in places of their own, three arc tangents, roots). Most pixels have 4,
/// but lanes wait for those beside them.
constexpr double kPixelOperations = 16 * 500;

/// Push constants of shaders/render/sphere.comp.
struct Push {
    std::uint32_t phi_d, theta_d, theta_h, size;
    float light[3];
    float tangent, camera, phi_range;
};

Push make_push(const Grid& grid, const SphereOptions& options, std::size_t light) {
    const auto& l = options.lights[light];
    const double length = std::hypot(l[0], l[1], l[2]);
    const double tangent = std::tan(options.field_of_view / 2 * std::numbers::pi / 180);
    // The silhouette is seen under an angle whose sine is one over the distance.
    const double camera = 1 / std::sin(std::atan(kFill * tangent));
    const auto number = [](double value) { return static_cast<float>(value); };
    return {grid.phi_d,
            grid.theta_d,
            grid.theta_h,
            options.size,
            {number(l[0] / length), number(l[1] / length), number(l[2] / length)},
            number(tangent),
            number(camera),
            number(grid.phi_d_range == PhiDRange::pi ? std::numbers::pi : 2 * std::numbers::pi)};
}

std::vector<std::uint32_t> compile_sphere() {
    const auto files = shader_files();
    const auto file = std::ranges::find(files, "render/sphere.comp", &device::ShaderText::name);
    return device::compile_shader(*file, "",
                                  [](std::string_view, std::string_view) { return nullptr; });
}

/// All samples of a material as texels, none negative. Returns the hash of what was read.
std::string fill_texels(const Database& database, std::size_t material, std::span<Texel> texels) {
    ContentHash hash(1);
    read_material(
        database, material, hash.sink(0), [&](VoxelRange range, std::span<const double> planes) {
            for (std::uint64_t i = 0; i < range.size(); ++i) {
                Texel& texel = texels[range.first + i];
                for (std::size_t plane = 0; plane < 3; ++plane) {
                    texel[plane] =
                        static_cast<float>(std::max(0.0, planes[plane * range.size() + i]));
                }
                texel[3] = 0;
            }
        });
    return hash.material_digest(0, database.grid().text());
}

void require_room(const device::Limits& limits, const Grid& grid, const SphereOptions& options) {
    const std::uint64_t texels = grid.voxels();
    const std::uint64_t image = std::uint64_t{options.size} * options.size * sizeof(SpherePixel);
    const std::uint64_t most =
        std::min(limits.texel_buffer_texels,
                 std::min(limits.allocation_bytes, limits.storage_buffer_bytes) / sizeof(Texel));
    if (texels > most) {
        throw Error(Fault::device,
                    fmt::format("a material of {} samples does not fit into one buffer of this "
                                "device, which takes {}",
                                texels, most));
    }
    if (image > limits.storage_buffer_bytes) {
        throw Error(Fault::device,
                    fmt::format("an image of {} x {} pixels does not fit into one buffer of this "
                                "device, which takes {} bytes",
                                options.size, options.size, limits.storage_buffer_bytes));
    }
}

/// What one material needs on the device. There are two: one is filled while the other works.
class Slot {
  public:
    Slot(Context& context, const Kernel& kernel, const Grid& grid, const SphereOptions& options,
         WorkBudget& budget)
        : grid_(grid),
          options_(options),
          budget_(budget),
          samples_(context, grid.voxels() * sizeof(Texel), Traffic::upload, Texels::floats),
          submission_(context) {
        for (std::size_t light = 0; light < options.lights.size(); ++light) {
            images_.emplace_back(context,
                                 std::uint64_t{options.size} * options.size * sizeof(SpherePixel),
                                 Traffic::download);
            const std::array<Buffer*, 2> buffers = {&samples_, &images_[light]};
            bound_.emplace_back(context, kernel, buffers);
        }
    }

    void start(const Database& database, std::size_t material, std::size_t number) {
        content_hash_ = fill_texels(database, material, samples_.host_as<Texel>());
        record();
        submission_.submit();
        running_ = true;
        number_ = number;
    }

    /// Hands over what was started, if anything was.
    void finish(const SphereSink& sink, const std::function<void()>& meanwhile) {
        if (!running_) {
            return;
        }
        submission_.wait(meanwhile);
        running_ = false;
        budget_.measured(pixels_, submission_.seconds().front());
        for (std::size_t light = 0; light < images_.size(); ++light) {
            sink({.material = number_,
                  .light = light,
                  .pixels = images_[light].host_as<const SpherePixel>(),
                  .content_hash = content_hash_});
        }
    }

  private:
    /// Anew for each material, since the budget changes.
    void record() {
        submission_.begin();
        submission_.upload(samples_, samples_.bytes());
        submission_.mark();
        PacedWork work(submission_);
        pixels_ = 0;
        const std::uint32_t groups = (options_.size + kSide - 1) / kSide;
        for (std::size_t light = 0; light < images_.size(); ++light) {
            const Push push = make_push(grid_, options_, light);
            work.dispatch(bound_[light], std::as_bytes(std::span(&push, 1)), groups, groups,
                          {kSide * kSide, budget_, pixels_});
            submission_.download(images_[light], images_[light].bytes());
        }
        submission_.mark();
    }

    const Grid& grid_;
    const SphereOptions& options_;
    WorkBudget& budget_;  // in pixels, of both slots
    double pixels_ = 0;   // that were recorded
    Buffer samples_;
    std::vector<Buffer> images_;
    std::vector<BoundKernel> bound_;
    Submission submission_;
    bool running_ = false;
    std::size_t number_ = 0;
    std::string content_hash_;  // of the material that was started
};

}  // namespace

void render_spheres(Context& context, const Database& database,
                    std::span<const std::size_t> materials, const SphereOptions& options,
                    const SphereSink& sink, const std::function<void()>& meanwhile) {
    require_room(context.limits(), database.grid(), options);
    const Kernel kernel(context, "sphere", compile_sphere(),
                        Kernel::Options{.bindings = {Binding::texels, Binding::storage},
                                        .constants = {},
                                        .push_bytes = sizeof(Push),
                                        .one_subgroup = false});
    WorkBudget budget(context.info(), kPixelOperations);
    Slot even(context, kernel, database.grid(), options, budget);
    Slot odd(context, kernel, database.grid(), options, budget);
    for (std::size_t i = 0; i < materials.size(); ++i) {
        Slot& slot = i % 2 == 0 ? even : odd;
        slot.start(database, materials[i], i);
        (i % 2 == 0 ? odd : even).finish(sink, meanwhile);
    }
    (materials.size() % 2 == 0 ? odd : even).finish(sink, meanwhile);
    context.check_validation();
}

}  // namespace merl::engine
