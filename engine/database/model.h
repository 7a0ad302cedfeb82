#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/database/domain.h"
#include "engine/database/model_header.h"

namespace merl::engine {

/// A model's GLSL file compiled as C++ in float64. Evaluates voxels that share theta_h and theta_d:
/// reflectance in 1/sr, zero below the horizon. `values` are those of the columns of its
/// parameters, in order; each plane has a number per voxel.
using ModelTwin = void (*)(std::span<const double> values, std::span<const Voxel> voxels,
                           std::span<double> red, std::span<double> green, std::span<double> blue);

/// A model's files, shaders/models/NAME.glsl and NAME.csv, that the build put into the program
/// (shaders/twins.cmake).
struct BuiltModel {
    std::string_view name;
    std::string_view source;
    std::string_view table;
    ModelTwin twin = nullptr;
};

/// The files of shaders/models/, by name.
std::span<const BuiltModel> built_models();

/// A reflectance model (docs/models.md), and its own table of parameters.
struct Model {
    std::string name;
    std::string source;  // the text of the file
    std::string table;   // likewise
    ModelHeader header;
    ModelTwin twin = nullptr;
};

/// Every model of the library, by name.
std::span<const Model> models();

/// The model with this name; null if there is none.
const Model* find_model(std::string_view name);

}  // namespace merl::engine
