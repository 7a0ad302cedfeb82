#include "engine/device/shader_compiler.h"

#include <SPIRV/GlslangToSpv.h>
#include <fmt/format.h>
#include <glslang/Public/ResourceLimits.h>
#include <glslang/Public/ShaderLang.h>

#include <array>
#include <memory>
#include <mutex>
#include <utility>

namespace merl::device {
namespace {

/// Deep enough for any shader here, and an end to files that include each other.
constexpr std::size_t kIncludeDepth = 8;

constexpr int kVersion = 460;

class Includer : public glslang::TShader::Includer {
  public:
    explicit Includer(const IncludeResolver& resolve) : resolve_(resolve) {}

    IncludeResult* includeLocal(const char* name, const char* includer,
                                std::size_t depth) override {
        const ShaderText* found = depth <= kIncludeDepth ? resolve_(name, includer) : nullptr;
        return found == nullptr ? nullptr
                                : std::make_unique<IncludeResult>(found->name, found->text.data(),
                                                                  found->text.size(), nullptr)
                                      .release();
    }

    void releaseInclude(IncludeResult* result) override {
        const std::unique_ptr<IncludeResult> owned(result);
    }

  private:
    const IncludeResolver& resolve_;
};

/// glslang keeps tables for the whole process.
void initialize_once() {
    struct Process {
        Process() { glslang::InitializeProcess(); }
        ~Process() { glslang::FinalizeProcess(); }
        Process(const Process&) = delete;
        Process& operator=(const Process&) = delete;
    };
    static const Process process;
}

/// What glslang needs to know of every shader; the texts are read one after the other.
class Shader {
  public:
    /// The texts must outlive it.
    Shader(std::span<const ShaderText* const> texts, std::string preamble)
        : preamble_(std::move(preamble)) {
        for (const auto* const text : texts) {
            texts_.push_back(text->text.data());
            lengths_.push_back(static_cast<int>(text->text.size()));
            names_.push_back(text->name.c_str());
        }
        shader_.setStringsWithLengthsAndNames(texts_.data(), lengths_.data(), names_.data(),
                                              static_cast<int>(texts_.size()));
        shader_.setPreamble(preamble_.c_str());  // which keeps the pointer
        shader_.setEnvInput(glslang::EShSourceGlsl, EShLangCompute, glslang::EShClientVulkan, 100);
        shader_.setEnvClient(glslang::EShClientVulkan, glslang::EShTargetVulkan_1_2);
        shader_.setEnvTarget(glslang::EShTargetSpv, glslang::EShTargetSpv_1_5);
    }

    glslang::TShader* operator->() { return &shader_; }
    glslang::TShader* get() { return &shader_; }

  private:
    std::vector<const char*> texts_;
    std::vector<int> lengths_;
    std::vector<const char*> names_;
    std::string preamble_;
    glslang::TShader shader_{EShLangCompute};
};

constexpr auto kMessages = static_cast<EShMessages>(EShMsgSpvRules | EShMsgVulkanRules);

std::mutex one_at_a_time;

}  // namespace

std::string preprocess_shader(const ShaderText& text, const IncludeResolver& resolve) {
    const std::scoped_lock lock(one_at_a_time);
    initialize_once();
    const ShaderText beginning = {
        "",
        fmt::format("#version {}\n#extension GL_GOOGLE_include_directive : require\n", kVersion)};
    const std::array<const ShaderText*, 2> texts = {&beginning, &text};
    Shader shader(texts, "");
    Includer includer(resolve);
    std::string result;
    if (!shader->preprocess(GetDefaultResources(), kVersion, ENoProfile, false, false, kMessages,
                            &result, includer)) {
        throw ShaderRefused(shader->getInfoLog());
    }
    if (!result.starts_with(beginning.text)) {
        throw std::runtime_error("the preprocessor changes the beginning of a shader");
    }
    return result.substr(beginning.text.size());
}

std::vector<std::uint32_t> compile_shader(const ShaderText& shader, const std::string& preamble,
                                          const IncludeResolver& resolve,
                                          std::span<const ShaderText> rest, Uncalled uncalled) {
    const std::scoped_lock lock(one_at_a_time);
    initialize_once();
    std::vector<const ShaderText*> texts = {&shader};
    for (const auto& text : rest) {
        texts.push_back(&text);
    }
    Shader compute(texts, preamble);
    Includer includer(resolve);
    const auto messages = uncalled == Uncalled::kept
                              ? static_cast<EShMessages>(kMessages | EShMsgKeepUncalled)
                              : kMessages;
    if (!compute->parse(GetDefaultResources(), kVersion, false, messages, includer)) {
        throw ShaderRefused(compute->getInfoLog());
    }
    glslang::TProgram program;
    program.addShader(compute.get());
    if (!program.link(messages)) {
        throw ShaderRefused(program.getInfoLog());
    }
    std::vector<std::uint32_t> spirv;
    glslang::SpvOptions options;
    options.generateDebugInfo = true;
    glslang::GlslangToSpv(*program.getIntermediate(EShLangCompute), spirv, &options);
    return spirv;
}

}  // namespace merl::device
