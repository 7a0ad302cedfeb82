#include "app/cli/control.h"

namespace merl::app {

pipeline::Control TerminalControl::control() {
    return {.progress =
                [this](std::string_view stage, double share) {
                    if (!progress_ || stage_ != stage) {
                        progress_.reset();
                        stage_ = stage;
                        progress_ = std::make_unique<Progress>(stage_, quiet_);
                    }
                    progress_->update(share);
                },
            .stop = {}};
}

}  // namespace merl::app
