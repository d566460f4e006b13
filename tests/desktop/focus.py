"""The profile follows the window that has the focus, as the unmodified sway, i3 and KWin tell it.

sway and KWin run without a screen, i3 on an X server of its own; it is asked by its own socket, and by X11. The windows in
KWin are Xwayland's.
"""
import argparse
import json
import os
import shutil
import subprocess

import desktop
from desktop import check, wait_until

PACKAGES = {"sway": "sway foot", "i3": "i3-wm xterm xvfb", "kwin": "kwin-wayland dbus xterm xdotool"}
PROGRAMS = {"sway": ["sway", "swaymsg", "foot"], "i3": ["i3", "i3-msg", "xterm", "Xvfb"],
            "kwin": ["kwin_wayland", "Xwayland", "dbus-daemon", "xterm", "xdotool"]}


def need(kind):
    missing = [program for program in PROGRAMS[kind] if not shutil.which(program)]
    if missing:
        desktop.skip(f"not installed: {' '.join(missing)} (Debian: {PACKAGES[kind]})")


def as_somebody(desk):
    """sway does not run as root."""
    if os.geteuid() != 0:
        return []
    subprocess.run(["chown", "-R", "nobody:nogroup", desk.run, desk.out + "/home"], check=True)
    return ["setpriv", "--reuid", "nobody", "--regid", "nogroup", "--clear-groups"]


class Sway:
    def __init__(self, desk):
        self.desk = desk
        self.user = as_somebody(desk)
        environment = desk.environment
        environment.update(XDG_RUNTIME_DIR=desk.run, WLR_BACKENDS="headless", WLR_LIBINPUT_NO_DEVICES="1", WLR_RENDERER="pixman")
        for name in ("DISPLAY", "WAYLAND_DISPLAY", "I3SOCK"):
            environment.pop(name, None)
        empty = desk.run + "/config"
        with open(empty, "w", encoding="ascii"):
            pass
        desk.start(*self.user, "sway", "-c", empty, log="sway")
        environment["SWAYSOCK"] = wait_until(lambda: self.named("sway-ipc."), "sway's socket")
        environment["WAYLAND_DISPLAY"] = wait_until(lambda: self.named("wayland-"), "sway's display")

    def named(self, start):
        names = [name for name in os.listdir(self.desk.run) if name.startswith(start) and not name.endswith(".lock")]
        return names and f"{self.desk.run}/{names[0]}"

    def window(self, program):
        self.desk.start(*self.user, "foot", "--app-id", program, "sleep", "1000", log="foot-" + program)

    def tell(self, *arguments):
        return subprocess.run(["swaymsg", "-r", *arguments], env=self.desk.environment, capture_output=True, text=True,
                              check=False).stdout

    def has_window(self, program):
        return f'"app_id": {json.dumps(program)}' in self.tell("-t", "get_tree")

    def focus(self, program):
        self.tell(f'[app_id="^{program}$"] focus')


class I3:
    def __init__(self, desk):
        self.desk = desk
        environment = desk.environment
        for name in ("SWAYSOCK", "WAYLAND_DISPLAY", "I3SOCK"):
            environment.pop(name, None)
        environment["XDG_RUNTIME_DIR"] = desk.run
        desk.screen()
        config = desk.run + "/config"
        with open(config, "w", encoding="ascii") as file:
            file.write("# i3 config file (v4)\n")
        desk.start("i3", "-c", config, log="i3")

        def socket():
            found = subprocess.run(["i3", "--get-socketpath"], env=environment, capture_output=True, text=True,
                                   check=False).stdout.strip()
            return found and os.path.exists(found) and found
        environment["I3SOCK"] = wait_until(socket, "i3's socket")

    def window(self, program):
        self.desk.start("xterm", "-class", program, "-e", "sleep", "1000", log="xterm-" + program)

    def tell(self, *arguments):
        return subprocess.run(["i3-msg", "-r", *arguments], env=self.desk.environment, capture_output=True, text=True,
                              check=False).stdout

    def has_window(self, program):
        return f'"class":{json.dumps(program)}' in self.tell("-t", "get_tree")

    def focus(self, program):
        self.tell(f'[class="^{program}$"] focus')


class Kwin:
    def __init__(self, desk):
        self.desk = desk
        environment = desk.environment
        for name in ("SWAYSOCK", "I3SOCK", "DISPLAY"):
            environment.pop(name, None)
        environment.update(XDG_RUNTIME_DIR=desk.run, KWIN_COMPOSE="Q",
                           DBUS_SESSION_BUS_ADDRESS=f"unix:path={desk.run}/bus")
        desk.start("dbus-daemon", "--session", "--nofork", "--address", environment["DBUS_SESSION_BUS_ADDRESS"], log="dbus")
        wait_until(lambda: os.path.exists(desk.run + "/bus"), "the session's D-Bus")
        # A copy has no capabilities, which containers do not give.
        shutil.copy(shutil.which("kwin_wayland"), desk.run + "/kwin_wayland")
        child = desk.run + "/child"
        with open(child, "w", encoding="ascii") as file:
            file.write(f'#!/bin/sh\necho "$DISPLAY" > {desk.run}/told && mv {desk.run}/told {desk.run}/display\n'
                       "exec tail -f /dev/null\n")
        os.chmod(child, 0o755)
        desk.start(desk.run + "/kwin_wayland", "--virtual", "--no-lockscreen", "--no-global-shortcuts", "--xwayland", "--socket",
                   "kwin", child, log="kwin")
        wait_until(lambda: os.path.exists(desk.run + "/display"), "KWin's X server")
        with open(desk.run + "/display", encoding="ascii") as file:
            self.display = file.read().strip()  # of the windows; who asks KWin has none
        environment["WAYLAND_DISPLAY"] = "kwin"

    def window(self, program):
        self.desk.start("xterm", "-display", self.display, "-class", program, "-e", "sleep", "1000", log="xterm-" + program)

    def tell(self, *arguments):
        return subprocess.run(["xdotool", *arguments], env={**self.desk.environment, "DISPLAY": self.display},
                              capture_output=True, text=True, check=False).stdout

    def has_window(self, program):
        return bool(self.tell("search", "--onlyvisible", "--class", f"^{program}$").split())

    def focus(self, program):
        self.tell("search", "--onlyvisible", "--class", f"^{program}$", "windowactivate")


DESKTOPS = {"sway": Sway, "i3": I3, "kwin": Kwin}


def follow(desk, kind, windows, programs):
    """`programs`: windows, and how they are told."""
    told = f"{desk.out}/bridge-{kind}.log"

    def heard(line):
        with open(told, encoding="utf-8") as file:
            return line in file.read()
    (cad, cad_told), (game, game_told) = programs
    windows.focus(game)
    bridge = desk.start(desk.tagwrench, "run", "--source", "sim", "--output", "jsonl:/dev/null", "--profile", "research",
                        "--profile", "cad", "--profile", "game", log="bridge-" + kind)
    wait_until(lambda: heard(f"profile: game ({game_told})"), "the window that has the focus at the start")
    windows.focus(cad)
    wait_until(lambda: heard(f"profile: cad ({cad_told})"), "the other window")
    windows.window("mail")
    wait_until(lambda: heard("profile: research (mail)"), "a new window that no profile is for")
    desktop.end(bridge, desktop.PATIENCE)
    check(f"{kind}: the profile follows the focus", bridge.returncode == 0, f"exit {bridge.returncode}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--tagwrench", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--desktop", choices=DESKTOPS, required=True)
    arguments = parser.parse_args()
    need(arguments.desktop)
    with desktop.Desk(arguments.tagwrench, arguments.out) as desk:
        windows = DESKTOPS[arguments.desktop](desk)
        programs = [("org.freecad.FreeCAD", "org.freecad.freecad"), ("RetroArch", "retroarch")]
        for program, _ in programs:
            windows.window(program)
        for program, _ in programs:
            wait_until(lambda wanted=program: windows.has_window(wanted), f"the window of {program}")
        follow(desk, arguments.desktop, windows, programs)
        if arguments.desktop == "i3":
            del desk.environment["I3SOCK"]
            follow(desk, "x11", windows, programs)
    desktop.finish()


main()
