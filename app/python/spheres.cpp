#include "app/pipeline/spheres.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "app/python/call.h"
#include "app/python/handles.h"
#include "app/python/text.h"
#include "engine/base/error.h"

namespace py = pybind11;

namespace merl::python {
namespace {

py::array_t<float> render(const DatabaseHandle& handle, std::size_t material, std::int64_t size,
                          double field_of_view, const std::array<double, 3>& light, double exposure,
                          double background, const std::string& encoding, const py::dict& call) {
    if (material >= handle.database->materials().size()) {
        throw py::index_error("no such material");
    }
    constexpr std::int64_t kMostPixels = 8192;
    constexpr double kMostStops = 30;  // as --exposure
    const double length = std::hypot(light[0], light[1], light[2]);
    if (size < 1 || size > kMostPixels) {
        throw Error(Fault::usage, "size: expected 1 to 8192 pixels, found " + std::to_string(size));
    }
    if (!(field_of_view > 0 && field_of_view < 180) || !(background >= 0 && background <= 1) ||
        !(std::abs(exposure) <= kMostStops) || !std::isfinite(length) || length == 0) {
        throw Error(Fault::usage,
                    "expected a field of view between 0 and 180 degrees, a background from 0 to 1, "
                    "an exposure from -30 to 30 stops and a direction of light that is not 0");
    }
    pipeline::SphereView view = {
        .sphere = {.size = static_cast<std::uint32_t>(size),
                   .field_of_view = field_of_view,
                   .lights = {light}},
        .exposure = exposure,
        .background = background,
        .encoding = encoding == "srgb" ? pipeline::Encoding::srgb : pipeline::Encoding::gamma};
    if (encoding != "gamma" && encoding != "srgb" && encoding != "linear") {
        throw Error(Fault::usage,
                    "encoding: found \"" + encoding + "\"; expected gamma, srgb or linear");
    }
    const auto options = call_options(call);
    pipeline::Image image(1, 1);
    run(options, [&](const pipeline::Control& control) {
        const std::size_t one[] = {material};
        pipeline::render_spheres(
            *handle.database, one, view, {.device = options.device},
            [&](const engine::SphereImage&, const pipeline::Image& linear) { image = linear; },
            control);
        if (encoding != "linear") {
            image = pipeline::displayed(image, view);
        }
    });
    py::array_t<float> pixels({static_cast<py::ssize_t>(image.height),
                               static_cast<py::ssize_t>(image.width), py::ssize_t{3}});
    std::copy_n(image.pixels.front().data(), 3 * image.pixels.size(), pixels.mutable_data());
    return pixels;
}

}  // namespace

void bind_spheres(py::module_& module) {
    module.def("render", render);
}

}  // namespace merl::python
