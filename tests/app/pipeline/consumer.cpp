// A program of somebody else's (docs/architecture.md): the distance of two materials under a
// metric.
#include <cstdio>

#include "app/pipeline/pair_distances.h"
#include "engine/database/open_database.h"

int main(int argc, char** argv) {
    try {
        const auto database = merl::engine::open_database(argc > 1 ? argv[1] : "");
        const auto& metric = merl::engine::find_metric("pawcielab");
        const merl::engine::Metric* const metrics[] = {&metric};
        merl::engine::Engines engines;  // a GPU if there is one, otherwise this processor
        const auto distances = merl::pipeline::compute_pair_distances(engines, *database, metrics);
        const auto& table = distances.table;
        std::printf("%s, %s: %.17g\n", table.names[0].c_str(), table.names[1].c_str(),
                    table.metrics[0].values[0]);
        return 0;
    } catch (const merl::Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
