"""Symbols of parts as SVG. Each draws itself and says where its pins are."""

from html import escape

INK, GREY, RED, PAPER = "#222", "#555", "#a00000", "#fff"


class Sheet:
    def __init__(self, width, height):
        self.width, self.height, self.items = width, height, []

    def line(self, points, colour=INK, width=1.6, dash=None):
        text = " ".join(f"{x:g},{y:g}" for x, y in points)
        dash = f' stroke-dasharray="{dash}"' if dash else ""
        self.items.append(f'<polyline points="{text}" fill="none" stroke="{colour}" stroke-width="{width}"{dash}/>')

    def shape(self, points, fill=INK):
        text = " ".join(f"{x:g},{y:g}" for x, y in points)
        self.items.append(f'<polygon points="{text}" fill="{fill}" stroke="{INK}" stroke-width="1.6"/>')

    def box(self, x, y, width, height, fill=PAPER, colour=INK, round_=3):
        self.items.append(f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="{round_}" fill="{fill}" '
                          f'stroke="{colour}" stroke-width="1.6"/>')

    def dot(self, x, y, radius=3.4, fill=INK):
        self.items.append(f'<circle cx="{x:g}" cy="{y:g}" r="{radius}" fill="{fill}" stroke="{INK}" stroke-width="1.4"/>')

    def text(self, x, y, words, size=13, anchor="start", colour=INK, bold=False):
        weight = ' font-weight="bold"' if bold else ""
        self.items.append(f'<text x="{x:g}" y="{y:g}" font-size="{size}" text-anchor="{anchor}" fill="{colour}"{weight}>'
                          f'{escape(words)}</text>')

    def svg(self):
        head = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width} {self.height}" '
                f'width="{self.width}" height="{self.height}" font-family="Helvetica, Arial, sans-serif">\n'
                '<rect width="100%" height="100%" fill="#fff"/>\n')
        return head + "\n".join(self.items) + "\n</svg>\n"


def ground(s, x, y):
    s.line([(x, y), (x, y + 9)])
    for half, down in ((11, 9), (7, 14), (3, 19)):
        s.line([(x - half, y + down), (x + half, y + down)], width=2)


def supply(s, x, y, words="+5 V"):
    s.line([(x, y), (x, y - 9)])
    s.line([(x - 10, y - 9), (x + 10, y - 9)], width=2.4)
    s.text(x, y - 14, words, 13, "middle", RED)


def resistor(s, name, value, x, y, upright=False):
    """Pins 50 apart, the first at (x, y), the second to the right or below."""
    if upright:
        s.box(x - 7, y + 7, 14, 36)
        s.line([(x, y), (x, y + 7)])
        s.line([(x, y + 43), (x, y + 50)])
        s.text(x - 14, y + 23, name, 13, "end", bold=True)
        s.text(x - 14, y + 38, value, 12.5, "end")
        return {"1": (x, y), "2": (x, y + 50)}
    s.box(x + 7, y - 7, 36, 14)
    s.line([(x, y), (x + 7, y)])
    s.line([(x + 43, y), (x + 50, y)])
    s.text(x + 25, y - 13, f"{name}  {value}", 12.5, "middle")
    return {"1": (x, y), "2": (x + 50, y)}


def led(s, name, value, x, y):
    """Upright, current flows down: A at (x, y), K 40 below."""
    s.line([(x, y), (x, y + 9)])
    s.shape([(x - 13, y + 9), (x + 13, y + 9), (x, y + 31)], "#ffe9a8")
    s.line([(x - 13, y + 31), (x + 13, y + 31)], width=2.4)
    s.line([(x, y + 31), (x, y + 40)])
    for down in (14, 23):
        s.line([(x + 18, y + down), (x + 32, y + down - 10)])
        s.shape([(x + 36, y + down - 13), (x + 29.5, y + down - 11.5), (x + 32.5, y + down - 6.5)])
    s.text(x - 20, y + 18, name, 13, "end", bold=True)
    s.text(x - 20, y + 34, value, 12.5, "end")
    s.text(x + 6, y + 4, "+", 14, colour=RED)
    s.text(x + 6, y + 44, "–", 14)
    return {"A": (x, y), "K": (x, y + 40)}


def mosfet(s, name, value, x, y):
    """N-channel: the gate at (x, y), the drain up right, the source down right."""
    s.line([(x, y), (x + 20, y)])
    s.line([(x + 20, y - 18), (x + 20, y + 18)], width=2.4)
    for middle in (-16, 0, 16):
        s.line([(x + 28, y + middle - 6), (x + 28, y + middle + 6)], width=2.4)
    s.line([(x + 28, y - 16), (x + 58, y - 16), (x + 58, y - 40)])
    s.line([(x + 28, y + 16), (x + 58, y + 16), (x + 58, y + 40)])
    s.line([(x + 28, y), (x + 58, y), (x + 58, y + 16)])
    s.shape([(x + 30, y), (x + 40, y - 4.5), (x + 40, y + 4.5)])
    s.text(x + 14, y - 24, "G", 12, "end", GREY)
    s.text(x + 64, y - 26, "D", 12, colour=GREY)
    s.text(x + 64, y + 36, "S", 12, colour=GREY)
    s.text(x + 76, y - 2, name, 13, bold=True)
    s.text(x + 76, y + 14, value, 12.5)
    return {"G": (x, y), "D": (x + 58, y - 40), "S": (x + 58, y + 40)}


def button(s, name, value, x, y):
    s.line([(x, y), (x + 30, y)])
    s.line([(x + 70, y), (x + 100, y)])
    s.dot(x + 33, y, 3, PAPER)
    s.dot(x + 67, y, 3, PAPER)
    s.line([(x + 32, y - 10), (x + 68, y - 10)], width=2)
    s.line([(x + 50, y - 10), (x + 50, y - 17)], width=2)
    s.text(x + 72, y - 9, name, 13, bold=True)
    s.text(x + 92, y - 9, value, 12.5)
    return {"1": (x, y), "2": (x + 100, y)}


def switch(s, name, value, x, y):
    s.line([(x, y), (x + 10, y)])
    s.line([(x + 40, y), (x + 50, y)])
    s.dot(x + 12, y, 3, PAPER)
    s.dot(x + 38, y, 3, PAPER)
    s.line([(x + 14, y - 2), (x + 37, y - 16)], width=2)
    s.text(x + 25, y - 22, f"{name}  {value}", 12.5, "middle")
    return {"1": (x, y), "2": (x + 50, y)}


def battery(s, name, value, x, y):
    """Upright: + at (x, y), - 50 below."""
    s.line([(x, y), (x, y + 20)])
    s.line([(x - 18, y + 20), (x + 18, y + 20)], width=2)
    s.line([(x - 9, y + 29), (x + 9, y + 29)], width=5)
    s.line([(x, y + 30), (x, y + 50)])
    s.text(x + 14, y + 14, "+", 15, colour=RED)
    s.text(x - 24, y + 22, name, 13, "end", bold=True)
    s.text(x - 24, y + 38, value, 12.5, "end")
    return {"+": (x, y), "-": (x, y + 50)}


def usb_cable(s, name, value, x, y):
    """A cable from the top down, its red and black wires tapped to the right."""
    s.box(x - 60, y - 75, 60, 40, "#eee")
    s.text(x - 30, y - 50, "camera", 12.5, "middle")
    s.box(x - 60, y + 85, 60, 40, "#eee")
    s.text(x - 30, y + 110, "computer", 12, "middle")
    for i, colour in enumerate(("#c00000", "#2e8b2e", "#aaa", "#111")):
        s.line([(x - 48 + 12 * i, y - 35), (x - 48 + 12 * i, y + 85)], colour, 2.4)
    s.text(x - 70, y + 20, name, 13, "end", bold=True)
    s.text(x - 70, y + 36, value, 12.5, "end")
    s.dot(x - 48, y)
    s.dot(x - 12, y + 50)
    s.line([(x - 48, y), (x, y)], "#c00000")
    s.line([(x - 12, y + 50), (x, y + 50)])
    s.text(x + 4, y - 6, "red, +5 V", 12, colour=RED)
    s.text(x + 4, y + 66, "black", 12)
    return {"red": (x, y), "black": (x, y + 50)}


def nano(s, name, value, x, y):
    """Seen from above, USB up; pins as they lie on the board, 40 apart."""
    left = "D13 3V3 REF A0 A1 A2 A3 A4 A5 A6 A7 5V RST GND VIN".split()
    right = "D12 D11 D10 D9 D8 D7 D6 D5 D4 D3 D2 GND RST D0 D1".split()
    s.box(x, y - 40, 190, 40 * 14 + 80, "#eef4fb", "#1f4e79", 8)
    s.box(x + 65, y - 62, 60, 46, "#ccc", "#777")
    s.text(x + 95, y - 34, "USB", 13, "middle")
    for i, word in enumerate(value.split()):
        s.text(x + 95, y + 278 + 20 * i, word, 17, "middle", "#1f4e79", True)
    s.text(x + 95, y + 316, "from above", 12.5, "middle", "#1f4e79")
    pins = {}
    for i, (a, b) in enumerate(zip(left, right)):
        row = y + 40 * i
        for label, px, tx, anchor in ((a, x, x + 14, "start"), (b, x + 190, x + 176, "end")):
            s.dot(px, row, 5, "#e8c860")
            s.text(tx, row + 5, label, 14, anchor, bold=True)
            key = label if label not in pins else label + "'"
            pins[key] = (px, row)
    return pins


def hx711(s, name, value, x, y):
    """The usual module, its two rows of pins as they lie."""
    s.box(x, y, 130, 112, "#f6f6ee", "#5b5b2e", 6)
    s.text(x + 65, y + 18, value, 14, "middle", "#5b5b2e", True)
    pins = {}
    for i, pin in enumerate(("E+", "E-", "A-", "A+")):
        pins[pin] = (x, y + 32 + 22 * i)
        s.text(x + 8, y + 37 + 22 * i, pin.replace("-", "−"), 12.5)
    for i, pin in enumerate(("GND", "DT", "SCK", "VCC")):
        pins[pin] = (x + 130, y + 32 + 22 * i)
        s.text(x + 122, y + 37 + 22 * i, pin, 12.5, "end")
    pins["RATE"] = (x + 65, y + 112)
    s.text(x + 65, y + 107, "RATE", 11, "middle", GREY)
    return pins


def load_cell(s, name, value, x, y):
    s.box(x - 70, y + 16, 70, 98, "#f4f4f4", GREY, 6)
    first, second = value.rsplit(" ", 1)
    s.text(x - 38, y + 62, first, 12.5, "middle")
    s.text(x - 38, y + 78, second, 12.5, "middle")
    return {p: (x, y + 32 + 22 * i) for i, p in enumerate(("E+", "E-", "A-", "A+"))}


def voltage(s, name, value, x, y):
    s.dot(x, y, 3, PAPER)
    s.text(x - 10, y + 5, value, 12.5, "end")
    return {"1": (x, y)}
