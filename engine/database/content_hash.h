#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/database/database.h"

namespace merl::engine {

/// Identifies the content of a database: XXH3-128 (not cryptographic) over, for each material in
/// order, its name, the grid, and one hash of each of its three colour planes as stored.
///
/// A plane is fed in pieces, in order; planes and materials may be fed by different threads. The
/// result does not depend on the size of the pieces.
///
/// The hashes of the planes of a material are one text, with spaces between them: whoever has read
/// materials one by one makes the hash of all from these.
class ContentHash {
  public:
    explicit ContentHash(std::size_t materials);
    ~ContentHash();

    void update(std::size_t material, std::size_t plane, std::span<const std::byte> bytes);

    /// What feeds a material, as long as this lives.
    SampleSink sink(std::size_t material);

    /// 32 hexadecimal digits. `header` is whatever else identifies the database (its grid).
    /// `materials` are the names of those that are hashed, which follow each other from `first` on.
    std::string digest(const std::vector<std::string>& materials, const std::string& header,
                       std::size_t first = 0) const;

    /// The same of one material, without its name: whatever has the same content has the same.
    std::string material_digest(std::size_t material, const std::string& header) const;

    /// The hashes of the planes of a material.
    std::string planes(std::size_t material) const;

    /// Whether two planes of a material were fed the same bytes, and any.
    bool same_planes(std::size_t material, std::size_t a, std::size_t b) const;

  private:
    struct Planes;
    std::vector<std::unique_ptr<Planes>> materials_;
};

/// What ContentHash::digest() gives, from the hashes of each material's planes.
std::string content_digest(std::span<const std::string> materials, const std::string& header,
                           std::span<const std::string> planes);

/// What ContentHash::material_digest() gives, likewise.
std::string material_digest(const std::string& header, const std::string& planes);

/// The content hash of a whole database. Reads everything; `progress` is called after each material
/// with the share that is done, and may throw. Throws what Database::read() throws.
std::string content_hash_of(const Database& database, const std::function<void(double)>& progress);

}  // namespace merl::engine
