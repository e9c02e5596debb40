import { beyond, type ColourMapName, colourTable, levelOf, rgbaOf } from "../scales/colourMaps";
import { fraction, type Scale } from "../scales/scale";

/** Draws a picture on a canvas, its pixels as `write` makes them of clear RGBA bytes. */
export function draw(canvas: HTMLCanvasElement | null, width: number, height: number, write: (rgba: Uint8ClampedArray) => void): void {
  const context = canvas?.getContext("2d");
  if (canvas === null || !context) return;
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  const image = context.createImageData(width, height);
  write(image.data);
  context.putImageData(image, 0, 0);
}

/** Writes the colours of `values` into RGBA bytes; what lies beyond the scale has a colour of its own, a pixel without a value stays clear. */
export function paint(values: ArrayLike<number>, scale: Scale, colours: ColourMapName, rgba: Uint8ClampedArray): void {
  const pick = picker(scale, colours);
  const pixels = new Uint32Array(rgba.buffer, rgba.byteOffset, rgba.byteLength / 4);
  for (let pixel = 0; pixel < pixels.length; pixel++) pixels[pixel] = pick(values[pixel]);
}

/** What is not known to differ: distinct from all of a diverging scale. */
const DOUBTFUL = rgbaOf("7d7d7d");

/** Greys the pixels whose values lie within their errors, or have none. */
export function grey(values: ArrayLike<number>, errors: ArrayLike<number>, rgba: Uint8ClampedArray): void {
  const pixels = new Uint32Array(rgba.buffer, rgba.byteOffset, rgba.byteLength / 4);
  for (let at = 0; at < pixels.length; at++) if (pixels[at] !== 0 && !(Math.abs(values[at]) > errors[at])) pixels[at] = DOUBTFUL;
}

const [DARK, LIGHT] = [0xa0000000, 0xa0ffffff];

/** Draws dark and light diagonal lines over the pixels that have a reason, on RGBA pixels, `scale` to each across and down. */
export function hatch(reasons: ArrayLike<number>, columns: number, scale: number, pixels: Uint32Array): void {
  const width = scale * columns;
  for (let at = 0; at < pixels.length; at++) {
    const [x, y] = [at % width, Math.floor(at / width)];
    const line = (x + y) % (2 * scale);
    if (line > 1 || reasons[Math.floor(y / scale) * columns + Math.floor(x / scale)] === 0) continue;
    pixels[at] = line === 0 ? DARK : LIGHT;
  }
}

/** The colour of a value as RGBA bytes in one number; 0, which is clear, where there is no value. */
export function picker(scale: Scale, colours: ColourMapName): (value: number) => number {
  const table = new Uint32Array(colourTable(colours).buffer);
  const { under, over } = beyond(colours);
  return (value) => {
    const place = fraction(scale, value);
    if (Number.isNaN(place)) return 0;
    return place < 0 ? under : place > 1 ? over : table[levelOf(place)];
  };
}
