#pragma once

#include <span>
#include <string>

#include "app/pipeline/pair_distances.h"
#include "scan/select/compare_metrics.h"
#include "scan/select/triangle.h"

namespace merl::app {

/// So many pairs are drawn on the page; of more, so many are drawn by lot.
inline constexpr std::size_t kPairsOnPage = 10000;

/// compare.html: one page that needs no other file and no network, with the heat map of all metric
/// pairs, the scatter plot of any two metrics, and what is known of each metric. `triangles` are of
/// those that are not proven to keep the triangle inequality.
std::string compare_page(const pipeline::PairDistances& distances,
                         const scan::ComparisonResult& compared,
                         std::span<const scan::TriangleCheck> triangles);

}  // namespace merl::app
