#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

namespace merl::app {

/// The processes of one run on many machines, as MPI has them; without MPI, or where nobody started
/// several, this one alone.
///
/// All of MPI is behind this: ranks.cpp has it, or where the program is built without it
/// (MERL_SCAN_MPI) ranks_alone.cpp has none.
class Ranks {
  public:
    /// Joins the others, if a launcher of MPI started this process (mpirun, srun). To be made once,
    /// after all processes that the program itself starts. Throws Error (usage) where there are
    /// others and the program is built without MPI.
    Ranks();

    /// Leaves them, after wait(). Where something was thrown instead, it does nothing: end_ranks()
    /// comes then.
    ~Ranks();
    Ranks(const Ranks&) = delete;
    Ranks& operator=(const Ranks&) = delete;

    std::uint32_t rank() const;
    std::uint32_t count() const;

    /// Waits until all have come here. `meanwhile` is called every few milliseconds; what it throws
    /// ends the wait.
    void wait(const std::function<void()>& meanwhile);

    /// Hands out the numbers from 0 to `numbers`, each to one of the ranks, whoever asks first.
    /// Returns none when all are given out: from then on nobody may ask. The first rank answers the
    /// others on a thread of its own, beside what it computes. `meanwhile` as above.
    std::optional<std::uint64_t> next(std::uint64_t numbers,
                                      const std::function<void()>& meanwhile);

    /// The sum over all ranks, which all ask for.
    std::uint64_t sum(std::uint64_t number);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Ends all ranks where this one ends with an error, so that none waits for it. `status` is the
/// exit status of the run. Does nothing where there are no others, or this one has left them.
void end_ranks(int status);

}  // namespace merl::app
