#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace merl::engine {

/// A number that a metric lets its user choose.
struct MetricParameter {
    std::string name;
    double value = 0;  // unless it is chosen
    double low = 0;    // the range, both ends allowed
    double high = 0;
    std::string description;

    bool operator==(const MetricParameter&) const = default;
};

/// What the numbers of a metric were fitted to.
struct FittedTo {
    std::string sha256;    // of the file of judgements, 64 lower-case hexadecimal digits
    std::string citation;  // of the data

    bool operator==(const FittedTo&) const = default;
};

/// A part of the domain that a metric looks at, of which a summary takes means.
struct MetricWindow {
    std::string name;
    std::string description;

    bool operator==(const MetricWindow&) const = default;
};

/// What the comment lines at the top of a metric file say (docs/metrics.md).
struct MetricHeader {
    std::string title;
    std::string formula;
    std::string source;  // the literature
    std::string note;
    /// The declared degree p: h is a sum over channels of |d|^p. 0 when there is none: any function
    /// of two samples, for which no error bound is known.
    double degree = 0;
    std::string degree_text;  // "2/3"
    std::vector<MetricParameter> parameters;
    std::vector<FittedTo> fitted;
    /// Of a summary metric its windows; of one with a degree those in which its weight lies, if its
    /// file names any.
    std::vector<MetricWindow> windows;
    /// How many numbers a summary makes of the means over its windows; 0 for any other metric.
    std::uint32_t features = 0;
};

/// Reads the header of a metric file. `file` is what messages call it. Throws Error (input) that
/// names the line.
MetricHeader parse_metric_header(std::string_view text, const std::string& file);

}  // namespace merl::engine
