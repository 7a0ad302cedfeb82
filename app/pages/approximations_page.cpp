#include "app/pages/approximations_page.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "app/output/provenance.h"
#include "app/pages/approximations_page_html.h"
#include "app/pages/page.h"
#include "app/pipeline/quotable_line.h"
#include "engine/base/text.h"
#include "scan/reference/reference_scan.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

ordered_json sphere_json(const PageSpheres& spheres, std::uint32_t material) {
    const auto found = spheres.png.find(material);
    return found == spheres.png.end()
               ? ordered_json()
               : ordered_json("data:image/png;base64," + base64(found->second));
}

ordered_json original_json(const scan::ReferenceDistances& distances,
                           const scan::OriginalRange& range,
                           const std::vector<std::vector<double>>& ranks,
                           const PageSpheres& spheres) {
    const auto& [reference, labels, list, lacking, without, unrelated] = distances.approximations;
    ordered_json approximations = ordered_json::array();
    for (auto i = range.begin; i < range.end; ++i) {
        ordered_json values = ordered_json::array();
        ordered_json of_metrics = ordered_json::array();
        for (std::size_t m = 0; m < ranks.size(); ++m) {
            values.push_back(distances.table.metrics[m].values[distances.pairs[i]]);
            of_metrics.push_back(ranks[m][i]);
        }
        approximations.push_back({{"label", list[i].label},
                                  {"distances", values},
                                  {"ranks", of_metrics},
                                  {"sphere", sphere_json(spheres, list[i].approximation)}});
    }
    return {{"name", printable(distances.table.names[range.original].substr(reference.size() + 1))},
            {"sphere", sphere_json(spheres, range.original)},
            {"approximations", approximations}};
}

ordered_json page_data(const pipeline::Provenance& provenance, std::size_t materials,
                       const pipeline::ReferenceScanResult& result, const PageSpheres& spheres) {
    const auto& distances = result.distances;
    const auto& summary = result.summary;
    ordered_json facts = ordered_json::array();
    for (const auto& lines : {source_lines(provenance, materials), engine_lines(provenance)}) {
        for (const auto& [name, text] : lines) {
            facts.push_back({name, printable(text)});
        }
    }
    ordered_json labels = ordered_json::array();
    for (const auto& label : distances.approximations.labels) {
        labels.push_back(printable(label));
    }
    ordered_json metrics = ordered_json::array();
    std::vector<std::vector<double>> ranks;
    for (std::size_t m = 0; m < summary.metrics.size(); ++m) {
        ranks.push_back(scan::ranks_of(distances, m));
        ordered_json of_labels = ordered_json::array();
        for (const auto& figures : summary.metrics[m].labels) {
            of_labels.push_back({{"best", figures.best},
                                 {"mean_rank", figures.mean_rank ? ordered_json(*figures.mean_rank)
                                                                 : ordered_json()}});
        }
        metrics.push_back(
            {{"name", printable(distances.table.metrics[m].metric)}, {"labels", of_labels}});
    }
    ordered_json pairs = ordered_json::array();
    for (const auto& pair : summary.pairs) {
        pairs.push_back({{"first", pair.first},
                         {"second", pair.second},
                         {"different", pair.different},
                         {"partly", pair.partly},
                         {"rate", pair.counts.disagreement_rate()}});
    }
    ordered_json originals = ordered_json::array();
    for (const auto place : originals_on_page(distances)) {
        originals.push_back(original_json(distances, distances.ranges[place], ranks, spheres));
    }
    return {{"version", provenance.version},
            {"quote", printable(pipeline::quotable_line(provenance))},
            {"facts", facts},
            {"reference", printable(distances.approximations.reference)},
            {"labels", labels},
            {"metrics", metrics},
            {"pairs", pairs},
            {"complete", summary.complete},
            {"contested", summary.contested},
            {"all", distances.ranges.size()},
            {"why_not", spheres.why_not},
            {"originals", originals}};
}

}  // namespace

std::vector<std::size_t> originals_on_page(const scan::ReferenceDistances& distances) {
    std::vector<std::size_t> places;
    std::vector<bool> taken(distances.ranges.size());
    const auto take = [&](std::size_t place) {
        if (!taken[place] && places.size() < kOriginalsOnPage) {
            taken[place] = true;
            places.push_back(place);
        }
    };
    for (const auto& configuration : scan::disagreements_of(distances)) {
        const auto original = distances.of_pair(configuration.left).original;
        const auto range = std::ranges::lower_bound(distances.ranges, original, {},
                                                    &scan::OriginalRange::original);
        take(static_cast<std::size_t>(range - distances.ranges.begin()));
    }
    for (std::size_t place = 0; place < taken.size(); ++place) {
        take(place);
    }
    return places;
}

std::string approximations_page(const pipeline::Provenance& provenance, std::size_t materials,
                                const pipeline::ReferenceScanResult& result,
                                const PageSpheres& spheres) {
    return page_of(kApproximationsPage, page_data(provenance, materials, result, spheres));
}

}  // namespace merl::app
