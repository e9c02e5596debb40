/** The colours of light in flight, as the shader has them, for whatever draws without it. */
import { colourTable, levelOf } from "../ui/colourMaps";
import type { Exposure } from "./renderer";
import { backdropGrey, strength, toned } from "./tone";

/** Writes the RGB of a pixel of `density` into an array of bytes at an index. */
export function lightPainter(density: Float32Array, { tone, colours, backdrop }: Omit<Exposure, "phase_rad">): (pixel: number, out: Uint8Array | Uint8ClampedArray, at: number) => void {
  const table = colourTable(colours);
  return (pixel, out, at) => {
    const share = density[pixel] / tone.white;
    const place = share >= 0 ? toned(tone.kind, share) : 0; // NaN: no density, no light
    const level = 4 * levelOf(place);
    const grey = backdrop === null ? 0 : backdropGrey(backdrop.values[pixel] / backdrop.white);
    const added = backdrop === null ? 1 : strength(place);
    for (let channel = 0; channel < 3; channel++) {
      const light = (added * table[level + channel]) / 255;
      out[at + channel] = Math.round(255 * (1 - (1 - grey) * (1 - light)));
    }
  };
}
