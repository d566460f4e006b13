#!/usr/bin/env python3
"""Holds what files include and import against the table of rooms in docs/architecture.md: arrows_test.py SOURCE_TREE

Fails on an arrow that the table does not list, on a circle in the table, on a room without a line there, and on a line that nobody
uses any more.
"""
import pathlib
import re
import sys

INCLUDE = re.compile(r'^\s*#\s*include "((?:host|protocol|firmware|tests)/[^"]+)"', re.M)
IMPORT = re.compile(r"""(?:^\s*import\b[^'"]*|\bfrom\s+|\bimport\()['"](\.{1,2}/[^'"]+)['"]""", re.M)


def read_table(document):
    """room -> the rooms that it may use, of the block under '## Rooms and arrows'."""
    section = document.split("## Rooms and arrows", 1)[1]
    block = section.split("```", 2)[1]
    table = {}
    for line in block.splitlines()[1:]:
        if line.strip():
            room, _, used = line.partition(" uses ")
            table[room.strip()] = [name.strip() for name in used.split(",") if name.strip() and name.strip() != "nobody"]
    return table


def room_of(path, table):
    """The room with the longest name that holds the file; host/main.cpp is `main`."""
    if path == "host/main.cpp":
        return "main"
    inside = path.removeprefix("host/")
    parents = [parent.as_posix() for parent in pathlib.PurePosixPath(inside).parents]
    return next((parent for parent in parents if parent in table), None)


def arrows_of(root, table):
    """(file, room, what it includes, that one's room) for all files of host/ and protocol/."""
    for top in ("host", "protocol"):
        for file in sorted((root / top).rglob("*")):
            relative = file.relative_to(root).as_posix()
            if "node_modules" in relative or file.suffix not in (".h", ".c", ".cpp", ".ts"):
                continue
            text = file.read_text(encoding="utf-8")
            if file.suffix == ".ts":
                names = [(file.parent / name).resolve().relative_to(root).as_posix() for name in IMPORT.findall(text)]
            else:
                names = INCLUDE.findall(text)
            for name in names:
                yield relative, room_of(relative, table), name, room_of(name, table)


def circle(table):
    """A path of rooms that comes back to where it began, or nothing."""
    done, path = set(), []

    def walk(room):
        if room in path:
            return path[path.index(room):] + [room]
        if room in done:
            return None
        path.append(room)
        for used in table.get(room, []):
            found = walk(used)
            if found:
                return found
        path.pop()
        done.add(room)
        return None

    return next((found for found in map(walk, table) if found), None)


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    table = read_table((root / "docs/architecture.md").read_text(encoding="utf-8"))
    faults = []
    used = set()
    for file, room, name, other in arrows_of(root, table):
        if room is None or other is None:
            faults.append(f"{file}: {name}: one of them is in no room of docs/architecture.md")
        elif room != other:
            used.add((room, other))
            if other not in table[room]:
                faults.append(f"{file}: includes {name}, but {room} may not use {other}")
    if len(used) < 20:
        faults.append(f"only {len(used)} arrows were found: the reader of includes is broken")
    faults += [f"docs/architecture.md: {room} uses {other}, which no file does; remove the arrow"
               for room, others in table.items() for other in others if (room, other) not in used]
    found = circle(table)
    if found:
        faults.append("docs/architecture.md: a circle: " + " -> ".join(found))
    print("\n".join(faults) if faults else f"{len(used)} arrows between {len(table)} rooms, no circle")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
