// With MPI.
#include "app/cli/ranks.h"

// The interface of C alone.
#define OMPI_SKIP_MPICXX 1
#define MPICH_SKIP_MPICXX 1
#include <mpi.h>

#include <atomic>
#include <chrono>
#include <exception>
#include <thread>

#include "app/cli/launcher.h"
#include "engine/base/error.h"

namespace merl::app {
namespace {

/// MPI's own waiting keeps a processor busy, which others compute on.
constexpr std::chrono::milliseconds kLookEvery{2};

constexpr int kAsk = 1;  // tags of messages
constexpr int kAnswer = 2;

bool joined = false;

/// Waits for what was begun.
void complete(MPI_Request& request, const std::function<void()>& meanwhile) {
    for (;;) {
        int done = 0;
        MPI_Test(&request, &done, MPI_STATUS_IGNORE);
        if (done != 0) {
            return;
        }
        meanwhile();
        std::this_thread::sleep_for(kLookEvery);
    }
}

}  // namespace

struct Ranks::State {
    int rank = 0;
    int count = 1;
    bool is_over = false;  // whether next() has given out all
    std::atomic<std::uint64_t> next = 0;
    std::atomic<bool> stop = false;
    std::atomic<bool> answered = false;
    std::thread answering;

    ~State() {
        stop = true;
        if (answering.joinable()) {
            answering.join();
        }
    }

    /// Until all other ranks know that there is no more.
    void answer(std::uint64_t numbers) {
        int left = count - 1;
        while (left > 0 && !stop) {
            int is_there = 0;
            MPI_Status status;
            MPI_Iprobe(MPI_ANY_SOURCE, kAsk, MPI_COMM_WORLD, &is_there, &status);
            if (is_there == 0) {
                std::this_thread::sleep_for(kLookEvery);
                continue;
            }
            MPI_Recv(nullptr, 0, MPI_BYTE, status.MPI_SOURCE, kAsk, MPI_COMM_WORLD,
                     MPI_STATUS_IGNORE);
            const std::uint64_t number = next++;
            left -= number < numbers ? 0 : 1;
            MPI_Send(&number, 1, MPI_UINT64_T, status.MPI_SOURCE, kAnswer, MPI_COMM_WORLD);
        }
        answered = true;
    }
};

Ranks::Ranks() : state_(std::make_unique<State>()) {
    if (launched_processes() == 1) {
        return;
    }
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided);
    joined = true;
    MPI_Comm_rank(MPI_COMM_WORLD, &state_->rank);
    MPI_Comm_size(MPI_COMM_WORLD, &state_->count);
    if (provided < MPI_THREAD_SERIALIZED && state_->count > 1) {
        throw Error(Fault::usage,
                    "this MPI does not let a thread of its own answer the other processes "
                    "(MPI_THREAD_SERIALIZED); use another, or --part K/N without MPI");
    }
}

Ranks::~Ranks() {
    if (joined && std::uncaught_exceptions() == 0) {
        MPI_Finalize();
        joined = false;
    }
}

std::uint32_t Ranks::rank() const {
    return static_cast<std::uint32_t>(state_->rank);
}

std::uint32_t Ranks::count() const {
    return static_cast<std::uint32_t>(state_->count);
}

void Ranks::wait(const std::function<void()>& meanwhile) {
    if (state_->count > 1) {
        MPI_Request request = MPI_REQUEST_NULL;
        MPI_Ibarrier(MPI_COMM_WORLD, &request);
        complete(request, meanwhile);
    }
}

std::optional<std::uint64_t> Ranks::next(std::uint64_t numbers,
                                         const std::function<void()>& meanwhile) {
    std::uint64_t number = 0;
    if (state_->rank == 0) {
        if (state_->count > 1 && !state_->answering.joinable() && !state_->is_over) {
            state_->answering = std::thread([this, numbers] { state_->answer(numbers); });
        }
        number = state_->next++;
        if (number >= numbers && state_->answering.joinable()) {
            // The other thread has MPI until everybody knows.
            while (!state_->answered) {
                meanwhile();
                std::this_thread::sleep_for(kLookEvery);
            }
            state_->answering.join();
        }
    } else {
        MPI_Request request = MPI_REQUEST_NULL;
        MPI_Send(nullptr, 0, MPI_BYTE, 0, kAsk, MPI_COMM_WORLD);
        MPI_Irecv(&number, 1, MPI_UINT64_T, 0, kAnswer, MPI_COMM_WORLD, &request);
        complete(request, meanwhile);
    }
    state_->is_over = number >= numbers;
    return state_->is_over ? std::nullopt : std::optional(number);
}

std::uint64_t Ranks::sum(std::uint64_t number) {
    std::uint64_t all = number;
    if (state_->count > 1) {
        MPI_Allreduce(&number, &all, 1, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
    }
    return all;
}

void end_ranks(int status) {
    if (joined) {
        MPI_Abort(MPI_COMM_WORLD, status);
    }
}

}  // namespace merl::app
