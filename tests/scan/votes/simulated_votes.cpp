#include "simulated_votes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace merl::scan {
namespace {

constexpr double limit = 0.3;  // beyond it a judge sees a difference

}  // namespace

Votes empty_votes(std::uint32_t judges, std::uint32_t configurations, std::uint32_t materials,
                  std::uint32_t seed) {
    Votes votes{.first_metric = "cwcbrt",
                .second_metric = "pawcielab",
                .kit_hash = "k",
                .with_kit = true,
                .configurations = {},
                .judges = {},
                .trials = configurations};
    std::mt19937 random(seed);
    for (std::uint32_t k = 0; k < configurations; ++k) {
        std::vector<std::uint32_t> four;
        while (four.size() < 4) {
            const auto material = static_cast<std::uint32_t>(random() % materials);
            if (std::ranges::find(four, material) == four.end()) {
                four.push_back(material);
            }
        }
        const auto name = [&](std::size_t i) { return fmt::format("m{}", four[i]); };
        votes.configurations.push_back({.number = k + 1,
                                        .kind = TrialKind::selection,
                                        .materials = {name(0), name(1), name(2), name(3)},
                                        .agreement = 0.5,
                                        .expected = 0});
    }
    for (std::uint32_t j = 0; j < judges; ++j) {
        votes.judges.push_back({.name = fmt::format("judge {}", j), .file = "f", .ballots = {}});
    }
    return votes;
}

Votes empty_reference_votes(std::uint32_t judges, std::uint32_t configurations,
                            std::uint32_t originals, std::uint32_t seed) {
    Votes votes = empty_votes(judges, configurations, 4);
    votes.reference = std::string("o");
    std::mt19937 random(seed);
    for (std::uint32_t k = 0; k < configurations; ++k) {
        const auto left = random() % 4;
        const auto right = (left + 1 + random() % 3) % 4;
        const auto name = [&](char label) { return fmt::format("{}/m{}", label, k % originals); };
        votes.configurations[k].materials = {name('o'), name("abcd"[left]), name('o'),
                                             name("abcd"[right])};
    }
    return votes;
}

Ballot ballot(std::uint32_t configuration, int side, bool swapped, bool repeat) {
    return {.configuration = configuration,
            .repeat = repeat,
            .swapped = swapped,
            .shown = static_cast<std::uint8_t>(swapped && side != 0 ? 4 - side : side),
            .response_ms = std::nullopt};
}

Votes SimulatedJudges::run(std::uint32_t seed) const {
    Votes votes = reference ? empty_reference_votes(judges, configurations, materials, seed)
                            : empty_votes(judges, configurations, materials, seed);
    std::mt19937 random(seed + 1'000'000);
    std::normal_distribution<double> normal;
    std::vector<double> of_materials(materials);
    for (auto& effect : of_materials) {
        effect = (reference ? 1 : 0.5) * material_effect * normal(random);
    }
    std::vector<double> seen;
    for (const auto& configuration : votes.configurations) {
        double x = mean + configuration_effect * normal(random);
        const std::span<const std::string> all = configuration.materials;
        for (const auto& name : reference ? all.first(1) : all) {
            x += of_materials.at(std::stoul(name.substr(name.find('m') + 1)));
        }
        seen.push_back(x);
    }
    for (auto& judge : votes.judges) {
        const double effect = judge_effect * normal(random);
        for (std::uint32_t k = 0; k < configurations; ++k) {
            const bool swapped = random() % 2 == 1;
            const double x = seen[k] + effect + normal(random) + (swapped ? leaning : -leaning);
            judge.ballots.push_back(ballot(k, x > limit ? 3 : x < -limit ? 1 : 2, swapped));
        }
    }
    return votes;
}

std::array<double, 3> SimulatedJudges::shares() const {
    const double sigma =
        std::sqrt(1 + judge_effect * judge_effect + material_effect * material_effect +
                  configuration_effect * configuration_effect);
    const auto above = [&](double expected, double least) {
        return 0.5 * std::erfc((least - expected) / sigma / std::sqrt(2.0));
    };
    double first = 0;
    double second = 0;
    for (const double expected : {mean + leaning, mean - leaning}) {
        first += (1 - above(expected, -limit)) / 2;
        second += above(expected, limit) / 2;
    }
    return {first, 1 - first - second, second};
}

}  // namespace merl::scan
