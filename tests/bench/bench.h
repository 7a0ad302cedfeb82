#pragma once

#include <benchmark/benchmark.h>

#include <functional>
#include <string>

namespace merl::bench {

/// What the command line says.
struct Settings {
    std::string database;  // a directory of MERL files; the built-in database when empty
    std::string device;    // empty: the best
    bool check = false;    // coarse grids, everything once: are the results right?
};
const Settings& settings();

enum class Clock {
    wall,
    manual,  // the body says how long each iteration took
};

/// Registers a benchmark. What `body` throws marks it as failed, and the program as a whole.
benchmark::internal::Benchmark& add(const std::string& name,
                                    const std::function<void(benchmark::State&)>& body,
                                    Clock clock = Clock::wall);

/// Calls `check` once a name, not once a repetition, and returns what it returned: the largest
/// error. It throws when a result is wrong.
double check_once(const std::string& name, const std::function<double()>& check);

/// Throws std::runtime_error with `what` unless `right`.
void require(bool right, const std::string& what);

// One of each file of this folder; they register what they time.
void add_reading();
void add_distances();
void add_scale();
void add_exact();
void add_scan();
void add_peers();

}  // namespace merl::bench
