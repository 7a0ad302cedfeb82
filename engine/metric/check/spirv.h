#pragma once

#define SPV_ENABLE_UTILITY_CODE
#include <SPIRV/spirv.hpp>
#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace merl::engine::spirv {

using Word = std::uint32_t;
using Id = std::uint32_t;

/// One instruction, and the place in the source that it is of: what the last OpLine says.
struct Instruction {
    spv::Op op = spv::OpNop;
    Id type = 0;    // of the result; 0 without one
    Id result = 0;  // likewise
    std::vector<Word> operands;
    Id file = 0;  // an OpString; 0 when not known
    Word line = 0;
};

/// Instructions after a label, the last of which ends the block.
struct Block {
    Id label = 0;
    std::vector<Instruction> code;
};

struct Function {
    Instruction head;
    std::vector<Instruction> parameters;
    std::vector<Block> blocks;

    Id id() const { return head.result; }
};

/// A SPIR-V module in pieces that can be looked at and changed.
class Module {
  public:
    Module() = default;
    explicit Module(std::span<const Word> words);

    /// As words again, without what only says where in the source something is from.
    std::vector<Word> words() const;

    /// What an OpName says; "" without one.
    const std::string& name(Id id) const;

    /// The text of an OpString.
    const std::string& string(Id id) const;

    /// The instruction outside functions that makes `id`: a type, constant or variable. Null when
    /// there is none.
    const Instruction* global(Id id) const;

    /// Scalars in a value of a type; a scalar has one. 0 for a type that is not made of scalars.
    std::uint64_t scalars(Id type) const;

    /// The scalar type of a scalar, vector or matrix; else the type itself.
    Id scalar_type(Id type) const;

    /// The value of an integer constant; false when `id` is none.
    bool integer(Id id, Word& value) const;

    /// The constant of this type that is zero all over.
    Id null(Id type);

    Id new_id() { return header_[3]++; }

    /// Adds a decoration without operands.
    void decorate(Id id, spv::Decoration decoration);

    /// Adds an execution mode of the entry point for numbers of `width` bits, and its capability.
    void declare(spv::ExecutionMode mode, Word width, spv::Capability capability);

    std::deque<Instruction> globals;  // which stay where they are when others are added
    std::vector<Function> functions;

  private:
    void index(const Instruction& instruction, std::size_t at);

    std::array<Word, 5> header_ = {};
    std::vector<Instruction> decorations_;  // added
    std::set<spv::Capability> capabilities_;
    std::vector<std::pair<spv::ExecutionMode, Word>> modes_;
    std::map<Id, std::string> names_;
    std::map<Id, std::string> strings_;
    std::map<Id, std::size_t> global_of_;
    std::map<Id, Id> nulls_;
};

/// The operands that are ids, for the instructions that may be in a metric (code.cpp).
std::vector<Id> ids_of(const Instruction& instruction);

/// The labels that the last instruction of a block may go to.
std::vector<Id> targets_of(const Instruction& last);

}  // namespace merl::engine::spirv
