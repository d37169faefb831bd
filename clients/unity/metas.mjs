// SPDX-License-Identifier: MIT
// The .meta files of a package, without which Unity ignores its assets. The GUID of an asset is a digest of its path, so it
// stays the same in each release, and scenes that use it keep their references.
import { createHash } from "node:crypto";
import { readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";

const kImporters = {
  ".cs": "MonoImporter",
  ".asmdef": "AssemblyDefinitionImporter",
  ".json": "PackageManifestImporter",
  ".md": "TextScriptImporter",
};

// Unity takes a folder with this ending as one plug-in, and ignores folders and files that end with ~ or begin with a point.
const isPlugin = (name) => name.endsWith(".androidlib");
const isIgnored = (name) => name.endsWith("~") || name.startsWith(".") || name.endsWith(".meta");

const guidOf = (packageName, path) => createHash("md5").update(`${packageName}/${path}`).digest("hex");

// Settings of a plug-in that is only for Android on ARM64.
const kPlugin = `PluginImporter:
  externalObjects: {}
  serializedVersion: 2
  iconMap: {}
  executionOrder: {}
  defineConstraints: []
  isPreloaded: 0
  isOverridable: 0
  isExplicitlyReferenced: 0
  validateReferences: 1
  platformData:
  - first:
      Android: Android
    second:
      enabled: 1
      settings:
        CPU: ARM64
  - first:
      Any: 
    second:
      enabled: 0
      settings: {}
  - first:
      Editor: Editor
    second:
      enabled: 0
      settings: {}
  userData: 
  assetBundleName: 
  assetBundleVariant: 
`;

function importerOf(entry) {
  if (isPlugin(entry.name)) return `folderAsset: yes\n${kPlugin}`;
  if (entry.isDirectory()) return "folderAsset: yes\nDefaultImporter:\n  externalObjects: {}\n  userData: \n";
  const ending = Object.keys(kImporters).find((text) => entry.name.endsWith(text));
  if (!ending) throw new Error(`${entry.name}: add the importer of this kind of asset to kImporters in metas.mjs`);
  return `${kImporters[ending]}:\n  externalObjects: {}\n  userData: \n`;
}

// Lists the assets of a package: path from its root, with the entry of the folder.
export function assets(root, folder = "") {
  return readdirSync(join(root, folder), { withFileTypes: true })
    .filter((entry) => !isIgnored(entry.name))
    .sort((a, b) => (a.name < b.name ? -1 : 1))
    .flatMap((entry) => {
      const path = folder ? `${folder}/${entry.name}` : entry.name;
      const inside = entry.isDirectory() && !isPlugin(entry.name) ? assets(root, path) : [];
      return [{ path, entry }, ...inside];
    });
}

export function writeMetas(root, packageName) {
  for (const { path, entry } of assets(root)) {
    writeFileSync(join(root, `${path}.meta`), `fileFormatVersion: 2\nguid: ${guidOf(packageName, path)}\n${importerOf(entry)}`);
  }
}
