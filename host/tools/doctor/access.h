// May this user open the nodes that virtual devices need, and if not, why not.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/tools/doctor/report.h"

namespace tagwrench {

/// What decides whether a node that the udev rule gives to group `input` can be opened.
struct NodeAccess {
  bool rule_installed = false;
  bool rule_applied = false;  ///< the node belongs to `input`, which may read and write it
  bool member = false;        ///< the user is in `input`, by the system's list of groups
  bool member_now = false;    ///< and this login knows it
};

/// What to do when the node cannot be opened for want of permission.
std::string access_advice(const NodeAccess& access);

/// What is so for `node` and who runs this.
NodeAccess look_at_access(const std::filesystem::path& node);

/// Where 70-tagwrench.rules is; empty: nowhere.
std::filesystem::path installed_rule();

void say_rule(Report& report);
/// True if a virtual device can be made through the node.
bool say_device_node(Report& report, const std::filesystem::path& node, const char* module,
                     const char* use);

/// Our devices among those of `folder` (/sys/class/hidraw): by the name that their uevent gives.
std::vector<std::string> our_hidraw(const std::filesystem::path& folder);
void say_hidraw(Report& report);

}  // namespace tagwrench
