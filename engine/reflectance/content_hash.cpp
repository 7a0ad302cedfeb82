#include "engine/reflectance/content_hash.h"

#include <fmt/format.h>
#include <xxhash.h>

namespace merl::reflectance {

struct ContentHash::Planes {
    struct Free {
        void operator()(XXH3_state_t* state) const { XXH3_freeState(state); }
    };
    std::array<std::unique_ptr<XXH3_state_t, Free>, 3> states;  // null until there are bytes
    std::array<std::uint64_t, 3> bytes = {};
};

namespace {

std::string hexadecimal(const XXH128_hash_t& hash) {
    return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

XXH128_hash_t digest_of(const XXH3_state_t* state) {
    return state == nullptr ? XXH3_128bits("", 0) : XXH3_128bits_digest(state);
}

}  // namespace

ContentHash::ContentHash(std::size_t materials) {
    for (std::size_t i = 0; i < materials; ++i) {
        materials_.push_back(std::make_unique<Planes>());
    }
}

ContentHash::~ContentHash() = default;

void ContentHash::update(std::size_t material, std::size_t plane,
                         std::span<const std::byte> bytes) {
    auto& planes = *materials_.at(material);
    auto& state = planes.states.at(plane);
    if (!state) {
        state.reset(XXH3_createState());
        XXH3_128bits_reset(state.get());
    }
    XXH3_128bits_update(state.get(), bytes.data(), bytes.size());
    planes.bytes.at(plane) += bytes.size();
}

std::string ContentHash::digest(const std::vector<std::string>& materials,
                                const std::string& header) const {
    std::string all = header;
    for (std::size_t i = 0; i < materials.size(); ++i) {
        all += '\n' + materials[i] + planes_text(i);
    }
    return hexadecimal(XXH3_128bits(all.data(), all.size()));
}

std::string ContentHash::material_digest(std::size_t material, const std::string& header) const {
    const std::string all = header + '\n' + planes_text(material);
    return hexadecimal(XXH3_128bits(all.data(), all.size()));
}

bool ContentHash::same_planes(std::size_t material, std::size_t a, std::size_t b) const {
    const auto& planes = *materials_.at(material);
    return planes.bytes.at(a) > 0 && planes.bytes.at(a) == planes.bytes.at(b) &&
           XXH128_isEqual(digest_of(planes.states.at(a).get()),
                          digest_of(planes.states.at(b).get())) != 0;
}

/// The hashes of the three planes, a space before each.
std::string ContentHash::planes_text(std::size_t material) const {
    std::string text;
    for (const auto& state : materials_.at(material)->states) {
        text += ' ' + hexadecimal(digest_of(state.get()));
    }
    return text;
}

}  // namespace merl::reflectance
