#include "scan/pairs/census.h"

#include <fmt/format.h>

#include <stdexcept>

namespace merl::scan {

Census count_disagreements(const Distances& distances) {
    const Counts counts = count_by_inversions(distances);
    if (counts.configurations > max_streamed) {
        return {counts, false};
    }
    const Counts streamed = count_by_streaming(distances);
    if (streamed != counts) {
        throw std::logic_error(fmt::format(
            "internal error: streaming counts {} disagreements where the inversions give {}",
            streamed.disagreements(), counts.disagreements()));
    }
    return {counts, true};
}

}  // namespace merl::scan
