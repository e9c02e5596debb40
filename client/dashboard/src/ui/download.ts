/** Files made in the page: what is on screen, as it is on screen; and files of the service. */
import { type Api, LIVE, liveFrame, MADE, refusalIn } from "../store/api";
import type { Frame } from "../store/frames";
import { frameUrl } from "../stream/frameUrl";

/** Hands a file to the browser's downloads. */
export function save(name: string, content: Blob): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = name;
  link.click();
  // The browser reads the address in a task of its own.
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** Rows of a table, the first of which has the names of the columns with their units. */
export type Rows = readonly (readonly (string | number | null | undefined)[])[];

/** A table, comma-separated; nothing where there is no value. */
export function tableText(rows: Rows): string {
  const cell = (value: Rows[number][number]): string => (value == null || Number.isNaN(value) ? "" : String(value));
  return rows.map((row) => `${row.map(cell).join(",")}\n`).join("");
}

/** Hands a table out. */
export function saveTable(name: string, rows: Rows): void {
  save(`${name}.csv`, new Blob([tableText(rows)], { type: "text/csv" }));
}

/**
 * Hands a file of the service to the browser's downloads, under the name that the service gives it, else under `name`.
 *
 * Without a token the browser fetches it by itself, with its own progress; with one it cannot show the token, so the
 * page fetches the file into what the browser keeps beside its memory. Raises RequestError then.
 */
export async function download(api: Api, path: string, name: string): Promise<void> {
  if (api.credentials.token.peek() !== null) {
    const file = await api.file(path);
    save(file.name || name, file);
    return;
  }
  const link = document.createElement("a");
  link.href = `api/v1${path}`;
  link.download = name;
  link.click();
}

/** A canvas as PNG, in its own pixels. Of WebGL only in the task that drew it. */
export function savePicture(name: string, canvas: HTMLCanvasElement | null): void {
  canvas?.toBlob((content) => {
    if (content !== null) save(`${name}.png`, content);
  }, "image/png");
}

/**
 * The numbers of a frame as NPY, as the service has them: all pixels, not in codes.
 *
 * Of a frame that the service has no more, those of the page: NaN where a pixel was not sent.
 */
export async function saveNumbers(api: Api, frame: Frame | null): Promise<void> {
  if (frame === null) return;
  const { product, meta, origin, values, shape } = frame;
  const name = `${product}-${meta.frame}.npy`;
  const path = origin === LIVE ? liveFrame(meta.frame) : origin;
  const here = (): void => save(name, new Blob([npy(values, shape)]));
  if (origin === MADE) return here();
  try {
    save(name, await api.file(frameUrl(path, `${product}.npy`)));
  } catch (error) {
    refusalIn(error);
    here();
  }
}

const DESCRIPTIONS: readonly (readonly [new (length: number) => Frame["values"], string])[] = [
  [Float32Array, "<f4"],
  [Float64Array, "<f8"],
  [Uint16Array, "<u2"],
  [Uint8Array, "|u1"],
];

/** An array in NumPy's format, version 1.0. */
export function npy(values: Frame["values"], shape: readonly number[]): Uint8Array<ArrayBuffer> {
  const descr = DESCRIPTIONS.find(([type]) => values instanceof type)?.[1] ?? "<f4";
  const tuple = shape.length === 1 ? `${shape[0]},` : shape.join(", ");
  const start = `{'descr': '${descr}', 'fortran_order': False, 'shape': (${tuple}), }`;
  // Magic, version and length are 10 bytes; data begins at a multiple of 64.
  const header = `${start.padEnd(Math.ceil((start.length + 11) / 64) * 64 - 11)}\n`;
  const bytes = new Uint8Array(10 + header.length + values.byteLength);
  bytes.set([0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59, 1, 0, header.length & 255, header.length >> 8]);
  bytes.set(new TextEncoder().encode(header), 10);
  bytes.set(new Uint8Array(values.buffer, values.byteOffset, values.byteLength), 10 + header.length);
  return bytes;
}
