// The pages of `tagwrench run --output web`: where they are served, and what they are told of a
// run.
#pragma once

#include <memory>
#include <span>

#include "host/app/board/run_board.h"
#include "host/app/input.h"
#include "host/app/outputs.h"
#include "host/app/run_options.h"
#include "host/core/os/unique_fd.h"
#include "host/web/bridge/web_bridge.h"

namespace tagwrench {

/// Whether there are pages. Throws ConfigError where options are theirs, and they are not there.
bool has_web(const RunOptions& options, std::span<const OutputSpec> outputs);

/// Binds, and says where; nothing is served yet. `stop` is of termination_fd().
std::unique_ptr<WebBridge> open_web(const RunOptions& options, std::span<const OutputSpec> outputs,
                                    const UniqueFd& stop);

/// `profiles`: they listen to requests.
RunFacts run_facts(const RunOptions& options, std::span<const OutputSpec> outputs,
                   const Input& input, bool board, bool profiles);

}  // namespace tagwrench
