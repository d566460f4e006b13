// `tagwrench doctor --focus`: how sharp the tags are while somebody turns the lens.
#pragma once

#include <optional>
#include <string>

namespace tagwrench {

struct FocusOptions {
  std::string sensor;  ///< sensor.yaml; empty: what the source suggests
  std::string source;  ///< SRC; empty: the only camera
  std::optional<double> seconds;
};

/// Says on standard output, live on a terminal and once a second elsewhere, how wide the edges of
/// each tag are and which way it goes, until a signal, the source's end or the time. Returns 0 if
/// the tags were seen, else 1. Throws ConfigError for a source or sensor that cannot be used.
int run_focus(const FocusOptions& options);

}  // namespace tagwrench
