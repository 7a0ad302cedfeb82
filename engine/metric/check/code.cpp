#include "engine/metric/check/code.h"

#include <SPIRV/GLSL.std.450.h>
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "engine/base/error.h"
#include "engine/metric/check/assignments.h"

namespace merl::engine {
namespace {

using namespace spirv;

/// Instructions that compute something of their operands and do nothing else, or say where to go
/// on.
const std::set<spv::Op> kAllowed = {
    spv::OpUndef,  // where a path ends without a result: its own message
    spv::OpUnreachable,
    spv::OpFunctionCall,
    spv::OpVariable,
    spv::OpLoad,
    spv::OpStore,
    spv::OpAccessChain,
    spv::OpInBoundsAccessChain,
    spv::OpVectorExtractDynamic,
    spv::OpVectorInsertDynamic,
    spv::OpVectorShuffle,
    spv::OpCompositeConstruct,
    spv::OpCompositeExtract,
    spv::OpCompositeInsert,
    spv::OpCopyObject,
    spv::OpTranspose,
    spv::OpConvertFToU,
    spv::OpConvertFToS,
    spv::OpConvertSToF,
    spv::OpConvertUToF,
    spv::OpFConvert,
    spv::OpBitcast,
    spv::OpSNegate,
    spv::OpFNegate,
    spv::OpIAdd,
    spv::OpFAdd,
    spv::OpISub,
    spv::OpFSub,
    spv::OpIMul,
    spv::OpFMul,
    spv::OpUDiv,
    spv::OpSDiv,
    spv::OpFDiv,
    spv::OpUMod,
    spv::OpSRem,
    spv::OpSMod,
    spv::OpFMod,
    spv::OpVectorTimesScalar,
    spv::OpMatrixTimesScalar,
    spv::OpVectorTimesMatrix,
    spv::OpMatrixTimesVector,
    spv::OpMatrixTimesMatrix,
    spv::OpOuterProduct,
    spv::OpDot,
    spv::OpAny,
    spv::OpAll,
    spv::OpIsNan,
    spv::OpIsInf,
    spv::OpLogicalEqual,
    spv::OpLogicalNotEqual,
    spv::OpLogicalOr,
    spv::OpLogicalAnd,
    spv::OpLogicalNot,
    spv::OpSelect,
    spv::OpIEqual,
    spv::OpINotEqual,
    spv::OpUGreaterThan,
    spv::OpSGreaterThan,
    spv::OpUGreaterThanEqual,
    spv::OpSGreaterThanEqual,
    spv::OpULessThan,
    spv::OpSLessThan,
    spv::OpULessThanEqual,
    spv::OpSLessThanEqual,
    spv::OpFOrdEqual,
    spv::OpFOrdNotEqual,
    spv::OpFUnordNotEqual,
    spv::OpFOrdLessThan,
    spv::OpFOrdGreaterThan,
    spv::OpFOrdLessThanEqual,
    spv::OpFOrdGreaterThanEqual,
    spv::OpShiftRightLogical,
    spv::OpShiftRightArithmetic,
    spv::OpShiftLeftLogical,
    spv::OpBitwiseOr,
    spv::OpBitwiseXor,
    spv::OpBitwiseAnd,
    spv::OpNot,
    spv::OpPhi,
    spv::OpLoopMerge,
    spv::OpSelectionMerge,
    spv::OpBranch,
    spv::OpBranchConditional,
    spv::OpSwitch,
    spv::OpReturn,
    spv::OpReturnValue,
};

/// Likewise, of the functions of GLSL that have no instruction of their own.
const std::set<Word> kAllowedFunctions = {
    GLSLstd450Round,
    GLSLstd450RoundEven,
    GLSLstd450Trunc,
    GLSLstd450FAbs,
    GLSLstd450SAbs,
    GLSLstd450FSign,
    GLSLstd450SSign,
    GLSLstd450Floor,
    GLSLstd450Ceil,
    GLSLstd450Fract,
    GLSLstd450Radians,
    GLSLstd450Degrees,
    GLSLstd450Sin,
    GLSLstd450Cos,
    GLSLstd450Tan,
    GLSLstd450Asin,
    GLSLstd450Acos,
    GLSLstd450Atan,
    GLSLstd450Sinh,
    GLSLstd450Cosh,
    GLSLstd450Tanh,
    GLSLstd450Asinh,
    GLSLstd450Acosh,
    GLSLstd450Atanh,
    GLSLstd450Atan2,
    GLSLstd450Pow,
    GLSLstd450Exp,
    GLSLstd450Log,
    GLSLstd450Exp2,
    GLSLstd450Log2,
    GLSLstd450Sqrt,
    GLSLstd450InverseSqrt,
    GLSLstd450Determinant,
    GLSLstd450MatrixInverse,
    GLSLstd450FMin,
    GLSLstd450UMin,
    GLSLstd450SMin,
    GLSLstd450FMax,
    GLSLstd450UMax,
    GLSLstd450SMax,
    GLSLstd450FClamp,
    GLSLstd450UClamp,
    GLSLstd450SClamp,
    GLSLstd450FMix,
    GLSLstd450Step,
    GLSLstd450SmoothStep,
    GLSLstd450Fma,
    GLSLstd450PackDouble2x32,
    GLSLstd450UnpackDouble2x32,
    GLSLstd450Length,
    GLSLstd450Distance,
    GLSLstd450Cross,
    GLSLstd450Normalize,
};

const std::set<std::string> kRoots = {"transform", "weight", "difference", "window", "feature"};

/// "transform" of "transform(vf3;...".
std::string short_name(const Module& module, Id function) {
    const auto& name = module.name(function);
    return name.substr(0, name.find('('));
}

class Check {
  public:
    Check(const Module& module, const std::string& file, const std::string& text_name)
        : module_(module), file_(file), text_name_(text_name) {
        for (std::size_t i = 0; i < module.functions.size(); ++i) {
            function_of_[module.functions[i].id()] = i;
        }
        for (const auto& i : module.globals) {
            if (i.op == spv::OpVariable ||
                (i.op >= spv::OpSpecConstantTrue && i.op <= spv::OpSpecConstantOp)) {
                out_of_reach_.insert(i.result);
            }
            if (is_not_finite(i)) {
                not_finite_.insert(i.result);
            }
        }
    }

    std::vector<std::size_t> check() {
        check_variables();
        for (const auto& i : module_.globals) {
            if (i.op == spv::OpEntryPoint) {
                find_used(i.operands[1]);
            }
        }
        for (std::size_t i = 0; i < module_.functions.size(); ++i) {
            if (kRoots.contains(short_name(module_, module_.functions[i].id()))) {
                visit(i);
            }
        }
        Assignments assignments(module_);
        for (const auto i : order_) {
            const auto& function = module_.functions[i];
            if (const auto* const offence = assignments.check(function)) {
                refuse(
                    *offence,
                    fmt::format("in {}() a variable may be read before it has a value: "
                                "give it one where it is declared, also an array that a loop fills",
                                short_name(module_, function.id())));
            }
        }
        return order_;
    }

  private:
    [[noreturn]] void refuse(const Instruction& at, const std::string& message) const {
        const auto& name = module_.string(at.file);
        if (name.empty() || at.line == 0) {
            throw InputError(fmt::format("{}: {}", file_, message));
        }
        throw InputError(
            fmt::format("{}:{}: {}", name == text_name_ ? file_ : name, at.line, message));
    }

    /// A constant with an infinity or NaN in it; its parts come before it.
    bool is_not_finite(const Instruction& i) const {
        if (i.op == spv::OpConstantComposite) {
            return std::any_of(i.operands.begin(), i.operands.end(),
                               [&](Id part) { return not_finite_.contains(part); });
        }
        if (i.op != spv::OpConstant || module_.global(i.type)->op != spv::OpTypeFloat) {
            return false;
        }
        const Word exponent = i.operands.size() == 1 ? 0x7f800000U : 0x7ff00000U;
        return (i.operands.back() & exponent) == exponent;
    }

    /// A variable of the whole file would keep its value from one call to the next, or be computed
    /// outside the functions that are looked at.
    void check_variables() const {
        for (const auto& i : module_.globals) {
            if (i.op == spv::OpVariable && i.operands[0] == spv::StorageClassPrivate &&
                !module_.name(i.result).starts_with("guard_")) {
                throw InputError(
                    fmt::format("{}: \"{}\" is a variable of the whole file: declare it in "
                                "a function, or const with a constant value",
                                file_, module_.name(i.result)));
            }
        }
    }

    /// The functions that the kernel calls. A metric's others are there too, in a precision that is
    /// not theirs.
    void find_used(Id function) {
        if (!function_of_.contains(function) || !used_.insert(function).second) {
            return;
        }
        for (const auto& block : module_.functions[function_of_.at(function)].blocks) {
            for (const auto& i : block.code) {
                if (i.op == spv::OpFunctionCall) {
                    find_used(i.operands[0]);
                }
            }
        }
    }

    void visit(std::size_t at) {
        if (done_.contains(at)) {
            return;
        }
        const auto& function = module_.functions[at];
        const auto name = short_name(module_, function.id());
        if (!on_the_way_.insert(at).second) {
            refuse(function.head, fmt::format("{}() calls itself: GLSL has no recursion", name));
        }
        std::map<Id, std::size_t> place;  // of a block
        for (std::size_t b = 0; b < function.blocks.size(); ++b) {
            place[function.blocks[b].label] = b;
        }
        const auto reachable = reachable_blocks(function);
        for (std::size_t b = 0; b < function.blocks.size(); ++b) {
            const auto& block = function.blocks[b];
            for (const auto& i : block.code) {
                if (reachable[b] && i.op == spv::OpUndef) {
                    refuse(function.blocks[b].code.back(),
                           fmt::format("{}() may end without a return: let it end with one", name));
                }
                check(i, name);
                if (used_.contains(function.id())) {
                    check_constants(i, name);
                }
            }
            check_flow(block, b, place, function);
        }
        on_the_way_.erase(at);
        done_.insert(at);
        order_.push_back(at);
    }

    void check(const Instruction& i, const std::string& name) {
        if (!kAllowed.contains(i.op) &&
            !(i.op == spv::OpExtInst && kAllowedFunctions.contains(i.operands[1]))) {
            refuse(i, fmt::format(
                          "{}() does what a metric has no use for ({} {}): a metric computes "
                          "numbers from numbers",
                          name, i.op == spv::OpExtInst ? "GLSL.std.450 function" : "SPIR-V opcode",
                          i.op == spv::OpExtInst ? i.operands[1] : static_cast<Word>(i.op)));
        }
        if (i.op == spv::OpVariable && i.operands[0] != spv::StorageClassFunction) {
            refuse(i, fmt::format("{}() has a variable that is not its own", name));
        }
        for (const Id id : ids_of(i)) {
            if (out_of_reach_.contains(id)) {
                refuse(i, fmt::format("{}() uses \"{}\", which is not its own: a metric sees its "
                                      "arguments and nothing else",
                                      name, module_.name(id)));
            }
        }
        if (i.op == spv::OpFunctionCall) {
            const auto callee = short_name(module_, i.operands[0]);
            if (callee.starts_with("guard_") || !function_of_.contains(i.operands[0])) {
                refuse(i, fmt::format("{}() calls {}(), which is not for metrics", name, callee));
            }
            visit(function_of_.at(i.operands[0]));
        }
    }

    /// The compiler computes what is constant throughout, and may leave no other trace of an error.
    void check_constants(const Instruction& i, const std::string& name) const {
        for (const Id id : ids_of(i)) {
            if (not_finite_.contains(id)) {
                refuse(i, fmt::format("{}() has a constant that is infinite or not a number: "
                                      "expected a finite one",
                                      name));
            }
        }
    }

    /// Jumps back lead to the head of a loop, where it is counted.
    void check_flow(const Block& block, std::size_t b, const std::map<Id, std::size_t>& place,
                    const Function& function) const {
        for (const Id target : targets_of(block.code.back())) {
            const auto& code = function.blocks[place.at(target)].code;
            const bool is_loop = std::any_of(code.begin(), code.end(), [](const Instruction& i) {
                return i.op == spv::OpLoopMerge;
            });
            if (place.at(target) <= b && !is_loop) {
                refuse(block.code.back(), "a jump back that is no loop");
            }
        }
    }

    const Module& module_;
    const std::string& file_;
    const std::string& text_name_;
    std::map<Id, std::size_t> function_of_;
    std::set<Id> out_of_reach_;
    std::set<Id> not_finite_;
    std::set<Id> used_;
    std::set<std::size_t> on_the_way_;
    std::set<std::size_t> done_;
    std::vector<std::size_t> order_;
};

}  // namespace

std::vector<std::size_t> check_metric_code(const Module& module, const std::string& file,
                                           const std::string& text_name) {
    return Check(module, file, text_name).check();
}

}  // namespace merl::engine
