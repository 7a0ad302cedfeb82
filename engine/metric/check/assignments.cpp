#include "engine/metric/check/assignments.h"

#include <algorithm>

namespace merl::engine {
namespace {

using namespace spirv;

/// A larger variable counts as one scalar: it has a value when all of it was given one at once.
constexpr std::uint64_t kMostScalars = 4096;

std::map<Id, std::size_t> places_of(const Function& function) {
    std::map<Id, std::size_t> places;
    for (std::size_t b = 0; b < function.blocks.size(); ++b) {
        places[function.blocks[b].label] = b;
    }
    return places;
}

/// Scalars of a function's variables.
struct Place {
    std::size_t first = 0;
    std::size_t count = 0;
    Id type = 0;
    bool exact = true;  // else a part of them, which is not known
};

}  // namespace

std::vector<bool> reachable_blocks(const Function& function) {
    const auto places = places_of(function);
    std::vector<bool> reachable(function.blocks.size());
    std::vector<std::size_t> left = {0};
    while (!left.empty()) {
        const auto b = left.back();
        left.pop_back();
        if (reachable[b]) {
            continue;
        }
        reachable[b] = true;
        for (const Id target : targets_of(function.blocks[b].code.back())) {
            left.push_back(places.at(target));
        }
    }
    return reachable;
}

/// The variables of one function, and which of their scalars have a value where.
class Assignments::Flow {
  public:
    Flow(const Module& module, const std::map<Id, Arguments>& arguments, const Function& function)
        : module_(module), arguments_(arguments), function_(function) {
        for (const auto& parameter : function.parameters) {
            const auto* const type = module.global(parameter.type);
            const bool is_pointer = type != nullptr && type->op == spv::OpTypePointer;
            parameters_.push_back(is_pointer ? add(parameter.result, type->operands[1]) : Place());
        }
        first_own_ = size_;
        for (const auto& block : function.blocks) {
            for (const auto& i : block.code) {
                if (i.op == spv::OpVariable) {
                    add(i.result, module.global(i.type)->operands[1]);
                }
            }
        }
    }

    const Instruction* run(Arguments& result) {
        settle();
        read_.assign(size_, false);
        std::vector<bool> at_return(size_, true);
        for (std::size_t b = 0; b < function_.blocks.size(); ++b) {
            if (!visited_[b]) {
                continue;
            }
            auto has = in_[b];
            pass(b, has, true);
            const auto end = function_.blocks[b].code.back().op;
            if (end == spv::OpReturn || end == spv::OpReturnValue) {
                meet(at_return, has);
            }
        }
        for (const auto& p : parameters_) {
            const auto part = [&](const std::vector<bool>& all) {
                const auto first = all.begin() + static_cast<std::ptrdiff_t>(p.first);
                return std::vector<bool>(first, first + static_cast<std::ptrdiff_t>(p.count));
            };
            result.push_back({.read = part(read_), .given = part(at_return)});
        }
        return offence_;
    }

  private:
    Place add(Id id, Id type) {
        const auto scalars = module_.scalars(type);
        const bool fits = scalars > 0 && scalars <= kMostScalars;
        const Place place = {.first = size_, .count = fits ? scalars : 1, .type = fits ? type : 0};
        size_ += place.count;
        place_of_[id] = place;
        return place;
    }

    static bool meet(std::vector<bool>& all, const std::vector<bool>& other) {
        bool changed = false;
        for (std::size_t i = 0; i < all.size(); ++i) {
            changed = changed || (all[i] && !other[i]);
            all[i] = all[i] && other[i];
        }
        return changed;
    }

    /// What has a value at the beginning of each block, on every path to it.
    void settle() {
        const auto places = places_of(function_);
        in_.assign(function_.blocks.size(), std::vector<bool>(size_, true));
        visited_.assign(function_.blocks.size(), false);
        in_[0].assign(size_, false);
        std::vector<std::size_t> left = {0};
        while (!left.empty()) {
            const auto b = left.back();
            left.pop_back();
            visited_[b] = true;
            auto has = in_[b];
            pass(b, has, false);
            for (const Id target : targets_of(function_.blocks[b].code.back())) {
                const auto next = places.at(target);
                if (meet(in_[next], has) || !visited_[next]) {
                    left.push_back(next);
                }
            }
        }
    }

    void pass(std::size_t b, std::vector<bool>& has, bool report) {
        for (const auto& i : function_.blocks[b].code) {
            switch (i.op) {
                case spv::OpVariable:
                    if (i.operands.size() > 1) {
                        give(place_of_.at(i.result), has);
                    }
                    break;
                case spv::OpAccessChain:
                case spv::OpInBoundsAccessChain:
                    place_of_[i.result] = part(i);
                    break;
                case spv::OpLoad:
                    if (report) {
                        read(place_of_.at(i.operands[0]), has, i);
                    }
                    break;
                case spv::OpStore:
                    give(place_of_.at(i.operands[0]), has);
                    break;
                case spv::OpFunctionCall:
                    call(i, has, report);
                    break;
                default:
                    break;
            }
        }
    }

    static void give(const Place& place, std::vector<bool>& has) {
        for (std::size_t i = 0; i < place.count && place.exact; ++i) {
            has[place.first + i] = true;
        }
    }

    void read_scalar(std::size_t i, const std::vector<bool>& has, const Instruction& by) {
        if (has[i]) {
            return;
        }
        read_[i] = true;
        if (i >= first_own_ && offence_ == nullptr) {
            offence_ = &by;
        }
    }

    void read(const Place& place, const std::vector<bool>& has, const Instruction& by) {
        for (std::size_t i = 0; i < place.count; ++i) {
            read_scalar(place.first + i, has, by);
        }
    }

    void call(const Instruction& i, std::vector<bool>& has, bool report) {
        const auto& arguments = arguments_.at(i.operands[0]);
        for (std::size_t a = 0; a < arguments.size(); ++a) {
            const auto found = place_of_.find(i.operands[a + 1]);
            if (found == place_of_.end()) {
                continue;  // a value
            }
            const auto& place = found->second;
            const auto& argument = arguments[a];
            for (std::size_t k = 0; k < place.count; ++k) {
                // Sizes differ where a variable counts as one scalar.
                const bool same = argument.read.size() == place.count;
                const bool all_given = std::all_of(argument.given.begin(), argument.given.end(),
                                                   [](bool given) { return given; });
                if (report && (same ? argument.read[k] : true)) {
                    read_scalar(place.first + k, has, i);
                }
                if (place.exact && (same ? argument.given[k] : all_given)) {
                    has[place.first + k] = true;
                }
            }
        }
    }

    /// The part of a variable that an access chain means.
    Place part(const Instruction& i) const {
        Place place = place_of_.at(i.operands[0]);
        for (std::size_t k = 1; k < i.operands.size() && place.type != 0; ++k) {
            const auto& type = *module_.global(place.type);
            Word index = 0;
            if (!module_.integer(i.operands[k], index)) {
                place.exact = false;
                return place;
            }
            std::size_t first = 0;
            Id element = 0;
            if (type.op == spv::OpTypeStruct) {
                for (Word member = 0; member < index; ++member) {
                    first += module_.scalars(type.operands[member]);
                }
                element = type.operands[index];
            } else {
                element = type.operands[0];
                first = index * module_.scalars(element);
            }
            const auto count = module_.scalars(element);
            if (first + count > place.count) {  // beyond its end: guard_metric_code() sees to it
                place.exact = false;
                return place;
            }
            place = {.first = place.first + first,
                     .count = count,
                     .type = element,
                     .exact = place.exact};
        }
        place.exact = place.exact && place.type != 0;
        return place;
    }

    const Module& module_;
    const std::map<Id, Arguments>& arguments_;
    const Function& function_;
    std::map<Id, Place> place_of_;  // what a pointer points at
    std::vector<Place> parameters_;
    std::size_t size_ = 0;       // scalars of all variables
    std::size_t first_own_ = 0;  // those before are of parameters
    std::vector<std::vector<bool>> in_;
    std::vector<bool> visited_;
    std::vector<bool> read_;
    const Instruction* offence_ = nullptr;
};

const Instruction* Assignments::check(const Function& function) {
    return Flow(module_, arguments_, function).run(arguments_[function.id()]);
}

}  // namespace merl::engine
