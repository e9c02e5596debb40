import { colourTable, levelOf, type ColourMapName } from "../../ui/colourMaps";
import { fraction, type Scale } from "../../ui/scale";

/** Writes the colours of `values` into RGBA bytes; a pixel without a value stays clear. */
export function paint(values: ArrayLike<number>, scale: Scale, colours: ColourMapName, rgba: Uint8ClampedArray): void {
  const table = new Uint32Array(colourTable(colours).buffer);
  const pixels = new Uint32Array(rgba.buffer, rgba.byteOffset, rgba.byteLength / 4);
  for (let pixel = 0; pixel < pixels.length; pixel++) {
    const place = fraction(scale, values[pixel]);
    pixels[pixel] = Number.isNaN(place) ? 0 : table[levelOf(place)];
  }
}
