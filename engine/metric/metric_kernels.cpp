#include "engine/metric/metric_kernels.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <string_view>

#include "engine/base/error.h"
#include "engine/base/number.h"
#include "engine/device/shader_compiler.h"
#include "engine/metric/check/code.h"
#include "engine/metric/check/words.h"
#include "engine/metric/double_literals.h"
#include "engine/metric/metric_library.h"

namespace merl::engine {
namespace {

using device::ShaderText;

/// What the compiler calls a metric's file, whatever it is called: a path may have quotes in it.
const std::string kText = "metric";

/// And what it calls the lines before it, parameters_text().
const std::string kParameters = "parameters";

/// A metric of 256 KiB may have macros.
constexpr std::size_t kMostBytes = std::size_t{1} << 20U;

/// The functions of a metric, as shaders/framework/metric.glsl declares them.
struct Function {
    std::string_view name;
    std::string_view declaration;
};
constexpr Function kTransform = {"transform", "vec3 transform(vec3 f, Voxel v)"};
constexpr Function kWeight = {"weight", "float weight(Voxel v)"};
constexpr Function kDifference = {"difference", "float difference(vec3 a, vec3 b)"};
constexpr Function kChannelDifference = {"difference", "float difference(float d)"};
constexpr Function kWindow = {"window", "float window(int w, Voxel v)"};
constexpr Function kFeature = {"feature", "float feature(int i, Means m)"};

std::vector<Function> functions(const Metric& metric) {
    if (metric.is_summary()) {
        return {kWindow, kFeature};
    }
    return {kTransform, kWeight, metric.has_degree() ? kChannelDifference : kDifference};
}

/// A GLSL constant of this value: 100 alone would be an int.
std::string literal(double value) {
    std::string text = fmt::format("{}", value);
    return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

/// The parameters and windows of a metric, and what else its text needs before its first line.
/// Those of a user's are specialization constants: see kFirstParameter.
std::string parameters_text(const Metric& metric) {
    std::string text = "#ifdef METRIC_FLOAT64\n#include \"framework/float64_names.glsl\"\n#endif\n";
    for (std::size_t i = 0; i < metric.parameters.size(); ++i) {
        const auto& name = metric.header.parameters[i].name;
        const auto value = literal(metric.parameters[i]);
        const auto layout = metric.is_checked()
                                ? fmt::format("layout(constant_id = {}) ", kFirstParameter + i)
                                : "";
        text += fmt::format(
            "#ifdef METRIC_FLOAT64\n{0}const double {1} = {2}lf;\n#else\n{0}const float {1} = "
            "{2};\n#endif\n",
            layout, name, value);
    }
    for (std::size_t w = 0; w < metric.header.windows.size(); ++w) {
        text += fmt::format("const int {} = {};\n", metric.header.windows[w].name, w);
    }
    return text;
}

const ShaderText* find_file(std::string_view name) {
    const auto files = shader_files();
    const auto found = std::find_if(files.begin(), files.end(), [&](const ShaderText& f) {
        return std::string_view(f.name) == name;
    });
    return found == files.end() ? nullptr : &*found;
}

/// The parameter or window whose name is why the compiler stops at this line of its log: what comes
/// before the metric has nothing else in it that it could refuse, and a function of lib/ may have
/// the same name. None when it is something else.
const std::string* clashing_name(const Metric& metric, std::string_view line) {
    std::vector<const std::string*> names;
    for (const auto& parameter : metric.header.parameters) {
        names.push_back(&parameter.name);
    }
    for (const auto& window : metric.header.windows) {
        names.push_back(&window.name);
    }
    const auto first = [&](const auto& is_it) {
        const auto found =
            std::ranges::find_if(names, [&](const std::string* name) { return is_it(*name); });
        return found == names.end() ? nullptr : *found;
    };
    if (line.starts_with(kParameters + ":")) {
        const auto number = line.substr(kParameters.size() + 1);
        const auto at = parse_number<std::size_t>(number.substr(0, number.find(':')));
        const std::string text = parameters_text(metric);
        std::string_view rest = text;
        for (std::size_t i = 1; at && i < *at && !rest.empty(); ++i) {
            rest.remove_prefix(std::min(rest.find('\n'), rest.size() - 1) + 1);
        }
        const auto declaration = rest.substr(0, rest.find('\n'));
        return first([&](const std::string& name) {
            return declaration.find(fmt::format(" {} = ", name)) != std::string_view::npos;
        });
    }
    if (line.starts_with("lib/")) {
        return first([&](const std::string& name) {
            return line.find(fmt::format("'{}'", name)) != std::string_view::npos;
        });
    }
    return nullptr;
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
                    : metric.has_degree()
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
    line = line.substr(0, line.find_last_not_of(' ') + 1);
    if (const auto* const name = clashing_name(metric, line)) {
        return fmt::format(
            "{}: \"{}\" is a word of GLSL, or of a file in lib/: choose another name", metric.file,
            *name);
    }
    std::string what_to_do;
    if (line.find("overloaded functions must have the same return type") !=
        std::string_view::npos) {
        for (const auto& function : functions(metric)) {
            if (line.find(fmt::format("'{}'", function.name)) != std::string_view::npos) {
                what_to_do = fmt::format(": expected \"{}\"", function.declaration);
            }
        }
    } else if (line.find("global const initializers must be constant") != std::string_view::npos) {
        what_to_do =
            ": what is computed from a parameter, or by a function of the file, belongs into the "
            "function that uses it";
    } else if (line.find("array size must be a constant") != std::string_view::npos) {
        what_to_do = ", and a parameter is none";
    }
    if (line.starts_with(kText + ":")) {
        return metric.file + std::string(line.substr(kText.size())) + what_to_do;
    }
    return fmt::format("{} cannot be compiled: {}", metric.file, line);
}

/// The text of a metric without its macros, so that they end with it.
std::string preprocessed(const Metric& metric) {
    const auto library_only = [](std::string_view name, std::string_view) {
        return name.starts_with("lib/") ? find_file(name) : nullptr;
    };
    std::string text;
    try {
        text = device::preprocess_shader({kText, metric.source}, library_only);
    } catch (const device::ShaderRefused& refused) {
        throw InputError(explain(metric, refused.what()));
    }
    if (text.size() > kMostBytes) {
        throw InputError(
            fmt::format("{}: its macros make more than {} bytes of it", metric.file, kMostBytes));
    }
    check_metric_words(text, kText, metric.file);
    return text;
}

/// Refuses, in a user's summary, what a metric over voxels has: nothing would call it.
void require_summary_only(const Metric& metric, const spirv::Module& module) {
    constexpr std::array<Function, 4> kOthers = {{{"transform(vd3;struct-Voxel", kTransform.name},
                                                  {"weight(struct-Voxel", kWeight.name},
                                                  {"difference(d1;", kDifference.name},
                                                  {"difference(vd3;vd3;", kDifference.name}}};
    for (const auto& function : module.functions) {
        const auto& name = module.name(function.id());
        for (const auto& [beginning, short_name] : kOthers) {
            if (name.starts_with(beginning)) {
                throw InputError(
                    fmt::format("{}:{}: {}() beside windows and features: a summary has window() "
                                "and feature(), and nothing calls another",
                                metric.file, function.head.line, short_name));
            }
        }
    }
}

/// Tells a kernel what it is to do with numbers, as far as its device can be told. In GLSL an
/// execution mode can be given for one width only.
void declare(const device::FloatControls& floats, bool keeps_nan, spirv::Module& module) {
    const auto to_nearest = [&](spirv::Word width) {
        module.declare(spv::ExecutionModeRoundingModeRTE, width, spv::CapabilityRoundingModeRTE);
    };
    if (floats.to_nearest) {
        to_nearest(32);
    }
    if (floats.to_nearest && floats.both_to_nearest) {
        to_nearest(64);
    }
    // Not where nobody looks for NaN: difference.comp would take twice as long on lavapipe.
    if (keeps_nan) {
        module.declare(spv::ExecutionModeSignedZeroInfNanPreserve, 32,
                       spv::CapabilitySignedZeroInfNanPreserve);
    }
}

/// Compiles kernels of the framework with one metric.
class Compiler {
  public:
    Compiler(const Metric& metric, const device::FloatControls& floats)
        : metric_(metric), floats_(floats), preamble_(preamble(metric, floats)) {
        const ShaderText parameters = {kParameters, parameters_text(metric)};
        const std::string plain = preprocessed(metric);
        in_float32_ = {parameters, {kText, plain}};
        in_float64_ = {parameters, {kText, with_double_literals(plain)}};
        if ((metric.is_checked() || metric.is_summary()) && !floats.float64) {
            throw std::logic_error(metric.name + " needs float64 in shaders");
        }
    }

    std::vector<std::uint32_t> kernel(const char* stage, bool has_metric,
                                      const char* defines = "") const {
        const auto any_file = [](std::string_view name, std::string_view) {
            return find_file(name);
        };
        const auto* const shader = find_file(fmt::format("framework/{}.comp", stage));
        const bool is_guarded = has_metric && metric_.is_checked();
        const bool keeps_nan = is_guarded && floats_.keeps_nan;
        const bool is_float64 = shader->text.find("#define METRIC_FLOAT64") != std::string::npos;
        const auto& text = is_float64 ? in_float64_ : in_float32_;
        spirv::Module module;
        try {
            module = spirv::Module(device::compile_shader(
                *shader, preamble_ + (keeps_nan ? "#define KEEPS_NAN\n" : "") + defines, any_file,
                has_metric ? std::span(text) : std::span<const ShaderText>(),
                // The code of a metric is given calls afterwards.
                is_guarded ? device::Uncalled::kept : device::Uncalled::dropped));
        } catch (const device::ShaderRefused& refused) {
            throw InputError(explain(metric_, refused.what()));
        }
        if (is_guarded) {
            if (metric_.is_summary()) {
                require_summary_only(metric_, module);
            }
            fix_parameters(module);
            guard_metric_code(module, check_metric_code(module, metric_.file, kText));
        }
        declare(floats_, keeps_nan, module);
        return module.words();
    }

  private:
    static std::string preamble(const Metric& metric, const device::FloatControls& floats) {
        std::string preamble = fmt::format(
            "#define BLOCK_VOXELS {}\n#define CELL_VOXELS {}\n#define CHUNK_TEXELS {}\n"
            "#define RUN_TEXELS {}\n#define WINDOW_LANES {}\n",
            kBlockVoxels, kCellVoxels, kChunkTexels, kRunTexels, kWindowLanes);
        if (metric.is_checked()) {
            preamble += "#define GUARDED\n";
        }
        if (floats.adds_float64) {
            preamble += "#define ADDS_FLOAT64\n";
        }
        if (floats.to_nearest) {
            preamble += "#define ROUNDS_TO_NEAREST\n";
        }
        if (metric.is_summary()) {
            preamble += fmt::format("#define WINDOWS {}\n", metric.header.windows.size());
        } else if (metric.has_degree()) {
            const auto slash = metric.header.degree_text.find('/');
            preamble += fmt::format(
                "#define DEGREE_NUMERATOR {}\n#define DEGREE_DENOMINATOR {}\n",
                metric.header.degree_text.substr(0, slash),
                slash == std::string::npos ? "1" : metric.header.degree_text.substr(slash + 1));
        }
        return preamble;
    }

    const Metric& metric_;
    const device::FloatControls& floats_;
    std::array<ShaderText, 2> in_float32_;
    std::array<ShaderText, 2> in_float64_;
    std::string preamble_;
};

}  // namespace

MetricKernels compile_kernels(const Metric& metric, const device::FloatControls& floats) {
    const Compiler compiler(metric, floats);
    const auto compile = [&](const char* stage, bool has_metric) {
        return compiler.kernel(stage, has_metric);
    };
    if (metric.is_summary()) {
        MetricKernels kernels;
        kernels.window = compile("window", true);
        kernels.window_parts = compile("window_parts", false);
        kernels.window_sums = compile("window_sums", false);
        if (metric.is_checked()) {  // the library's are those of its twin, on every device
            kernels.feature = compile("feature", true);
        }
        return kernels;
    }
    const auto compile_if = [&](bool needed, const char* stage, bool has_metric) {
        return needed ? compile(stage, has_metric) : std::vector<std::uint32_t>();
    };
    return {.weigh = compile_if(floats.float64, "weigh", true),
            .prepare = compile_if(floats.float64, "prepare", true),
            .difference = metric.has_degree() ? compile("difference", false)
                                              : compile("any_difference", true),
            .norms = compile_if(metric.has_norms(), "norms", false),
            .ranges = compile_if(metric.has_slopes(), "ranges", false),
            .slopes = compile_if(metric.has_slopes(), "slopes", false),
            .check = compile_if(metric.is_checked(), "check", true),
            .degree = compile_if(metric.is_checked() && metric.has_degree(), "degree", true)};
}

Float64Kernels compile_float64_kernels(const Metric& metric, const device::FloatControls& floats) {
    const Compiler compiler(metric, floats);
    return {.weigh = compiler.kernel("weigh", true, "#define UNFOLDED\n"),
            .grid = compiler.kernel("float64_grid", true),
            .sums = compiler.kernel("float64_sums", false)};
}

std::vector<std::uint32_t> compile_feature(const Metric& metric,
                                           const device::FloatControls& floats) {
    return Compiler(metric, floats).kernel("feature", true);
}

}  // namespace merl::engine
