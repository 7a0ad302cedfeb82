#pragma once

// Compiles a metric's GLSL file as C++ in float32. Included only by the generated file of each
// metric without a degree (single_twin.cpp.in).

#include <array>
#include <span>

#include "engine/base/glsl_in_float32.h"
#include "engine/base/widest_vectors.h"
#include "engine/metric/metric.h"

#define precise
