#!/usr/bin/env python3
"""Fails when comments, docs, messages or test names become harder to read.

Usage: check_prose.py [--list] [FILE...]    (default: all files in git)

Counted are
  fragments   comments that begin with a relative pronoun, so that their subject stands elsewhere
  words       sentences with a word or phrase that CONTRIBUTING.md rules out
  names       test names that begin so, contain such a word, or are longer than twelve words
  lines       lines of Markdown wider than 120 columns, except tables, code and links
LIMITS holds the allowed counts. --list prints every place, not only those of an exceeded limit.
"""
import argparse
import pathlib
import re
import subprocess
import sys

# Allowed counts over the whole project: fragments for 100 comments, sentences with such words for 100 sentences, and
# plain counts of names and lines.
LIMITS = {"fragments": 0.3, "words": 0.2, "names": 10, "lines": 10}

OPENERS = ("Of", "That", "Those", "Who", "Whoever", "Whose", "What", "Which", "Such", "So many", "So much", "As long", "One that")
WORDS = (
    "all that", "anew", "beside", "by turns", "comes? to (?:be|lie)", "goes? before", "in place of", "is as it was", "is none",
    "lies? (?:behind|beside|in)", "nobody", "of its own", "so many", "so much", "somebody", "there is no more", "to be had",
    "told", "tells? (?:of|who)", "what (?:came|comes|is left|stands)", "whatever it", "whoever",
    "who (?:asks|comes|does|goes|has|is|joins|only|wants)",
)
OPENER = re.compile(r"(?:%s)\b(?!.*\?$)" % "|".join(OPENERS))
WORD = re.compile(r"\b(?:%s)\b" % "|".join(WORDS), re.IGNORECASE)
TEST = re.compile(r"\s*TEST(?:_F|_P)?\(\s*\w+\s*,\s*(\w+)")
SOURCES = {".cpp", ".h", ".c", ".comp", ".glsl", ".proto", ".ts", ".mjs", ".py", ".sh", ".cmake"}
SLASHES = {".cpp", ".h", ".c", ".comp", ".glsl", ".proto", ".ts", ".mjs"}
SPDX = re.compile(r"SPDX-License-Identifier: \S+\s*")


def comments(path, text):
    """Yields (line, text) for each block of comment lines, and for each comment behind code."""
    slashes = path.suffix in SLASHES
    whole = re.compile(r"\s*(?://+|/?\*+)\s?(.*)" if slashes else r"\s*#+(?!!)\s?(.*)")
    behind = re.compile(r"""(?<![:"'])//\s(.*)$""" if slashes else r"\s{2}#\s(.*)$")
    first, block = 0, []
    for number, line in enumerate(text.split("\n") + [""], 1):
        match = whole.match(line)
        if match and not (slashes and line.lstrip().startswith("#")):
            if not block:
                first = number
            block.append(match.group(1).replace("*/", "").strip())
            continue
        if block:
            yield first, SPDX.sub("", " ".join(filter(None, block))).strip()
            block = []
        tail = behind.search(line)
        if tail:
            yield number, tail.group(1).strip()


def paragraphs(text, places, path):
    """Yields (line, text) for each paragraph and table row of Markdown; wide lines go to places."""
    first, block, fenced = 0, [], False
    for number, line in enumerate(text.split("\n") + [""], 1):
        fence = line.startswith("```")
        fenced ^= fence
        row = line.lstrip().startswith("|")
        if len(line) > 120 and not (row or fenced or "](" in line[100:]):
            places["lines"].append((path, number, line))
        if not line.strip() or fence or fenced or row or line.startswith("#"):
            if block:
                yield first, " ".join(block)
                block = []
            if row:
                yield number, line.replace("|", ". ")
            continue
        if not block:
            first = number
        block.append(line.strip())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", action="store_true", help="print every place")
    parser.add_argument("files", nargs="*")
    options = parser.parse_args()
    files = options.files or subprocess.run(["git", "ls-files"], check=True, capture_output=True, text=True).stdout.splitlines()

    places = {kind: [] for kind in LIMITS}
    total = {"fragments": 0, "words": 0}
    for path in map(pathlib.Path, files):
        source = path.suffix in SOURCES or path.name in ("dev", "CMakeLists.txt")
        if not (source or path.suffix == ".md") or "golden" in path.parts or path.name == "check_prose.py" or not path.is_file():
            continue
        text = path.read_text(encoding="utf-8")
        if source:
            prose = [block for block in comments(path, text) if len(block[1].split()) > 2]
            total["fragments"] += len(prose)
            places["fragments"] += [(path, *block) for block in prose if OPENER.match(block[1])]
            for number, line in enumerate(text.split("\n"), 1):
                prose += [(number, message) for message in re.findall(r'"((?:[^"\\]|\\.){25,})"', line)]
                test = TEST.match(line)
                if test:
                    name = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", test.group(1))
                    if OPENER.match(name) or WORD.search(name) or len(name.split()) > 12:
                        places["names"].append((path, number, test.group(1)))
        else:
            prose = list(paragraphs(text, places, path))
        for number, block in prose:
            for sentence in re.split(r"(?<=[.;:?!])\s+", block):
                total["words"] += 1
                if WORD.search(sentence):
                    places["words"].append((path, number, sentence))

    failed = False
    for kind, limit in LIMITS.items():
        count = len(places[kind])
        figure = 100 * count / max(1, total[kind]) if kind in total else count
        exceeded = figure > limit and not options.files
        failed |= exceeded
        print(f"prose: {kind}: {count}" + (f" ({figure:.2f} of 100)" if kind in total else "") + f", allowed {limit}",
              file=sys.stderr)
        if exceeded or options.list or options.files:
            for path, number, found in places[kind]:
                print(f"{path}:{number}: {kind}: {found[:110]}")
    if failed:
        sys.exit("prose: too many of the places above; CONTRIBUTING.md says how this project writes")


if __name__ == "__main__":
    main()
