#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace merl {

/// XXH3-128 (not cryptographic) of bytes that come in pieces: what `content_hash` is in summaries.
class Hash {
  public:
    Hash();
    Hash(Hash&&) noexcept;
    Hash& operator=(Hash&&) noexcept;
    ~Hash();

    void update(std::span<const std::byte> bytes);

    /// 32 hexadecimal digits, of what came so far.
    std::string hexadecimal() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// The same of all bytes at once.
std::string hash_of(std::string_view bytes);

/// SHA-256 of all bytes, 64 hexadecimal digits: what other programs know a file by.
std::string sha256_of(std::string_view bytes);

}  // namespace merl
