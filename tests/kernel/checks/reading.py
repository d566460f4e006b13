"""Reading it back: `tagwrench read`, the C and Python examples, the logger and the joystick's mapping line, as an ordinary user
with our udev rule, on the devices of a live bridge; then the bridge ends and another one comes."""
import csv
import json
import os
import shutil
import signal

import rig

USER = "1500"
FOLDER = "/run/reading"
JSONL = f"{FOLDER}/out/bridge.jsonl"
LOG = f"{FOLDER}/out/log.csv"
EXAMPLES = ("read_wrench.py", "log_events.py", "joystick_mapping.md")
PLATEAU_N = 0.9  # of the held push: readings between the ends of it


def prepare(setup):
    """Everything in one folder that an ordinary user can read."""
    os.makedirs(f"{FOLDER}/out", exist_ok=True)
    os.chmod(f"{FOLDER}/out", 0o777)
    client = os.path.join(os.path.dirname(setup.tagwrench), "tools", "reading")
    for file in (setup.tagwrench, f"{client}/read_wrench", f"{client}/libtagwrench-hid.so.0",
                 f"{setup.project}/tests/kernel/guest/controller.py",
                 *(f"{setup.project}/host/tools/reading/examples/{name}" for name in EXAMPLES)):
        rig.open_to_all(shutil.copy(file, FOLDER))
    setup.tagwrench = f"{FOLDER}/tagwrench"


def reader(name, *arguments):
    env = {"LD_LIBRARY_PATH": FOLDER, "PYTHONDONTWRITEBYTECODE": "1", "SDL_JOYSTICK_DISABLE_UDEV": "1"}
    return rig.Program(name, list(arguments), user=USER, env=env)


def check_list(setup):
    status, out, err = rig.run(*rig.as_user(USER), setup.tagwrench, "read", "--list")
    lines = out.splitlines()
    rig.check("read --list names the wrench sensor and the SpaceMouse, without permission to open them",
              status == 0 and len(lines) == 2 and lines[0].startswith("wrench  1209:7a6e  /dev/hidraw")
              and lines[1].startswith("6-dof   256f:c62e  /dev/hidraw") and "combined layout" in lines[1], out + err)


def check_refusals(setup):
    for what, command in (("tagwrench read", [setup.tagwrench, "read", "--seconds", "1"]),
                          ("read_wrench.c", [f"{FOLDER}/read_wrench"]),
                          ("read_wrench.py", ["python3", f"{FOLDER}/read_wrench.py"])):
        refused = reader(what, *command)
        status = refused.wait()
        rig.check(f"without the udev rule {what} ends with status 2 and one line that names node and rule",
                  status == 2 and len(refused.err) == 1 and "/dev/hidraw" in refused.err[0]
                  and "70-tagwrench.rules" in refused.err[0], refused.state())


def bridge_samples():
    """By sequence and status, because a frame that stays away makes a second sample: what the bridge wrote itself, whole
    lines only."""
    with open(JSONL, encoding="utf-8") as file:
        lines = file.read().split("\n")[:-1]
    return {(sample["seq"], sample["status"]): sample for sample in map(json.loads, lines)}


def compare(what, readings, own):
    """Readings (sequence, status, six numbers) against the bridge's own; returns the largest force along z."""
    readings = [reading for reading in readings if not (reading[0] == 0 and reading[1] == "lost")]  # of its watchdog
    strangers = []
    worst = numbers = 0
    for sequence, status, values in readings:
        sample = own.get((sequence, status))
        if sample is None:
            strangers.append((sequence, status))
        elif status in ("ok", "saturated"):
            numbers += 1
            worst = max([worst] + [abs(a - b) for a, b in zip(values, sample["f_n"] + sample["m_nm"])])
    rig.check(f"{what}: the same newtons as the bridge's jsonl, to 1 uN and 1 uN m",
              numbers > 10 and not strangers and worst <= 1.001e-6,
              f"{numbers} of {len(readings)} readings, not in it {strangers[:5]}, {worst} off")
    return max((abs(values[2]) for _, _, values in readings), default=0)


def of_text(lines):
    words = [line.split() for line in lines]
    return [(int(w[0]), w[1], [float(v) for v in w[2:8]]) for w in words if len(w) == 9]


def of_json(lines):
    return [(s["seq"], s["status"], s["f_n"] + s["m_nm"]) for s in map(json.loads, lines)]


def of_log(path):
    with open(path, encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    keys = ("fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm")
    samples = [row for row in rows if row["kind"] == "sample"]
    return rows, [(int(row["sequence"]), row["status"], [float(row[key] or 0) for key in keys]) for row in samples]


def truth(setup):
    with open(setup.clip("held_fz") + "/truth.csv", encoding="utf-8") as file:
        return float(list(csv.DictReader(file))[-1]["fz_n"])


def start_readers(setup):
    """Each reads from the first to the last; the puck's is the one that needs no wrench."""
    programs = {
        "tagwrench read": reader("read", setup.tagwrench, "read", "1209:7a6e", "--json", "--wait", "--log",
                                 f"{FOLDER}/out/read.csv"),
        "read_wrench.c": reader("read_wrench.c", f"{FOLDER}/read_wrench"),
        "read_wrench.py": reader("read_wrench.py", "python3", f"{FOLDER}/read_wrench.py"),
        "log_events.py": reader("log_events.py", "python3", f"{FOLDER}/log_events.py", LOG),
        "puck": reader("puck", setup.tagwrench, "read", "256f:c62e", "--json"),
        "controller": reader("controller", "python3", f"{FOLDER}/controller.py", f"{FOLDER}/joystick_mapping.md"),
    }
    for name in ("tagwrench read", "read_wrench.c", "read_wrench.py", "puck"):
        programs[name].wait_line("")
    programs["controller"].wait_line("controller tagwrench joystick")
    programs["log_events.py"].wait_error("logging")
    rig.check("the log begins with samples", rig.wait_until(lambda: of_log(LOG)[1]), programs["log_events.py"].state())
    return programs


def check_lines(setup):
    """For people: one line that is refreshed on a terminal, a line a second elsewhere."""
    command = [setup.tagwrench, "read", "1209:7a6e", "--seconds", "2"]
    plain = reader("read", *command)
    terminal = reader("read on a terminal", "script", "-qec", " ".join(command), "/dev/null")
    rig.check("read prints lines with newtons and rate", plain.wait() == 0 and plain.out
              and all(" N m " in line and "/s, jitter " in line and "\x1b" not in line for line in plain.out), plain.state())
    rig.check("on a terminal it is one line, and the summary begins on another",
              terminal.wait() == 0 and sum("\x1b[K" in line for line in terminal.out) >= 2
              and terminal.out[-1].startswith("tagwrench: 1209:7a6e"), terminal.out)


def push(feeder, programs):
    """A held push and its release, with marks; ends when every reader has seen both."""
    def saw(low, high):
        values = [abs(v[2]) for _, _, v in of_text(programs["read_wrench.py"].out[-3:])]
        return values and all(low <= value <= high for value in values)
    programs["log_events.py"].tell("push")
    feeder.tell("once held_fz")
    rig.check("the push arrives", rig.wait_until(lambda: saw(0.5, 1e3)), programs["read_wrench.py"].state())
    mark = len(feeder.out)
    rig.wait_until(lambda: len(feeder.out) > mark + 16)
    feeder.tell("loop rest")
    programs["log_events.py"].tell("released, \"at once\"")
    rig.check("the release arrives", rig.wait_until(lambda: saw(0, 0.1)), programs["read_wrench.py"].state())


def check_puck(programs):
    counts = [json.loads(line)["counts"] for line in programs["puck"].out]
    far = max(counts, key=lambda c: max(map(abs, c)))
    rig.check("read shows the SpaceMouse: the push on Z, and exact zero after it",
              far[2] <= -70 and max(map(abs, far)) == -far[2] and counts[-1] == [0] * 6, f"{far}, last {counts[-1]}")
    axes = [[int(word) for word in line.split()[1:]] for line in programs["controller"].out if line.startswith("axes ")]
    pulled = max((a[4] for a in axes), default=0)
    rig.check("with the mapping line SDL's controller has it on the left trigger, and nothing on the right one",
              pulled > 6000 and max(a[5] for a in axes) == 0, axes[-5:])


def check_readings(setup, programs, own):
    wanted = abs(truth(setup))
    readings = {name: of_text(programs[name].out) for name in ("read_wrench.c", "read_wrench.py")}
    readings["tagwrench read"] = of_json(programs["tagwrench read"].out)
    rows, readings["log_events.py"] = of_log(LOG)
    for name, got in readings.items():
        peak = compare(name, got, own)
        plateau = sorted(abs(v[2]) for _, _, v in got if abs(v[2]) > PLATEAU_N * peak)
        middle = plateau[len(plateau) // 2] if plateau else 0
        rig.check(f"{name}: the push reads {wanted:.3g} N within 10 %", abs(middle - wanted) < 0.1 * wanted, middle)
        print(f"     {name}: {middle:.4f} N of {wanted:.4f} N, {len(got)} readings")
    return rows


def check_log(rows):
    marks = [row for row in rows if row["kind"] == "mark"]
    times = [int(row["host_ns"]) for row in rows if row["kind"] == "sample"]
    rig.check("the log has both marks, on the samples' clock",
              [row["mark"] for row in marks] == ["push", "released, \"at once\""]
              and all(times[0] < int(row["host_ns"]) < times[-1] for row in marks), marks)
    late = [int(row["latency_us"]) for row in rows if row["latency_us"]]
    rig.check("the log has a latency for every picture, never negative", late and min(late) >= 0, sorted(late)[:3])


def check_unplugged(programs):
    for name in ("read_wrench.c", "read_wrench.py", "puck"):
        status = programs[name].wait()
        rig.check(f"{name}: the end of the bridge is one line and status 1",
                  status == 1 and "gone" in " ".join(programs[name].err), programs[name].state())
    rig.check("read --wait says that the sensor is gone", programs["tagwrench read"].wait_error("waiting for it"),
              programs["tagwrench read"].state())


def check_replugged(setup, programs):
    read = programs["tagwrench read"]
    mark = len(read.out)
    bridge = setup.bridge("wrench", sensor=f"{FOLDER}/sensor.yaml")
    rig.check("read --wait goes on with the next bridge", read.wait_error("back,") and read.wait_line("", mark), read.state())
    missing = [json.loads(line)["missing"] for line in read.out[mark:mark + 1]]
    rig.check("a new bridge is no gap", missing == [0], missing)
    logger = programs["log_events.py"]
    rig.check("the logger goes on, too", rig.wait_until(lambda: any(row["kind"] == "back" for row in of_log(LOG)[0])), logger.state())
    rig.check("Ctrl-C ends read with status 0 and a summary", read.stop(signal.SIGINT) == 0
              and "latency median" in read.err[-1], read.state())
    print(f"     {read.err[-1]}")
    rig.check("Ctrl-C ends the logger with status 0", logger.stop(signal.SIGINT) == 0, logger.state())
    bridge.stop()


def body(setup):
    rig.load("uhid", "hid-generic", "uinput", "evdev", "joydev", "v4l2loopback video_nr=0 exclusive_caps=1")
    prepare(setup)
    shutil.copy(setup.clip("rest") + "/sensor.yaml", FOLDER)
    feeder = setup.feeder(["rest", "held_fz"])
    feeder.tell("loop rest")
    bridge = setup.bridge("wrench", "spacemouse", "joystick", f"jsonl:{JSONL}")
    rig.check("the bridge learns the rest pose", bridge.wait_error("rest pose learned"), bridge.state())
    check_list(setup)
    check_refusals(setup)
    rig.start_udevd(setup.project + "/host/output/70-tagwrench.rules")
    check_lines(setup)
    programs = start_readers(setup)
    push(feeder, programs)
    bridge.stop(signal.SIGINT)
    check_unplugged(programs)
    rows = check_readings(setup, programs, bridge_samples())
    check_log(rows)
    check_puck(programs)
    check_replugged(setup, programs)


rig.main(body)
