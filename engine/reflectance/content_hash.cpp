#include "engine/reflectance/content_hash.h"

#include <fmt/format.h>
#include <xxhash.h>

namespace merl::reflectance {

struct ContentHash::Planes {
    struct Free {
        void operator()(XXH3_state_t* state) const { XXH3_freeState(state); }
    };
    std::array<std::unique_ptr<XXH3_state_t, Free>, 3> states;
};

ContentHash::ContentHash(std::size_t materials) {
    for (std::size_t i = 0; i < materials; ++i) {
        auto planes = std::make_unique<Planes>();
        for (auto& state : planes->states) {
            state.reset(XXH3_createState());
            XXH3_128bits_reset(state.get());
        }
        materials_.push_back(std::move(planes));
    }
}

ContentHash::~ContentHash() = default;

void ContentHash::update(std::size_t material, std::size_t plane,
                         std::span<const std::byte> bytes) {
    XXH3_128bits_update(materials_.at(material)->states.at(plane).get(), bytes.data(),
                        bytes.size());
}

std::string ContentHash::digest(const std::vector<std::string>& materials,
                                const std::string& header) const {
    std::string all = header;
    for (std::size_t i = 0; i < materials.size(); ++i) {
        all += '\n' + materials[i];
        for (const auto& state : materials_.at(i)->states) {
            const auto plane = XXH3_128bits_digest(state.get());
            all += fmt::format(" {:016x}{:016x}", plane.high64, plane.low64);
        }
    }
    const auto hash = XXH3_128bits(all.data(), all.size());
    return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

}  // namespace merl::reflectance
