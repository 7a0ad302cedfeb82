#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "app/pipeline/control.h"
#include "engine/distance/engines.h"

namespace merl::python {

/// How a call is done: what every function that computes takes.
struct CallOptions {
    std::string device;                        // as --device
    std::uint64_t memory_bytes = 1ULL << 30U;  // as --memory
    int threads = 0;                           // as --threads; 0: all
    pybind11::object progress;                 // None, or called with the stage and the share
};

/// The options that a function of the module has as its last arguments. Throws Error (usage).
CallOptions call_options(const pybind11::dict& options);

/// Runs `work` without the lock of the interpreter, on so many threads. Several times a second the
/// control looks for signals and calls back, with the lock; what Python raises in there ends the
/// work and comes out. Throws Error (resource) in a process that was forked from one that had
/// computed already: the threads and devices of that are gone.
void run(const CallOptions& options, const std::function<void(const pipeline::Control&)>& work);

/// Engines for one call at a time, kept from call to call. Those of a call that throws are not used
/// again.
class BorrowedEngines {
  public:
    explicit BorrowedEngines(const std::string& device);
    ~BorrowedEngines();
    BorrowedEngines(const BorrowedEngines&) = delete;
    BorrowedEngines& operator=(const BorrowedEngines&) = delete;

    engine::Engines& operator*() { return *engines_; }

  private:
    std::string device_;
    int exceptions_;
    std::unique_ptr<engine::Engines> engines_;
};

}  // namespace merl::python
