/**
 * How much the page asks for: everything, or less over a link that does not carry it.
 *
 * The service counts the frames that it leaves out as the page has not acknowledged earlier ones. Where these are many
 * although the page draws what comes at once, the way between is too slow: the page then asks for fewer frames a second,
 * and where that would be too few, for smaller ones. Where none is left out it asks for more again, step by step.
 */

/** What is asked for. */
export interface Demand {
  /** Most frames a second; null for all. */
  readonly maxRate_hz: number | null;
  /** Numbers in codes of 16 bits, where a product can be sent so. */
  readonly coded: boolean;
  /** Only the part of the picture in sight; of a whole one, every second pixel. */
  readonly part: boolean;
}

export const EVERYTHING: Demand = { maxRate_hz: null, coded: false, part: false };

/** What is decided by the link, and what it carried then. */
export interface LinkDecision {
  readonly demand: Demand;
  readonly carried_bytes_s: number;
}

/** Time over which the link is judged, at least. */
const WINDOW_S = 2;
/** Windows that a link must be bad for before less than everything is asked for: a page that is just opened has much to do. */
const BAD_WINDOWS = 2;
/** Least share of the frames that arrives over a link that is good, while all are asked for, and while fewer are. */
const TAKEN = 0.75;
const TAKEN_OF_FEWER = 0.9;
/** Least share of the time in which the page waits for frames, where it is not the page that is slow. */
const WAITING = 0.5;
/** A link that carries so much is not thin: what is slow then is the service. */
const WIDE_BYTES_S = 40e6;
/** Share of what the link carries that is asked for. */
const SPARE = 0.8;
/** Fewer frames a second than this, or than half of the camera's, are too few while they could be smaller. */
const ENOUGH_HZ = 5;
/** How many times as many frames the link carries in codes, and of a quarter of the pixels. */
const CODED_GAIN = 1.7;
const PART_GAIN = 4;
/** Each time, so many times as many frames are asked for. */
const RAISE = 1.5;
const LEAST_RATE_HZ = 0.05;
/** A link that carries so many times what it carried when it lost frames is another one. */
const BETTER = 1.1;
/** Most windows without loss before more is asked for than the link carried then; twice as many after each time that it was too much. */
const MOST_PATIENCE = 16;

/** Decides what to ask for by what arrives; times are of any one clock. */
export class DemandControl {
  /** Fewer frames are asked for than this asks for. */
  limited = false;
  /** The page moves light too slowly, and asks for less because of that: what is late says nothing of the link. */
  excused = false;
  #demand = EVERYTHING;
  /** Frames that the camera takes a second, measured while all were asked for. */
  #camera_hz = 0;
  #quiet = 0;
  #bad = 0;
  #patience = 1;
  #raised = false;
  /** What the link carried when it last lost frames. */
  #capacity_bytes_s = 0;
  /** The window: since when, and what came in it; null before its first frame. */
  #began_s: number | null = null;
  #last: number | null = null;
  #frames = 0;
  #bytes = 0;
  #dropped = new Map<number, number>();
  /** Since when the page waits for a frame; null while it has one to draw. */
  #waits_s: number | null = null;
  #waited_s = 0;

  get demand(): Demand {
    return this.#demand;
  }

  /** Another session or sequence: what was measured does not hold any more. */
  reset(): void {
    this.#demand = EVERYTHING;
    this.#camera_hz = 0;
    this.#quiet = 0;
    this.#bad = 0;
    this.#patience = 1;
    this.#raised = false;
    this.#capacity_bytes_s = 0;
    this.restart();
  }

  /** What is asked for changed: the window begins anew. */
  restart(): void {
    this.#began_s = null;
    this.#last = null;
    this.#waits_s = null;
  }

  /** The service left out frames of a channel, for want of acknowledgements. */
  dropped(channel: number, count: number): void {
    this.#dropped.set(channel, (this.#dropped.get(channel) ?? 0) + count);
  }

  /** The page has drawn all that arrived. */
  drewAll(now_s: number): void {
    this.#waits_s ??= now_s;
  }

  /** A product of a frame arrived; answers what to ask for where that changes. */
  arrived(now_s: number, frame: number, bytes: number): LinkDecision | null {
    this.#waited_s += now_s - (this.#waits_s ?? now_s);
    this.#waits_s = null;
    this.#bytes += bytes;
    if (frame === this.#last) return null;
    this.#last = frame;
    if (this.#began_s === null) {
      this.#begin(now_s);
      return null;
    }
    this.#frames += 1;
    const span_s = now_s - this.#began_s;
    if (span_s < WINDOW_S) return null;
    const carried_bytes_s = this.#bytes / span_s;
    const changed = this.#decide(span_s, carried_bytes_s);
    this.#begin(now_s);
    return changed ? { demand: this.#demand, carried_bytes_s } : null;
  }

  #begin(now_s: number): void {
    this.#began_s = now_s;
    this.#frames = 0;
    this.#bytes = 0;
    this.#dropped.clear();
    this.#waited_s = 0;
  }

  /** Whether what is asked for changed. */
  #decide(span_s: number, carried_bytes_s: number): boolean {
    const lost = Math.max(0, ...this.#dropped.values());
    const all = this.#demand.maxRate_hz === null;
    if (all && !this.limited) this.#camera_hz = (this.#frames + lost) / span_s;
    if (lost === 0) {
      this.#bad = 0;
      return !all && this.#calm(carried_bytes_s);
    }
    this.#quiet = 0;
    const taken = this.#frames / (this.#frames + lost);
    const good =
      this.excused || taken >= (all ? TAKEN : TAKEN_OF_FEWER) || this.#waited_s < WAITING * span_s || carried_bytes_s > WIDE_BYTES_S;
    this.#bad = good ? 0 : this.#bad + 1;
    if (good || (all && this.#bad < BAD_WINDOWS)) return false;
    if (this.#raised) this.#patience = Math.min(MOST_PATIENCE, 2 * this.#patience);
    this.#raised = false;
    this.#capacity_bytes_s = carried_bytes_s;
    this.#demand = this.#less(SPARE * (this.#frames / span_s));
    return true;
  }

  get #enough_hz(): number {
    return Math.min(ENOUGH_HZ, this.#camera_hz / 2);
  }

  /** What to ask for where the link carries so many frames of the present kind with some to spare. */
  #less(rate_hz: number): Demand {
    const { coded, part } = this.#demand;
    if (rate_hz >= this.#enough_hz || part) return { coded, part, maxRate_hz: Math.max(LEAST_RATE_HZ, rate_hz) };
    return coded ? { coded, part: true, maxRate_hz: PART_GAIN * rate_hz } : { coded: true, part, maxRate_hz: CODED_GAIN * rate_hz };
  }

  /** A window without loss: more is asked for, at once where the link is known to carry it. */
  #calm(carried_bytes_s: number): boolean {
    this.#quiet += 1;
    if (carried_bytes_s > BETTER * this.#capacity_bytes_s) [this.#capacity_bytes_s, this.#patience] = [carried_bytes_s, 1];
    const more = this.#more(RAISE * (this.#demand.maxRate_hz ?? 0));
    const expected_bytes_s =
      more.maxRate_hz === null ? Infinity : (more.maxRate_hz * gainOf(this.#demand) * this.#bytes) / this.#frames / gainOf(more);
    if (expected_bytes_s > this.#capacity_bytes_s && this.#quiet < this.#patience) return false;
    this.#quiet = 0;
    this.#raised = true;
    this.#demand = more;
    return true;
  }

  #more(rate_hz: number): Demand {
    const { coded, part } = this.#demand;
    const larger_hz = rate_hz / (part ? PART_GAIN : CODED_GAIN);
    // Larger frames, where there are enough of them or all that there are.
    if ((part || coded) && (larger_hz >= this.#enough_hz || rate_hz >= this.#camera_hz))
      return { coded: part && coded, part: false, maxRate_hz: larger_hz };
    return !coded && rate_hz > this.#camera_hz ? EVERYTHING : { coded, part, maxRate_hz: rate_hz };
  }
}

/** How many times as many frames of this kind the link carries as whole ones. */
function gainOf({ coded, part }: Demand): number {
  return (coded ? CODED_GAIN : 1) * (part ? PART_GAIN : 1);
}
