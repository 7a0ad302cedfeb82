#pragma once

#include <cstdint>
#include <vector>

#include "scan/pairs/agreement.h"
#include "scan/pairs/pairs.h"
#include "scan/select/disagreement_search.h"

namespace merl::scan {

/// In how many chosen configurations each material takes part, up to a limit
/// (docs/file-formats.md).
class Participation {
  public:
    Participation(std::uint32_t materials, std::uint32_t limit);

    /// Whether neither of the pair's materials has reached the limit.
    bool open(Pair pair) const;

    /// The same of a pair by its index among all pairs.
    bool open(std::uint32_t pair) const;

    /// Counts a chosen configuration of two pairs; a material in both takes part once. Returns the
    /// materials that have reached the limit by it.
    std::vector<std::uint32_t> take(Pair left, Pair right);

    /// The same for a configuration of all pairs. Those of materials that reach the limit are
    /// dropped from the search.
    void take(const Configuration& chosen, DisagreementSearch& search);

  private:
    std::uint32_t limit_;
    std::vector<std::uint32_t> parts_;  // per material
};

}  // namespace merl::scan
