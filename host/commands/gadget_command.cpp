#include "host/commands/gadget_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/output/gadget_daemon.h"
#include "host/output/uhid_device.h"

namespace tagwrench {
namespace {

std::string described(const GadgetFound& gadget) {
  return fmt::format("{} {}", face_name(*gadget.face), hex_id(gadget.id.vendor, gadget.id.product));
}

/// Before the cable goes, so to speak: a program on the other computer keeps what it was last told.
void rest(const GadgetFiles& files, const KernelPlaces& places, const GadgetTree& tree,
          const GadgetFound& gadget) {
  if (!gadget.whole || !gadget.name()) return;
  rest_before_the_end(open_gadget_node(files, places, tree.function(*gadget.name(), *gadget.face)),
                      *gadget.face);
}

GadgetSpec spec_of(const std::string& name, const std::string& face, const std::string& id,
                   bool self_powered) {
  GadgetSpec spec;
  spec.name = name;
  spec.face = face_of(face).value_or(GadgetFace::spacemouse);
  spec.id = face_id(spec.face);
  spec.self_powered = self_powered;
  if (id.empty()) return spec;
  const std::optional<UsbId> given = parse_usb_id(id);
  if (!given) {
    throw ConfigError(
        fmt::format("--id {}: not vendor:product in hexadecimal; write it as in 256f:c62e", id));
  }
  spec.id = *given;
  return spec;
}

bool same(const GadgetFound& found, const GadgetSpec& spec, const Controller& controller) {
  return found.whole && found.face == spec.face && found.id.vendor == spec.id.vendor &&
         found.id.product == spec.id.product && found.udc == controller.name &&
         found.self_powered == spec.self_powered;
}

/// Before anything is rested or half undone.
void need_root(const KernelPlaces& places, const char* verb, const std::string& name) {
  if (::access(places.gadgets().c_str(), W_OK) == 0) return;
  throw ConfigError(fmt::format(
      "gadget {}{}: {} cannot be written; run it as root: sudo tagwrench "
      "gadget {}{}",
      kGadgetPrefix, name, places.gadgets(), verb, name == "sensor" ? "" : " --name " + name));
}

std::string run_command_of(const std::string& name) {
  const std::string more = name == "sensor" ? "" : " --name " + name;
  return "tagwrench run --output gadget" + more;
}

}  // namespace

GadgetCommand::GadgetCommand(command_line::Command program)
    : verb_(program.add_subcommand("gadget", "be a USB device of another computer")),
      keep_(verb_.add_subcommand("keep", "").hidden()),
      up_(verb_.add_subcommand("up", "make the device and offer it at the USB device port")),
      down_(verb_.add_subcommand("down", "take it away; done if it is not there")) {
  verb_.require_subcommand();
  verb_.add_subcommand("status", "device ports of this computer, and what is on them");
  verb_.footer("`tagwrench run --output gadget` then feeds it. Only up and down need root.");
  for (command_line::Command command : {up_, down_}) {
    command.add_option("--name", name_, "of the sensor, as `tagwrench run --name` has it")
        .capture_default_str();
  }
  up_.add_option("--face", face_, "what the other computer sees")
      .check(command_line::one_of({"spacemouse", "wrench"}))
      .capture_default_str();
  up_.add_option("--id", id_, "VENDOR:PRODUCT; without it 256f:c62e, and of the wrench 1209:7a6e");
  up_.add_option("--udc", udc_, "USB device controller; without it the first free one");
  keep_.add_option("--face", face_).check(command_line::one_of({"spacemouse", "wrench"}));
  keep_.add_option("--sysfs", inherited_.places.sysfs);
  keep_.add_option("--devices", inherited_.places.devices);
  keep_.add_option("--function", inherited_.function).required();
  keep_.add_option("--node", inherited_.node).required();
  up_.add_flag("--self-powered", self_powered_,
               "the board has a supply of its own; without it up to 500 mA are asked for");
}

int GadgetCommand::run() const {
  if (keep_.parsed()) {
    GadgetInheritance given = inherited_;
    given.face = face_of(face_).value();
    keep_gadget(given);
  } else if (up_.parsed()) {
    up();
  } else if (down_.parsed()) {
    down();
  } else {
    status();
  }
  return 0;
}

void GadgetCommand::up() const {
  GadgetFiles files;
  GadgetTree tree(files, places_.gadgets());
  GadgetSpec spec = spec_of(name_, face_, id_, self_powered_);
  check_gadget_name(name_);
  const std::string ours = std::string(kGadgetPrefix) + name_;
  choose_controller(controllers(files, places_, tree.all()), udc_, ours);
  prepare_kernel(files, places_, run_program);
  need_root(places_, "up", name_);
  const UniqueFd lock = lock_gadgets(places_);
  const Controller controller =
      choose_controller(controllers(files, places_, tree.all()), udc_, ours);
  spec.udc = controller.name;
  if (const std::optional<GadgetFound> found = tree.find(name_)) {
    if (same(*found, spec, controller)) {
      log_info(fmt::format("gadget {}: is up already on {}; feed it: {}", ours, found->udc,
                           run_command_of(name_)));
      return;
    }
    rest(files, places_, tree, *found);
  }
  tree.up(spec);
  log_info(fmt::format("gadget {}: up on {} as {}; feed it: {}", ours, spec.udc,
                       described(tree.find(name_).value()), run_command_of(name_)));
}

void GadgetCommand::down() const {
  GadgetFiles files;
  GadgetTree tree(files, places_.gadgets());
  const std::string ours = std::string(kGadgetPrefix) + name_;
  if (!tree.find(name_)) {
    log_info(fmt::format("gadget {}: is not up", ours));
    return;
  }
  need_root(places_, "down", name_);
  const UniqueFd lock = lock_gadgets(places_);
  if (const std::optional<GadgetFound> found = tree.find(name_)) rest(files, places_, tree, *found);
  tree.down(name_);
  log_info(fmt::format("gadget {}: taken down", ours));
}

void GadgetCommand::status() const {
  GadgetFiles files;
  const GadgetTree tree(files, places_.gadgets());
  const std::vector<GadgetFound> gadgets = tree.all();
  const std::vector<Controller> ports = controllers(files, places_, gadgets);
  for (const Controller& one : ports) {
    fmt::print("controller {}: {}, {}, {}\n", one.name, one.state, one.speed,
               one.owner.empty() ? "free" : "has " + one.owner);
  }
  for (const GadgetFound& gadget : gadgets) {
    if (!gadget.name() || !gadget.face) {
      fmt::print("gadget {}: not whole, or of another program\n", gadget.folder);
      continue;
    }
    const std::string node =
        gadget_node(files, places_, tree.function(*gadget.name(), *gadget.face)).value_or("");
    fmt::print("gadget {}: {}, serial {}, {}, {}\n", gadget.folder, described(gadget),
               gadget.serial, gadget.udc.empty() ? "not bound" : "on " + gadget.udc,
               node.empty() ? "no node" : places_.devices + "/" + node);
  }
  std::fflush(stdout);
  if (!ports.empty()) return;
  try {
    choose_controller(ports, "", "");
  } catch (const ConfigError& none) {
    log_info(none.what());
  }
}

}  // namespace tagwrench
