"""What the checks have in common: programs that are watched line by line, waiting for conditions, and the summary.

The checks run as root in the guest (see ../vm). The guest may be emulated, twenty times slower than a computer, so a
check waits for conditions and never for a time to pass, and no limit below says how fast something ought to be.
"""
import argparse
import glob
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time

PATIENCE = 90.0  # s; for anything that a healthy system does at once
SERVICE_ID = 900  # user and group of the service of devices, as sysusers makes them

_failed = []
_checks = 0
_programs = []


def monotonic_ns():
    return time.clock_gettime_ns(time.CLOCK_MONOTONIC)


def check(what, ok, detail=""):
    """One line of the summary."""
    global _checks
    _checks += 1
    if ok:
        print(f"ok - {what}", flush=True)
    else:
        _failed.append(what)
        print(f"FAILED - {what}: {detail}", flush=True)
    return bool(ok)


def wait_until(condition, patience=PATIENCE):
    """The condition's first true value, or None."""
    end = time.monotonic() + patience
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > end:
            return None
        time.sleep(0.02)


class GaveUp(Exception):
    """What was waited for did not come: nothing after it makes sense."""


class Program:
    """A running program. Its lines are collected with the time of their arrival."""

    def __init__(self, name, arguments, user=None, env=None, cwd="/"):
        self.name = name
        if user is not None:
            arguments = as_user(user) + arguments
        if shutil.which(arguments[0]) is None:
            raise GaveUp(f"no program {arguments[0]}")
        self.process = subprocess.Popen(
            arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, bufsize=1,
            cwd=cwd, env={**os.environ, **(env or {})}, start_new_session=True)
        self.out, self.err = [], []
        self.readers = [threading.Thread(target=self._read, args=pair, daemon=True)
                        for pair in ((self.process.stdout, self.out), (self.process.stderr, self.err))]
        for reader in self.readers:
            reader.start()
        _programs.append(self)

    @staticmethod
    def _read(stream, lines):
        for line in stream:
            lines.append(line.rstrip("\n"))

    @property
    def pid(self):
        return self.process.pid

    def running(self):
        return self.process.poll() is None

    def tell(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def find(self, words, since=0, stream=None):
        """The first line from index `since` on that starts with `words`, or None."""
        lines = self.out if stream is None else stream
        return next((line for line in lines[since:] if line.startswith(words)), None)

    def wait_line(self, words, since=0, patience=PATIENCE):
        """Waits for a line of standard output that starts with `words`; gives up if it does not come."""
        line = wait_until(lambda: self.find(words, since) or (not self.running() and "ended"), patience)
        line = self.find(words, since)
        if line is None:
            raise GaveUp(f"{self.name} did not say '{words}' ({self.state()})")
        return line

    def wait_error(self, part, since=0, patience=PATIENCE):
        """Waits for a line of standard error that contains `part`; None if it does not come."""
        def there():
            return next((line for line in self.err[since:] if part in line), None)
        wait_until(lambda: there() or not self.running(), patience)
        return there()

    def state(self):
        status = self.process.poll()
        said = " | ".join((self.out[-3:] + self.err[-5:])) or "nothing"
        return f"{'running' if status is None else f'ended with {status}'}, said last: {said}"

    def send(self, number):
        if self.running():
            self.process.send_signal(number)

    def stop(self, number=signal.SIGTERM):
        """Ends it and returns its exit status; what it said is complete afterwards."""
        self.send(number)
        return self.wait()

    def wait(self, patience=PATIENCE):
        try:
            self.process.wait(patience)
        except subprocess.TimeoutExpired:
            state = self.state()
            self.process.kill()
            raise GaveUp(f"{self.name} did not end within {patience:.0f} s ({state})") from None
        for reader in self.readers:
            reader.join(5)
        return self.process.returncode


def as_user(user, groups=f"{SERVICE_ID},input,video"):
    """Drops from root to an ordinary user of the groups tagwrench and video, as `useradd -G tagwrench,video` makes one; the group
    input stands for the seat, whose user may read joysticks."""
    return ["setpriv", f"--reuid={user}", f"--regid={user}", "--groups", groups, "--inh-caps=-all",
            "--bounding-set=-all", "--no-new-privs"]


def run(*arguments, patience=PATIENCE, **options):
    """Runs a command to its end; (exit status, standard output, standard error)."""
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=patience, stdin=subprocess.DEVNULL, **options)
    return done.returncode, done.stdout, done.stderr


def load(*modules):
    """Loads kernel modules; a module with parameters is one string."""
    for module in modules:
        status, _, err = run("modprobe", *module.split())
        if status != 0:
            raise GaveUp(f"modprobe {module}: {err.strip()}")


def add_service_user():
    """What tagwrench-sysusers.conf makes; once."""
    for file, line in (("/etc/passwd", f"tagwrench:x:{SERVICE_ID}:{SERVICE_ID}::/:/usr/sbin/nologin"),
                       ("/etc/group", f"tagwrench:x:{SERVICE_ID}:")):
        with open(file, "r+", encoding="utf-8") as lines:
            if line not in lines.read():
                lines.write(line + "\n")


def start_udevd(*rules):
    """With these files of rules; one that is called otherwise gets the place of our own."""
    add_service_user()
    for path in rules:
        name = os.path.basename(path)
        shutil.copy(path, "/etc/udev/rules.d/" + (name if name.startswith("7") else "70-tagwrench.rules"))
    os.makedirs("/run/udev", exist_ok=True)
    for command in (["/lib/systemd/systemd-udevd", "--daemon"], ["udevadm", "trigger", "--action=add"],
                    ["udevadm", "settle", "-t", "60"]):
        status, _, err = run(*command, patience=120)
        if status != 0:
            raise GaveUp(f"{' '.join(command)}: {err.strip()}")


def input_devices(name_part):
    """The names of the kernel's input devices that contain `name_part`."""
    with open("/proc/bus/input/devices", encoding="utf-8") as file:
        names = [line[len('N: Name="'):-2] for line in file if line.startswith("N:")]
    return [name for name in names if name_part in name]


def hidraw_nodes():
    return glob.glob("/sys/class/hidraw/hidraw*")


def our_devices():
    """Whatever the bridge has made that still exists."""
    return input_devices("tagwrench") + hidraw_nodes()


def processes(part):
    """The command names of all processes that contain `part`, with their ids."""
    found = []
    for path in glob.glob("/proc/[0-9]*/comm"):
        try:
            with open(path, encoding="utf-8") as file:
                name = file.read().strip()
        except OSError:
            continue
        if part in name:
            found.append(f"{name} ({path.split('/')[2]})")
    return found


def open_to_all(path):
    """What its owner may read or execute everybody may, and everybody finds the way to it. The project may lie where only
    its owner can go, or come from a clone under umask 077; the guest's files are an overlay, so this changes the guest alone."""
    path = os.path.abspath(path)
    while path != "/":
        mode = os.stat(path).st_mode & 0o7777
        wanted = mode | (mode & 0o500) >> 3 | (mode & 0o500) >> 6
        if wanted != mode:
            os.chmod(path, wanted)
        path = os.path.dirname(path)


def serve_devices(program, folder="/run/tagwrench-devices"):
    """What systemd does for the service of devices: listens at its sockets, and starts it for each connection as its user."""
    os.makedirs(folder, exist_ok=True)
    open_to_all(program)

    def accept(listener):
        while True:
            connection, _ = listener.accept()
            with connection:
                service = subprocess.Popen(["setpriv", f"--reuid={SERVICE_ID}", f"--regid={SERVICE_ID}", "--clear-groups", "--inh-caps=-all",
                                            "--bounding-set=-all", "--no-new-privs", program], stdin=connection)
            threading.Thread(target=service.wait, daemon=True).start()
    for node in ("uhid", "uinput"):
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        listener.bind(f"{folder}/{node}")
        os.chmod(f"{folder}/{node}", 0o666)
        listener.listen()
        threading.Thread(target=accept, args=(listener,), daemon=True).start()


class Setup:
    """Where the check finds what the build made. An ordinary user finds it, too."""

    def __init__(self):
        parser = argparse.ArgumentParser()
        parser.add_argument("--tagwrench", required=True, help="the program under test")
        parser.add_argument("--programs", required=True, help="folder of the guest programs")
        parser.add_argument("--frames", required=True, help="folder of the rendered clips")
        parser.add_argument("--source-dir", required=True, help="the project")
        options = parser.parse_args()
        self.tagwrench, self.programs, self.frames = options.tagwrench, options.programs, options.frames
        self.project = options.source_dir
        for file in (self.tagwrench, *glob.glob(f"{self.programs}/*_client"), *glob.glob(f"{self.frames}/*/sensor.yaml")):
            open_to_all(file)

    def clip(self, name):
        return f"{self.frames}/{name}"

    def feeder(self, clips, device="/dev/video0", kind="GREY", rate=8, wait=True):
        """The camera: a v4l2loopback node fed with clips. Returns when the first frame is in."""
        arguments = [f"{self.programs}/feeder", device, kind, str(rate)]
        arguments += [f"{name}={self.clip(name)}" for name in clips]
        feeder = Program("feeder", arguments)
        if wait:
            feeder.wait_line("frame")
        return feeder

    def bridge(self, *outputs, source="v4l2:/dev/video0", sensor=None, user=None, more=()):
        """Of the clips' sensor unless `sensor` names another; "" is the built-in one."""
        sensor = self.clip("rest") + "/sensor.yaml" if sensor is None else sensor
        arguments = [self.tagwrench, "run", "--source", source] + (["--sensor", sensor] if sensor else [])
        for output in outputs:
            arguments += ["--output", output]
        return Program("tagwrench", arguments + list(more), user=user)

    def client(self, name, *arguments, user=None, env=None):
        return Program(name, [f"{self.programs}/{name}", *arguments], user=user, env=env)


def check_taken(daemon):
    """spacenavd has opened an input device (it says so on a buffered stream, too late to wait for)."""
    def opened():
        for link in glob.glob(f"/proc/{daemon.pid}/fd/*"):
            try:
                if os.readlink(link).startswith("/dev/input/event"):
                    return True
            except OSError:
                pass  # closed in between
        return False
    check("spacenavd takes the device", wait_until(opened), daemon.state())


def start_spacenavd(rules=""):
    """The real daemon. Its socket's path is relative when it stays in the foreground, hence cwd /."""
    with open("/etc/spnavrc", "w", encoding="utf-8") as file:
        file.write(rules)
    daemon = Program("spacenavd", ["spacenavd", "-d", "-v"], cwd="/")
    if not wait_until(lambda: os.path.exists("/var/run/spnav.sock") or not daemon.running()):
        raise GaveUp("spacenavd made no socket")
    return daemon


def main(body):
    """Runs the check, ends every program that it left, prints the summary, exits."""
    try:
        body(Setup())
    except GaveUp as reason:
        check("the check ran to its end", False, str(reason))
    if _failed:
        for program in [p for p in _programs if p.running()] + [p for p in _programs if not p.running()][-3:]:
            print(f"--- {program.name}: {program.state()}")
            for line in program.err[-6:]:
                print(f"    {line}")
    for program in _programs:
        program.send(signal.SIGKILL)
    print(f"{_checks - len(_failed)} of {_checks} ok", flush=True)
    sys.exit(1 if _failed or _checks == 0 else 0)
