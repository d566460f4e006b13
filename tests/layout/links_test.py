#!/usr/bin/env python3
"""Every link and picture of the documents leads to a file of the tree, and to a heading where it names one: links_test.py SOURCE_TREE"""
import pathlib
import re
import sys

LINK = re.compile(r'\]\(([^)\s]+)\)|\bsrc="([^"]+)"')


def anchors_of(document):
    """As GitHub makes them of headings."""
    text = re.sub(r"(?ms)^```.*?^```", "", document)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in re.findall(r"(?m)^#+ (.*)$", text)}


def documents_of(root):
    """All of the tree but what is built, fetched or hidden; git is not asked, for a machine may have none."""
    for file in sorted(root.rglob("*.md")):
        top = file.relative_to(root).parts[0]
        if not top.startswith(("build", ".")) and "node_modules" not in file.parts:
            yield file


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    faults, count = [], 0
    for document in documents_of(root):
        text = document.read_text(encoding="utf-8")
        for match in LINK.finditer(re.sub(r"(?ms)^```.*?^```|`[^`\n]*`", "", text)):
            link = match[1] or match[2]
            if re.match(r"[a-z]+:", link):
                continue
            count += 1
            name, _, anchor = link.partition("#")
            target = document if not name else document.parent / name
            where = document.relative_to(root)
            if not target.exists():
                faults.append(f"{where}: {link}: no such file")
            elif anchor and target.suffix == ".md" and anchor not in anchors_of(target.read_text(encoding="utf-8")):
                faults.append(f"{where}: {link}: no such heading")
    if count < 30:
        faults.append(f"only {count} links were found: the reader of links is broken")
    print("\n".join(faults) if faults else f"{count} links")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
