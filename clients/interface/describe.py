#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes interface.json: the constants, enums, structs and functions of core.h, recording.h and clothstream.h, as clang
reads them. All generators for other languages read this file instead of the headers.
Usage: describe.py CLANG [--check]. With --check it writes nothing, and fails if the file is out of date.

The file has one object for each header:
  constants  #define NAME NUMBERu: name and value
  enums      name ("" if it has none), comment, and values by name
  opaque     names of structs whose members are private
  structs    by name: comment, size, and fields with type, count (arrays), offset and comment. Sizes and offsets are in
             bytes, for each of the TARGETS
  functions  by name: comment, result, and parameters with name and type
  native     functions that WebAssembly does not have, because they take a path, bytes of the program or a function"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

FOLDER = pathlib.Path(__file__).resolve().parent
HEADERS = {"core": "core/core.h", "recording": "recording/recording.h", "library": "library/clothstream.h"}
OUT = FOLDER / "interface.json"
TARGETS = {"wasm32": "wasm32", "native64": "x86_64-linux-gnu"}
NATIVE = ["cs_set_clock", "cs_recording_open", "cs_recording_open_bytes", "cs_recording_open_source"]
COLUMNS = 118


class Compiler:
    """Runs clang on a folder that has the headers as programs include them."""

    def __init__(self, command: str, folder: str):
        self.command = [command, "-x", "c", "-std=c11", "-ffreestanding", f"-I{folder}"]
        self.source = f"{folder}/all.h"
        (pathlib.Path(folder) / "clothstream").mkdir()
        includes = ""
        for path in HEADERS.values():
            name = pathlib.Path(path).name
            (pathlib.Path(folder) / "clothstream" / name).write_text((FOLDER.parent / path).read_text())
            includes += f"#include <clothstream/{name}>\n"
        pathlib.Path(self.source).write_text(includes)

    def output(self, target: str, *flags: str) -> str:
        return subprocess.run([*self.command, f"--target={TARGETS[target]}", *flags, self.source], check=True,
                              stdout=subprocess.PIPE, text=True).stdout


def header_of(file: str) -> str:
    """The key in HEADERS; "" for another file."""
    return next((key for key, path in HEADERS.items() if file.endswith("clothstream/" + pathlib.Path(path).name)), "")


def constants(preprocessed: str) -> dict:
    """Constants of each header. Lines such as `# 12 "file"` say where the following ones are from."""
    found: dict = {key: {} for key in HEADERS}
    header = ""
    for line in preprocessed.splitlines():
        if place := re.match(r'# \d+ "(.*?)"', line):
            header = header_of(place[1])
        elif define := re.match(r"#define (\w+) (0x[0-9a-fA-F]+|\d+)u$", line):
            if header:
                found[header][define[1]] = int(define[2], 0)
    return found


def layouts(dump: str) -> dict:
    """Sizes of all structs, and offsets of their fields: {struct: (size, {field: offset})}."""
    found = {}
    for record in dump.split("*** Dumping AST Record Layout")[1:]:
        if not (name := re.search(r"0 \| struct (\w+)$", record, flags=re.M)):
            continue
        offsets = {field: int(offset) for offset, field in re.findall(r"^ +(\d+) \|   \S.* (\w+)$", record, flags=re.M)}
        found[name[1]] = (int(re.search(r"\[sizeof=(\d+)", record)[1]), offsets)
    return found


def tidy(qualified: str) -> str:
    """`const char *` becomes `const char*`."""
    return re.sub(r" +\*", "*", qualified.strip())


def children(node: dict, kind: str) -> list:
    return [inner for inner in node.get("inner", []) if inner["kind"] == kind]


def with_comment(node: dict, described: dict) -> dict:
    """Adds the comment of a declaration, line by line as in the header."""
    lines = [text["text"].strip() for comment in children(node, "FullComment")
             for paragraph in children(comment, "ParagraphComment") for text in children(paragraph, "TextComment")]
    if any(lines) and not lines[0].startswith("---"):  # the title of a section
        described["comment"] = "\n".join(lines).strip()
    return described


def value_of(constant: dict) -> int:
    return int(children(constant, "ConstantExpr")[0]["value"])


def field_of(node: dict) -> dict:
    kind, count = re.match(r"(.*?)(?:\[(\d+)\])?$", node["type"]["qualType"]).groups()
    field = {"name": node["name"], "type": tidy(kind)}
    if count:
        field["count"] = int(count)
    return with_comment(node, field)


def function_of(node: dict) -> dict:
    qualified = node["type"]["qualType"]
    parameters = [{"name": one["name"], "type": tidy(one["type"]["qualType"])} for one in children(node, "ParmVarDecl")]
    return with_comment(node, {"result": tidy(qualified[:qualified.index("(")]), "parameters": parameters})


class Files:
    """The file of each declaration. clang names a file only where it differs from the one before."""

    def __init__(self) -> None:
        self.current = ""

    def of(self, declaration: dict) -> str:
        place = declaration["loc"]
        self.current = place.get("file", self.current)
        found = self.current
        self._follow(declaration)
        return found

    def _follow(self, node: object) -> None:
        if isinstance(node, list):
            for inner in node:
                self._follow(inner)
        elif isinstance(node, dict):
            if isinstance(node.get("file"), str):
                self.current = node["file"]
            for key, inner in node.items():
                if key != "includedFrom":
                    self._follow(inner)


def describe(command: str) -> dict:
    with tempfile.TemporaryDirectory() as folder:
        compiler = Compiler(command, folder)
        tree = json.loads(compiler.output("native64", "-fsyntax-only", "-fparse-all-comments", "-Xclang", "-ast-dump=json"))
        defined = constants(compiler.output("native64", "-E", "-dD"))
        laid_out = {target: layouts(compiler.output(target, "-fsyntax-only", "-Xclang", "-fdump-record-layouts-complete"))
                    for target in TARGETS}
    described = {key: {"constants": defined[key], "enums": [], "opaque": [], "structs": {}, "functions": {}, "native": []}
                 for key in HEADERS}
    files = Files()
    for node in tree["inner"]:
        header = header_of(files.of(node))
        if not header:
            continue
        to, name = described[header], node.get("name", "")
        if node["kind"] == "EnumDecl":
            values = [with_comment(one, {"name": one["name"], "value": value_of(one)})
                      for one in children(node, "EnumConstantDecl")]
            to["enums"].append(with_comment(node, {"name": name, "values": values}))
        elif node["kind"] == "RecordDecl" and not node.get("completeDefinition"):
            to["opaque"].append(name)
        elif node["kind"] == "RecordDecl":
            fields = [field_of(one) for one in children(node, "FieldDecl")]
            for field in fields:
                field["offset"] = {target: laid_out[target][name][1][field["name"]] for target in TARGETS}
            size = {target: laid_out[target][name][0] for target in TARGETS}
            to["structs"][name] = with_comment(node, {"size": size, "fields": fields})
        elif node["kind"] == "FunctionDecl":
            to["functions"][name] = function_of(node)
            if name in NATIVE:
                to["native"].append(name)
    return described


def written(value: object, indent: str = "") -> str:
    """JSON in which what fits on a line is on one line."""
    line = json.dumps(value)
    if len(indent) + len(line) <= COLUMNS or not isinstance(value, (dict, list)):
        return line
    deeper = indent + " "
    if isinstance(value, dict):
        parts = [f"{json.dumps(key)}: {written(inner, deeper)}" for key, inner in value.items()]
        opened, closed = "{", "}"
    else:
        parts = [written(inner, deeper) for inner in value]
        opened, closed = "[", "]"
    return f"{opened}\n{deeper}" + f",\n{deeper}".join(parts) + f"\n{indent}{closed}"


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3) or sys.argv[2:] not in ([], ["--check"]):
        sys.exit(__doc__)
    text = written(describe(sys.argv[1])) + "\n"
    if not sys.argv[2:]:
        OUT.write_text(text)
    elif not OUT.exists() or OUT.read_text() != text:
        sys.exit(f"{OUT} is out of date. Run: {__file__} {sys.argv[1]}")
