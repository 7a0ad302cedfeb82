#include "engine/base/hash.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <new>

namespace merl {
namespace {

std::string digits(const XXH128_hash_t& hash) {
    return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

}  // namespace

struct Hash::State {
    struct Free {
        void operator()(XXH3_state_t* state) const { XXH3_freeState(state); }
    };
    std::unique_ptr<XXH3_state_t, Free> xxh{XXH3_createState()};
};

Hash::Hash() : state_(std::make_unique<State>()) {
    if (!state_->xxh) {
        throw std::bad_alloc();
    }
    XXH3_128bits_reset(state_->xxh.get());
}

Hash::Hash(Hash&&) noexcept = default;
Hash& Hash::operator=(Hash&&) noexcept = default;
Hash::~Hash() = default;

void Hash::update(std::span<const std::byte> bytes) {
    XXH3_128bits_update(state_->xxh.get(), bytes.data(), bytes.size());
}

std::string Hash::hexadecimal() const {
    return digits(XXH3_128bits_digest(state_->xxh.get()));
}

std::string hash_of(std::string_view bytes) {
    return digits(XXH3_128bits(bytes.data(), bytes.size()));
}

}  // namespace merl
