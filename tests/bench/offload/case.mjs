// SPDX-License-Identifier: MIT
// A file of write_offload_case, and the WebAssembly modules that use it.
import { readFileSync } from "node:fs";

// Reads PATH.json and PATH.bin. floats() and bytes() return an array by its place.
export function readCase(path) {
  const numbers = JSON.parse(readFileSync(`${path}.json`, "utf8"));
  const file = readFileSync(`${path}.bin`);
  const bytes = ([at, size]) => file.subarray(at, at + size);
  const floats = (place) => {
    const from = bytes(place);
    return new Float32Array(from.buffer.slice(from.byteOffset, from.byteOffset + from.length));
  };
  return { ...numbers, vertices: numbers.rows * numbers.columns, bytes, floats };
}

// An instance of a module that imports nothing.
export function instantiate(path) {
  const { exports } = new WebAssembly.Instance(new WebAssembly.Module(readFileSync(path)));
  exports._initialize();
  return exports;
}

// Copies a typed array into the module's memory. The caller frees the pointer.
export function copyIn(exports, array) {
  const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
  const pointer = exports.malloc(Math.max(bytes.length, 1));
  new Uint8Array(exports.memory.buffer, pointer, bytes.length).set(bytes);
  return pointer;
}
