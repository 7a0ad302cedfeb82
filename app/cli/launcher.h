#pragma once

#include <cstdint>
#include <cstdlib>
#include <optional>

#include "engine/base/number.h"

namespace merl::app {

/// How many processes a launcher of MPI has started, this one among them, as its variables of the
/// environment say: Open MPI's, or those of MPICH and of srun for it. 1 where there is no launcher,
/// 0 where it does not say: srun for Open MPI.
inline std::uint64_t launched_processes() {
    for (const char* const variable : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}) {
        const char* const text = std::getenv(variable);
        if (text != nullptr) {
            return parse_number<std::uint64_t>(text).value_or(0);
        }
    }
    if (std::getenv("PMIX_RANK") == nullptr) {
        return 1;
    }
    const char* const tasks = std::getenv("SLURM_NTASKS");
    return tasks == nullptr ? 0 : parse_number<std::uint64_t>(tasks).value_or(0);
}

}  // namespace merl::app
