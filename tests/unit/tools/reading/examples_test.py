"""examples_test.py EXAMPLES GOLDEN.json: the Python examples on the golden reports, with another hidapi under them."""
import contextlib
import csv
import io
import json
import os
import subprocess
import sys
import tempfile
import types
import unittest

EXAMPLES, GOLDEN = sys.argv[1:3]
sys.dont_write_bytecode = True


class FakeDevice:
    """Opens what is plugged in; its reports come one by one, then it is gone."""
    reports = []

    def open_path(self, path):
        if path != b"/dev/hidraw7":
            raise OSError("open failed")

    def read(self, _length, timeout_ms=0):
        if not FakeDevice.reports:
            raise OSError("read error")
        return FakeDevice.reports.pop(0)

    def close(self):
        pass


plugged = []
sys.modules["hidraw"] = types.SimpleNamespace(enumerate=lambda vendor, product: plugged, device=FakeDevice)
sys.path.insert(0, EXAMPLES)
import log_events  # noqa: E402
import read_wrench  # noqa: E402

with open(GOLDEN, encoding="utf-8") as golden_file:
    REPORTS = [(entry["what"], bytes.fromhex("".join(value for _, value in entry["bytes"])), entry["sample"])
               for entry in json.load(golden_file)["reports"]]
GOOD = REPORTS[0][1]


def numbered(sequence):
    return list(GOOD[:57] + sequence.to_bytes(4, "little") + GOOD[61:])


def changed(at, *values):
    report = bytearray(GOOD)
    report[at:at + len(values)] = bytes(values)
    return bytes(report)


class Decoder(unittest.TestCase):
    def test_golden_reports(self):
        self.assertGreaterEqual(len(REPORTS), 3)
        for what, report, wanted in REPORTS:
            with self.subTest(what):
                self.assertEqual(read_wrench.decode(list(report))._asdict(), wanted)

    def test_anything_else_is_none(self):
        for report in (b"", GOOD[:63], GOOD + b"\0", changed(0, 1), changed(1, 0, 0, 0, 0x80), changed(25, 0, 0, 0, 0x80),
                       changed(53, 0x40, 0x42, 0x0f), changed(60, 0x80), changed(63, 5)):
            self.assertIsNone(read_wrench.decode(report))

    def test_a_status_without_numbers_has_none(self):
        sample = read_wrench.decode(changed(63, 3))
        self.assertEqual((sample.status, sample.has_numbers, sample.force_n), ("doubtful", False, [0, 0, 0]))


class Programs(unittest.TestCase):
    def setUp(self):
        plugged[:] = [{"path": b"/dev/hidraw7", "serial_number": "bench"}]
        FakeDevice.reports = [numbered(1), [1, 2, 3], [], numbered(2), numbered(5)]

    @staticmethod
    def run_main(main, *arguments):
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = main(*arguments)
        return status, out.getvalue(), err.getvalue()

    def test_reader_prints_newtons(self):
        status, out, err = self.run_main(read_wrench.main, ["bench"])
        lines = [line.split() for line in out.splitlines()]
        self.assertEqual([line[0] for line in lines], ["1", "2", "5"])
        self.assertEqual(lines[0][1:8], ["ok", "0.100000", "-0.250000", "3.000000", "0.001000", "-0.002000", "0.000000"])
        self.assertEqual((status, err), (1, "the sensor is gone: unplugged, or the bridge has ended\n"))

    def test_reader_ends_after_so_many(self):
        status, out, _ = self.run_main(read_wrench.main, ["-", "2"])
        self.assertEqual((status, out.count("\n")), (0, 2))

    def test_reader_says_what_is_there_instead(self):
        status, _, err = self.run_main(read_wrench.main, ["other"])
        self.assertEqual((status, err), (2, "no wrench sensor with serial other; there is: bench\n"))

    def test_log_has_samples_and_counts_what_is_missing(self):
        text = io.StringIO()
        log = log_events.Log(text)
        for report in (numbered(1), numbered(2), list(REPORTS[2][1]), numbered(5)):
            log.sample(read_wrench.decode(report), 7_000_251_500)
        log.event("mark", 8, "x,\"y")
        log.event("gone", 9)
        log.sample(read_wrench.decode(numbered(0)), 7_000_251_500)
        rows = list(csv.DictReader(io.StringIO(text.getvalue())))
        self.assertEqual([row["missing"] for row in rows], ["0", "0", "0", "2", "", "", "0"])
        self.assertEqual([row["kind"] for row in rows], ["sample"] * 4 + ["mark", "gone", "sample"])
        self.assertEqual((rows[0]["latency_us"], rows[0]["fz_n"], rows[0]["lost"]), ("1", "3.000000", "2"))
        self.assertEqual((rows[2]["status"], rows[2]["fx_n"], rows[2]["latency_us"]), ("lost", "", ""))
        self.assertEqual((rows[4]["mark"], rows[4]["host_ns"]), ("x,\"y", "8"))

    def test_logger_says_that_nothing_is_there(self):
        with tempfile.TemporaryDirectory() as folder:
            no_devices = os.path.join(folder, "hidraw.py")
            with open(no_devices, "w", encoding="utf-8") as file:
                file.write("def enumerate(vendor, product):\n    return []\n")
            done = subprocess.run([sys.executable, "-B", f"{EXAMPLES}/log_events.py", f"{folder}/log.csv"], text=True,
                                  capture_output=True, env={**os.environ, "PYTHONPATH": folder}, stdin=subprocess.DEVNULL)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn("no wrench sensor is here", done.stderr)
            self.assertFalse(os.path.exists(f"{folder}/log.csv"))


unittest.main(argv=sys.argv[:1])
