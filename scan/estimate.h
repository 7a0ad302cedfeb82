#pragma once

#include "scan/bootstrap.h"

namespace merl::scan {

/// A figure and its 95 % interval from a bootstrap.
struct Estimate {
    double value;
    Interval interval;
};

}  // namespace merl::scan
