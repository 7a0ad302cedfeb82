#pragma once

namespace merl::app {

/// Exit statuses of the program (documented in README.md and by --help).
enum ExitStatus : int {
    kSuccess = 0,
    kVerificationFailed = 1,  // `verify` found a wrong number
    kUsage = 2,               // an unknown option, value, metric
    kInput = 3,               // a database that cannot be used
    kDevice = 4,              // no usable Vulkan device, or it failed
    kOutput = 5,              // a result that cannot be written
    kResource = 6,            // not enough memory, threads or open files
    kInternal = 70,           // a bug of the program
    kInterrupted = 128,       // plus the number of the signal: 130 for Ctrl-C
};

}  // namespace merl::app
