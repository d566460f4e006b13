#!/usr/bin/env python3
"""Logs a wrench sensor and a person's key presses on one clock, for experiments.

    ./log_events.py FILE.csv [--serial SERIAL] [--seconds S]

Every sample is one row of kind `sample`; every key pressed in this terminal (every line, where standard input is none)
is one row of kind `mark` with its text. Ctrl-C ends the log, Ctrl-D on a terminal too. Columns:

    kind              sample, mark, gone (the sensor was unplugged), back
    host_ns           CLOCK_MONOTONIC of this computer when the sample was read, or the key came
    capture_ns        the same clock when the camera took the picture (of a live sensor on this computer)
    sequence          of the captured frame, modulo 2^31
    lost              frames that the camera lost right before this one
    missing           frames between this row and the sample before it, by their sequence: whatever the reason
    latency_us        host_ns - capture_ns
    fx_n ... mz_nm    N and N m; empty unless status is ok or saturated
    status            ok, acquiring, lost, doubtful, saturated
    mark              text of the mark
"""
import argparse
import csv
import os
import queue
import sys
import termios
import threading
import time
import tty

import read_wrench

COLUMNS = ("kind", "host_ns", "capture_ns", "sequence", "lost", "missing", "latency_us", "fx_n", "fy_n", "fz_n", "mx_nm",
           "my_nm", "mz_nm", "status", "mark")
TURN = 2**31
END_KEY = "\x04"  # Ctrl-D
RETRY_S = 0.2


def read_marks(marks):
    """Puts (time, text) of each key or line into the queue, and None at the key that ends the log. Runs in a thread, so
    that a key has the time it came."""
    terminal = os.isatty(0)
    rest = b""
    while True:
        data = os.read(0, 64 if terminal else 4096)
        now = time.monotonic_ns()
        if terminal:
            text = data.decode(errors="replace")
            if text in ("", END_KEY):
                marks.put(None)
                break
            marks.put((now, text))
            continue
        if not data:
            break  # no more marks; the log goes on
        *lines, rest = (rest + data).split(b"\n")
        for line in lines:
            marks.put((now, line.decode(errors="replace")))


class Log:
    def __init__(self, file):
        self.rows = csv.DictWriter(file, COLUMNS, restval="", lineterminator="\n")
        self.rows.writeheader()
        self.last = None
        self.samples = self.missing = self.marks = 0

    def event(self, kind, now, mark=""):
        self.rows.writerow({"kind": kind, "host_ns": now, "mark": mark})
        self.marks += kind == "mark"
        if kind == "gone":
            self.last = None  # a bridge that starts again counts from zero

    def sample(self, sample, now):
        of_a_frame = sample.capture_time_ns != 0  # the bridge's watchdog sends neutral ones that are not
        step = (sample.sequence - self.last) % TURN if self.last is not None and of_a_frame else 1
        missing = step - 1 if 0 < step < TURN // 2 else 0
        self.last = sample.sequence if of_a_frame else self.last
        self.samples += 1
        self.missing += missing
        values = [f"{value:.6f}" if sample.has_numbers else "" for value in sample.force_n + sample.torque_nm]
        self.rows.writerow(dict(zip(COLUMNS, (
            "sample", now, sample.capture_time_ns, sample.sequence, sample.lost, missing,
            (now - sample.capture_time_ns) // 1000 if of_a_frame else "", *values, sample.status))))


def follow(device, serial, log, marks, end):
    """Until the end, or the key for it. Returns the device that is open then."""
    while time.monotonic() < end:
        while not marks.empty():
            mark = marks.get()
            if mark is None:
                return device
            log.event("mark", *mark)
        if device is None:
            time.sleep(RETRY_S)
            try:
                device = read_wrench.open_sensor(serial)
                log.event("back", time.monotonic_ns())
            except OSError:
                continue
        try:
            sample = next(read_wrench.samples(device, timeout_ms=20))
        except OSError:
            log.event("gone", time.monotonic_ns())
            device.close()
            device = None
            continue
        if sample is not None:
            log.sample(sample, time.monotonic_ns())
    return device


def main():
    parser = argparse.ArgumentParser(description="Logs a wrench sensor and key presses on one clock.")
    parser.add_argument("file", help="CSV file to write")
    parser.add_argument("--serial", help="of the sensor; without it the first one")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="end after so many")
    options = parser.parse_args()
    try:
        serial = read_wrench.find_sensor(options.serial)["serial_number"]  # of two sensors the same one after a replug
        device = read_wrench.open_sensor(serial)
        file = open(options.file, "w", encoding="utf-8", newline="", buffering=1)
    except OSError as error:
        print(error, file=sys.stderr)
        return 2
    before = termios.tcgetattr(0) if os.isatty(0) else None
    marks = queue.SimpleQueue()
    with file:
        log = Log(file)
        try:
            if before is not None:
                tty.setcbreak(0)
            threading.Thread(target=read_marks, args=(marks,), daemon=True).start()
            print("logging; every key is a mark, Ctrl-D ends", file=sys.stderr)
            device = follow(device, serial, log, marks, time.monotonic() + options.seconds)
        except KeyboardInterrupt:
            pass
        finally:
            if before is not None:
                termios.tcsetattr(0, termios.TCSADRAIN, before)
    if device is not None:
        device.close()
    print(f"{log.samples} samples, {log.missing} missing, {log.marks} marks in {options.file}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
