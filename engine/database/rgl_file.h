#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/file.h"

namespace merl::engine {

/// An array of a file of the RGL, as its header describes it.
struct RglField {
    std::string name;
    std::uint8_t type = 0;
    std::uint64_t offset = 0;
    std::uint64_t bytes = 0;
    std::vector<std::uint64_t> shape;

    std::string text() const;  // "the field NAME [SHAPE] at byte OFFSET"
};

/// The container of RGL `.bsdf` files (docs/file-formats.md): named arrays, each inside the file
/// and beside all others. Every error is an InputError that begins with the path.
class RglFile {
  public:
    /// Reads the header. `file` has to outlive this.
    explicit RglFile(const File& file);

    /// Null: there is no such field.
    const RglField* find(std::string_view name) const;

    /// A field of float32 of so many dimensions.
    const RglField& floats(std::string_view name, std::size_t dimensions) const;

  private:
    void expect_magic();
    void take(std::span<std::byte> to, std::string_view what);
    template <typename Value>
    Value take(std::string_view what);
    RglField take_field(std::uint32_t number);
    [[noreturn]] void fail_beyond(const RglField& field) const;
    void expect_apart() const;

    const File& file_;
    std::uint64_t position_ = 0;  // in the header
    std::vector<RglField> fields_;
};

}  // namespace merl::engine
