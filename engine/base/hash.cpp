#include "engine/base/hash.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <openssl/evp.h>
#include <xxhash.h>

#include <array>
#include <new>
#include <stdexcept>

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

std::string sha256_of(std::string_view bytes) {
    std::array<unsigned char, 32> digest = {};
    if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), nullptr, EVP_sha256(), nullptr) !=
        1) {
        throw std::runtime_error("libcrypto has no SHA-256");
    }
    return fmt::format("{:02x}", fmt::join(digest, ""));
}

}  // namespace merl
