#pragma once

#include <exception>
#include <filesystem>

namespace merl::app {

/// Thrown when the user asked the program to stop (SIGINT, SIGTERM, SIGUSR1 or SIGHUP).
class Interrupted : public std::exception {
  public:
    explicit Interrupted(int signal) : signal_(signal) {}
    int signal() const { return signal_; }
    const char* what() const noexcept override { return "interrupted"; }

  private:
    int signal_;
};

/// From now on SIGINT, SIGTERM, SIGUSR1, which batch systems send before time is up, and, unless it
/// was ignored, SIGHUP are only noted, and writing to a
/// closed pipe or beyond the largest file allowed is an error like any other: nothing half-written
/// is left behind. Work that does not look at what was noted within a second, such as a driver that
/// compiles, is ended all the same. A second signal ends the program at once; one that comes within
/// a fifth of a second is the first again, as programs such as timeout send it.
void catch_interrupts();

/// Throws Interrupted when a signal was noted. Called between pieces of work.
void throw_if_interrupted();

/// The directory to remove where work is ended that does not look; empty: none any more.
void set_unfinished(const std::filesystem::path& directory);

/// Results are being put into place: from now on only a second signal ends the program.
void finish_in_any_case();

/// The same as long as it lives: what a run that was stopped left is being put into place.
class Finishing {
  public:
    Finishing();
    ~Finishing();
    Finishing(const Finishing&) = delete;
    Finishing& operator=(const Finishing&) = delete;
};

/// What is said then of what was written, "nothing was written" otherwise; a literal.
void say_when_interrupted(const char* what);

/// Says once, on standard error, that the program was interrupted.
void say_interrupted();

}  // namespace merl::app
