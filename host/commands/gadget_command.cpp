// `tagwrench gadget`: this computer as a USB device of another one.
#include <fmt/format.h>
#include <unistd.h>

#include "host/commands/commands.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/printable.h"
#include "host/output/gadget_output.h"
#include "host/output/gadget_tree.h"
#include "host/output/hid_outputs.h"

namespace tagwrench {
namespace {

struct GadgetCommandOptions {
  KernelPlaces places;
  GadgetInheritance inherited;  ///< of `keep`
  std::string name = "sensor";
  std::string face = "spacemouse";
  std::string id;
  std::string udc;
  bool self_powered = false;
};

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

GadgetSpec spec_of(const GadgetCommandOptions& o) {
  GadgetSpec spec;
  spec.name = o.name;
  spec.face = face_of(o.face).value_or(GadgetFace::spacemouse);
  spec.id = face_id(spec.face);
  spec.self_powered = o.self_powered;
  if (o.id.empty()) return spec;
  const std::optional<UsbId> given = parse_usb_id(o.id);
  if (!given)
    throw ConfigError("--id {}: not vendor:product in hexadecimal; write it as in 256f:c62e", o.id);
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
  throw ConfigError("gadget {}{}: {} cannot be written; run it as root: sudo tagwrench gadget {}{}",
                    kGadgetPrefix, name, places.gadgets(), verb,
                    name == "sensor" ? "" : " --name " + name);
}

std::string run_command_of(const std::string& name) {
  const std::string more = name == "sensor" ? "" : " --name " + name;
  return "tagwrench run --output gadget" + more;
}

int bring_up(const GadgetCommandOptions& o) {
  GadgetFiles files;
  GadgetTree tree(files, o.places.gadgets());
  GadgetSpec spec = spec_of(o);
  check_sensor_name(o.name);
  const std::string ours = std::string(kGadgetPrefix) + o.name;
  choose_controller(controllers(files, o.places, tree.all()), o.udc, ours);
  prepare_kernel(files, o.places, run_program);
  need_root(o.places, "up", o.name);
  const UniqueFd lock = lock_gadgets(o.places);
  const Controller controller =
      choose_controller(controllers(files, o.places, tree.all()), o.udc, ours);
  spec.udc = controller.name;
  if (const std::optional<GadgetFound> found = tree.find(o.name)) {
    if (same(*found, spec, controller)) {
      log_info("gadget {}: is up already on {}; feed it: {}", ours, found->udc,
               run_command_of(o.name));
      return 0;
    }
    rest(files, o.places, tree, *found);
  }
  tree.up(spec);
  log_info("gadget {}: up on {} as {}; feed it: {}", ours, spec.udc,
           described(tree.find(o.name).value()), run_command_of(o.name));
  return 0;
}

int take_down(const GadgetCommandOptions& o) {
  GadgetFiles files;
  GadgetTree tree(files, o.places.gadgets());
  const std::string ours = std::string(kGadgetPrefix) + o.name;
  if (!tree.find(o.name)) {
    log_info("gadget {}: is not up", ours);
    return 0;
  }
  need_root(o.places, "down", o.name);
  const UniqueFd lock = lock_gadgets(o.places);
  if (const std::optional<GadgetFound> found = tree.find(o.name))
    rest(files, o.places, tree, *found);
  tree.down(o.name);
  log_info("gadget {}: taken down", ours);
  return 0;
}

/// Names in it are those of other programs and of the hardware.
template <typename... Args>
void print_line(fmt::format_string<Args...> format, Args&&... args) {
  fmt::print("{}\n", printable(fmt::format(format, std::forward<Args>(args)...)));
}

int show_status(const GadgetCommandOptions& o) {
  GadgetFiles files;
  const GadgetTree tree(files, o.places.gadgets());
  const std::vector<GadgetFound> gadgets = tree.all();
  const std::vector<Controller> ports = controllers(files, o.places, gadgets);
  for (const Controller& one : ports) {
    print_line("controller {}: {}, {}, {}", one.name, one.state, one.speed,
               one.owner.empty() ? "free" : "has " + one.owner);
  }
  for (const GadgetFound& gadget : gadgets) {
    if (!gadget.name() || !gadget.face) {
      print_line("gadget {}: not whole, or of another program", gadget.folder);
      continue;
    }
    const std::string node =
        gadget_node(files, o.places, tree.function(*gadget.name(), *gadget.face)).value_or("");
    print_line("gadget {}: {}, serial {}, {}, {}", gadget.folder, described(gadget), gadget.serial,
               gadget.udc.empty() ? "not bound" : "on " + gadget.udc,
               node.empty() ? "no node" : o.places.devices + "/" + node);
  }
  std::fflush(stdout);
  if (!ports.empty()) return 0;
  try {
    choose_controller(ports, "", "");
  } catch (const ConfigError& none) {
    log_info(none.what());
  }
  return 0;
}

}  // namespace

void gadget_command(command_line::Command program) {
  const auto o = std::make_shared<GadgetCommandOptions>();
  auto verb = program.add_subcommand("gadget", "be a USB device of another computer");
  verb.require_subcommand();
  auto keep = verb.add_subcommand("keep", "").hidden();
  auto up = verb.add_subcommand("up", "make the device and offer it at the USB device port");
  auto down = verb.add_subcommand("down", "take it away; done if it is not there");
  for (command_line::Command command : {up, down}) {
    command.add_option("--name", o->name, "of the sensor, as `tagwrench run --name` has it")
        .capture_default_str();
  }
  up.add_option("--face", o->face, "what the other computer sees")
      .check(command_line::one_of({"spacemouse", "wrench"}))
      .capture_default_str();
  up.add_option("--id", o->id, "VENDOR:PRODUCT; without it 256f:c62e, and of the wrench 1209:7a6e");
  up.add_option("--udc", o->udc, "USB device controller; without it the first free one");
  keep.add_option("--face", o->face).check(command_line::one_of({"spacemouse", "wrench"}));
  keep.add_option("--sysfs", o->inherited.places.sysfs);
  keep.add_option("--devices", o->inherited.places.devices);
  keep.add_option("--function", o->inherited.function).required();
  keep.add_option("--node", o->inherited.node).required();
  up.add_flag("--self-powered", o->self_powered,
              "the board has a supply of its own; without it up to 500 mA are asked for");
  keep.runs([o] {
    o->inherited.face = face_of(o->face).value();
    keep_gadget(o->inherited);
    return 0;
  });
  up.runs([o] { return bring_up(*o); });
  down.runs([o] { return take_down(*o); });
  verb.add_subcommand("status", "device ports of this computer, and what is on them").runs([o] {
    return show_status(*o);
  });
  // Last: the verbs below would have it too.
  verb.footer("`tagwrench run --output gadget` then feeds it. Only up and down need root.");
}

}  // namespace tagwrench
