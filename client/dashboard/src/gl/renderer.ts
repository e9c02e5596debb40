import type { Coefficients } from "../physics/maximumEntropy";
import type { ColourMapName } from "../scales/colourMaps";
import type { Tone } from "../scales/tone";

/** The still scene behind the light: one brightness a pixel, `white` shown brightest. */
export type Backdrop = Readonly<{ values: Float32Array; white: number }>;

export type Exposure = Readonly<{ phase_rad: number; tone: Tone; colours: ColourMapName; backdrop: Backdrop | null }>;

/**
 * Draws the density of Eq. (2) at one time of flight on a canvas of the sensor's size.
 *
 * `draw` may be called with the same coefficients many times; they are taken over only once.
 */
export interface DensityRenderer {
  readonly kind: "webgl2" | "typed-array";
  draw(coefficients: Coefficients, exposure: Exposure): void;
  /** The numbers behind the picture: density of every pixel, in units of b_0 per second. */
  readDensity(coefficients: Coefficients, phase_rad: number): Float32Array;
  /** Called when the renderer can no longer draw on this canvas and another must be made. */
  onLost(listener: () => void): void;
  dispose(): void;
}
