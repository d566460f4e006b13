#include "host/recording/records.h"

namespace tagwrench::record {

std::string_view name(Keep keep) {
  switch (keep) {
    case Keep::raw:
      return "raw";
    case Keep::region:
      return "region";
    case Keep::none:
      return "none";
  }
  return "?";
}

std::string_view name(EventKind kind) {
  switch (kind) {
    case EventKind::note:
      return "note";
    case EventKind::missing:
      return "missing";
    case EventKind::disconnected:
      return "disconnected";
    case EventKind::reconnected:
      return "reconnected";
    case EventKind::board:
      return "board";
    case EventKind::led:
      return "led";
    case EventKind::clock:
      return "clock";
    case EventKind::button:
      return "button";
    case EventKind::mark:
      return "mark";
    case EventKind::lost:
      return "lost";
  }
  return "?";
}

}  // namespace tagwrench::record
