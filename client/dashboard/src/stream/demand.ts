/**
 * How much the page asks for: everything, or less where something is too slow for that.
 *
 * The service counts the frames that it leaves out as the page has not acknowledged earlier ones. Where these are many
 * although the page draws what comes at once, the way between is slow: smaller frames are asked for. Where light moves at
 * fewer than 30 pictures a second, frames may be what keeps the page from drawing it: fewer are asked for, then parts of
 * them. Each is tried, and kept only where it helped: what is slow else (the service, other programs) no demand mends.
 * Where there is room again, one step after the other is taken back. While light stands, or is measured, nobody waits for
 * fluent pictures: everything is asked for.
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

/** What is asked for, and why less than everything; null for what is no reason. */
export interface Decision {
  readonly demand: Demand;
  /** What the link carried. */
  readonly carried_bytes_s: number | null;
  /** Pictures of the light a second that the page drew before it asked for less. */
  readonly pictures_hz: number | null;
}

/** Time over which is judged, at least: while light moves, and else. */
const WINDOW_S = 2;
const STILL_WINDOW_S = 4;
/** Windows that must be slow before less is asked for: a page that is just opened has much to do. After more was tried, one will do. */
const SLOW_WINDOWS = 2;
/** Least share of the frames that arrives over a link that is good. */
const TAKEN = 0.75;
/** Least share of the time in which the page waits for frames, where it is not the page that is slow. */
const WAITING = 0.5;
/** So many frames a second, or half of the camera's, are enough. */
const ENOUGH_HZ = 5;
/** How many times as many frames the link carries in codes, and of a quarter of the pixels. */
const CODED_GAIN = 1.7;
const PART_GAIN = 4;
/** Pictures a second that are fluent, less what counting may miss of 30. */
const FLUENT_HZ = 29;
/** Share of the frames that a page asks for that they keep from drawing. */
const FEWER = 0.5;
/** A step helps where it gives so many times as many frames, or pictures. */
const HELPS = 1.15;
/** Where it did not, it is tried again when there are fewer by this. */
const MUCH_SLOWER = 0.8;
/** Windows with room before more is asked for, and the most; twice as many after each time that it was too much. */
const PATIENCE = 4;
const MOST_PATIENCE = 16;

type Bottleneck = "link" | "page";

/** A step to less: what is asked for since, what was slow, and what was counted before. */
type Step = Readonly<{ demand: Demand; slow: Bottleneck; before_hz: number; carried_bytes_s: number }>;

/** What came in a window: pictures are null where no light moved, `taken` is the share of the frames that were due. */
interface Counted {
  readonly frames_hz: number;
  readonly pictures_hz: number | null;
  readonly carried_bytes_s: number;
  readonly taken: number;
  readonly waited: number;
  readonly enough_hz: number;
}

/** Decides what to ask for by what arrives and what is drawn; times are of any one clock. */
export class DemandControl {
  #steps: readonly Step[] = [];
  #rests = false;
  /** The last step is not judged yet. */
  #tried = false;
  /** Less of this kind did not help where there were so many a second: below, it may. */
  #vain_hz: Readonly<Record<Bottleneck, number>> = NEVER_IN_VAIN;
  #slow = 0;
  #calm = 0;
  #patience = PATIENCE;
  #raised = false;
  /** The window: since when, and what came in it; null before its first frame. */
  #began_s: number | null = null;
  #first = 0;
  #last: number | null = null;
  #frames = 0;
  #bytes = 0;
  #pictures_hz: number | null = null;
  readonly #dropped = new Map<number, number>();
  /** Since when the page waits for a frame; null while it has one to draw. */
  #waits_s: number | null = null;
  #waited_s = 0;

  get demand(): Demand {
    return this.#rests ? EVERYTHING : (this.#steps.at(-1)?.demand ?? EVERYTHING);
  }

  get decision(): Decision {
    const first = (slow: Bottleneck): Step | undefined => (this.#rests ? undefined : this.#steps.find((step) => step.slow === slow));
    return { demand: this.demand, carried_bytes_s: first("link")?.carried_bytes_s ?? null, pictures_hz: first("page")?.before_hz ?? null };
  }

  /** Another session or sequence: what was measured does not hold any more. */
  reset(): void {
    [this.#steps, this.#tried, this.#raised, this.#vain_hz] = [[], false, false, NEVER_IN_VAIN];
    [this.#slow, this.#calm, this.#patience] = [0, 0, PATIENCE];
    this.restart();
  }

  /** What is asked for changed: the window begins anew. */
  restart(): void {
    this.#began_s = this.#last = this.#waits_s = null;
  }

  /** Light stands or is measured from now on, or does not any more. */
  rest(rests: boolean): void {
    this.#rests = rests;
    this.restart();
  }

  /** Pictures a second that were drawn of moving light. */
  pictured(pictures_hz: number): void {
    this.#pictures_hz = pictures_hz;
  }

  /** The service left out frames of a channel, for want of acknowledgements. */
  dropped(channel: number, count: number): void {
    this.#dropped.set(channel, (this.#dropped.get(channel) ?? 0) + count);
  }

  /** The page has drawn all that arrived. */
  drewAll(now_s: number): void {
    this.#waits_s ??= now_s;
  }

  /** A product of a frame arrived; answers whether what to ask for changed. */
  arrived(now_s: number, frame: number, bytes: number): boolean {
    this.#waited_s += now_s - (this.#waits_s ?? now_s);
    this.#waits_s = null;
    this.#bytes += bytes;
    if (frame === this.#last) return false;
    this.#last = frame;
    if (this.#began_s === null) {
      this.#begin(now_s, frame);
      return false;
    }
    this.#frames += 1;
    const span_s = now_s - this.#began_s;
    if (span_s < (this.#pictures_hz === null ? STILL_WINDOW_S : WINDOW_S)) return false;
    const lost = Math.max(0, ...this.#dropped.values());
    const changed =
      !this.#rests &&
      this.#judge({
        frames_hz: this.#frames / span_s,
        pictures_hz: this.#pictures_hz,
        carried_bytes_s: this.#bytes / span_s,
        taken: this.#frames / (this.#frames + lost),
        waited: this.#waited_s / span_s,
        enough_hz: Math.min(ENOUGH_HZ, (frame - this.#first) / span_s / 2),
      });
    this.#begin(now_s, frame);
    return changed;
  }

  #begin(now_s: number, frame: number): void {
    [this.#began_s, this.#first, this.#pictures_hz] = [now_s, frame, null];
    this.#frames = this.#bytes = this.#waited_s = 0;
    this.#dropped.clear();
  }

  /** Whether what is asked for changed. */
  #judge(counted: Counted): boolean {
    const top = this.#steps.at(-1);
    if (this.#tried && top !== undefined) {
      const now_hz = figureOf(counted, top.slow);
      if (now_hz === null) return false;
      this.#tried = false;
      if (now_hz < HELPS * top.before_hz) {
        this.#vain_hz = { ...this.#vain_hz, [top.slow]: MUCH_SLOWER * top.before_hz };
        this.#steps = this.#steps.slice(0, -1);
        return true;
      }
    }
    const slow = this.#bottleneck(counted);
    if (slow === null) return this.#hasRoom(counted, top);
    this.#calm = 0;
    this.#slow += 1;
    if (this.#slow < (this.#raised ? 1 : SLOW_WINDOWS)) return false;
    return this.#less(counted, slow);
  }

  /** What is too slow, where less might help. */
  #bottleneck(counted: Counted): Bottleneck | null {
    const { frames_hz, pictures_hz, taken, waited, enough_hz } = counted;
    const thin = taken < TAKEN && waited >= WAITING;
    if (thin && frames_hz < Math.min(enough_hz, this.#vain_hz.link)) return "link";
    return pictures_hz !== null && pictures_hz < Math.min(FLUENT_HZ, this.#vain_hz.page) ? "page" : null;
  }

  #less(counted: Counted, slow: Bottleneck): boolean {
    if (this.#raised) this.#patience = Math.min(MOST_PATIENCE, 2 * this.#patience);
    [this.#raised, this.#slow] = [false, 0];
    const less = lessThan(this.demand, counted, slow);
    if (less === null) return false;
    const step = { demand: less, slow, before_hz: figureOf(counted, slow) ?? 0, carried_bytes_s: counted.carried_bytes_s };
    [this.#steps, this.#tried] = [[...this.#steps, step], true];
    return true;
  }

  /** Nothing is too slow: the last step is taken back after enough windows with room. */
  #hasRoom({ frames_hz, pictures_hz, taken, enough_hz }: Counted, top: Step | undefined): boolean {
    this.#slow = 0;
    const fluent = pictures_hz === null || pictures_hz >= FLUENT_HZ;
    const carried = taken === 1 || frames_hz >= (top?.demand.part ? PART_GAIN : CODED_GAIN) * enough_hz;
    this.#calm = (top?.slow === "link" ? carried : fluent) ? this.#calm + 1 : 0;
    if (top === undefined) {
      // Long well with everything: what was slow is over.
      if (!carried) this.#calm = 0;
      if (this.#calm >= MOST_PATIENCE) [this.#patience, this.#raised, this.#vain_hz] = [PATIENCE, false, NEVER_IN_VAIN];
      return false;
    }
    if (this.#calm < this.#patience) return false;
    [this.#calm, this.#raised, this.#steps] = [0, true, this.#steps.slice(0, -1)];
    return true;
  }
}

const NEVER_IN_VAIN = { link: Infinity, page: Infinity };

/** What a step against a bottleneck is to raise. */
function figureOf({ frames_hz, pictures_hz }: Counted, slow: Bottleneck): number | null {
  return slow === "link" ? frames_hz : pictures_hz;
}

/** The next less to ask for; null where there is none. */
function lessThan(demand: Demand, { frames_hz, enough_hz }: Counted, slow: Bottleneck): Demand | null {
  const part = demand.part ? null : { ...demand, part: true };
  if (slow === "link") return demand.coded ? part : { ...demand, coded: true };
  const fewer_hz = Math.max(enough_hz, FEWER * frames_hz);
  return fewer_hz < 0.9 * frames_hz ? { ...demand, maxRate_hz: fewer_hz } : part;
}
