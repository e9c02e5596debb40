// Prints what a browser downloads: every file of the build, and its size as gzip sends it.
import { readdirSync, readFileSync } from "node:fs";
import { gzipSync } from "node:zlib";

const build = new URL("../../../server/transientcam_server/static/", import.meta.url);
let total = 0;
for (const file of readdirSync(build, { recursive: true, withFileTypes: true }).filter((entry) => entry.isFile())) {
  const path = `${file.parentPath}/${file.name}`;
  const bytes = readFileSync(path);
  const compressed = gzipSync(bytes, { level: 9 }).length;
  total += compressed;
  console.log(`${file.name.padEnd(28)} ${String(bytes.length).padStart(8)} B ${String(compressed).padStart(8)} B gzip`);
}
console.log(`${"all".padEnd(28)} ${String(total).padStart(19)} B gzip`);
