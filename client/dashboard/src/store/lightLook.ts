import { computed, type ReadonlySignal, type Signal } from "@preact/signals";
import { COLOUR_MAPS, type ColourMapName } from "../scales/colourMaps";
import type { Tone, ToneKind } from "../scales/tone";
import { TONES } from "../scales/tone";
import type { Frame } from "./frames";
import { aBoolean, aNumber, oneOf, remembered, type Shelf } from "./settings";

/** Light as it comes, what came within the last nanosecond, or all that has come so far. */
export const PLAYS = ["density", "gate", "cumulative"] as const;
export type Play = (typeof PLAYS)[number];

export const NAMES: Readonly<Record<Play, string>> = { density: "Light in flight", gate: "Light of the last nanosecond", cumulative: "Light so far" };

/** Length of the gate, in time of flight. */
const GATE_S = 1e-9;

/** Phase at which the gate opens that closes at a phase; a flight begins with its period. */
export function gateStart_rad(phase_rad: number, period_s: number): number {
  return Math.max(0, phase_rad - (2 * Math.PI * GATE_S) / period_s);
}

/** What of the look of light is set by hand; travels in a link. */
export interface LightChoice {
  readonly play: Play;
  readonly colours: ColourMapName;
  readonly tone: ToneKind;
  readonly stops: number;
  readonly backdrop: boolean;
}

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
  readonly white: ReadonlySignal<number>;
  #metered: number | null = null;

  constructor(frame: ReadonlySignal<Frame | null>, shelf: Shelf | null) {
    this.colours = remembered<ColourMapName>(shelf, "transient.colours", "inferno", oneOf(COLOUR_MAPS));
    this.tone = remembered<ToneKind>(shelf, "transient.tone", "root", oneOf(TONES));
    this.stops = remembered(shelf, "transient.stops", 0, aNumber);
    this.backdrop = remembered(shelf, "transient.backdrop", true, aBoolean);
    this.play = remembered<Play>(shelf, "transient.play", "density", oneOf(PLAYS));
    this.white = computed(() => this.#meter(frame.value?.light?.peak ?? NaN) / 2 ** this.stops.value);
  }

  get choice(): LightChoice {
    return { play: this.play.peek(), colours: this.colours.peek(), tone: this.tone.peek(), stops: this.stops.peek(), backdrop: this.backdrop.peek() };
  }

  set choice({ play, colours, tone, stops, backdrop }: LightChoice) {
    this.play.value = play;
    this.colours.value = colours;
    this.tone.value = tone;
    this.stops.value = stops;
    this.backdrop.value = backdrop;
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
