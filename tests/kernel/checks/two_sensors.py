"""Two sensors on one computer, a bridge and a name each: whoever opens one by its serial gets its newtons and no others',
also after one was killed, and after both came back in another order."""
import json
import os
import shutil
import signal

import rig

FOLDER = "/run/two_sensors"
HELD_N, REST_N = 0.9, 0.1  # the held push is 1.4 N along z


class Sensor:
    """A camera, a bridge, and who reads it by its serial."""

    def __init__(self, setup, name, device, profile):
        self.setup, self.name, self.device, self.profile = setup, name, device, profile
        self.serial, self.runs = f"tagwrench-{name}", 0
        self.feeder = setup.feeder(["rest", "held_fz"], device=device)
        self.bridge = None
        self.readers = {}

    def jsonl(self):
        return f"{FOLDER}/{self.name}.{self.runs}.jsonl"

    def start(self):
        """Returns when its devices are there."""
        self.feeder.tell("loop rest")
        self.runs += 1
        self.bridge = self.setup.bridge("spacemouse", "wrench", f"spnav:{FOLDER}/{self.name}.sock", f"jsonl:{self.jsonl()}",
                                        source=f"v4l2:{self.device}", more=["--name", self.name, "--profile", self.profile])
        rig.check(f"{self.name} starts", self.bridge.wait_error("source: "), self.bridge.state())

    def learn(self):
        rig.check(f"{self.name} learns its rest", self.bridge.wait_error("rest pose learned"), self.bridge.state())

    def read_by_serial(self):
        program = self.setup.tagwrench
        self.readers = {
            "read": rig.Program(f"read {self.name}", [program, "read", self.serial, "--json", "--wait"]),
            "read_wrench.py": rig.Program(f"py {self.name}", ["python3", "-B", f"{FOLDER}/read_wrench.py", self.serial])}

    def forces(self, reader, since):
        """(sequence, status, force along z) of what a reader printed."""
        lines = self.readers[reader].out[since:]
        if reader == "read":
            return [(s["seq"], s["status"], s["f_n"][2]) for s in map(json.loads, lines)]
        words = [line.split() for line in lines]
        return [(int(w[0]), w[1], float(w[4])) for w in words if len(w) == 9]

    def written(self):
        with open(self.jsonl(), encoding="utf-8") as file:
            samples = map(json.loads, file.read().split("\n")[:-1])
            return {(sample["seq"], sample["status"]): sample["f_n"][2] for sample in samples}


def settle(sensors, held):
    """Until every reader of every sensor shows what is held there and what is not."""
    def as_wanted(sensor, reader):
        last = [abs(force) for _, status, force in sensor.forces(reader, -3) if status in ("ok", "saturated")]
        wanted = sensor is held
        return len(last) == 3 and all(force > HELD_N if wanted else force < REST_N for force in last)
    pairs = [(sensor, reader) for sensor in sensors for reader, program in sensor.readers.items() if program.running()]
    ok = rig.wait_until(lambda: all(as_wanted(*pair) for pair in pairs))
    state = {f"{sensor.name} {reader}": sensor.forces(reader, -2) for sensor, reader in pairs}
    rig.check(f"{held.name} is pushed: all {len(pairs)} readers show it there and nowhere else", ok, state)


def hold(sensors, held):
    for sensor in sensors:
        sensor.feeder.tell("hold held_fz" if sensor is held else "loop rest")
    settle(sensors, held)


def check_own_numbers(sensor, since):
    """Sample by sample what its own bridge wrote; two sensors never agree to a micronewton for long."""
    for reader, mark in since.items():
        def readings():
            return [sample for sample in sensor.forces(reader, mark) if sample[1] in ("ok", "saturated")]
        rig.wait_until(lambda: len(readings()) > 4 or not sensor.readers[reader].running())
        got = readings()
        rig.wait_until(lambda: not got or got[-1][:2] in sensor.written(), 10)  # the device has it a moment before the file
        own = sensor.written()
        strangers = [s for s in got if abs(own.get(s[:2], 1e9) - s[2]) > 1.001e-6]
        rig.check(f"{sensor.name}: {reader} prints its own bridge's newtons and no other's",
                  len(got) > 4 and not strangers, f"{len(got)} readings, strangers {strangers[:3]}")


def check_names(setup, sensors):
    _, out, err = rig.run(setup.tagwrench, "read", "--list")
    lines = out.splitlines()
    for sensor in sensors:
        kinds = sorted(line.split()[0] for line in lines if sensor.serial in line)
        rig.check(f"read --list has a puck and a wrench sensor with the serial {sensor.serial}", kinds == ["6-dof", "wrench"],
                  out + err)


def check_ambiguous(setup, sensors):
    refused = rig.run(setup.tagwrench, "read", "1209:7a6e")
    rig.check("an id that two have is refused, and the line names the serials",
              refused[0] == 2 and all(sensor.serial in refused[2] for sensor in sensors), refused)


def check_control(setup, sensors):
    for sensor in sensors:
        status, out, err = rig.run(setup.tagwrench, "control", "--name", sensor.name, "status")
        rig.check(f"control --name {sensor.name} reaches the one with its profile", status == 0 and sensor.profile in out, out + err)
    second = setup.bridge("wrench", source="images:" + setup.clip("rest"), more=["--name", sensors[0].name])
    rig.check("a third bridge with a name that is taken is refused", second.wait() == 2
              and f"--name {sensors[0].name}" in second.err[-1], second.state())


def check_sockets(setup, sensors, held):
    """libspnav programs, each on the socket of its sensor."""
    clients = {}
    for sensor in sensors:
        clients[sensor] = setup.client("spnav_client", env={"SPNAV_SOCKET": f"{FOLDER}/{sensor.name}.sock"})
        clients[sensor].wait_line("connected")
    rig.check(f"a libspnav program on {held.name}'s socket moves", clients.pop(held).wait_line("motion"))
    still = next(iter(clients.values()))
    rig.check("one on the other's does not", not still.find("motion"), still.out[-3:])


def marks(sensor):
    return {reader: len(program.out) for reader, program in sensor.readers.items()}


def check_kill(left, right):
    """The other one goes on; the readers of this one wait for it and for nothing else."""
    hold((left, right), left)
    since, readers = marks(right), marks(left)
    os.kill(left.bridge.pid, signal.SIGKILL)
    left.bridge.wait()
    rig.check("the killed one's reader waits", left.readers["read"].wait_error("waiting for it"), left.readers["read"].state())
    rig.check("its read_wrench.py ends", left.readers["read_wrench.py"].wait() == 1, left.readers["read_wrench.py"].state())
    before = len(right.readers["read"].out)
    rig.wait_until(lambda: len(right.readers["read"].out) > before + 8)
    sequence = [s[0] for s in right.forces("read", since["read"]) if s[0] > 0]
    quiet = not any("gone" in line for program in right.readers.values() for line in program.err)
    rig.check("the other goes on, and its readers notice nothing", quiet and sequence == sorted(sequence)
              and len(right.readers["read"].out) > before + 8, (sequence, right.readers["read"].err))
    rest = left.forces("read", readers["read"])
    rig.check("what the killed one's reader saw last is neutral", rest and rest[-1][1] == "lost" and rest[-1][2] == 0, rest[-3:])
    check_own_numbers(right, since)


def check_other_order(setup, left, right):
    """Both go; the right one comes first and gets the nodes that the left one had."""
    right.bridge.stop(signal.SIGINT)
    rig.check("all devices are gone", rig.wait_until(lambda: not rig.our_devices()), rig.our_devices())
    right.start()
    left.start()
    for sensor in (left, right):
        sensor.learn()
        back = sensor.readers["read"].wait_error("back,")
        rig.check(f"{sensor.name}'s reader has it back", back and sensor.serial in back, sensor.readers["read"].state())
        sensor.readers.pop("read_wrench.py").stop()
    check_names(setup, (left, right))
    since = {sensor.name: marks(sensor) for sensor in (left, right)}
    hold((left, right), right)
    for sensor in (left, right):
        check_own_numbers(sensor, since[sensor.name])


def body(setup):
    rig.load("uhid", "hid-generic", "evdev", "v4l2loopback video_nr=0,1 devices=2 exclusive_caps=1,1")
    os.makedirs(FOLDER)
    shutil.copy(f"{setup.project}/host/tools/reading/examples/read_wrench.py", FOLDER)
    left, right = Sensor(setup, "left", "/dev/video0", "cad"), Sensor(setup, "right", "/dev/video1", "game")
    for sensor in (left, right):
        sensor.start()
    for sensor in (left, right):
        sensor.learn()
    check_names(setup, (left, right))
    check_ambiguous(setup, (left, right))
    check_control(setup, (left, right))
    for sensor in (left, right):
        sensor.read_by_serial()
    since = {sensor.name: marks(sensor) for sensor in (left, right)}
    hold((left, right), right)
    check_sockets(setup, (left, right), right)
    check_kill(left, right)
    check_own_numbers(right, since["right"])
    check_other_order(setup, left, right)
    for sensor in (left, right):
        rig.check(f"Ctrl-C ends {sensor.name} with status 0", sensor.bridge.stop(signal.SIGINT) == 0, sensor.bridge.state())


rig.main(body)
