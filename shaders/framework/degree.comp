#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require

// Whether the difference of a user's metric is the |d|^degree that it declares: a function of one number, looked
// at for numbers of both signs all over the range in which samples are. Two steps, each a dispatch: search,
// where every invocation takes some numbers; and by one workgroup what the first that is wrong has to say,
// unless check.comp has said something. Others that occur are check.comp's.

#define FINDING_BINDING 0
#include "framework/metric.glsl"
#include "framework/finding.glsl"

layout(local_size_x_id = 0) in;

layout(push_constant) uniform Push {
    uint degree_step;
    uint numbers;  // looked at, beside 0
};

// 2^kBits numbers of each power of two, from 2^-40 on; the host says up to where.
const uint kBits = 14;
const uint kLowest = 127 - 40;
const uint kOfInvocation = 32;  // the host has the same

// The last is 0. The bits that are not counted through change from number to number.
float number_at(uint at) {
    uint rest = (at * 2654435761u) >> (9 + kBits);
    uint bits = (kLowest << 23) + (at << (23 - kBits)) + rest;
    return at == numbers ? 0.0 : uintBitsToFloat(bits);
}

void main() {
    float there, back;
    if (degree_step == 0) {
        uint wrong = kNothing;
        for (uint i = 0; i < kOfInvocation; ++i) {
            uint at = gl_GlobalInvocationID.x * kOfInvocation + i;
            if (at <= numbers && degree_offence(number_at(at), there, back) != kFine) {
                wrong = min(wrong, at);
            }
        }
        if (guard_cut()) {
            wrong = min(wrong, gl_GlobalInvocationID.x * kOfInvocation);
            atomicOr(finding.row_faults, kEndlessLoop);
        }
        wrong = subgroupMin(wrong);
        if (wrong != kNothing && gl_LocalInvocationID.x == 0) {
            atomicMin(finding.number, wrong);
        }
        return;
    }
    if (finding.number == kNothing || finding.kind != kFine || gl_LocalInvocationID.x != 0) {
        return;
    }
    float d = number_at(finding.number);
    uint kind = degree_offence(d, there, back);
    bool is_cut = kind == kFine;
    finding.kind = is_cut ? kFault : kind;
    finding.there = is_cut ? float(finding.row_faults) : there;
    finding.back = back;
    finding.first = kNothing;
    finding.second = kNothing;
    finding.channel = 0;
    finding.a[0] = d;
    finding.b[0] = 0.0;
}
