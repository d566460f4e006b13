"""CAD programs under an X server of their own, fed by `tagwrench run` through the spnav socket."""
import contextlib
import math
import os
import select
import shutil
import signal
import socket
import struct
import subprocess
import sys
import time
import traceback

SKIPPED = 77
PATIENCE = 120  # seconds, of a busy machine; nothing is judged by time
EVENT = struct.Struct("=8i")

# A push of the sensor, and where it must come out among x y z rx ry rz of spnav, with which sign. The camera looks up from
# below, and spnav's axes are x right, y up, z away from the user.
PUSHES = {"fx": (0, +1), "fy": (2, +1), "fz": (1, +1), "mx": (3, +1), "my": (5, +1), "mz": (4, +1)}

failures = []


def skip(reason):
    print("SKIP:", reason)
    sys.exit(SKIPPED)


def check(what, holds, details=""):
    print("ok  " if holds else "FAIL", what, details, flush=True)
    if not holds:
        failures.append(what)
    return holds


def finish():
    print(f"{len(failures)} of the checks failed" if failures else "all checks passed")
    sys.exit(1 if failures else 0)


def need(*programs):
    missing = [program for program in programs if not shutil.which(program)]
    if missing:
        skip(f"not installed: {' '.join(missing)} (Debian: xvfb xdotool imagemagick x11-utils freecad blender)")


def wait_until(condition, what):
    """Looks again and again; the CAD programs tell of nothing."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.05)
    raise RuntimeError(f"waited in vain for {what}")


def quaternion(vector):
    """x y z w of a rotation vector."""
    angle = math.sqrt(sum(v * v for v in vector))
    k = 0.5 if angle < 1e-12 else math.sin(angle / 2) / angle
    return [v * k for v in vector] + [math.cos(angle / 2)]


def times(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz]


def inverse(q):
    return [-q[0], -q[1], -q[2], q[3]]


def rotation_vector(q):
    """Of the shorter way round."""
    if q[3] < 0:
        q = [-v for v in q]
    sine = math.sqrt(sum(v * v for v in q[:3]))
    angle = 2 * math.atan2(sine, q[3])
    return [0.0] * 3 if sine < 1e-12 else [v / sine * angle for v in q[:3]]


def rotated(q, v):
    return times(times(q, list(v) + [0.0]), inverse(q))[:3]


def degrees(vector):
    return [round(math.degrees(v), 2) for v in vector]


class View:
    """Where the CAD program says that its camera is: position, orientation (x y z w), and how much it sees."""

    def __init__(self, path):
        self.path = path

    def lines(self):
        if not os.path.exists(self.path):
            return []
        with open(self.path, encoding="ascii") as file:
            return [line for line in file.read().split("\n")[:-1] if line]

    def go_home(self):
        """Where it was at first, so that there is something to be seen."""
        with open(self.path + ".home", "w", encoding="ascii"):
            pass
        wait_until(lambda: not os.path.exists(self.path + ".home"), "the view to go home")
        return self.at_rest()

    def at_rest(self):
        """The three, when it has told the same a few times."""
        told = len(self.lines())

        def same():
            lines = self.lines()
            return lines[-1] if len(lines) >= told + 4 and len(set(lines[-4:])) == 1 else None
        numbers = [float(word) for word in wait_until(same, "a camera that stands still").split()]
        return numbers[:3], numbers[3:7], numbers[7]


class Desk(contextlib.ExitStack):
    """A screen, a folder for what is kept, and whatever is started; all of it is ended at the end."""

    def __init__(self, tagwrench, out):
        super().__init__()
        self.tagwrench = tagwrench
        self.out = out
        shutil.rmtree(out, ignore_errors=True)
        os.makedirs(out + "/home")
        # Socket paths are short.
        self.run = subprocess.check_output(["mktemp", "-d", "/tmp/tw-desktop-XXXXXX"], text=True).strip()
        self.callback(shutil.rmtree, self.run, ignore_errors=True)
        self.socket = self.run + "/spnav.sock"
        self.environment = {**os.environ, "HOME": out + "/home", "LIBGL_ALWAYS_SOFTWARE": "1", "QT_QPA_PLATFORM": "xcb",
                            "QTWEBENGINE_DISABLE_SANDBOX": "1", "SPNAV_SOCKET": self.socket}

    def start(self, *arguments, log, **more):
        file = self.enter_context(open(f"{self.out}/{log}.log", "w", encoding="utf-8"))
        process = subprocess.Popen(arguments, stdin=subprocess.DEVNULL, stdout=more.pop("stdout", file), stderr=file,
                                   env=self.environment, **more)
        self.callback(end, process)
        return process

    def screen(self):
        ours, theirs = os.pipe()
        self.start("Xvfb", "-displayfd", str(theirs), "-screen", "0", "800x600x24", "-noreset", "-nolisten", "tcp", log="xvfb",
                   pass_fds=[theirs])
        os.close(theirs)
        with os.fdopen(ours, encoding="ascii") as told:
            display = told.readline().strip()
        if not display:
            raise RuntimeError("Xvfb has not started; see xvfb.log")
        self.environment["DISPLAY"] = ":" + display

    def focus(self, name):
        """There is no window manager to give it."""
        def window():
            found = subprocess.run(["xdotool", "search", "--onlyvisible", "--name", name], env=self.environment, check=False,
                                   capture_output=True, text=True).stdout.split()
            return found and found[0]
        subprocess.run(["xdotool", "windowfocus", "--sync", wait_until(window, f"a window called {name}")],
                       env=self.environment, check=True)

    def point(self, x, y):
        subprocess.run(["xdotool", "mousemove", str(x), str(y)], env=self.environment, check=True)

    def screenshot(self, name):
        subprocess.run(["import", "-window", "root", f"{self.out}/{name}.png"], env=self.environment, check=True)

    def spnav_daemon(self):
        """The process that holds the socket, as a service would."""
        self.start(self.tagwrench, "spnav", "--socket", self.socket, log="daemon")
        wait_until(lambda: os.path.exists(self.socket), "the daemon's socket")

    def push(self, axis, share):
        """A bridge, from its start to its end: the simulated sensor at rest, pushed by a share of its range for two seconds, and
        let go."""
        scenario = f"{self.run}/{axis}.yaml"
        with open(scenario, "w", encoding="utf-8") as file:
            file.write(f"seed: 1\ntrajectory: {{motion: push, axis: {axis}, share: {share}, hold_s: 2}}\n")
        with open(f"{self.out}/bridge.log", "a", encoding="utf-8") as log:
            subprocess.run([self.tagwrench, "run", "--source", "sim:" + scenario, "--output", "spnav:" + self.socket,
                            "--seconds", "4.6"], env=self.environment, stdout=log, stderr=log, check=True)

    def push_every_axis(self, view, witness, share_of, check_turn, check_shift):
        """From the same view each time; a push of share_of(axis) of full scale, and what the view makes of it."""
        for axis in PUSHES:
            before = view.go_home()
            self.screenshot(axis + "_before")
            motions = witness.pushed(lambda: self.push(axis, share_of(axis)))
            after = view.at_rest()
            self.screenshot(axis + "_after")
            check_motions(axis, motions)
            if axis[0] == "m":
                check_turn(axis, motions, before, after)
            else:
                check_shift(axis, before, after)


def end(process, patience=1):
    process.send_signal(signal.SIGTERM)
    try:
        process.wait(patience)
    except subprocess.TimeoutExpired:
        process.kill()  # Blender takes its time over SIGTERM
        process.wait()


class Witness:
    """A second program on the socket: what the CAD program is told, with the time of its coming."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.socket.connect(path)
        self.socket.sendall(struct.pack("=I", 0x7faa5501))
        assert self.socket.recv(4, socket.MSG_WAITALL) == struct.pack("=I", 0x7faa5501)

    def pushed(self, bridge):
        """Motions while bridge() runs: (time, six counts)."""
        motions = []
        done, wake = socket.socketpair()
        child = os.fork()
        if child == 0:
            status = 1
            try:
                bridge()
                status = 0
            except Exception:
                traceback.print_exc()
            finally:
                wake.sendall(b".")
                os._exit(status)
        while True:
            ready, _, _ = select.select([self.socket, done], [], [])
            if self.socket in ready:
                event = EVENT.unpack(self.socket.recv(EVENT.size, socket.MSG_WAITALL))
                if event[0] == 0:
                    motions.append((time.monotonic(), event[1:7]))
            elif done in ready:
                break
        _, status = os.waitpid(child, 0)
        check("the bridge ends well", status == 0)
        return motions


def check_motions(axis, motions):
    """The axis and its sign, crosstalk, and rest at the end."""
    index, sign = PUSHES[axis]
    if not check(f"{axis}: programs are told of motion", len(motions) > 20, f"{len(motions)} events"):
        return
    peak = max(motions, key=lambda m: max(map(abs, m[1])))[1]
    others = max(abs(v) for i, v in enumerate(peak) if i != index)
    check(f"{axis}: it is axis {index} of spnav, sign {sign:+d}", peak[index] * sign > 20 and others < abs(peak[index]) / 3,
          f"at most {peak}")
    check(f"{axis}: the last event is zero", motions[-1][1] == (0,) * 6)
    span = motions[-1][0] - motions[0][0]
    print(f"     {len(motions)} events in {span:.2f} s")
