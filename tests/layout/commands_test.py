#!/usr/bin/env python3
"""The commands that documents show exist, with the options that they show: commands_test.py SOURCE_TREE PROGRAM

Reads the indented and fenced blocks of README.md, CONTRIBUTING.md, docs/*.md and the rooms' README.md, and in docs/commands.md the
options of each section and table row as well. Asks `tagwrench VERB --help` for what there is, and `./run help` for the commands of run.
"""
import functools
import pathlib
import re
import subprocess
import sys

OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
HIDDEN = {"manual"}  # verbs that no list of help shows


def documents_of(root):
    yield from (root / name for name in ("README.md", "CONTRIBUTING.md"))
    yield from sorted((root / "docs").glob("*.md"))
    yield from (file for file in sorted(root.glob("*/**/README.md"))
                if not file.relative_to(root).parts[0].startswith(("build", ".")) and "node_modules" not in file.parts)


def commands_of(text):
    """Lines of code, those that end with a backslash joined with the next ones; without comments."""
    fenced, lines = False, []
    for line in text.splitlines():
        if line.startswith("```"):
            fenced = not fenced
        elif fenced or line.startswith("    "):
            lines.append(line.strip())
    joined = re.sub(r"\\\n\s*", "", "\n".join(lines))
    return [re.sub(r"(^|\s)#\s.*", "", line) for line in joined.splitlines()]


def invocations_of(line):
    """What follows `tagwrench` or a path to it, for each program that a shell line starts."""
    for piece in re.split(r"&&|\|\||[|;]", line):
        words = piece.split()
        while words and (re.fullmatch(r"\w+=\S*", words[0]) or words[0] == "sudo"):
            words.pop(0)
        if words and words[0] in ("tagwrench", "build/host/tagwrench"):
            yield words[1:]


class Program:
    def __init__(self, path):
        self.path = path

    @functools.lru_cache(maxsize=None)
    def help(self, verbs):
        done = subprocess.run([self.path, *verbs, "--help"], capture_output=True, text=True, timeout=60, check=False)
        return done.stdout if done.returncode == 0 else None

    @functools.lru_cache(maxsize=None)
    def verbs(self, verbs):
        """The verbs below these."""
        listed = (self.help(verbs) or "").partition("\nSubcommands:\n")[2]
        return set(re.findall(r"(?m)^  ([a-z][a-z-]*)", listed)) | (HIDDEN if not verbs else set())

    def faults(self, words):
        verbs = ()
        for word in words:
            if word not in self.verbs(verbs):
                break
            verbs += (word,)
        name = " ".join(("tagwrench", *verbs))
        if self.verbs(verbs) and not verbs and words and re.match(r"[a-z]", words[0]):
            return [f"{name} has no verb {words[0]}"]
        text = self.help(verbs)
        if text is None:
            return [f"{name} --help fails"]
        given = OPTION.findall(" " + " ".join(words))
        return [f"{name} has no option {option}" for option in given if option not in OPTION.findall(text)]


def reference_of(text):
    """(verbs, option) of docs/commands.md: of table rows that begin with verbs, and of the text of sections named after one verb."""
    for section in re.split(r"(?m)^## ", text)[1:]:
        title, _, body = section.partition("\n")
        for line in body.splitlines():
            row = re.match(r"\| ((?:`[a-z -]+`(?:, )?)+) \|(.*)", line)
            if row and not row[1].startswith("`--"):
                for verbs in re.findall(r"`([a-z -]+)`", row[1]):
                    yield verbs.split(), row[2]
            elif " " not in title and not line.startswith("    ") and "`tagwrench" not in line:
                yield [title], line


def main():
    root, program = pathlib.Path(sys.argv[1]).resolve(), Program(sys.argv[2])
    run_help = subprocess.run([root / "run", "help"], capture_output=True, text=True, timeout=60, check=True).stdout
    faults, count = [], 0
    for document in documents_of(root):
        where = document.relative_to(root)
        for line in commands_of(document.read_text(encoding="utf-8")):
            for words in invocations_of(line):
                count += 1
                faults += [f"{where}: {line.strip()}: {fault}" for fault in program.faults(words)]
            for verb in re.findall(r"(?:^|\s)\./run ([a-z]+)", line):
                if not re.search(rf"\./run {verb}\b", run_help):
                    faults.append(f"{where}: {line.strip()}: run has no command {verb}")
    shown = 0
    for verbs, words in reference_of((root / "docs/commands.md").read_text(encoding="utf-8")):
        options = OPTION.findall(words)
        shown += len(options)
        if verbs[0] == "board" and len(verbs) == 1 or verbs[0] == "calibrate" and len(verbs) == 1:
            continue  # said of each of their verbs
        faults += [f"docs/commands.md: {fault}" for fault in program.faults([*verbs, *options])]
    if count < 60 or shown < 60:
        faults.append(f"only {count} commands and {shown} options were found: the reader of documents is broken")
    print("\n".join(faults) if faults else f"{count} commands, {shown} options of docs/commands.md")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
