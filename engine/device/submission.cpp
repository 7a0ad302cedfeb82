#include "engine/device/submission.h"

#include <fmt/format.h>

#include "engine/base/error.h"
#include "engine/device/buffer_handles.h"
#include "engine/device/kernel_handles.h"

namespace merl::device {
namespace {

constexpr std::uint64_t kStepNanoseconds = 100'000'000;  // soon enough for who presses Ctrl-C
constexpr std::uint64_t kPatienceNanoseconds = 10'000'000'000;

using Access = vk::AccessFlagBits;
using Stage = vk::PipelineStageFlagBits;

}  // namespace

struct Submission::Handles {
    Context::Handles* context = nullptr;
    std::vector<vk::raii::CommandBuffer> parts;  // each for a submit of its own
    std::size_t used = 0;                        // of them, by what is recorded
    vk::raii::CommandBuffer copies = nullptr;    // of uploads, where they have a queue of their own
    vk::raii::Semaphore copied = nullptr;        // what the first part waits for then
    bool has_copies = false;
    // What of the uploads and downloads is in memory that is not coherent.
    std::vector<vk::MappedMemoryRange> to_flush;
    std::vector<vk::MappedMemoryRange> to_invalidate;
    vk::raii::Fence fence = nullptr;
    vk::raii::QueryPool queries = nullptr;
    std::uint32_t most_marks = 0;
    std::uint32_t marks = 0;
    bool recording = false;
    bool running = false;

    const vk::raii::CommandBuffer& commands() const { return parts[used - 1]; }

    void begin_part() {
        if (used == parts.size()) {
            parts.push_back(std::move(
                vk::raii::CommandBuffers(context->device,
                                         {*context->pool, vk::CommandBufferLevel::ePrimary, 1})
                    .front()));
        }
        parts[used].reset();
        parts[used].begin(vk::CommandBufferBeginInfo());
        ++used;
    }

    void barrier(vk::PipelineStageFlags from, vk::AccessFlags written, vk::PipelineStageFlags to,
                 vk::AccessFlags read) const {
        commands().pipelineBarrier(from, to, {}, vk::MemoryBarrier(written, read), {}, {});
    }

    /// Copies first, then the parts in order.
    void hand_over() const {
        if (has_copies) {
            context->transfer_queue.submit(vk::SubmitInfo({}, {}, *copies, *copied));
        }
        const vk::PipelineStageFlags waiting = Stage::eComputeShader | Stage::eTransfer;
        for (std::size_t i = 0; i < used; ++i) {
            vk::SubmitInfo part({}, {}, *parts[i]);
            if (i == 0 && has_copies) {  // the parts after it come later on the same queue
                part.setWaitSemaphores(*copied);
                part.setWaitDstStageMask(waiting);
            }
            context->queue.submit(part, i + 1 == used ? *fence : vk::Fence());
        }
    }
};

Submission::Submission(Context& context, std::uint32_t most_marks)
    : handles_(std::make_unique<Handles>()) {
    auto& h = *handles_;
    h.most_marks = most_marks;
    h.context = &context.handles();
    auto& c = *h.context;
    guarded("creating a fence and timestamps", [&] {
        h.fence = {c.device, vk::FenceCreateInfo()};
        if (c.transfer_family) {
            h.copies =
                std::move(vk::raii::CommandBuffers(
                              c.device, {*c.transfer_pool, vk::CommandBufferLevel::ePrimary, 1})
                              .front());
            h.copied = {c.device, vk::SemaphoreCreateInfo()};
        }
        if (c.timestamp_seconds > 0) {
            h.queries = {c.device, {{}, vk::QueryType::eTimestamp, most_marks}};
        }
    });
}

Submission::~Submission() {
    if (handles_ && handles_->running) {
        // Its buffers go next, so it should end first. Where the device is lost, or does not end,
        // there is nobody left to tell; and after one submission that does not, none will.
        auto& c = *handles_->context;
        try {
            c.hangs =
                c.hangs || c.device.waitForFences(*handles_->fence, true, kPatienceNanoseconds) !=
                               vk::Result::eSuccess;
        } catch (const std::exception&) {
            c.hangs = true;
        }
    }
}
Submission::Submission(Submission&&) noexcept = default;
Submission& Submission::operator=(Submission&&) noexcept = default;

void Submission::begin() {
    auto& h = *handles_;
    h.used = 0;
    h.has_copies = false;
    h.to_flush.clear();
    h.to_invalidate.clear();
    guarded("recording commands", [&] { h.begin_part(); });
    if (*h.queries) {
        h.commands().resetQueryPool(*h.queries, 0, h.most_marks);
    }
    // The shared buffers may still be read or written by the submission before this one.
    h.barrier(
        Stage::eComputeShader | Stage::eTransfer,
        Access::eShaderRead | Access::eShaderWrite | Access::eTransferRead | Access::eTransferWrite,
        Stage::eComputeShader | Stage::eTransfer,
        Access::eShaderRead | Access::eShaderWrite | Access::eTransferRead |
            Access::eTransferWrite);
    h.marks = 0;
    h.recording = true;
}

void Submission::upload(const Buffer& buffer, std::uint64_t bytes) {
    auto& h = *handles_;
    const auto& b = buffer.handles();
    if (b.staging && *h.copies) {
        if (!h.has_copies) {
            h.copies.reset();
            h.copies.begin(vk::CommandBufferBeginInfo());
            h.has_copies = true;
        }
        h.copies.copyBuffer(*b.staging->buffer, *b.device->buffer, vk::BufferCopy(0, 0, bytes));
    } else if (b.staging) {
        h.commands().copyBuffer(*b.staging->buffer, *b.device->buffer, vk::BufferCopy(0, 0, bytes));
        h.barrier(Stage::eTransfer, Access::eTransferWrite, Stage::eComputeShader,
                  Access::eShaderRead);
    }  // else submitting makes visible what the host wrote
    if (const auto range = b.host().incoherent()) {
        h.to_flush.push_back(*range);
    }
}

void Submission::split() {
    auto& h = *handles_;
    guarded("recording commands", [&] {
        h.commands().end();
        h.begin_part();
    });
}

void Submission::dispatch(const BoundKernel& kernel, std::span<const std::byte> push,
                          std::uint32_t groups_x, std::uint32_t groups_y) {
    dispatch(kernel, push, {.groups_x = groups_x, .groups_y = groups_y});
}

void Submission::dispatch(const BoundKernel& kernel, std::span<const std::byte> push,
                          const GroupRange& range) {
    auto& h = *handles_;
    const auto& k = *kernel.handles().kernel;
    const auto& limits = h.context->info.limits;
    const auto groups_x = std::uint64_t{range.first_x} + range.groups_x;
    const auto groups_y = std::uint64_t{range.first_y} + range.groups_y;
    if (groups_x > limits.groups_x || groups_y > limits.groups_y || push.size() != k.push_bytes) {
        throw std::logic_error(fmt::format(
            "kernel \"{}\": {} × {} workgroups and {} push bytes were planned; the device "
            "allows {} × {}, the kernel takes {}",
            k.name, groups_x, groups_y, push.size(), limits.groups_x, limits.groups_y,
            k.push_bytes));
    }
    const auto& commands = h.commands();
    commands.bindPipeline(vk::PipelineBindPoint::eCompute, *k.pipeline);
    commands.bindDescriptorSets(vk::PipelineBindPoint::eCompute, *k.layout, 0,
                                *kernel.handles().set, {});
    if (!push.empty()) {
        commands.pushConstants<std::byte>(*k.layout, vk::ShaderStageFlagBits::eCompute, 0, push);
    }
    commands.dispatchBase(range.first_x, range.first_y, 0, range.groups_x, range.groups_y, 1);
    h.barrier(Stage::eComputeShader, Access::eShaderRead | Access::eShaderWrite,
              Stage::eComputeShader | Stage::eTransfer,
              Access::eShaderRead | Access::eShaderWrite | Access::eTransferRead);
}

void Submission::download(const Buffer& buffer, std::uint64_t bytes) {
    auto& h = *handles_;
    const auto& b = buffer.handles();
    if (b.staging) {
        h.commands().copyBuffer(*b.device->buffer, *b.staging->buffer, vk::BufferCopy(0, 0, bytes));
        h.barrier(Stage::eTransfer, Access::eTransferWrite, Stage::eHost, Access::eHostRead);
    } else {
        h.barrier(Stage::eComputeShader, Access::eShaderWrite, Stage::eHost, Access::eHostRead);
    }
    if (const auto range = b.host().incoherent()) {
        h.to_invalidate.push_back(*range);
    }
}

void Submission::mark() {
    auto& h = *handles_;
    if (h.marks == h.most_marks) {
        throw std::logic_error(fmt::format("more than {} marks in a submission", h.most_marks));
    }
    if (*h.queries) {
        h.commands().writeTimestamp(Stage::eBottomOfPipe, *h.queries, h.marks);
    }
    ++h.marks;
}

void Submission::submit() {
    auto& h = *handles_;
    guarded("submitting work", [&] {
        if (h.recording) {
            h.commands().end();
            if (h.has_copies) {
                h.copies.end();
            }
            h.recording = false;
        }
        if (!h.to_flush.empty()) {
            h.context->device.flushMappedMemoryRanges(h.to_flush);
        }
        h.context->device.resetFences(*h.fence);
        try {
            h.hand_over();
        } catch (const vk::SystemError&) {
            // Some of it may run, without the fence that comes last.
            h.context->device.waitIdle();
            throw;
        }
    });
    h.running = true;
}

void Submission::wait(const std::function<void()>& meanwhile) {
    auto& h = *handles_;
    while (h.running) {
        const auto result = guarded("waiting for the device", [&] {
            return h.context->device.waitForFences(*h.fence, true, kStepNanoseconds);
        });
        h.running = result != vk::Result::eSuccess;
        if (!h.running && !h.to_invalidate.empty()) {
            guarded("reading the device's memory",
                    [&] { h.context->device.invalidateMappedMemoryRanges(h.to_invalidate); });
        }
        if (h.running && meanwhile) {
            meanwhile();
        }
    }
}

std::vector<double> Submission::seconds() const {
    const auto& h = *handles_;
    std::vector<double> result(h.marks > 0 ? h.marks - 1 : 0, 0.0);
    if (!*h.queries || h.marks < 2) {
        return result;
    }
    const auto [status, ticks] = guarded("reading timestamps", [&] {
        return h.queries.getResults<std::uint64_t>(
            0, h.marks, h.marks * sizeof(std::uint64_t), sizeof(std::uint64_t),
            vk::QueryResultFlagBits::e64 | vk::QueryResultFlagBits::eWait);
    });
    for (std::size_t i = 0; i + 1 < ticks.size(); ++i) {
        const auto passed = (ticks[i + 1] - ticks[i]) & h.context->timestamp_mask;
        result[i] = static_cast<double>(passed) * h.context->timestamp_seconds;
    }
    return result;
}

}  // namespace merl::device
