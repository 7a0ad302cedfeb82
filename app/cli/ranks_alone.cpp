// Without MPI.
#include <cstdlib>

#include "app/cli/launcher.h"
#include "app/cli/ranks.h"
#include "engine/base/error.h"

namespace merl::app {

struct Ranks::State {
    std::uint64_t next = 0;
};

Ranks::Ranks() : state_(std::make_unique<State>()) {
    if (launched_processes() > 1) {
        throw Error(Fault::usage,
                    "this program is built without MPI, so the processes that mpirun or srun "
                    "started would all do the same; build it with -DMERL_SCAN_MPI=ON, or give "
                    "each of them a --part K/N");
    }
}

Ranks::~Ranks() = default;

// NOLINTNEXTLINE(readability-convert-member-functions-to-static): as with MPI
std::uint32_t Ranks::rank() const {
    return 0;
}

// NOLINTNEXTLINE(readability-convert-member-functions-to-static): as with MPI
std::uint32_t Ranks::count() const {
    return 1;
}

void Ranks::wait(const std::function<void()>& /*meanwhile*/) {}

std::optional<std::uint64_t> Ranks::next(std::uint64_t numbers,
                                         const std::function<void()>& /*meanwhile*/) {
    return state_->next < numbers ? std::optional(state_->next++) : std::nullopt;
}

// NOLINTNEXTLINE(readability-convert-member-functions-to-static): as with MPI
std::uint64_t Ranks::sum(std::uint64_t number) {
    return number;
}

void end_ranks(int /*status*/) {}

}  // namespace merl::app
