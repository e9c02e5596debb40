import { computed, type ReadonlySignal, signal } from "@preact/signals";

/** Nanoseconds of flight that pass in a second of watching. */
export const SPEEDS_NS: readonly number[] = [0.5, 1, 2, 5, 10, 20];
const USUAL_NS = 5;

/** Least time that a pass of the light takes, until another speed is chosen: shorter ones flicker. */
const PASS_S = 1.5;

/** An arrival as near as this, in shares of the period, is where the light is already. */
const NEAR = 1e-3;

/** A part of the period, in shares of it. */
export type Lit = Readonly<{ first: number; last: number }>;

/** Which moment of the flight is looked at, and how it moves on. */
export class Player {
  /** Share of the period that has passed, 0 to 1: it keeps its meaning when the base frequency changes. */
  readonly turn = signal(0);
  readonly playing = signal(false);
  /** Whether the timeline is held, to move the light by hand. */
  readonly scrubbed = signal(false);
  readonly speed_ns = signal(USUAL_NS);
  readonly time_s: ReadonlySignal<number>;
  /** The part of the period in which there is light, in shares of it: what plays passes over the rest. */
  readonly lit = signal<Lit | null>(null);
  /** Parts of it that are passed over, too. */
  readonly gaps = signal<readonly Lit[]>([]);
  /** When most light arrives in the whole picture, in shares of the period, in their order. */
  readonly arrivals = signal<readonly number[]>([]);
  readonly phase_rad = computed(() => 2 * Math.PI * this.turn.value);

  /** `period_s` is 1/f of what is streamed: the time after which the flight repeats. */
  /** The speed that was not chosen by anybody. */
  #paced_ns = this.speed_ns.peek();

  constructor(readonly period_s: ReadonlySignal<number>) {
    this.time_s = computed(() => this.turn.value * this.period_s.value);
  }

  /** Takes when there is light, and which parts to pass over; who has not looked at any moment yet is shown the first arrival. */
  learn(lit: Lit | null, arrivals: readonly number[], gaps: readonly Lit[]): void {
    this.gaps.value = gaps;
    if (lit !== this.lit.peek() && lit !== null) this.#pace(lit, gaps);
    if (this.arrivals.peek().length === 0 && this.turn.peek() === 0 && arrivals.length > 0) this.turn.value = arrivals[0];
    this.lit.value = lit;
    this.arrivals.value = arrivals;
  }

  #pace({ first, last }: Lit, gaps: readonly Lit[]): void {
    if (this.speed_ns.peek() !== this.#paced_ns) return;
    const within = (gap: Lit): number => Math.max(0, Math.min(last, gap.last) - Math.max(first, gap.first));
    const seen_ns = gaps.reduce((left, gap) => left - within(gap), last - first) * this.period_s.peek() * 1e9;
    this.#paced_ns = SPEEDS_NS.findLast((speed_ns) => speed_ns <= USUAL_NS && seen_ns / speed_ns >= PASS_S) ?? SPEEDS_NS[0];
    this.speed_ns.value = this.#paced_ns;
  }

  /** Lets `elapsed_s` of watching pass; true while there is more to come. */
  advance(elapsed_s: number): boolean {
    if (!this.playing.peek()) return false;
    this.step(elapsed_s * this.speed_ns.peek() * 1e-9);
    const [lit, turn, gaps] = [this.lit.peek(), this.turn.peek(), this.gaps.peek()];
    const after = (from: number): number => gaps.find(({ first, last }) => from >= first && from < last)?.last ?? from;
    // The last gap goes on in the first.
    const next = after(after(turn) % 1);
    if (next !== turn) this.turn.value = next;
    else if (lit !== null && (turn < lit.first || turn > lit.last)) this.turn.value = lit.first;
    return true;
  }

  /** Moves by `flight_s`, around the period at either end. */
  step(flight_s: number): void {
    const turn = this.turn.peek() + flight_s / this.period_s.peek();
    this.turn.value = turn - Math.floor(turn);
  }

  /** Goes to the next time at which light arrives, or to the one before, around the period at either end. */
  jump(forward: boolean): void {
    const [arrivals, turn] = [this.arrivals.peek(), this.turn.peek()];
    const after = arrivals.find((each) => each > turn + NEAR);
    const before = arrivals.findLast((each) => each < turn - NEAR);
    const found = forward ? (after ?? arrivals[0]) : (before ?? arrivals.at(-1));
    this.playing.value = false;
    if (found !== undefined) this.turn.value = found;
  }

  seek(turn: number): void {
    this.turn.value = Math.min(1, Math.max(0, turn));
  }

  toggle(): void {
    this.playing.value = !this.playing.peek();
  }
}
