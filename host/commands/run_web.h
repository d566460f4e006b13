// The pages of `tagwrench run --output web`: where they are served, and what they are told of a
// run.
#pragma once

#include <memory>

#include "host/app/input.h"
#include "host/commands/board/run_board.h"
#include "host/commands/run_command.h"
#include "host/core/os/unique_fd.h"
#include "host/web/bridge/web_bridge.h"

namespace tagwrench {

/// Whether `web` is among the outputs. Throws ConfigError where it is, but cannot be.
bool has_web(const RunOptions& options);

/// Binds, and says where; nothing is served yet. `stop` is of termination_fd().
std::unique_ptr<WebBridge> open_web(const RunOptions& options, const UniqueFd& stop);

/// `desk`: it listens to requests.
RunFacts run_facts(const RunOptions& options, const Input& input, bool board, bool profiles);

}  // namespace tagwrench
