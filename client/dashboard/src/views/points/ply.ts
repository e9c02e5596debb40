import type { Cloud } from "./cloud";

const VERTEX_BYTES = 15;

/**
 * The first `count` points of a cloud as a binary PLY file, in the camera's own axes: x right, y down, z ahead, in m.
 *
 * `facts` go into its comment.
 */
export function plyOf({ positions, colours }: Cloud, count: number, facts: Readonly<Record<string, unknown>>): Uint8Array<ArrayBuffer> {
  const head = new TextEncoder().encode(
    [
      "ply",
      "format binary_little_endian 1.0",
      `comment ${JSON.stringify({ unit: "m", ...facts })}`,
      `element vertex ${count}`,
      ...["x", "y", "z"].map((axis) => `property float ${axis}`),
      ...["red", "green", "blue"].map((colour) => `property uchar ${colour}`),
      "end_header\n",
    ].join("\n"),
  );
  const file = new Uint8Array(head.length + VERTEX_BYTES * count);
  file.set(head);
  const vertices = new DataView(file.buffer, head.length);
  for (let n = 0; n < count; n++) {
    const at = VERTEX_BYTES * n;
    vertices.setFloat32(at, positions[3 * n], true);
    vertices.setFloat32(at + 4, -positions[3 * n + 1], true);
    vertices.setFloat32(at + 8, -positions[3 * n + 2], true);
    for (let channel = 0; channel < 3; channel++) vertices.setUint8(at + 12 + channel, colours[3 * n + channel]);
  }
  return file;
}
