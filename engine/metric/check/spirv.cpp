#include "engine/metric/check/spirv.h"

#include <algorithm>
#include <stdexcept>

namespace merl::engine::spirv {
namespace {

const std::string kNone;

std::string text_of(std::span<const Word> words) {
    std::string text;
    for (const Word word : words) {
        for (unsigned shift = 0; shift < 32; shift += 8) {
            const auto c = static_cast<char>(word >> shift & 0xffU);
            if (c == '\0') {
                return text;
            }
            text += c;
        }
    }
    return text;
}

const std::string& find(const std::map<Id, std::string>& texts, Id id) {
    const auto found = texts.find(id);
    return found == texts.end() ? kNone : found->second;
}

bool is_debug(spv::Op op) {
    return op == spv::OpSource || op == spv::OpSourceExtension || op == spv::OpSourceContinued ||
           op == spv::OpString || op == spv::OpModuleProcessed;
}

bool is_type(spv::Op op) {
    return op >= spv::OpTypeVoid && op <= spv::OpTypeForwardPointer;
}

void append(std::vector<Word>& words, const Instruction& i) {
    const std::size_t size =
        1 + (i.type != 0 ? 1U : 0U) + (i.result != 0 ? 1U : 0U) + i.operands.size();
    words.push_back(static_cast<Word>(size << 16U) | static_cast<Word>(i.op));
    if (i.type != 0) {
        words.push_back(i.type);
    }
    if (i.result != 0) {
        words.push_back(i.result);
    }
    words.insert(words.end(), i.operands.begin(), i.operands.end());
}

}  // namespace

Module::Module(std::span<const Word> words) {
    std::copy_n(words.begin(), header_.size(), header_.begin());
    Id file = 0;
    Word line = 0;
    for (std::size_t at = header_.size(); at < words.size();) {
        const std::size_t size = words[at] >> 16U;
        if (size == 0 || at + size > words.size()) {
            throw std::runtime_error("the compiler's SPIR-V is cut off");
        }
        Instruction i;
        i.op = static_cast<spv::Op>(words[at] & 0xffffU);
        auto rest = words.subspan(at + 1, size - 1);
        at += size;
        if (i.op == spv::OpLine) {
            file = rest[0];
            line = rest[1];
            continue;
        }
        if (i.op == spv::OpNoLine) {
            file = 0;
            line = 0;
            continue;
        }
        bool has_result = false;
        bool has_type = false;
        spv::HasResultAndType(i.op, &has_result, &has_type);
        if (has_type) {
            i.type = rest[0];
            rest = rest.subspan(1);
        }
        if (has_result) {
            i.result = rest[0];
            rest = rest.subspan(1);
        }
        i.operands.assign(rest.begin(), rest.end());
        i.file = file;
        i.line = line;
        if (i.op == spv::OpFunction) {
            functions.emplace_back().head = std::move(i);
        } else if (functions.empty()) {
            index(i, globals.size());
            globals.push_back(std::move(i));
        } else if (i.op == spv::OpFunctionParameter) {
            functions.back().parameters.push_back(std::move(i));
        } else if (i.op == spv::OpLabel) {
            functions.back().blocks.push_back({.label = i.result, .code = {}});
        } else if (i.op != spv::OpFunctionEnd) {
            functions.back().blocks.back().code.push_back(std::move(i));
        }
    }
}

void Module::index(const Instruction& i, std::size_t at) {
    if (i.op == spv::OpName) {
        names_[i.operands[0]] = text_of(std::span(i.operands).subspan(1));
    } else if (i.op == spv::OpString) {
        strings_[i.result] = text_of(i.operands);
    }
    if (i.result != 0) {
        global_of_[i.result] = at;
    }
    if (i.op == spv::OpConstantNull) {
        nulls_[i.type] = i.result;
    }
}

std::vector<Word> Module::words() const {
    std::vector<Word> words(header_.begin(), header_.end());
    for (const auto capability : capabilities_) {
        append(words, {.op = spv::OpCapability, .operands = {static_cast<Word>(capability)}});
    }
    bool decorated = false;
    for (const auto& i : globals) {
        if (!decorated && is_type(i.op)) {
            decorated = true;
            for (const auto& decoration : decorations_) {
                append(words, decoration);
            }
        }
        if (!is_debug(i.op) && i.op != spv::OpNop) {
            append(words, i);
        }
        if (i.op == spv::OpEntryPoint) {
            for (const auto& [mode, width] : modes_) {
                append(words, {.op = spv::OpExecutionMode,
                               .operands = {i.operands[1], static_cast<Word>(mode), width}});
            }
        }
    }
    for (const auto& function : functions) {
        append(words, function.head);
        for (const auto& parameter : function.parameters) {
            append(words, parameter);
        }
        for (const auto& block : function.blocks) {
            append(words, {.op = spv::OpLabel, .result = block.label, .operands = {}});
            for (const auto& i : block.code) {
                append(words, i);
            }
        }
        append(words, {.op = spv::OpFunctionEnd, .operands = {}});
    }
    return words;
}

const std::string& Module::name(Id id) const {
    return find(names_, id);
}

const std::string& Module::string(Id id) const {
    return find(strings_, id);
}

const Instruction* Module::global(Id id) const {
    const auto found = global_of_.find(id);
    return found == global_of_.end() ? nullptr : &globals[found->second];
}

std::uint64_t Module::scalars(Id type) const {
    const auto* const t = global(type);
    if (t == nullptr) {
        return 0;
    }
    Word length = 0;
    std::uint64_t sum = 0;
    switch (t->op) {
        case spv::OpTypeBool:
        case spv::OpTypeInt:
        case spv::OpTypeFloat:
            return 1;
        case spv::OpTypeVector:
        case spv::OpTypeMatrix:
            return t->operands[1] * scalars(t->operands[0]);
        case spv::OpTypeArray:
            return integer(t->operands[1], length) ? length * scalars(t->operands[0]) : 0;
        case spv::OpTypeStruct:
            for (const Id member : t->operands) {
                sum += scalars(member);
            }
            return sum;
        default:
            return 0;
    }
}

Id Module::scalar_type(Id type) const {
    const auto* const t = global(type);
    return t != nullptr && (t->op == spv::OpTypeVector || t->op == spv::OpTypeMatrix)
               ? scalar_type(t->operands[0])
               : type;
}

bool Module::integer(Id id, Word& value) const {
    const auto* const constant = global(id);
    if (constant == nullptr || constant->op != spv::OpConstant || constant->operands.size() != 1) {
        return false;
    }
    const auto* const type = global(constant->type);
    value = constant->operands[0];
    return type != nullptr && type->op == spv::OpTypeInt;
}

Id Module::null(Id type) {
    Id& id = nulls_[type];
    if (id == 0) {
        id = new_id();
        global_of_[id] = globals.size();
        globals.push_back({.op = spv::OpConstantNull, .type = type, .result = id, .operands = {}});
    }
    return id;
}

void Module::decorate(Id id, spv::Decoration decoration) {
    decorations_.push_back(
        {.op = spv::OpDecorate, .operands = {id, static_cast<Word>(decoration)}});
}

void Module::declare(spv::ExecutionMode mode, Word width, spv::Capability capability) {
    modes_.emplace_back(mode, width);
    capabilities_.insert(capability);
}

std::vector<Id> ids_of(const Instruction& i) {
    const auto first = [&](std::size_t count) {
        const auto size = std::min(count, i.operands.size());
        return std::vector<Id>(i.operands.begin(),
                               i.operands.begin() + static_cast<std::ptrdiff_t>(size));
    };
    std::vector<Id> ids;
    switch (i.op) {
        case spv::OpCompositeExtract:
        case spv::OpLoad:
        case spv::OpSelectionMerge:
            return first(1);
        case spv::OpCompositeInsert:
        case spv::OpVectorShuffle:
        case spv::OpStore:
        case spv::OpLoopMerge:
            return first(2);
        case spv::OpBranchConditional:
            return first(3);
        case spv::OpVariable:
            return {i.operands.begin() + 1, i.operands.end()};
        case spv::OpExtInst:
            return {i.operands.begin() + 2, i.operands.end()};
        case spv::OpSwitch:  // of 32 bits: the selector, the default, then literals and labels
            ids = first(2);
            for (std::size_t at = 3; at < i.operands.size(); at += 2) {
                ids.push_back(i.operands[at]);
            }
            return ids;
        default:
            return i.operands;
    }
}

std::vector<Id> targets_of(const Instruction& last) {
    auto ids = ids_of(last);
    switch (last.op) {
        case spv::OpBranch:
            return ids;
        case spv::OpBranchConditional:
        case spv::OpSwitch:
            ids.erase(ids.begin());
            return ids;
        default:
            return {};
    }
}

}  // namespace merl::engine::spirv
