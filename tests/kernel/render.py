#!/usr/bin/env python3
"""render.py TAGWRENCH OUT [RIG]: the clips that the kernel tests feed, rendered on the host by `tagwrench sim`.

Small frames and short clips, because the guest may be emulated. All clips show one and the same sensor (same seed).
Clips that are there already and as new as the program stay. Exit status 77 where the rig RIG is not available.
"""
import os
import shutil
import subprocess
import sys

BASE = """seed: 7
camera: {width: 320, height: 240, fx: 402.5, fy: 402.5, cx: 159.5, cy: 119.5, fps: 25}
"""
PGM, JPEG = "compression: {file: pgm}\n", "compression: {jpeg_quality: 90, file: jpeg}\n"
REST = "trajectory: {motion: rest}\n"


def push(axis, hold_s):
    """0.2 s at rest, 0.3 s taking hold, the hold (0: for ever), 0.3 s letting go."""
    return f"trajectory: {{motion: push, axis: {axis}, rest_s: 0.2, hold_s: {hold_s}}}\n"


# name: (frames, scenario)
CLIPS = {
    "rest": (10, BASE + PGM + REST),
    # Ends in the hold: repeating its last frame is a push that does not change by a single bit.
    "held_fz": (16, BASE + PGM + push("fz", 0)),
    "jpeg_rest": (10, BASE + JPEG + REST),
    "jpeg_held_fz": (16, BASE + JPEG + push("fz", 0)),
    **{f"push_{axis}": (45, BASE + PGM + push(axis, 0.6)) for axis in ("fx", "fy", "fz", "mx", "my", "mz")},
}


def main():
    program, out = sys.argv[1:3]
    if len(sys.argv) > 3 and not os.path.exists(f"{sys.argv[3]}/accelerator"):
        print("kernel tests unavailable: the guest is not built")
        sys.exit(77)
    os.makedirs(out, exist_ok=True)
    for name, (frames, scenario) in CLIPS.items():
        file, folder = f"{out}/{name}.yaml", f"{out}/{name}"
        recipe = f"# {frames} frames\n{scenario}"
        if os.path.exists(file) and os.path.getmtime(file) > os.path.getmtime(program):
            with open(file, encoding="utf-8") as there:
                if there.read() == recipe:
                    continue
        shutil.rmtree(folder, ignore_errors=True)
        with open(file + ".new", "w", encoding="utf-8") as new:
            new.write(recipe)
        subprocess.run([program, "sim", "--scenario", file + ".new", "--out", folder, "--frames", str(frames)], check=True)
        os.replace(file + ".new", file)


main()
