#!/usr/bin/env python3
"""What documents point at is there: links_test.py SOURCE_TREE

Every link and picture leads to a file of the tree, and to a heading where it names one. Sources that the documents of the house name in
backticks, and that the first header of a room sends on to ("Then: ..."), are found somewhere in the tree by the end of their path.
"""
import fnmatch
import os
import pathlib
import re
import sys

NAMED = re.compile(r"`([\w./*-]+\.(?:h|cpp|ts|mjs|py|sh|proto))`")
THEN = re.compile(r"(?m)^// Then: .*(?:\n// .*)*?\.$")
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


def sources_of(root):
    paths = []
    for folder, folders, files in os.walk(root):
        folders[:] = [name for name in folders if not name.startswith((".", "build")) and name != "node_modules"]
        paths += ["/" + os.path.relpath(os.path.join(folder, name), root) for name in files]
    return paths


def names_of(root):
    """(where, source named there)"""
    documents = [root / "README.md", root / "CONTRIBUTING.md", *root.glob("docs/*.md"), *root.glob("host/*/README.md"),
                 *root.glob("tests/README.md"), *root.glob("protocol/README.md"), *root.glob("firmware/README.md")]
    for document in documents:
        if document.exists():
            for match in NAMED.finditer(document.read_text(encoding="utf-8")):
                yield document.relative_to(root), match[1]
    for header in root.glob("host/**/*.h"):
        if "node_modules" not in header.parts:
            for line in THEN.findall(header.read_text(encoding="utf-8")):
                for name in re.findall(r"[\w/]+\.(?:h|cpp)\b", line):
                    yield header.relative_to(root), name


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
    sources, names = sources_of(root), list(names_of(root))
    for where, name in names:
        if not any(path.endswith("/" + name) or fnmatch.fnmatch(path, "*/" + name) for path in sources):
            faults.append(f"{where}: {name}: no such file in the tree")
    if len(names) < 100:
        faults.append(f"only {len(names)} names of sources were found: the reader of names is broken")
    if count < 30:
        faults.append(f"only {count} links were found: the reader of links is broken")
    print("\n".join(faults) if faults else f"{count} links, {len(names)} names of sources")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
