#include <SPIRV/GLSL.std.450.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>

#include "engine/metric/check/code.h"

namespace merl::engine {
namespace {

using namespace spirv;

/// Instructions and functions of GLSL of which another is called instead, component by component.
const std::map<spv::Op, const char*> kInstead = {{spv::OpFDiv, "guard_divide"},
                                                 {spv::OpFMod, "guard_modulo"}};
const std::map<Word, const char*> kFunctionInstead = {
    {GLSLstd450Pow, "guard_pow"},    {GLSLstd450Atan, "guard_atan"},
    {GLSLstd450Atan2, "guard_atan"}, {GLSLstd450FMin, "guard_min"},
    {GLSLstd450FMax, "guard_max"},   {GLSLstd450FClamp, "guard_clamp"},
    {GLSLstd450FMix, "guard_mix"},   {GLSLstd450FSign, "guard_sign"},
    {GLSLstd450Step, "guard_step"},  {GLSLstd450SmoothStep, "guard_smoothstep"},
};

/// A larger constant is left as it is; its zeros are hidden where it is read.
constexpr std::uint64_t kMostScalars = 64;

bool is_integer_division(spv::Op op) {
    return op == spv::OpUDiv || op == spv::OpSDiv || op == spv::OpUMod;
}

bool is_shift(spv::Op op) {
    return op == spv::OpShiftLeftLogical || op == spv::OpShiftRightLogical ||
           op == spv::OpShiftRightArithmetic;
}

/// Arithmetic that a compiler would else be free to rearrange, so that infinity less infinity is 0.
bool is_arithmetic(spv::Op op) {
    return op == spv::OpFNegate || op == spv::OpFAdd || op == spv::OpFSub || op == spv::OpFMul ||
           (op >= spv::OpVectorTimesScalar && op <= spv::OpDot);
}

/// Where an instruction has numbers among its operands, unless it only compares them.
struct Numbers {
    std::size_t first = 0;
    std::size_t last = SIZE_MAX;  // one after
    std::size_t step = 1;
};

Numbers numbers_of(spv::Op op) {
    switch (op) {
        case spv::OpStore:
            return {.first = 1, .last = 2};
        case spv::OpFunctionCall:
            return {.first = 1};
        case spv::OpExtInst:
            return {.first = 2};
        case spv::OpPhi:
            return {.step = 2};
        case spv::OpVectorShuffle:
            return {.last = 2};
        case spv::OpCompositeInsert:
        case spv::OpVectorInsertDynamic:
            return {.last = 1};
        case spv::OpCompositeConstruct:
        case spv::OpSelect:
        case spv::OpReturnValue:
        case spv::OpFDiv:
        case spv::OpFMod:
            return {};
        default:
            return {.last = is_arithmetic(op) ? SIZE_MAX : 0};
    }
}

class Guard {
  public:
    explicit Guard(Module& module) : module_(module) {
        for (const auto& function : module.functions) {
            const auto& name = module.name(function.id());
            if (name.starts_with("guard_")) {
                guards_[name] = {function.id(), function.head.type};
            }
        }
        for (const auto& i : module.globals) {
            if (i.op == spv::OpDecorate && i.operands[1] == spv::DecorationNoContraction) {
                precise_.insert(i.operands[0]);
            } else if (i.op == spv::OpExtInstImport) {
                glsl_ = i.result;
            }
        }
    }

    void change(Function& function) {
        const auto size = function.blocks.size();
        for (const auto& parameter : function.parameters) {
            types_[parameter.result] = parameter.type;
        }
        for (std::size_t b = 0; b < size; ++b) {
            for (const auto& i : function.blocks[b].code) {
                types_[i.result] = i.type;
            }
        }
        zeros_ = {};
        for (std::size_t b = 0; b < size; ++b) {
            auto before = std::move(function.blocks[b].code);
            code_ = {};
            for (std::size_t k = 0; k < before.size(); ++k) {
                if (before[k].op == spv::OpLoopMerge) {
                    count_loop(function, before[k], before.at(k + 1));
                } else {
                    change(std::move(before[k]));
                }
            }
            function.blocks[b].code = std::move(code_);
        }
        auto& entry = function.blocks[0].code;
        entry.insert(std::find_if(entry.begin(), entry.end(),
                                  [](const Instruction& i) { return i.op != spv::OpVariable; }),
                     zeros_code_.begin(), zeros_code_.end());
        zeros_code_ = {};
    }

  private:
    struct Callee {
        Id id = 0;
        Id type = 0;
    };

    /// A head of a loop goes on only while the count lasts. Where nothing comes after the loop, the
    /// function ends then.
    void count_loop(Function& function, const Instruction& merge, Instruction& branch) {
        if (branch.op != spv::OpBranch) {
            throw std::runtime_error("the compiler makes loops of another shape");
        }
        const Id next = branch.operands[0];
        const auto callee = guards_.at("guard_loop(");
        const Id goes_on = module_.new_id();
        code_.push_back({.op = spv::OpFunctionCall,
                         .type = callee.type,
                         .result = goes_on,
                         .operands = {callee.id}});
        code_.push_back(merge);
        const Id end = merge.operands[0];
        branch = {.op = spv::OpBranchConditional, .operands = {goes_on, next, end}};
        for (auto& block : function.blocks) {
            if (block.label == end && !block.code.empty() &&
                block.code.back().op == spv::OpUnreachable) {
                const bool is_void = module_.global(function.head.type)->op == spv::OpTypeVoid;
                block.code.back() =
                    is_void ? Instruction{.op = spv::OpReturn, .operands = {}}
                            : Instruction{.op = spv::OpReturnValue,
                                          .operands = {module_.null(function.head.type)}};
            }
        }
    }

    void change(Instruction i) {
        const auto numbers = numbers_of(i.op);
        for (std::size_t k = numbers.first; k < std::min(numbers.last, i.operands.size());
             k += numbers.step) {
            i.operands[k] = without_zeros(i.operands[k]);
        }
        if (is_arithmetic(i.op) && precise_.insert(i.result).second) {
            module_.decorate(i.result, spv::DecorationNoContraction);
        }
        if (i.op == spv::OpCompositeConstruct &&
            std::all_of(i.operands.begin(), i.operands.end(),
                        [&](Id id) { return is_good_divisor(id); })) {
            good_divisors_.insert(i.result);
        }
        if (const auto instead = kInstead.find(i.op); instead != kInstead.end()) {
            if (i.op == spv::OpFDiv && is_good_divisor(i.operands[1])) {
                code_.push_back(std::move(i));
            } else {
                call_instead(i, instead->second, i.operands);
            }
        } else if (i.op == spv::OpExtInst) {
            change_function(std::move(i));
        } else if (i.op == spv::OpFSub) {  // a device may know a - a to be 0 without a look at a
            const Id minus = emit(spv::OpFNegate, i.type, {i.operands[1]});
            module_.decorate(minus, spv::DecorationNoContraction);
            i.op = spv::OpFAdd;
            i.operands[1] = minus;
            code_.push_back(std::move(i));
        } else {
            change_operands(i);
            if (may_be_known_zero(i)) {
                hide_zeros(std::move(i));
            } else {
                code_.push_back(std::move(i));
            }
        }
    }

    /// Whether an instruction may give a zero that the device knows and that is no constant here:
    /// of an integer, where a loop is unrolled, or of an array, which may be a large constant.
    bool may_be_known_zero(const Instruction& i) const {
        switch (i.op) {
            case spv::OpConvertSToF:
            case spv::OpConvertUToF:
                return true;
            case spv::OpBitcast:
                return is_float(i.type);
            case spv::OpLoad:
                return is_float(i.type) && of_array_.contains(i.operands[0]);
            case spv::OpCompositeExtract:
                return is_float(i.type) && has_array(type_of(i.operands[0]));
            default:
                return false;
        }
    }

    void hide_zeros(Instruction i) {
        const Id result = i.result;
        const Id type = i.type;
        i.result = module_.new_id();
        const Id number = i.result;
        types_[number] = type;
        code_.push_back(std::move(i));
        const auto& t = *module_.global(type);
        if (t.op != spv::OpTypeMatrix) {
            const Id hidden = per_component("guard_hidden", type, {number});
            code_.push_back(
                {.op = spv::OpCopyObject, .type = type, .result = result, .operands = {hidden}});
            return;
        }
        std::vector<Id> columns;
        for (Word k = 0; k < t.operands[1]; ++k) {
            const Id column = emit(spv::OpCompositeExtract, t.operands[0], {number, k});
            columns.push_back(per_component("guard_hidden", t.operands[0], {column}));
        }
        code_.push_back({.op = spv::OpCompositeConstruct,
                         .type = type,
                         .result = result,
                         .operands = std::move(columns)});
    }

    void change_function(Instruction i) {
        const auto function = i.operands[1];
        const auto instead = kFunctionInstead.find(function);
        if (instead != kFunctionInstead.end()) {
            call_instead(i, instead->second, {i.operands.begin() + 2, i.operands.end()});
        } else if (function == GLSLstd450Normalize || function == GLSLstd450MatrixInverse) {
            times_size(i, function == GLSLstd450Normalize);
        } else if (function == GLSLstd450Distance) {
            i.operands = {glsl_, GLSLstd450Length, less(i.operands[2], i.operands[3])};
            length(std::move(i));
        } else if (function == GLSLstd450Length) {
            length(std::move(i));
        } else if (function == GLSLstd450Cross) {
            cross(i);
        } else if (function == GLSLstd450Fma) {
            const Id product = arithmetic(spv::OpFMul, i.type, {i.operands[2], i.operands[3]});
            module_.decorate(i.result, spv::DecorationNoContraction);
            code_.push_back({.op = spv::OpFAdd,
                             .type = i.type,
                             .result = i.result,
                             .operands = {product, i.operands[4]}});
        } else if (function == GLSLstd450Determinant) {
            determinant(std::move(i));
        } else if (function == GLSLstd450PackDouble2x32) {
            hide_zeros(std::move(i));
        } else {
            code_.push_back(std::move(i));
        }
    }

    /// As its definition says: what a device has of its own may lose a NaN.
    void length(Instruction i) {
        const Id vector = i.operands[2];
        const bool is_vector = type_of(vector) != i.type;
        i.operands = {
            glsl_,
            is_vector ? static_cast<Word>(GLSLstd450Sqrt) : static_cast<Word>(GLSLstd450FAbs),
            is_vector ? arithmetic(spv::OpDot, i.type, {vector, vector}) : vector};
        code_.push_back(std::move(i));
    }

    /// Differences of products, of which a device may know that they are 0 when they are of the
    /// same numbers.
    void cross(const Instruction& i) {
        const Id a = i.operands[2];
        const Id b = i.operands[3];
        const auto turned = [&](Id v, Word x, Word y, Word z) {
            return emit(spv::OpVectorShuffle, i.type, {v, v, x, y, z});
        };
        const Id plus = arithmetic(spv::OpFMul, i.type, {turned(a, 1, 2, 0), turned(b, 2, 0, 1)});
        const Id minus = arithmetic(spv::OpFMul, i.type, {turned(a, 2, 0, 1), turned(b, 1, 2, 0)});
        code_.push_back({.op = spv::OpCopyObject,
                         .type = i.type,
                         .result = i.result,
                         .operands = {less(plus, minus)}});
    }

    /// Of a matrix that is not finite: NaN, also where a device may know the products to be the
    /// same.
    void determinant(Instruction i) {
        const Id result = i.result;
        const Id type = i.type;
        const Id matrix = i.operands[2];
        const auto& t = *module_.global(type_of(matrix));
        i.result = module_.new_id();
        Id sum = i.result;
        code_.push_back(std::move(i));
        for (Word k = 0; k < t.operands[1]; ++k) {
            const Id column = emit(spv::OpCompositeExtract, t.operands[0], {matrix, k});
            const Id zero =
                arithmetic(spv::OpDot, type, {column, without_zeros(module_.null(t.operands[0]))});
            sum = arithmetic(spv::OpFAdd, type, {sum, zero});
        }
        code_.push_back(
            {.op = spv::OpCopyObject, .type = type, .result = result, .operands = {sum}});
    }

    /// a - b, also where a device may know the two to be the same.
    Id less(Id a, Id b) {
        const Id type = type_of(a);
        return arithmetic(spv::OpFAdd, type, {a, arithmetic(spv::OpFNegate, type, {b})});
    }

    /// An instruction that no device may rearrange.
    Id arithmetic(spv::Op op, Id type, std::vector<Word> operands) {
        const Id result = emit(op, type, std::move(operands));
        module_.decorate(result, spv::DecorationNoContraction);
        return result;
    }

    /// The direction of a vector without length, and the inverse of a matrix without one: NaN.
    void times_size(Instruction i, bool is_vector) {
        const Id scalar = module_.scalar_type(i.type);
        const Id result = i.result;
        const Id of = i.operands[2];
        const Id size =
            is_vector ? arithmetic(i.type == scalar ? spv::OpFMul : spv::OpDot, scalar, {of, of})
                      : emit(spv::OpExtInst, scalar, {glsl_, GLSLstd450Determinant, of});
        const Id one = call("guard_size", scalar, {size});
        i.result = module_.new_id();
        const Id direction = i.result;
        const Id type = i.type;
        code_.push_back(std::move(i));
        const auto op = type == scalar ? spv::OpFMul
                        : is_vector    ? spv::OpVectorTimesScalar
                                       : spv::OpMatrixTimesScalar;
        module_.decorate(result, spv::DecorationNoContraction);
        code_.push_back({.op = op, .type = type, .result = result, .operands = {direction, one}});
    }

    /// Integers that may be beyond what the instruction is defined for.
    void change_operands(Instruction& i) {
        if (i.op == spv::OpSRem || i.op == spv::OpSMod) {
            i.operands[1] = per_component("guard_modulus", i.type, i.operands);
        } else if (is_integer_division(i.op)) {
            if (Word divisor = 0; !module_.integer(i.operands[1], divisor) || divisor + 1 < 2) {
                i.operands[1] = per_component("guard_divisor", i.type, i.operands);
            }
        } else if (is_shift(i.op)) {
            if (Word shift = 0; !module_.integer(i.operands[1], shift) || shift > 31) {
                i.operands[1] =
                    per_component("guard_shift", type_of(i.operands[1]), {i.operands[1]});
            }
        } else if (i.op == spv::OpConvertFToS || i.op == spv::OpConvertFToU) {
            i.operands[0] =
                per_component(i.op == spv::OpConvertFToS ? "guard_to_int" : "guard_to_uint",
                              type_of(i.operands[0]), {i.operands[0]});
        } else if (i.op == spv::OpVectorExtractDynamic) {
            check_index(i.operands[1], type_of(i.operands[0]));
        } else if (i.op == spv::OpVectorInsertDynamic) {
            check_index(i.operands[2], type_of(i.operands[0]));
        } else if (i.op == spv::OpAccessChain || i.op == spv::OpInBoundsAccessChain) {
            Id type = module_.global(type_of(i.operands[0]))->operands[1];
            if (has_array(type) || of_array_.contains(i.operands[0])) {
                of_array_.insert(i.result);
            }
            for (std::size_t k = 1; k < i.operands.size(); ++k) {
                const auto& t = *module_.global(type);
                Word member = 0;
                if (t.op == spv::OpTypeStruct) {
                    module_.integer(i.operands[k], member);
                } else {
                    check_index(i.operands[k], type);
                }
                type = t.operands[member];
            }
        }
    }

    /// An index of an array, a matrix or a vector.
    void check_index(Id& index, Id type) {
        const auto& t = *module_.global(type);
        Word size = t.operands[1];
        if (t.op == spv::OpTypeArray) {
            module_.integer(t.operands[1], size);
        }
        if (Word value = 0; module_.integer(index, value) && value < size) {
            return;
        }
        const Id index_type = type_of(index);
        index = call("guard_index", index_type, {index, constant(index_type, size)});
    }

    void call_instead(const Instruction& i, const std::string& name,
                      const std::vector<Id>& values) {
        const Id result = per_component(name, i.type, values);
        code_.push_back(
            {.op = spv::OpCopyObject, .type = i.type, .result = i.result, .operands = {result}});
    }

    /// Calls a function for each component of the values, which are scalars or vectors of one size.
    Id per_component(const std::string& name, Id type, const std::vector<Id>& values) {
        const auto& t = *module_.global(type);
        if (t.op != spv::OpTypeVector) {
            return call(name, type, values);
        }
        std::vector<Id> components;
        for (Word k = 0; k < t.operands[1]; ++k) {
            std::vector<Id> arguments;
            std::transform(values.begin(), values.end(), std::back_inserter(arguments),
                           [&](Id value) {
                               return emit(spv::OpCompositeExtract,
                                           module_.scalar_type(type_of(value)), {value, k});
                           });
            components.push_back(call(name, t.operands[0], arguments));
        }
        return emit(spv::OpCompositeConstruct, type, components);
    }

    Id call(const std::string& name, Id type, const std::vector<Id>& arguments) {
        std::string full = name + "(";
        for (const Id argument : arguments) {
            full += fmt::format("{}1;", letter(type_of(argument)));
        }
        const auto found = guards_.find(full);
        if (found == guards_.end()) {
            throw std::runtime_error("shaders/framework/guards.glsl has no " + full);
        }
        std::vector<Word> operands = {found->second.id};
        operands.insert(operands.end(), arguments.begin(), arguments.end());
        return emit(spv::OpFunctionCall, type, std::move(operands));
    }

    Id emit(spv::Op op, Id type, std::vector<Word> operands) {
        const Id result = module_.new_id();
        types_[result] = type;
        code_.push_back(
            {.op = op, .type = type, .result = result, .operands = std::move(operands)});
        return result;
    }

    /// As the compiler has it in the names of functions.
    char letter(Id type) const {
        const auto& t = *module_.global(type);
        if (t.op == spv::OpTypeFloat) {
            return t.operands[0] == 64 ? 'd' : 'f';
        }
        return t.operands[1] == 1 ? 'i' : 'u';
    }

    Id type_of(Id id) const {
        const auto own = types_.find(id);
        return own != types_.end() ? own->second : module_.global(id)->type;
    }

    Id constant(Id type, Word value) {
        Id& id = constants_[{type, value}];
        if (id == 0) {
            id = module_.new_id();
            module_.globals.push_back(
                {.op = spv::OpConstant, .type = type, .result = id, .operands = {value}});
            types_[id] = type;
        }
        return id;
    }

    /// A constant with every zero in it replaced by one that the device does not know.
    Id without_zeros(Id id) {
        const auto* const c = module_.global(id);
        if (c == nullptr || !has_zero(*c)) {
            return id;
        }
        if (const auto known = zeros_.find(id); known != zeros_.end()) {
            return known->second;
        }
        std::vector<Word> operands;
        const auto& type = *module_.global(c->type);
        if (type.op == spv::OpTypeFloat) {
            const bool is_double = type.operands[0] == 64;
            operands = {guards_.at(is_double ? "guard_zero64(" : "guard_zero32(").id};
        } else {
            for (const Id part : parts_of(*c)) {
                operands.push_back(without_zeros(part));
            }
        }
        const auto op =
            type.op == spv::OpTypeFloat ? spv::OpFunctionCall : spv::OpCompositeConstruct;
        Id result = module_.new_id();
        types_[result] = c->type;
        zeros_code_.push_back(
            {.op = op, .type = c->type, .result = result, .operands = std::move(operands)});
        if (type.op == spv::OpTypeFloat && c->op == spv::OpConstant && c->operands.back() != 0) {
            const Id minus = module_.new_id();  // -0
            types_[minus] = c->type;
            module_.decorate(minus, spv::DecorationNoContraction);
            zeros_code_.push_back(
                {.op = spv::OpFNegate, .type = c->type, .result = minus, .operands = {result}});
            result = minus;
        }
        zeros_[id] = result;
        return result;
    }

    /// The parts of a composite constant.
    std::vector<Id> parts_of(const Instruction& c) {
        if (c.op == spv::OpConstantComposite) {
            return c.operands;
        }
        const auto& type = *module_.global(c.type);
        if (type.op == spv::OpTypeStruct) {
            std::vector<Id> parts;
            const auto members = type.operands;
            std::transform(members.begin(), members.end(), std::back_inserter(parts),
                           [&](Id member) { return module_.null(member); });
            return parts;
        }
        Word size = type.operands[1];
        if (type.op == spv::OpTypeArray) {
            module_.integer(type.operands[1], size);
        }
        std::vector<Id> parts(size, module_.null(type.operands[0]));
        return parts;
    }

    /// Whether a constant that is not large has a zero among its floating point numbers.
    bool has_zero(const Instruction& c) const {
        const auto scalars = module_.scalars(c.type);
        if (scalars == 0 || scalars > kMostScalars) {
            return false;
        }
        if (c.op == spv::OpConstantComposite) {
            return std::any_of(c.operands.begin(), c.operands.end(),
                               [&](Id part) { return has_zero(*module_.global(part)); });
        }
        if (c.op == spv::OpConstantNull) {
            return has_float(c.type);
        }
        return c.op == spv::OpConstant && module_.global(c.type)->op == spv::OpTypeFloat &&
               (c.operands.back() & 0x7fffffffU) == 0 &&
               (c.operands.size() == 1 || c.operands[0] == 0);
    }

    bool is_float(Id type) const {
        return module_.global(module_.scalar_type(type))->op == spv::OpTypeFloat;
    }

    /// Whether a type is an array or a matrix, or has one in it.
    bool has_array(Id type) const {
        const auto& t = *module_.global(type);
        return t.op == spv::OpTypeArray || t.op == spv::OpTypeMatrix ||
               (t.op == spv::OpTypeStruct &&
                std::any_of(t.operands.begin(), t.operands.end(),
                            [&](Id member) { return has_array(member); }));
    }

    bool has_float(Id type) const {
        const auto& t = *module_.global(type);
        if (t.op == spv::OpTypeStruct) {
            return std::any_of(t.operands.begin(), t.operands.end(),
                               [&](Id member) { return has_float(member); });
        }
        return t.op == spv::OpTypeFloat ||
               ((t.op == spv::OpTypeArray || t.op == spv::OpTypeVector ||
                 t.op == spv::OpTypeMatrix) &&
                has_float(t.operands[0]));
    }

    /// A constant that is finite and not zero.
    bool is_good_divisor(Id id) const {
        const auto* const c = module_.global(id);
        if (c == nullptr) {
            return good_divisors_.contains(id);
        }
        if (c->op == spv::OpConstantComposite) {
            return std::all_of(c->operands.begin(), c->operands.end(),
                               [&](Id part) { return is_good_divisor(part); });
        }
        if (c->op != spv::OpConstant || module_.global(c->type)->op != spv::OpTypeFloat) {
            return false;
        }
        const Word exponent = c->operands.size() == 1 ? 0x7f800000U : 0x7ff00000U;
        const Word high = c->operands.back() & exponent;
        return high != 0 && high != exponent;  // nor subnormal, which devices may take for zero
    }

    Module& module_;
    std::map<std::string, Callee> guards_;
    std::map<Id, Id> types_;  // of what functions compute
    std::map<std::pair<Id, Word>, Id> constants_;
    std::set<Id> precise_;
    std::set<Id> good_divisors_;
    std::set<Id> of_array_;                // pointers into arrays and matrices
    std::map<Id, Id> zeros_;               // constants and what replaces them in this function
    std::vector<Instruction> zeros_code_;  // which is made at its beginning
    Id glsl_ = 0;
    std::vector<Instruction> code_;  // the new one of a block
};

/// Makes of a constant's conversion between float32 and float64 the constant that it gives.
void convert(Instruction& conversion, const Instruction& number) {
    conversion.op = spv::OpConstant;
    if (number.operands.size() == 1) {
        const double wide = std::bit_cast<float>(number.operands[0]);
        const auto bits = std::bit_cast<std::uint64_t>(wide);
        conversion.operands = {static_cast<Word>(bits), static_cast<Word>(bits >> 32U)};
    } else {
        const auto bits = std::uint64_t{number.operands[1]} << 32U | number.operands[0];
        conversion.operands = {
            std::bit_cast<Word>(static_cast<float>(std::bit_cast<double>(bits)))};
    }
}

}  // namespace

void fix_parameters(Module& module) {
    std::map<Id, Word> spec_ids;
    for (auto& i : module.globals) {
        if (i.op == spv::OpDecorate && i.operands[1] == spv::DecorationSpecId &&
            i.operands[2] >= kFirstParameter) {
            spec_ids[i.operands[0]] = i.operands[2];
            i = {.op = spv::OpNop, .operands = {}};
        }
    }
    std::set<Id> fixed;  // made of parameters and constants
    const auto is_fixed = [&](Id id) {
        return fixed.contains(id) || module.global(id)->op == spv::OpConstant;
    };
    for (auto& i : module.globals) {
        if (i.op == spv::OpSpecConstant && spec_ids.contains(i.result)) {
            i.op = spv::OpConstant;
        } else if (i.op == spv::OpSpecConstantComposite &&
                   std::all_of(i.operands.begin(), i.operands.end(), is_fixed)) {
            i.op = spv::OpConstantComposite;
        } else if (i.op == spv::OpSpecConstantOp && i.operands[0] == spv::OpFConvert &&
                   fixed.contains(i.operands[1])) {
            convert(i, *module.global(i.operands[1]));
        } else {
            continue;
        }
        fixed.insert(i.result);
    }
}

void guard_metric_code(Module& module, const std::vector<std::size_t>& functions) {
    Guard guard(module);
    for (const auto i : functions) {
        guard.change(module.functions[i]);
    }
}

}  // namespace merl::engine
