#!/usr/bin/env python3
"""soak.py --hours H [--seed N]: the closed instrument for hours, with pages, CAD programs, recordings and faults drawn from a seed.

The program shows the simulated sensor, pushed about, in real time, with load cells of the emulated board where that was built; a page
records, pages and CAD programs come and go, some of them badly behaved. Faults come at random: the program killed or stopped, the
board gone, no room for a recording, the time of day set, floods of requests; nobody kills it in the second half. A camera that is
unplugged takes a real driver: the kernel test `cameras` has one. What is reported: memory and descriptors, latency, samples that
were lost and whether the program said so, how soon everything was at rest after a kill, and which recordings can be read. Status 1:
something was lost without a word, did not come to rest within 80 ms, grew, or ended by itself.
"""
import argparse
import collections
import json
import os
import pathlib
import random
import resource
import shutil
import signal
import socket
import struct
import subprocess
import sys
import threading
import time

from clients import CadProgram, Lines, Page, monotonic_ns

REST_MS = 80            # what is promised after a kill
GROWTH_KB_PER_H = 2048  # of memory, beyond which it is a leak
WARM_S = 900            # before memory counts: what the first crowd takes comes once
LONG_S = 1800           # that tells whether memory grows: in ten minutes, noise of 1 MB reads as 6 MB an hour
CROWD_S = 60            # how long those stay who do not read or do not finish
FAULTS = ["killed", "stopped", "without_board", "no_room", "flood_of_requests", "half_open", "deaf", "clock_set"]
SCENARIO = "trajectory: {motion: desk}\n"


def say(text):
    print(f"soak: {text}", file=sys.stderr, flush=True)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Board:
    """The flashable image on a pseudo terminal."""

    def __init__(self, program, folder):
        self.program, self.port = program, folder / "board"
        self.process = None
        if program:
            self.start()

    def start(self):
        command = [self.program, "--quiet", "--port", self.port, "--cell", "0=sine:1:0.3"]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + 20
        while not self.port.exists() and time.monotonic() < deadline:
            time.sleep(0.05)

    def stop(self):
        if self.process:
            self.process.kill()
            self.process.wait()


class Instrument:
    """One life of the program, with whoever reads it."""

    def __init__(self, soak):
        self.soak = soak
        self.port = free_port()
        command = [soak.program, "run", "--source", f"sim:{soak.folder / 'desk.yaml'}", "--profile", "cad", "--profile", "game",
                   "--output", "jsonl:-", "--output", f"spnav:{soak.spnav}", "--output", f"web:127.0.0.1:{self.port}",
                   "--recordings", soak.folder / "recordings"]
        if soak.board.process:
            command += ["--board", soak.board.port]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=soak.environment)
        self.started = time.monotonic()
        self.lines = Lines(self.process.stdout)
        self.memory = []  # (s, kB, whether a crowd was there)
        self.descriptors = 0
        threading.Thread(target=self._said, daemon=True).start()
        self.page = None
        self.recording = None

    def _said(self):
        for line in self.process.stderr:
            self.soak.messages[line.removeprefix("tagwrench: ").strip()] += 1

    def ready(self, patience=60):
        deadline = time.monotonic() + patience
        while time.monotonic() < deadline and self.process.poll() is None:
            if self.lines.statuses.get("ok", 0) > 5:
                return True
            time.sleep(0.1)
        return False

    def measure(self):
        try:
            status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
            self.descriptors = max(self.descriptors, len(os.listdir(f"/proc/{self.process.pid}/fd")))
        except OSError:
            return
        kb = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS"))
        self.memory.append((time.monotonic() - self.started, kb, bool(self.soak.crowd)))

    def record(self):
        """Begins a recording from a page, and ends the one before."""
        try:
            self.page = self.page or Page(self.port)
            if self.recording:
                self.page.ask("record_stop")
                self.soak.check_recording(self.recording, "closed")
            self.soak.names += 1
            self.recording = f"soak-{self.soak.names}"
            answer = self.page.ask("record_start", name=self.recording, keep="region")
            if not answer or not answer["ok"]:
                why = answer["text"].split(": ", 1)[-1] if answer else "no answer"  # without the file's name
                self.soak.notes[f"record_start: {why}"] += 1
                self.recording = None
        except OSError:
            self.page = self.recording = None

    def growth(self):
        """kB an hour by least squares, after a quarter of an hour and while no crowd is there; None: too short a life to tell."""
        points = [(t, kb) for t, kb, crowd in self.memory if t > WARM_S and not crowd]
        if len(points) < 20 or points[-1][0] - points[0][0] < LONG_S:
            return None
        t_mean = sum(t for t, _ in points) / len(points)
        kb_mean = sum(kb for _, kb in points) / len(points)
        over = sum((t - t_mean) ** 2 for t, _ in points)
        return 3600 * sum((t - t_mean) * (kb - kb_mean) for t, kb in points) / over


class Soak:
    def __init__(self, options):
        self.program, self.random = options.program, random.Random(options.seed)
        self.kinds, self.every_s = options.only.split(",") if options.only else FAULTS, options.every
        self.folder = pathlib.Path(options.out)
        shutil.rmtree(self.folder, ignore_errors=True)
        (self.folder / "recordings").mkdir(parents=True)
        (self.folder / "desk.yaml").write_text(SCENARIO)
        (self.folder / "runtime").mkdir(mode=0o700)
        self.spnav = self.folder / "spnav.sock"
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(self.folder / "runtime"), "XDG_CONFIG_HOME": str(self.folder)}
        self.clock = self.folder / "clock"
        self.clock.write_bytes(bytes(8))
        library = self.folder / "time_of_day.so"
        subprocess.run(["cc", "-shared", "-fPIC", "-O2", "-o", library, pathlib.Path(__file__).with_name("time_of_day.c")], check=True)
        self.environment |= {"LD_PRELOAD": str(library.resolve()), "TIME_OF_DAY_FILE": str(self.clock.resolve())}
        self.board = Board(options.board, self.folder)
        self.messages, self.notes, self.faults = collections.Counter(), collections.Counter(), collections.Counter()
        self.rest_ms = {"kill -9": [], "SIGSTOP": []}
        self.lives, self.bad = [], []
        self.names = self.recordings = self.readable = self.cad_closed = 0
        self.cad = None
        self.crowd = []    # (until, who)
        self.history = []  # (ns, fault)

    # ---- Faults; each leaves the instrument running

    def killed(self):
        moving = self.cad.wait_moving(20)
        at = monotonic_ns()
        self.life.process.send_signal(signal.SIGKILL)
        self.life.process.wait()
        self._came_to_rest("kill -9", at, moving)
        if self.life.recording:
            self.check_recording(self.life.recording, "killed")
        self.begin()

    def stopped(self):
        moving = self.cad.wait_moving(20)
        at = monotonic_ns()
        self.life.process.send_signal(signal.SIGSTOP)
        self._came_to_rest("SIGSTOP", at, moving)
        time.sleep(1)
        self.life.process.send_signal(signal.SIGCONT)

    def _came_to_rest(self, what, at, moving):
        if not moving:
            self.notes[f"{what}: nothing moved within 20 s, so rest proves nothing"] += 1
            return
        rest = self.cad.wait_zero(at, 5)
        if rest is None:
            self.bad.append(f"{what}: a CAD program was left moving")
        else:
            self.rest_ms[what].append(rest)

    def without_board(self):
        if not self.board.process:
            return
        self.board.stop()
        time.sleep(self.random.uniform(1, 5))
        self.board.start()

    def no_room(self):
        """Files of the program may not grow for a while, as on a full disk."""
        everything = resource.prlimit(self.life.process.pid, resource.RLIMIT_FSIZE)
        resource.prlimit(self.life.process.pid, resource.RLIMIT_FSIZE, (1, everything[1]))
        self.life.record()
        time.sleep(self.random.uniform(1, 4))
        resource.prlimit(self.life.process.pid, resource.RLIMIT_FSIZE, everything)

    def clock_set(self):
        """The time of day jumps by hours, forward or back, as at a first contact with a time server."""
        with open(self.clock, "r+b") as file:
            file.write(struct.pack("q", self.random.randrange(-86400, 86400)))

    def flood_of_requests(self):
        try:
            pages = [Page(self.life.port) for _ in range(8)]
            for _ in range(200):
                for page in pages:
                    page.post("try", name="cad", text="translation: 1\n" + "# slider\n" * 200)
        except OSError:
            pass  # closed for it, as they should be

    def half_open(self):
        for _ in range(100):
            try:
                half = socket.create_connection(("127.0.0.1", self.life.port), 5)
                half.sendall(b"GET / HTTP/1.1\r\nHost:")
                self._join(half)
            except OSError:
                break
        try:
            with socket.create_connection(("127.0.0.1", self.life.port), 5) as one:
                one.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                if not one.recv(64).startswith(b"HTTP/1.1 200"):
                    self.bad.append("a hundred half-open connections starved one that was whole")
        except OSError as error:
            self.bad.append(f"a hundred half-open connections starved one that was whole: {error}")

    def _join(self, one):
        self.crowd.append((time.monotonic() + CROWD_S, one))

    def _let_go(self, all_of_them=False):
        now = time.monotonic()
        for until, one in self.crowd:
            if all_of_them or now > until:
                one.close()
        self.crowd = [] if all_of_them else [(until, one) for until, one in self.crowd if now <= until]

    def deaf(self):
        for make in (lambda: Page(self.life.port, reads=False), lambda: CadProgram(str(self.spnav), reads=False)):
            try:
                self._join(make())
            except OSError:
                self.notes["one that does not read was not let in"] += 1

    # ---- The course of it

    def begin(self):
        if self.lives:
            self._end_account()
        self.life = Instrument(self)
        self.lives.append(self.life)
        if not self.life.ready():
            self.bad.append(f"it did not come up; the last words: {list(self.messages)[-1:]}")
        if self.cad is None or self.cad.closed:
            self.cad = CadProgram(str(self.spnav))
        self.life.record()

    def _end_account(self):
        self.life.lines.join(10)
        self._let_go(all_of_them=True)

    def run(self, hours):
        half = time.monotonic() + 1800 * hours
        end = half + 1800 * hours
        self.begin()
        fault_at = time.monotonic() + 10
        record_at = told_at = time.monotonic() + 60
        while time.monotonic() < end:
            time.sleep(1)
            self._let_go()
            self.life.measure()
            if self.life.process.poll() is not None:
                self.bad.append(f"it ended by itself with status {self.life.process.returncode}")
                self.begin()
            if monotonic_ns() - self.life.lines.last_ns > 5e9:
                self.bad.append("no sample for five seconds")
                self.life.lines.last_ns = monotonic_ns()
            if self.cad.closed:
                self.cad_closed += 1
                self.cad = CadProgram(str(self.spnav))
            if time.monotonic() > record_at:
                self.life.record()
                record_at = time.monotonic() + self.random.uniform(20, 90)
            # In the second half nobody kills it, so that it shows whether it grows.
            kinds = [kind for kind in self.kinds if kind != "killed" or time.monotonic() < half]
            if kinds and time.monotonic() > fault_at:
                name = self.random.choice(kinds).replace("_", " ")
                self.faults[name] += 1
                self.history.append((monotonic_ns(), name))
                getattr(self, name.replace(" ", "_"))()
                fault_at = time.monotonic() + self.random.expovariate(1 / self.every_s)
            if time.monotonic() > told_at:
                say(f"{(end - time.monotonic()) / 60:.0f} min to go, {sum(self.faults.values())} faults, {len(self.bad)} bad")
                told_at += 300
        self.finish()

    def finish(self):
        if self.life.recording and self.life.page:
            self.life.page.ask("record_stop")
            self.check_recording(self.life.recording, "closed")
        self.life.process.send_signal(signal.SIGINT)
        try:
            status = self.life.process.wait(20)
        except subprocess.TimeoutExpired:
            status = "none: it did not end"
            self.life.process.kill()
        if status != 0:
            self.bad.append(f"Ctrl-C ended it with status {status}")
        self._end_account()
        self.board.stop()
        subprocess.run(["pkill", "-f", f"tagwrench spnav --socket {self.spnav}"], check=False)

    def check_recording(self, name, how):
        """Whether it can be read; then it goes, or hours would fill the disk."""
        file = self.folder / "recordings" / f"{name}.twr"
        if not file.exists():
            return  # there was no room for its head
        self.recordings += 1
        done = subprocess.run([self.program, "export", file, "--csv", "-"], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            self.bad.append(f"recording {name}, {how}, cannot be read: {done.stderr.strip()}")
            return
        self.readable += 1
        for part in ("", "-wal", "-shm"):
            pathlib.Path(f"{file}{part}").unlink(missing_ok=True)

    def _before(self, at_ns):
        past = [(at_ns - began_ns, name) for began_ns, name in self.history if began_ns <= at_ns]
        return f"{past[-1][0] / 1e9:.1f} s after: {past[-1][1]}" if past else "before any fault"

    def report(self, hours, seed):
        latencies = sorted(value for life in self.lives for value in life.lines.latencies_us)
        samples = sum(life.lines.samples for life in self.lives)
        dropped = sum(life.lines.dropped for life in self.lives)
        gaps = [gap for life in self.lives for gap in life.lines.gaps]
        missing = sum(after - before - 1 - said for _, before, after, said in gaps)
        growth = [g for g in (life.growth() for life in self.lives) if g is not None]

        def at(share, values):
            return values[min(len(values) - 1, int(share * len(values)))] if values else float("nan")

        def rest(what):
            values = sorted(self.rest_ms[what])
            return f"{at(0.5, values):.0f} {values[-1]:.0f} of {len(values)}" if values else "never"
        for at_ns, before, after, said in gaps:
            self.bad.append(f"between samples {before} and {after} {said} are said to be lost ({self._before(at_ns)})")
        if growth and max(growth) > GROWTH_KB_PER_H:
            self.bad.append(f"memory grew by {max(growth):.0f} kB an hour")
        late = [r for values in self.rest_ms.values() for r in values if r > REST_MS]
        if late:
            self.bad.append(f"{len(late)} times rest took more than {REST_MS} ms")
        rows = [
            ("hours, seed", f"{hours:g}, {seed}"),
            ("lives of the program", len(self.lives)),
            ("faults", ", ".join(f"{name} {count}" for name, count in sorted(self.faults.items())) or "none"),
            ("the board", "emulated" if self.board.process else "not there"),
            ("samples; lost and said; lost without a word", f"{samples}; {dropped}; {missing}"),
            ("picture to line, ms: median, p99, most", " ".join(f"{at(s, latencies) / 1e3:.1f}" for s in (0.5, 0.99, 1))),
            ("kill -9 to rest in a CAD program, ms: median, most", rest("kill -9")),
            ("SIGSTOP to rest in a CAD program, ms: median, most", rest("SIGSTOP")),
            ("memory, MB: most; growth of lives of 45 min and more, kB/h", f"{max((kb for life in self.lives for _, kb, _ in life.memory), default=0) / 1024:.0f}; "
             + (f"{sum(growth) / len(growth):.0f} (most {max(growth):.0f}, of {len(growth)})" if growth else "none lived so long")),
            ("descriptors, most", max(life.descriptors for life in self.lives)),
            ("recordings that can be read", f"{self.readable} of {self.recordings}"),
            ("CAD program cut off", self.cad_closed),
        ]
        lines = ["| what | measured |", "|---|---|"] + [f"| {what} | {value} |" for what, value in rows]
        lines += ["", "What was bad:" if self.bad else "Nothing was bad."] + [f"- {line}" for line in self.bad]
        if self.notes:
            lines += ["", "Beside that:"] + [f"- {line} ({count})" for line, count in self.notes.most_common()]
        return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True)
    parser.add_argument("--board", help="the emulated board's program")
    parser.add_argument("--out", required=True, help="a folder, which is emptied first")
    parser.add_argument("--hours", type=float, required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", help=f"these faults: of {', '.join(FAULTS)}")
    parser.add_argument("--every", type=float, default=25, help="seconds from one to the next, about")
    options = parser.parse_args()
    # Started in the background of a shell, we have Ctrl-C ignored, which children would inherit.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    soak = Soak(options)
    soak.run(options.hours)
    report = soak.report(options.hours, options.seed)
    (soak.folder / "report.md").write_text(report)
    (soak.folder / "said.json").write_text(json.dumps(soak.messages.most_common(), indent=1))
    (soak.folder / "memory.json").write_text(json.dumps([life.memory for life in soak.lives]))
    print(report)
    return 1 if soak.bad else 0


if __name__ == "__main__":
    sys.exit(main())
