#include "app/interrupt.h"

#include <csignal>

namespace merl::app {
namespace {

volatile std::sig_atomic_t noted_signal = 0;

void note_signal(int signal) {
    noted_signal = signal;
}

}  // namespace

void catch_interrupts() {
    std::signal(SIGINT, note_signal);
    std::signal(SIGTERM, note_signal);
    if (std::signal(SIGHUP, note_signal) == SIG_IGN) {
        std::signal(SIGHUP, SIG_IGN);  // nohup
    }
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);
}

void throw_if_interrupted() {
    if (noted_signal != 0) {
        throw Interrupted(noted_signal);
    }
}

}  // namespace merl::app
