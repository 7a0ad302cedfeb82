#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace merl::engine {

/// A parameter of a model, which its table has for each material.
struct ModelParameter {
    std::string name;
    bool is_rgb = false;  // three numbers, a column of the table each; otherwise one
    std::string description;

    bool operator==(const ModelParameter&) const = default;

    /// Its columns: NAME, or NAME_red, NAME_green and NAME_blue.
    std::vector<std::string> columns() const;
};

/// What the comment lines at the top of a model file say (docs/models.md).
struct ModelHeader {
    std::string title;
    std::string database;  // what the database of the model's own table is called
    std::string formula;
    std::string source;  // the literature
    std::string table;   // where the figures of its own table are from
    std::string slow;    // why samples are kept for the next reading; empty: they are not
    std::string note;
    std::vector<ModelParameter> parameters;

    /// The columns of all parameters, in their order.
    std::vector<std::string> columns() const;
};

/// Reads the header of a model file. `file` is what messages call it. Throws InputError that names
/// the line.
ModelHeader parse_model_header(std::string_view text, const std::string& file);

}  // namespace merl::engine
