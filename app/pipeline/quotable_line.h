#pragma once

#include <string>

#include "app/pipeline/pair_distances.h"

namespace merl::pipeline {

/// What a paper says of distances so that others can compute them again, in one line: program and
/// version, metrics with their parameters and how exact they are, database with hash and grid, and
/// engines:
///
///     merl-scan v0.1.0, pawcielab (float32, bounded), database ABC fits of MERL (xxh3 ...), 100
///     materials, grid 90x90x180, engine host
///
/// Of a table of distances its name without directories and its hash. Names are as they are, of any
/// bytes.
std::string quotable_line(const Provenance& provenance);

}  // namespace merl::pipeline
