import { computed, type ReadonlySignal, type Signal, signal } from "@preact/signals";
import { COLOUR_MAPS, type ColourMapName } from "../scales/colourMaps";
import type { Tone, ToneKind } from "../scales/tone";
import { TONES } from "../scales/tone";
import type { Frame } from "./frames";
import { aBoolean, aNumber, oneOf, type Setting, type Settings } from "./settings";

/** Light as it comes, what came within the last nanosecond, or all that has come so far. */
export const PLAYS = ["density", "gate", "cumulative"] as const;
export type Play = (typeof PLAYS)[number];

export const NAMES: Readonly<Record<Play, string>> = {
  density: "Light in flight",
  gate: "Light of the last nanosecond",
  cumulative: "Light so far",
};

/** Length of the gate, in time of flight. */
export const GATE_S = 1e-9;

/** Phase at which the gate opens that closes at a phase; a flight begins with its period. */
export function gateStart_rad(phase_rad: number, period_s: number): number {
  return Math.max(0, phase_rad - (2 * Math.PI * GATE_S) / period_s);
}

const PLAY: Setting<Play> = { key: "transient.play", initial: "density", ...oneOf(PLAYS) };
const COLOURS: Setting<ColourMapName> = { key: "transient.colours", initial: "inferno", ...oneOf(COLOUR_MAPS) };
const TONE: Setting<ToneKind> = { key: "transient.tone", initial: "root", ...oneOf(TONES) };
const STOPS: Setting<number> = { key: "transient.stops", initial: 0, ...aNumber(-99, 99) };
const BACKDROP: Setting<boolean> = { key: "transient.backdrop", initial: true, ...aBoolean("scene", "black") };

/** How light in flight is shown. */
export class TransientLook {
  readonly colours: Signal<ColourMapName>;
  readonly tone: Signal<ToneKind>;
  /** Exposure compensation in stops: +1 shows half as much light as brightest. */
  readonly stops: Signal<number>;
  readonly backdrop: Signal<boolean>;
  readonly play: Signal<Play>;
  /** Draws the picture anew and answers its canvas, which can be read in this task. */
  snapshot: () => HTMLCanvasElement | null = () => null;
  /** Stills and films that can be made of it: none while it is not on screen. */
  readonly files = signal<readonly Readonly<{ text: string; run: () => void }>[]>([]);
  readonly white: ReadonlySignal<number>;
  #metered: number | null = null;

  constructor(frame: ReadonlySignal<Frame | null>, settings: Settings) {
    settings.together("light", [PLAY, COLOURS, TONE, STOPS, BACKDROP]);
    this.play = settings.of(PLAY);
    this.colours = settings.of(COLOURS);
    this.tone = settings.of(TONE);
    this.stops = settings.of(STOPS);
    this.backdrop = settings.of(BACKDROP);
    this.white = computed(() => this.#meter(frame.value?.light?.peak ?? NaN) / 2 ** this.stops.value);
  }

  get toneNow(): Tone {
    return { kind: this.tone.value, white: this.white.value };
  }

  /** Follows the brightest light, but not its noise: a change of less than a fifth is kept out. */
  #meter(peak: number): number {
    if (peak > 0 && (this.#metered === null || Math.abs(Math.log(peak / this.#metered)) > 0.2)) this.#metered = peak;
    return this.#metered ?? 1;
  }
}
