#include "app/pipeline/image.h"

#include <algorithm>
#include <cmath>

namespace merl::pipeline {

float srgb(float linear) {
    const float x = std::clamp(linear, 0.0F, 1.0F);
    return x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1 / 2.4F) - 0.055F;
}

float lightness(float value) {
    const float l = 100 * std::clamp(value, 0.0F, 1.0F);
    const float f = (l + 16) / 116;
    return srgb(l > 8 ? f * f * f : l * 27.0F / 24389.0F);
}

}  // namespace merl::pipeline
