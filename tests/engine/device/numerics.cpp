#include "tests/engine/device/numerics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "engine/device/submission.h"
#include "tests/engine/support.h"

namespace merl::device {

std::vector<float> on_device(Context& context, Function function, const std::vector<float>& x) {
    const std::uint64_t bytes = x.size() * sizeof(float);
    Buffer in(context, bytes, Traffic::upload);
    Buffer out(context, bytes, Traffic::download);
    const Kernel kernel(context, "numerics",
                        test::compile(MERL_TEST_SHADERS "/device/numerics.comp"),
                        {.bindings = {Binding::storage, Binding::storage},
                         .constants = {static_cast<std::uint32_t>(function)},
                         .push_bytes = 4});
    Buffer* const buffers[] = {&in, &out};
    const BoundKernel bound(context, kernel, buffers);
    std::copy(x.begin(), x.end(), in.host_as<float>().begin());
    std::fill(out.host_as<float>().begin(), out.host_as<float>().end(), std::nanf(""));
    Submission work(context);
    work.begin();
    work.upload(in, bytes);
    const auto size = static_cast<std::uint32_t>(x.size());
    work.mark();
    work.dispatch(bound, std::as_bytes(std::span(&size, 1)), (size + 63) / 64, 1);
    work.mark();
    work.download(out, bytes);
    work.submit();
    work.wait();
    EXPECT_EQ(work.seconds().size(), 1U);
    context.check_validation();
    const auto result = out.host_as<float>();
    return {result.begin(), result.end()};
}

}  // namespace merl::device
