#include "engine/reflectance/metric_kernels.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "engine/device/shader_compiler.h"
#include "engine/error.h"
#include "engine/reflectance/metric_library.h"
#include "engine/reflectance/metric_words.h"

namespace merl::reflectance {
namespace {

using device::ShaderText;

constexpr std::string_view kChosen = "chosen_metric.glsl";  // what the framework includes
constexpr std::string_view kMetric = "metric";              // what that includes

/// The functions of a metric, declared before its file: so a wrong result type is an error there,
/// and a function that is missing one that names it.
struct Function {
    std::string_view name;
    std::string_view declaration;
};
constexpr Function kTransform = {"transform", "vec3 transform(vec3 f, Voxel v)"};
constexpr Function kWeight = {"weight", "float weight(Voxel v)"};
constexpr Function kDifference = {"difference", "float difference(vec3 a, vec3 b)"};
constexpr Function kChannelDifference = {"difference", "float difference(float d)"};

std::vector<Function> functions(const Metric& metric) {
    return {kTransform, kWeight, metric.has_bound() ? kChannelDifference : kDifference};
}

/// A GLSL constant of this value: 100 alone would be an int.
std::string literal(double value) {
    std::string text = fmt::format("{}", value);
    return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

/// chosen_metric.glsl: the functions there must be, the parameters, and the file.
std::string chosen_text(const Metric& metric) {
    std::string text;
    for (const auto& function : functions(metric)) {
        text += fmt::format("{};\n", function.declaration);
    }
    for (std::size_t i = 0; i < metric.parameters.size(); ++i) {
        const auto& name = metric.header.parameters[i].name;
        const auto value = literal(metric.parameters[i]);
        text += fmt::format(
            "#ifdef METRIC_FLOAT64\nconst double {0} = {1}lf;\n#else\nconst float {0} = "
            "{1};\n#endif\n",
            name, value);
    }
    return text + fmt::format("#include \"{}\"\n", kMetric);
}

/// The first error of the compiler's log as one line for the user.
std::string explain(const Metric& metric, std::string_view log) {
    constexpr std::string_view kError = "ERROR: ";
    constexpr std::string_view kNoBody = "No function definition (body) found:";
    if (log.find(kNoBody) != std::string_view::npos) {
        for (const auto& function : functions(metric)) {
            if (log.find(fmt::format("    {}(", function.name)) != std::string_view::npos) {
                return fmt::format(
                    "{}: there is no \"{}\"{}", metric.file, function.declaration,
                    function.name != kDifference.name ? ""
                    : metric.has_bound()
                        ? ", which a metric with a degree needs (leave the degree out for a "
                          "difference of two colours)"
                        : ", which a metric without a degree needs (\"// degree: 2\" declares that "
                          "it is float difference(float d) of each channel)");
            }
        }
    }
    if (log.find("Recursion detected") != std::string_view::npos) {
        return fmt::format(
            "{}: a function calls itself, or others that call it: GLSL has no "
            "recursion",
            metric.file);
    }
    const auto first = log.find(kError);
    if (first == std::string_view::npos) {
        return fmt::format("{}: the compiler refuses it without a reason", metric.file);
    }
    auto line = log.substr(first + kError.size());
    line = line.substr(0, line.find('\n'));
    if (line.starts_with(metric.file + ":")) {
        return std::string(line);
    }
    return fmt::format("{} cannot be compiled: {}", metric.file, line);
}

}  // namespace

MetricKernels compile_kernels(const Metric& metric) {
    check_metric_words(metric.source, metric.file);
    const ShaderText chosen = {std::string(kChosen), chosen_text(metric)};
    // A path must not look like one of the names above.
    const bool looks_built_in = metric.file.starts_with("framework/") || metric.file == kChosen;
    const ShaderText file = {looks_built_in ? "./" + metric.file : metric.file,
                             with_counted_loops(metric.source, metric.file)};
    const auto resolve = [&](std::string_view name,
                             std::string_view includer) -> const ShaderText* {
        const bool from_framework = includer.starts_with("framework/");
        if (name == kChosen) {
            return from_framework ? &chosen : nullptr;
        }
        if (includer == kChosen) {
            return name == kMetric ? &file : nullptr;
        }
        const auto files = shader_files();
        const auto found = std::find_if(files.begin(), files.end(), [&](const ShaderText& f) {
            return std::string_view(f.name) == name;
        });
        const bool allowed = from_framework || name.starts_with("lib/");
        return found != files.end() && allowed ? &*found : nullptr;
    };
    std::string preamble;
    if (metric.has_bound()) {
        const auto slash = metric.header.degree_text.find('/');
        preamble = fmt::format(
            "#define DEGREE_NUMERATOR {}\n#define DEGREE_DENOMINATOR {}\n",
            metric.header.degree_text.substr(0, slash),
            slash == std::string::npos ? "1" : metric.header.degree_text.substr(slash + 1));
    }
    if (file.text != metric.source) {
        preamble += "#define COUNTED_LOOPS\n";
    }
    const auto compile = [&](const char* stage) {
        const std::string name = fmt::format("framework/{}.comp", stage);
        const auto files = shader_files();
        const auto shader = std::find_if(files.begin(), files.end(),
                                         [&](const ShaderText& f) { return f.name == name; });
        try {
            return device::compile_shader(*shader, preamble, resolve);
        } catch (const device::ShaderRefused& refused) {
            throw Error(Fault::input, explain(metric, refused.what()));
        }
    };
    const auto compile_if = [&](bool needed, const char* stage) {
        return needed ? compile(stage) : std::vector<std::uint32_t>();
    };
    return {.weigh = compile_if(!metric.has_twin(), "weigh"),
            .prepare = compile_if(!metric.has_twin(), "prepare"),
            .difference = compile(metric.has_bound() ? "difference" : "any_difference"),
            .norms = compile_if(metric.has_norms(), "norms"),
            .ranges = compile_if(metric.has_slopes(), "ranges"),
            .slopes = compile_if(metric.has_slopes(), "slopes"),
            .check = compile_if(metric.is_checked(), "check")};
}

}  // namespace merl::reflectance
