#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "app/commands/obtain_distances.h"
#include "app/pipeline/scan.h"

namespace merl::app {

/// The options of `scan`, with --reference and without.
struct ScanCommandOptions {
    DistanceOptions distances;
    std::string reference;  // the label of originals; empty: a scan of all pairs
    std::string out = "merl-scan-results";
    std::uint32_t select = 100;
    std::uint32_t per_material = 10;
    std::uint32_t spheres = 20;                  // of so many originals, with a reference
    std::optional<std::uint64_t> disagreements;  // how many rows to write; all without
    bool fast = false;
    bool force = false;
    bool quiet = false;

    pipeline::ScanOptions of_pipeline() const {
        return {.select = select,
                .per_material = per_material,
                .disagreements = disagreements,
                .fast = fast,
                .memory_bytes = distances.memory};
    }
};

/// The scan of originals and their approximations, scan_reference.cpp. Returns the exit status.
int run_reference_scan(const ScanCommandOptions& options);

/// Those of the options that say what is selected and listed, and how distances are computed, for
/// summaries.
nlohmann::ordered_json scan_options_json(const ScanCommandOptions& options);

}  // namespace merl::app
