#include "engine/database/model.h"

#include <algorithm>

namespace merl::engine {

std::span<const Model> models() {
    static const auto all = [] {
        std::vector<Model> opened;
        for (const auto& built : built_models()) {
            auto& model = opened.emplace_back();
            model.name = built.name;
            model.source = built.source;
            model.table = built.table;
            model.header = parse_model_header(model.source, model.name + ".glsl");
            model.twin = built.twin;
        }
        return opened;
    }();
    return all;
}

const Model* find_model(std::string_view name) {
    const auto all = models();
    const auto found = std::ranges::find(all, name, &Model::name);
    return found == all.end() ? nullptr : &*found;
}

}  // namespace merl::engine
