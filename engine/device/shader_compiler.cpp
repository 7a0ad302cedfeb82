#include "engine/device/shader_compiler.h"

#include <SPIRV/GlslangToSpv.h>
#include <glslang/Public/ResourceLimits.h>
#include <glslang/Public/ShaderLang.h>

#include <array>
#include <memory>
#include <mutex>

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

}  // namespace

std::vector<std::uint32_t> compile_shader(const ShaderText& shader, const std::string& preamble,
                                          const IncludeResolver& resolve) {
    static std::mutex one_at_a_time;
    const std::scoped_lock lock(one_at_a_time);
    initialize_once();

    glslang::TShader compute(EShLangCompute);
    const std::array texts = {shader.text.data()};
    const std::array lengths = {static_cast<int>(shader.text.size())};
    const std::array names = {shader.name.c_str()};
    compute.setStringsWithLengthsAndNames(texts.data(), lengths.data(), names.data(), 1);
    compute.setPreamble(preamble.c_str());
    compute.setEnvInput(glslang::EShSourceGlsl, EShLangCompute, glslang::EShClientVulkan, 100);
    compute.setEnvClient(glslang::EShClientVulkan, glslang::EShTargetVulkan_1_2);
    compute.setEnvTarget(glslang::EShTargetSpv, glslang::EShTargetSpv_1_5);
    constexpr auto kMessages = static_cast<EShMessages>(EShMsgSpvRules | EShMsgVulkanRules);
    Includer includer(resolve);
    if (!compute.parse(GetDefaultResources(), kVersion, false, kMessages, includer)) {
        throw ShaderRefused(compute.getInfoLog());
    }
    glslang::TProgram program;
    program.addShader(&compute);
    if (!program.link(kMessages)) {
        throw ShaderRefused(program.getInfoLog());
    }
    std::vector<std::uint32_t> spirv;
    glslang::SpvOptions options;
    glslang::GlslangToSpv(*program.getIntermediate(EShLangCompute), spirv, &options);
    return spirv;
}

}  // namespace merl::device
