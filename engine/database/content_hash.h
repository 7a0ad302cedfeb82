#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace merl::engine {

/// Identifies the content of a database: XXH3-128 (not cryptographic) over, for each material in
/// order, its name, the grid, and one hash of each of its three colour planes as stored.
///
/// A plane is fed in pieces, in order; planes and materials may be fed by different threads. The
/// result does not depend on the size of the pieces.
class ContentHash {
  public:
    explicit ContentHash(std::size_t materials);
    ~ContentHash();

    void update(std::size_t material, std::size_t plane, std::span<const std::byte> bytes);

    /// 32 hexadecimal digits. `header` is whatever else identifies the database (its grid).
    std::string digest(const std::vector<std::string>& materials, const std::string& header) const;

    /// The same of one material, without its name: whatever has the same content has the same.
    std::string material_digest(std::size_t material, const std::string& header) const;

    /// Whether two planes of a material were fed the same bytes, and any.
    bool same_planes(std::size_t material, std::size_t a, std::size_t b) const;

  private:
    struct Planes;
    std::string planes_text(std::size_t material) const;
    std::vector<std::unique_ptr<Planes>> materials_;
};

}  // namespace merl::engine
