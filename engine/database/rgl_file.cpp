#include "engine/database/rgl_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <span>

#include "engine/base/text.h"
#include "engine/database/other_formats.h"

namespace merl::engine {
namespace {

static_assert(std::endian::native == std::endian::little, "RGL files are little-endian");

constexpr std::string_view kMagic("tensor_file\0", 12);

// Far more than any file has, and little enough that a header can be read entry by entry.
constexpr std::uint32_t kMostFields = 1024;
constexpr std::uint16_t kMostNameBytes = 256;
constexpr std::uint16_t kMostDimensions = 16;
/// Of one array. The largest of the isotropic files of the RGL have some hundred thousand.
constexpr std::uint64_t kMostNumbers = 1ULL << 24U;

/// Bytes of a number of each type of the container; 0 is no type.
constexpr std::array<std::uint64_t, 12> kTypeBytes = {0, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8};
constexpr std::uint8_t kFloat32 = 10;

/// What a file begins with that is none of the RGL, for people.
std::string other_beginning(const File& file, const std::string& begin) {
    if (begin.size() < kMagic.size()) {
        return fmt::format("has {} bytes", begin.size());
    }
    if (is_unknown_text(file)) {
        return "is text, like the .bsdf files of Zemax and LightTools, which cannot be read";
    }
    const std::vector<unsigned char> bytes(begin.begin(), begin.end());
    const auto known = known_as(file);
    return fmt::format("begins with the bytes {:02x}{}", fmt::join(bytes, " "),
                       known.empty() ? "" : ", " + known);
}

}  // namespace

std::string RglField::text() const {
    return fmt::format("the field {} [{}] at byte {}", printable(name), fmt::join(shape, ", "),
                       offset);
}

/// The next bytes of the header.
void RglFile::take(std::span<std::byte> to, std::string_view what) {
    if (to.size() > file_.bytes() - position_) {
        file_.fail(fmt::format("has {} bytes and ends before {}, so it is truncated", file_.bytes(),
                               what));
    }
    file_.read(position_, to);
    position_ += to.size();
}

template <typename Value>
Value RglFile::take(std::string_view what) {
    Value value = {};
    take(std::as_writable_bytes(std::span(&value, 1)), what);
    return value;
}

RglFile::RglFile(const File& file) : file_(file) {
    expect_magic();
    if (const auto version = take<std::array<std::uint8_t, 2>>("its version");
        version != std::array<std::uint8_t, 2>{1, 0}) {
        file.fail(fmt::format("is of version {}.{}; expected 1.0", version[0], version[1]));
    }
    const auto count = take<std::uint32_t>("the number of fields");
    if (count > kMostFields) {
        file.fail(fmt::format("has {} fields; expected at most {}", count, kMostFields));
    }
    for (std::uint32_t i = 0; i < count; ++i) {
        fields_.push_back(take_field(i));
    }
    expect_apart();
}

const RglField* RglFile::find(std::string_view name) const {
    const auto field = std::ranges::find(fields_, name, &RglField::name);
    return field == fields_.end() ? nullptr : &*field;
}

const RglField& RglFile::floats(std::string_view name, std::size_t dimensions) const {
    const RglField* const field = find(name);
    if (field == nullptr) {
        file_.fail(
            fmt::format("has no field {}; expected phi_i, theta_i, sigma, ndf, vndf and "
                        "rgb",
                        name));
    }
    if (field->type != kFloat32 || field->shape.size() != dimensions) {
        file_.fail(
            fmt::format("{} is of type {} and {} dimensions; expected type {} (float32) "
                        "and {}",
                        field->text(), field->type, field->shape.size(), kFloat32, dimensions));
    }
    if (field->bytes / sizeof(float) > kMostNumbers) {
        file_.fail(fmt::format("{} has {} numbers; expected at most {}", field->text(),
                               field->bytes / sizeof(float), kMostNumbers));
    }
    return *field;
}

void RglFile::expect_magic() {
    std::string begin(std::min<std::uint64_t>(kMagic.size(), file_.bytes()), '\0');
    file_.read(0, std::as_writable_bytes(std::span(begin)));
    position_ = begin.size();
    if (begin != kMagic) {
        file_.fail(fmt::format(
            "{}; expected a file of the RGL, which begins with \"tensor_file\" and a zero byte",
            other_beginning(file_, begin)));
    }
}

RglField RglFile::take_field(std::uint32_t number) {
    RglField field;
    const auto what = fmt::format("the end of its header (field {})", number);
    const auto name_bytes = take<std::uint16_t>(what);
    if (name_bytes > kMostNameBytes) {
        file_.fail(fmt::format("the name of field {} has {} bytes; expected at most {}", number,
                               name_bytes, kMostNameBytes));
    }
    field.name.resize(name_bytes);
    take(std::as_writable_bytes(std::span(field.name)), what);
    const auto dimensions = take<std::uint16_t>(what);
    field.type = take<std::uint8_t>(what);
    if (dimensions > kMostDimensions) {
        file_.fail(fmt::format("the field {} has {} dimensions; expected at most {}",
                               printable(field.name), dimensions, kMostDimensions));
    }
    if (field.type == 0 || field.type >= kTypeBytes.size()) {
        file_.fail(fmt::format("the field {} is of type {}; expected 1 to {}",
                               printable(field.name), field.type, kTypeBytes.size() - 1));
    }
    field.offset = take<std::uint64_t>(what);
    field.shape.resize(dimensions);
    take(std::as_writable_bytes(std::span(field.shape)), what);
    field.bytes = kTypeBytes[field.type];
    const bool empty = std::ranges::find(field.shape, 0U) != field.shape.end();
    for (const auto size : field.shape) {
        if (!empty && field.bytes > file_.bytes() / size) {
            fail_beyond(field);
        }
        field.bytes *= empty ? 0 : size;  // at most the size of the file: no overflow
    }
    if (field.bytes > file_.bytes() || field.offset > file_.bytes() - field.bytes) {
        fail_beyond(field);
    }
    return field;
}

void RglFile::fail_beyond(const RglField& field) const {
    file_.fail(
        fmt::format("{}, type {}, ends after the {} bytes that the file has, so it is "
                    "truncated or damaged",
                    field.text(), field.type, file_.bytes()));
}

/// No field overlaps the header or another field, and none is there twice.
void RglFile::expect_apart() const {
    std::vector<const RglField*> sorted;
    for (const auto& field : fields_) {
        if (find(field.name) != &field) {
            file_.fail(
                fmt::format("has two fields {}; expected different names", printable(field.name)));
        }
        if (field.bytes > 0) {
            sorted.push_back(&field);
        }
    }
    std::ranges::sort(sorted, {}, &RglField::offset);
    std::uint64_t end = position_;
    std::string before = "the header";
    for (const RglField* field : sorted) {
        if (field->offset < end) {
            file_.fail(
                fmt::format("{} begins before byte {}, where {} ends; expected fields "
                            "that do not overlap",
                            field->text(), end, before));
        }
        end = field->offset + field->bytes;
        before = field->text();
    }
}

}  // namespace merl::engine
