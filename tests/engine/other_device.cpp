#include "tests/engine/other_device.h"

#include <cstdlib>

namespace merl::test {

std::unique_ptr<device::Context> other_device(const std::string& changes) {
    ::setenv("VK_LAYER_PATH", MERL_TEST_LAYERS ":/usr/share/vulkan/explicit_layer.d", 1);
    ::setenv("VK_INSTANCE_LAYERS", "VK_LAYER_MERL_SCAN_other_device", 1);
    ::setenv("MERL_SCAN_OTHER_DEVICE", changes.c_str(), 1);
    auto context = std::make_unique<device::Context>();
    for (const char* name : {"VK_LAYER_PATH", "VK_INSTANCE_LAYERS", "MERL_SCAN_OTHER_DEVICE"}) {
        ::unsetenv(name);
    }
    return context;
}

}  // namespace merl::test
