#!/usr/bin/env python3
"""Everything that is needed to build a sensor, in one folder: parts to print, tag sheet, drawings, pictures, table.

    hardware/export.py [VARIANT | FILE.yaml] [FOLDER]       (./run hardware builds the program first)

VARIANT is a file of hardware/sensors, by default `paper`; FOLDER is build/hardware/VARIANT by default. A folder that an
earlier export wrote is replaced, any other is left alone; it appears complete, or not at all. What cannot be built is
refused before anything is written, in the words of `tagwrench design --check`.

In the folder: NAME.stl, each as it lies on the printer's bed; tags.pdf; *.png and *.svg; bom.csv, what to buy; sensor.yaml
and scenario.yaml for the program; parameters.scad for OpenSCAD (OPENSCADPATH=FOLDER openscad hardware/scad/sensor.scad);
parts.csv and contents.txt, the table.

Exit status: 0 done; 1 something failed, or a tool is missing; 2 wrong usage, or a sensor that cannot be built.
"""
import argparse
import concurrent.futures
import contextlib
import csv
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile

HARDWARE = pathlib.Path(__file__).resolve().parent
ROOT = HARDWARE.parent
SCAD = HARDWARE / "scad" / "sensor.scad"
PROFILE = HARDWARE / "print" / "pla_0.2.ini"
PACKAGES = {"openscad": "openscad", "prusa-slicer": "prusa-slicer", "Xvfb": "xvfb"}
PICTURE = ["--imgsize=1200,900", "--projection=o", "--autocenter", "--viewall", "--colorscheme=Tomorrow"]
VIEWS = {  # and the angles from which they are seen
    "assembly": (68, 0, 40), "exploded": (68, 0, 40), "section": (76, 0, 18),
    **{f"step_{number}": (62, 0, 35) for number in range(1, 9)},
    "step_6": (20, 0, 12),  # into the hood
}
NEEDS = {"step_8": "puck_base"}  # views of some variants only
JOBS = 2
COLUMNS = ["part", "x_mm", "y_mm", "z_mm", "facets", "volume_mm3", "print_s", "filament_g"]


class Stop(Exception):
    """What the user is told, a complaint a line, and the exit status."""

    def __init__(self, line, status=1):
        super().__init__(line)
        self.status = status


class Tools:
    """Runs programs, and ends those that still run when the export ends."""

    def __init__(self):
        self.running = set()
        self.stopped = False

    def run(self, what, *command, env=None):
        """Standard output of a program that must succeed; `what` it makes is named where it does not."""
        process = subprocess.Popen([str(word) for word in command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True, errors="replace", env={**os.environ, **(env or {})})
        self.running.add(process)
        if self.stopped:
            process.kill()
        out, err = process.communicate()
        self.running.discard(process)
        if process.returncode != 0:
            lines = [line for line in (err + out).splitlines() if line.strip()]
            says = next((line for line in lines if re.search("error|warning", line, re.I)), lines[-1] if lines else "it says nothing")
            raise Stop(f"{what}: {pathlib.Path(command[0]).name} fails ({process.returncode}): {says.strip()}")
        return out

    def stop(self):
        self.stopped = True
        for process in list(self.running):
            process.kill()


@contextlib.contextmanager
def screen():
    """A display that nobody sees: OpenSCAD draws pictures only on one. Yields its environment."""
    read, write = os.pipe()
    server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x1024x24", "-noreset", "-nolisten", "tcp"],
                              pass_fds=[write], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(write)
    try:
        with os.fdopen(read) as number:
            display = number.readline().strip()
        if not display:
            raise Stop("Xvfb does not start: no pictures can be drawn; leave them out with --no-pictures")
        yield {"DISPLAY": f":{display}", "LIBGL_ALWAYS_SOFTWARE": "1"}
    finally:
        server.kill()
        server.wait()


class Export:
    def __init__(self, program, sensor, folder, scratch, tools):
        self.program, self.sensor, self.folder, self.scratch, self.tools = program, sensor, folder, scratch, tools

    def openscad(self, out, part, *options, env=None):
        """Warnings are errors: OpenSCAD writes a part even where a number is missing."""
        self.tools.run(part, "openscad", "--hardwarnings", "-o", out, "-D", f'part="{part}"', *options, SCAD,
                       env={"OPENSCADPATH": str(self.folder), **(env or {})})

    def part(self, name):
        """Draws it as printed, slices it, and returns its line of the table."""
        stl = self.folder / f"{name}.stl"
        self.openscad(stl, name, "-D", "print=true", "--export-format", "binstl")
        said = self.tools.run(name, "prusa-slicer", "--loglevel", "1", "--datadir", self.scratch, "--info", stl)
        info = dict(re.findall(r"^(\w+) = +(\S+)$", said, re.M))
        if info["manifold"] != "yes" or info["number_of_parts"] != "1":
            raise Stop(f"{name}: not one solid (manifold {info['manifold']}, {info['number_of_parts']} parts): "
                       "the drawing is wrong for these parameters")
        gcode = self.scratch / f"{name}.gcode"
        self.tools.run(name, "prusa-slicer", "--loglevel", "1", "--datadir", self.scratch, "--load", PROFILE,
                       "--export-gcode", "-o", gcode, stl)
        text = gcode.read_text()
        gcode.unlink()
        days, hours, minutes, seconds = (int(n or 0) for n in re.search(
            r"; estimated printing time \(normal mode\) = (?:(\d+)d )?(?:(\d+)h )?(?:(\d+)m )?(?:(\d+)s)?", text).groups())
        grams = re.search(r"; total filament used \[g\] = ([\d.]+)", text).group(1)
        return [name, *(f"{float(info['size_' + axis]):.2f}" for axis in "xyz"), info["number_of_facets"],
                f"{float(info['volume']):.1f}", 86400 * days + 3600 * hours + 60 * minutes + seconds, grams]

    def picture(self, view, angles, display):
        camera = "--camera=0,0,0," + ",".join(str(angle) for angle in angles) + ",100"
        self.openscad(self.folder / f"{view}.png", view, camera, *PICTURE, env=display)

    def tags(self):
        self.tools.run("tags.pdf", self.program, "tags", "--sensor", self.folder / "sensor.yaml", "--out", self.folder / "tags.pdf")

    def wiring(self):
        self.tools.run("wiring", sys.executable, "-B", HARDWARE / "wiring" / "draw.py", self.folder)


def tagwrench(program, *arguments):
    """The program's own words are the message."""
    done = subprocess.run([program, *map(str, arguments)], stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode != 0:
        says = (done.stdout + done.stderr).replace("tagwrench: ", "").strip()
        raise Stop(says or f"{program} {arguments[0]}: exit status {done.returncode}", done.returncode)


def bill(variant):
    """The rows of the bill of materials for this variant, and what they cost at least and at most, in dollars."""
    with open(HARDWARE / "bom.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if {variant, "all"} & set(row["variant"].split())]
    totals = [sum(float(row["quantity"]) * float(row[f"price_{end}_usd"]) for row in rows) for end in ("low", "high")]
    return rows, totals


def duration(seconds):
    return f"{seconds // 3600} h {seconds % 3600 // 60:02d} min"


def table(parts, costs):
    lines = [f"{'part':18} {'size, mm':>20} {'facets':>7} {'volume, cm3':>11} {'print time':>11} {'filament, g':>11}"]
    for name, x, y, z, facets, volume, seconds, grams in parts:
        size = " x ".join(f"{float(edge):.1f}" for edge in (x, y, z))
        lines.append(f"{name:18} {size:>20} {facets:>7} {float(volume) / 1e3:11.2f} {duration(seconds):>11} {float(grams):11.1f}")
    lines.append(f"{'all':18} {'':20} {'':7} {sum(float(p[5]) for p in parts) / 1e3:11.2f} "
                 f"{duration(sum(p[6] for p in parts)):>11} {sum(float(p[7]) for p in parts):11.1f}")
    if costs:
        lines.append(f"what to buy, filament included: {costs[0]:.0f} to {costs[1]:.0f} US dollars (bom.csv)")
    return "\n".join(lines) + "\n"


def write_csv(path, header, rows):
    with open(path, "w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([header, *rows])


def export(options, sensor, folder, scratch, tools):
    """Fills `folder`; returns the table."""
    tagwrench(options.program, "design", "--hardware", sensor, "--export", folder)
    job = Export(options.program, sensor, folder, scratch, tools)
    text = (folder / "parameters.scad").read_text()
    variant = json.loads(re.search(r"^name = (.*);$", text, re.M).group(1))
    names = json.loads(re.search(r"^parts = (.*);$", text, re.M).group(1))
    views = {view: angles for view, angles in VIEWS.items() if view not in NEEDS or NEEDS[view] in names}
    with contextlib.ExitStack() as stack:
        display = None if options.no_pictures else stack.enter_context(screen())
        pool = stack.enter_context(concurrent.futures.ThreadPoolExecutor(JOBS))
        stack.callback(tools.stop)
        parts = [pool.submit(job.part, name) for name in names]
        others = [pool.submit(job.tags), pool.submit(job.wiring)]
        if display:
            others += [pool.submit(job.picture, name, angles, display) for name, angles in views.items()]
        for done in concurrent.futures.as_completed(parts + others):
            if done.exception():
                pool.shutdown(wait=False, cancel_futures=True)
                raise done.exception()
    lines = [done.result() for done in parts]
    write_csv(folder / "parts.csv", COLUMNS, lines)
    rows, costs = bill(variant)
    if rows:
        write_csv(folder / "bom.csv", list(rows[0]), [list(row.values()) for row in rows])
    listing = table(lines, costs if rows else None)
    (folder / "contents.txt").write_text(listing)
    return listing


def ours(folder):
    return (folder / "parts.csv").is_file() and (folder / "parameters.scad").is_file()


def replace(new, folder):
    old = new.with_name(new.name + "-old")
    if folder.exists():
        folder.rename(old)
    new.rename(folder)
    shutil.rmtree(old, ignore_errors=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sensor", nargs="?", default="paper", metavar="VARIANT|FILE")
    parser.add_argument("folder", nargs="?", type=pathlib.Path, metavar="FOLDER")
    parser.add_argument("--program", default=str(ROOT / "build/host/tagwrench"), help="tagwrench, as built")
    parser.add_argument("--no-pictures", action="store_true", help="leave out what takes longest")
    options = parser.parse_args()
    named = re.fullmatch(r"[\w-]+", options.sensor) is not None
    sensor = HARDWARE / "sensors" / f"{options.sensor}.yaml" if named else pathlib.Path(options.sensor).resolve()
    if named and not sensor.is_file():
        raise Stop(f"no variant '{options.sensor}'; there are {', '.join(sorted(f.stem for f in sensor.parent.glob('*.yaml')))}; "
                   "or give a file: ./my.yaml", 2)
    folder = (options.folder or ROOT / "build/hardware" / sensor.stem).absolute()
    if not shutil.which(options.program):
        raise Stop(f"{options.program} is missing: ./run build, or name it with --program")
    tagwrench(options.program, "design", "--check", sensor)
    if folder.exists() and not (folder.is_dir() and (ours(folder) or not any(folder.iterdir()))):
        raise Stop(f"{folder} is there, and no earlier export: choose another folder, or remove it", 2)
    for tool, package in PACKAGES.items():
        if not shutil.which(tool) and not (options.no_pictures and tool == "Xvfb"):
            raise Stop(f"{tool} is missing: sudo apt install {package}")
    tools = Tools()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f"{folder.name}.partial-", dir=folder.parent) as partial:
            new, scratch = pathlib.Path(partial, "folder"), pathlib.Path(partial, "scratch")
            new.mkdir()
            scratch.mkdir()
            text = export(options, sensor, new, scratch, tools)
            replace(new, folder)
    except OSError as error:
        raise Stop(f"{error.filename or folder}: {error.strerror or error}") from error
    print(text, end="")
    print(f"in {folder}: " + " ".join(sorted(entry.name for entry in folder.iterdir())))


if __name__ == "__main__":
    try:
        main()
    except Stop as stop:
        print("\n".join(f"hardware: {line}" for line in str(stop).splitlines()), file=sys.stderr)
        sys.exit(stop.status)
    except KeyboardInterrupt:
        sys.exit(130)
