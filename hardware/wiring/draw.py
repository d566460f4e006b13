#!/usr/bin/env python3
"""Draws the wiring. What is connected to what stands in nets.csv, what the parts are in parts.csv, and
here only where they lie on the sheet; a wire that is not in nets.csv, or one of it that is not drawn, is
an error.

    python3 hardware/wiring/draw.py [OUT_DIR]      # writes nano.svg and no_board.svg, by default beside this file

A test draws again and compares with the drawings that are kept here.
"""

import csv
import os
import sys

sys.dont_write_bytecode = True  # beside the sources
import symbols  # noqa: E402

HERE = os.path.dirname(os.path.abspath(__file__))
WIRE_COLOURS = {"E+": "#c00000", "E-": "#111", "A+": "#2e8b2e", "A-": "#999"}


class Mismatch(Exception):
    pass


def rows(name):
    with open(os.path.join(HERE, name), newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


class Circuit:
    """One circuit of the two files, and how much of it has been drawn."""

    def __init__(self, name):
        self.name = name
        self.parts = {r["part"]: r for r in rows("parts.csv") if r["circuit"] == name}
        self.net_of, self.pins_of = {}, {}
        for r in rows("nets.csv"):
            if r["circuit"] != name:
                continue
            if r["part"] not in self.parts:
                raise Mismatch(f"{name}: nets.csv names {r['part']}, which is not in parts.csv")
            self.net_of[(r["part"], r["pin"])] = r["net"]
            self.pins_of.setdefault(r["net"], []).append((r["part"], r["pin"]))
        self.placed, self.joined = {}, {}

    def place(self, sheet, part, *where, **how):
        row = self.parts[part]
        pins = getattr(symbols, row["kind"])(sheet, part, row["value"], *where, **how)
        self.placed.update({(part, pin): at for pin, at in pins.items()})

    def at(self, end):
        return self.placed[tuple(end.split("."))] if isinstance(end, str) else end

    def join(self, ends, through=None):
        """Notes that these pins are drawn as one; `through`: a symbol that is the same everywhere."""
        pins = [tuple(e.split(".")) for e in ends if isinstance(e, str)]
        nets = {self.net_of.get(p) for p in pins}
        if len(nets) != 1 or None in nets:
            raise Mismatch(f"{self.name}: drawn together, but not in nets.csv: {ends}")
        group = set(pins) | ({through} if through else set())
        groups = self.joined.setdefault(nets.pop(), [])
        for other in [g for g in groups if g & group]:
            groups.remove(other)
            group |= other
        groups.append(group)

    def wire(self, sheet, *ends, **style):
        """A line through pins ("R1.2") and points."""
        self.join(ends)
        sheet.line([self.at(e) for e in ends], **style)

    def rail(self, sheet, pin, symbol, *points):
        """From a pin to a supply or ground symbol at the last point."""
        self.join([pin], symbol.__name__)
        path = [self.at(pin), *points]
        if points:
            sheet.line(path)
        symbol(sheet, *path[-1])

    def flag(self, sheet, pin, dx, dy=0, colour="#1f4e79"):
        """A short wire with the names of its other ends."""
        part = pin.split(".")[0]
        others = [p for p in self.pins_of[self.net_of[tuple(pin.split("."))]] if p[0] != part]
        self.join([pin], "flag")
        x, y = self.at(pin)
        sheet.line([(x, y), (x + dx, y + dy)], colour, 2)
        if any(p[0] == "U1" for p in others):
            words = "to " + next(p[1] for p in others if p[0] == "U1")
        elif len(others) > 1:
            words = f"to {others[0][1]} of every HX711"
        else:
            words = f"to {others[0][1]} of {self.parts[others[0][0]]['value']}"
        if dy:
            sheet.text(x + dx, y + dy + 13, words, 12.5, "middle", colour)
        else:
            sheet.text(x + dx + (6 if dx > 0 else -6), y + 4.5, words, 12.5, "start" if dx > 0 else "end", colour)

    def alone(self, sheet, pin, words, dx):
        """A pin that nothing is soldered to, and why it is named."""
        self.join([pin])
        x, y = self.at(pin)
        sheet.text(x + dx, y + 4.5, words, 12.5, "start" if dx > 0 else "end", symbols.GREY)

    def finish(self):
        for net, pins in self.pins_of.items():
            groups = self.joined.get(net, [])
            drawn = set().union(*groups) if groups else set()
            missing = [".".join(p) for p in pins if p not in drawn]
            if missing or len(groups) != 1:
                raise Mismatch(f"{self.name}: net {net} of nets.csv is not drawn as one: {missing or groups}")

    def notes(self, sheet, x, y, width):
        """What parts.csv says of the parts, in lines of about `width` characters."""
        for text in (r["note"] for r in self.parts.values() if r["note"]):
            line = ""
            for word in text.replace(" - ", " − ").split():
                if len(line) + len(word) > width:
                    sheet.text(x, y, line, 12.5)
                    line, y = "", y + 17
                line += word + " "
            sheet.text(x, y, line, 12.5)
            y += 22
        return y


def draw_nano():
    s = symbols.Sheet(1280, 1010)
    c = Circuit("nano")
    s.text(40, 42, "Arduino Nano: light, buttons, load cells", 20, bold=True)
    for i in range(4):
        top = 92 + 158 * i
        c.place(s, f"M{i}", 170, top)
        c.place(s, f"W{i}", 100, top)
        for pin, colour in WIRE_COLOURS.items():
            c.wire(s, f"W{i}.{pin}", f"M{i}.{pin}", colour=colour, width=2)
        c.rail(s, f"M{i}.GND", symbols.ground, (395, top + 32))
        c.flag(s, f"M{i}.DT", 16)
        c.flag(s, f"M{i}.SCK", 16)
        c.rail(s, f"M{i}.VCC", symbols.supply, (395, top + 98), (395, top + 94))
        c.flag(s, f"M{i}.RATE", 0, 8)

    c.place(s, "U1", 590, 150)
    for i in range(4):
        c.flag(s, f"U1.A{i}", -16)
        c.flag(s, f"U1.D{4 + i}", 16)
    c.flag(s, "U1.D2", 16)
    c.alone(s, "U1.D13", "the lamp on it", -14)
    c.alone(s, "U1.D0", "leave D0 and D1 open: the USB chip talks on them", 14)
    c.alone(s, "U1.D1", "", 14)
    for part, pin in (("X1", "A4"), ("X2", "A5")):
        y = c.at(f"U1.{pin}")[1]
        c.place(s, part, 540, y)
        c.wire(s, f"{part}.1", f"U1.{pin}")
    c.rail(s, "U1.5V", symbols.supply, (530, c.at("U1.5V")[1]), (530, c.at("U1.5V")[1] - 4))
    c.rail(s, "U1.GND", symbols.ground, (830, c.at("U1.GND")[1]))

    for part, pin in (("S2", "D12"), ("S1", "D8")):
        x, y = c.at(f"U1.{pin}")
        c.place(s, part, x + 30, y)
        c.wire(s, f"U1.{pin}", f"{part}.1")
        c.rail(s, f"{part}.2", symbols.ground, (x + 150, y))

    y9, y3 = c.at("U1.D9")[1], c.at("U1.D3")[1]
    c.place(s, "R1", 870, y9)
    c.place(s, "R2", 870, y3)
    c.wire(s, "U1.D9", "R1.1")
    c.wire(s, "U1.D3", "R2.1")
    gate = y9 + 120
    c.place(s, "Q1", 1060, gate)
    c.wire(s, "R1.2", (970, y9), (970, y3), "R2.2")
    s.line([(970, gate), c.at("Q1.G")])
    c.join(["R1.2", "Q1.G"])
    s.dot(970, gate)
    c.place(s, "R3", 1020, gate + 24, upright=True)
    s.line([c.at("R3.1"), (1020, gate)])
    c.join(["R3.1", "Q1.G"])
    s.dot(1020, gate)
    c.rail(s, "R3.2", symbols.ground)
    c.rail(s, "Q1.S", symbols.ground)
    c.place(s, "L1", 1118, 184)
    c.wire(s, "L1.K", "Q1.D")
    c.place(s, "R4", 1118, 92, upright=True)
    c.wire(s, "R4.2", "L1.A")
    c.rail(s, "R4.1", symbols.supply)
    s.line([(990, 160), (1190, 160), (1190, 252), (990, 252), (990, 160)], symbols.GREY, 1.2, "5,4")
    s.text(996, 246, "in the sensor", 12, colour=symbols.GREY)
    outlines(s, 1000, 540)
    c.notes(s, 40, 800, 175)
    c.finish()
    return s.svg()


def outlines(s, x, y):
    """The two transistors as they look."""
    s.text(x, y - 16, "Q1 as it looks from above", 12.5, colour=symbols.GREY)
    s.box(x + 8, y, 74, 22, "#bbb", "#777")
    s.box(x + 8, y + 22, 74, 42, "#444", "#222")
    s.text(x + 45, y + 48, "IRLZ44N", 12.5, "middle", "#fff")
    for i, pin in enumerate("GDS"):
        s.line([(x + 20 + 25 * i, y + 64), (x + 20 + 25 * i, y + 92)], width=3)
        s.text(x + 20 + 25 * i, y + 108, pin, 13, "middle", bold=True)
    s.box(x + 130, y + 28, 70, 34, "#444", "#222")
    s.text(x + 165, y + 49, "AO3400", 12, "middle", "#fff")
    for pin, px, py in (("G", x + 142, 62), ("S", x + 188, 62)):
        s.line([(px, y + py), (px, y + py + 16)], width=4)
        s.text(px, y + py + 32, pin, 13, "middle", bold=True)
    s.line([(x + 165, y + 28), (x + 165, y + 12)], width=4)
    s.text(x + 165, y + 7, "D", 13, "middle", bold=True)


def draw_no_board():
    s = symbols.Sheet(1000, 520)
    s.text(40, 42, "Light without a board", 20, bold=True)
    s.text(40, 82, "A coin cell, as in the paper", 15, bold=True)
    c = Circuit("coin_cell")
    c.place(s, "BT1", 130, 200)
    c.place(s, "S1", 170, 150)
    c.place(s, "R1", 250, 150)
    c.place(s, "L1", 400, 200)
    c.wire(s, "BT1.+", (130, 150), "S1.1")
    c.wire(s, "S1.2", "R1.1")
    c.wire(s, "R1.2", (400, 150), "L1.A")
    c.wire(s, "L1.K", (400, 290), (130, 290), "BT1.-")
    c.notes(s, 40, 370, 66)
    c.finish()
    c = Circuit("camera_usb")
    s.text(530, 82, "The camera's own USB cable: brighter, no battery", 15, bold=True)
    c.place(s, "P1", 710, 190)
    c.place(s, "R1", 800, 190)
    c.place(s, "L1", 910, 195)
    c.wire(s, "P1.red", "R1.1")
    c.wire(s, "R1.2", (910, 190), "L1.A")
    c.wire(s, "L1.K", (910, 240), "P1.black")
    c.notes(s, 530, 370, 66)
    c.finish()
    return s.svg()


def main(arguments):
    out = arguments[0] if arguments else HERE
    try:
        sheets = {"nano.svg": draw_nano(), "no_board.svg": draw_no_board()}
    except Mismatch as mismatch:
        sys.exit(f"draw.py: {mismatch}")
    os.makedirs(out, exist_ok=True)
    for name, text in sheets.items():
        path = os.path.join(out, name)
        with open(path + ".partial", "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(path + ".partial", path)


if __name__ == "__main__":
    main(sys.argv[1:])
