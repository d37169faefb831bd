// SPDX-License-Identifier: MIT
// Writes the enums, structs and functions of clients/core/core.h in C#. Used by clients/web/generate_layout.mjs.

const kTypes = new Map([
  ["uint8_t", "byte"],
  ["int32_t", "int"],
  ["uint32_t", "uint"],
  ["uint64_t", "ulong"],
  ["size_t", "UIntPtr"],
]);
// C# words that are names in core.h.
const kWords = new Set(["fixed", "out", "in", "event", "object", "string", "params", "ref", "lock"]);
const kAnonymous = ["Events", "Errors"];

const pascal = (text) => text.toLowerCase().replaceAll(/(?:^|_)([a-z0-9])/g, (_, letter) => letter.toUpperCase());
const camel = (text) => {
  const name = text.replaceAll(/_([a-z0-9])/g, (_, letter) => letter.toUpperCase());
  return kWords.has(name) ? `@${name}` : name;
};
const typeName = (name) => pascal(name.replace(/^cs_/, ""));

// The type of a parameter, result or member, for example `const uint32_t**`.
function csharpType(text, enums, structs) {
  const pointers = text.match(/\*/g)?.length ?? 0;
  const name = text.replaceAll(/\bconst\b|\*/g, "").trim();
  if (name === "cs_client") return "IntPtr";
  if (name === "char") return `byte${"*".repeat(pointers)}`;
  const base = enums.has(name) || structs.has(name) ? typeName(name) : (kTypes.get(name) ?? name);
  return base + "*".repeat(pointers);
}

function writeEnum(name, body) {
  const members = [...body.matchAll(/(CS_\w+) = (\d+)/g)];
  const words = members.map(([, member]) => member.split("_"));
  let shared = 0;
  while (words.every((parts) => shared < parts.length - 1 && parts[shared] === words[0][shared])) ++shared;
  const lines = members.map(([, member, value]) => `        ${pascal(member.split("_").slice(shared).join("_"))} = ${value},`);
  const flags = name === "Events" ? ["    [Flags]"] : [];
  return [...flags, `    public enum ${name} : uint`, "    {", ...lines, "    }", ""];
}

// Constants of #define: integers and array sizes.
function constants(header) {
  return [...header.matchAll(/#define (CS_\w+) (0x[0-9a-fA-F]+|\d+)u?\b/g)].map(([, name, value]) => ({ name, value }));
}

function members(body) {
  return body
    .split(";")
    .filter((text) => text.trim() !== "")
    .flatMap((text) => {
      const [first, ...rest] = text.trim().split(",");
      const [, type, pointer] = first.match(/^((?:const )?\w+)\s*(\**)\s*\w+/);
      return [first, ...rest].map((part, i) => {
        const [, stars, name, count] = part.match(/(\**)\s*(\w+)\s*(?:\[(\w+)\])?\s*$/);
        return { type: type + (i === 0 ? pointer : stars), name, count };
      });
    });
}

function writeStruct(name, body, layout, enums, structs) {
  const lines = members(body).map((member) => {
    const type = csharpType(member.type, enums, structs);
    const declaration = member.count ? `fixed ${type} ${camel(member.name)}[${member.count}]` : `${type} ${camel(member.name)}`;
    return `        [FieldOffset(${layout.get(`offsetof(${name}, ${member.name})`)})] public ${declaration};`;
  });
  const size = layout.get(`sizeof(${name})`);
  return [`    [StructLayout(LayoutKind.Explicit, Size = ${size})]`, `    public unsafe struct ${typeName(name)}`, "    {", ...lines, "    }", ""];
}

function writeFunction(result, name, parameters, enums, structs) {
  const list = parameters
    .split(",")
    .map((text) => text.trim())
    .filter((text) => text !== "void")
    .map((text) => {
      const [, type, parameter] = text.match(/^(.*?)(\w+)$/);
      return `${csharpType(type, enums, structs)} ${camel(parameter)}`;
    });
  return `        [DllImport(Library)] public static extern ${csharpType(result, enums, structs)} ${name}(${list.join(", ")});`;
}

// Functions and structs with function pointers are left out. layout: values of `sizeof(STRUCT)`, `offsetof(STRUCT, MEMBER)` and of the constants whose names end in _VERSION.
export function writeCSharp(header, layout) {
  const code = header.replaceAll(/\/\*[^]*?\*\//g, "");
  const foundEnums = [...code.matchAll(/typedef enum (\w+) \{([^}]*)\}/g)];
  const foundStructs = [...code.matchAll(/typedef struct \w+ \{([^}]*)\} (\w+);/g)].filter(([, body]) => !body.includes("(*"));
  const enums = new Set(foundEnums.map(([, name]) => name));
  const structs = new Set(foundStructs.map(([, , name]) => name));
  const lines = [];
  [...code.matchAll(/^enum \{([^}]*)\}/gm)].forEach(([, body], i) => lines.push(...writeEnum(kAnonymous[i], body)));
  for (const [, name, body] of foundEnums) lines.push(...writeEnum(typeName(name), body));
  for (const [, body, name] of foundStructs) lines.push(...writeStruct(name, body, layout, enums, structs));
  lines.push("    // The functions of core.h. Each takes the client first; see Client.Handle.");
  lines.push("    public static unsafe class Native", "    {", `        const string Library = "clothstream_core";`, "");
  for (const { name, value } of constants(code)) lines.push(`        public const uint ${name} = ${value};`);
  lines.push("");
  for (const [, result, name, parameters] of code.matchAll(/^([a-z][\w *]*?[ *])(cs_\w+)\(([^)]*)\) CS_NOEXCEPT;/gm)) {
    lines.push(writeFunction(result.trim(), name, parameters.replaceAll(/\s+/g, " "), enums, structs));
  }
  lines.push("    }");
  return `// SPDX-License-Identifier: MIT
// Enums, structs and functions of clients/core/core.h, whose comments have units, ranges and errors. The layout is that of
// 64-bit machines. Generated by clients/web/generate_layout.mjs. Do not edit.
using System;
using System.Runtime.InteropServices;

namespace ClothStream.Core
{
${lines.join("\n")}
}
`;
}
