#include "engine/database/content_hash.h"

#include <optional>

#include "engine/base/hash.h"

namespace merl::engine {

struct ContentHash::Planes {
    std::array<std::optional<Hash>, 3> hashes;  // none until there are bytes
    std::array<std::uint64_t, 3> bytes = {};

    std::string digest(std::size_t plane) const {
        const auto& hash = hashes.at(plane);
        return hash ? hash->hexadecimal() : hash_of("");
    }
};

ContentHash::ContentHash(std::size_t materials) {
    for (std::size_t i = 0; i < materials; ++i) {
        materials_.push_back(std::make_unique<Planes>());
    }
}

ContentHash::~ContentHash() = default;

void ContentHash::update(std::size_t material, std::size_t plane,
                         std::span<const std::byte> bytes) {
    auto& planes = *materials_.at(material);
    auto& hash = planes.hashes.at(plane);
    if (!hash) {
        hash.emplace();
    }
    hash->update(bytes);
    planes.bytes.at(plane) += bytes.size();
}

SampleSink ContentHash::sink(std::size_t material) {
    return [this, material](std::size_t plane, std::span<const std::byte> bytes) {
        update(material, plane, bytes);
    };
}

std::string ContentHash::digest(const std::vector<std::string>& materials,
                                const std::string& header, std::size_t first) const {
    std::vector<std::string> of_all(materials.size());
    for (std::size_t i = 0; i < materials.size(); ++i) {
        of_all[i] = planes(first + i);
    }
    return content_digest(materials, header, of_all);
}

bool ContentHash::same_planes(std::size_t material, std::size_t a, std::size_t b) const {
    const auto& planes = *materials_.at(material);
    return planes.bytes.at(a) > 0 && planes.bytes.at(a) == planes.bytes.at(b) &&
           planes.digest(a) == planes.digest(b);
}

std::string ContentHash::material_digest(std::size_t material, const std::string& header) const {
    return engine::material_digest(header, planes(material));
}

std::string ContentHash::planes(std::size_t material) const {
    const auto& of_material = *materials_.at(material);
    return of_material.digest(0) + ' ' + of_material.digest(1) + ' ' + of_material.digest(2);
}

std::string content_digest(std::span<const std::string> materials, const std::string& header,
                           std::span<const std::string> planes) {
    std::string all = header;
    for (std::size_t i = 0; i < materials.size(); ++i) {
        all += '\n' + materials[i] + ' ' + planes[i];
    }
    return hash_of(all);
}

std::string material_digest(const std::string& header, const std::string& planes) {
    const std::string all = header + "\n " + planes;
    return hash_of(all);
}

std::string content_hash_of(const Database& database, const std::function<void(double)>& progress) {
    const std::size_t materials = database.materials().size();
    ContentHash hash(materials);
    for (std::size_t material = 0; material < materials; ++material) {
        read_material(database, material, hash.sink(material),
                      [](VoxelRange, std::span<const double>) {});
        progress(static_cast<double>(material + 1) / static_cast<double>(materials));
    }
    return hash.digest(database.materials(), database.grid().text());
}

}  // namespace merl::engine
