/** What happened, for people: notices of the service and what this page noticed, the newest last. */
import { signal } from "@preact/signals";
import { engineering, fixed, grouped } from "../scales/format";
import type { AppliedDocument, SamplingDocument } from "../stream/documents";
import type { Notice } from "../stream/protocol";
import { refusalIn } from "./api";

export type EventTone = "plain" | "good" | "bad";

/** What can be done about what happened. */
type Remedy = Readonly<{ word: string; run: () => void }>;

export interface Happening {
  /** Counts the happenings of this page. */
  readonly number: number;
  /** Unix time. */
  readonly at_s: number;
  readonly words: string;
  readonly tone: EventTone;
  /** Names it where two may report it: the service and this page. */
  readonly key?: string;
  readonly remedy?: Remedy;
}

/** Only so many are kept. */
const MOST = 100;

/** How long events that come in bursts are shown as one. */
const BURST_S = 30;

export class Events {
  readonly all = signal<readonly Happening[]>([]);
  readonly #bursts = new Map<string, { readonly number: number; count: number }>();
  #number = 0;

  constructor(private readonly now_s: () => number = () => Date.now() / 1000) {}

  /**
   * Shows events that come in bursts: those within `BURST_S` of the first are shown as one.
   *
   * `words` makes the sentence of how many there were.
   */
  tally(kind: string, count: number, words: (count: number) => string, tone: EventTone): void {
    const burst = this.#bursts.get(kind);
    const happening = burst && this.all.peek().find(({ number }) => number === burst.number);
    if (burst === undefined || happening === undefined || this.now_s() - happening.at_s > BURST_S) {
      this.tell(words(count), tone);
      this.#bursts.set(kind, { number: this.#number, count });
      return;
    }
    burst.count += count;
    this.all.value = this.all.peek().map((each) => (each === happening ? { ...each, words: words(burst.count) } : each));
  }

  /** Shows an event; one of the same key that was shown just before stays in its place, with the remedy of either. */
  tell(words: string, tone: EventTone = "plain", more: Pick<Happening, "key" | "remedy"> = {}): void {
    const shown =
      more.key === undefined ? undefined : this.all.peek().find(({ key, at_s }) => key === more.key && this.now_s() - at_s < BURST_S);
    if (shown !== undefined) {
      this.all.value = this.all.peek().map((each) => (each === shown ? { ...each, ...more } : each));
      return;
    }
    this.#number += 1;
    const happening = { number: this.#number, at_s: this.now_s(), words, tone, ...more };
    this.all.value = [...this.all.peek().slice(1 - MOST), happening];
  }

  /** Does something, and shows why it was refused where it was. */
  async reported(work: () => Promise<unknown>): Promise<void> {
    try {
      await work();
    } catch (error) {
      this.tell(refusalIn(error).message, "bad");
    }
  }
}

/** Gains without a calibration, by the id that frames carry. */
const UNMEASURED: Readonly<Record<string, string | undefined>> = { nominal: "Nominal gains", factory: "The gains that the camera reports" };

/** Why a recording ended, in words. */
export const END_REASONS: Readonly<Record<string, string | undefined>> = {
  stopped: "stopped",
  duration: "reached its duration",
  size: "reached its size",
  frames: "has all its frames",
  "disk-space": "ended because the disk is nearly full",
  "sequence-changed": "ended because the sequence changed",
  failed: "failed",
  shutdown: "ended with the service",
  interrupted: "was interrupted",
};

/** Images that did not arrive, as a sentence. */
export function lossWords(count: number): string {
  return `${grouped(count)} ${count === 1 ? "image" : "images"} did not arrive intact from the camera: its connection, or the service's machine, was too busy. Another port, or a longer exposure with fewer images a second, helps.`;
}

/** Why the camera was lost, without saying once more that it was. */
export function lossReason(reason: string): string {
  return reason.replace(/^the camera was lost: /i, "");
}

/** A notice as a sentence; null for those that are shown otherwise: drops and lost images have their figures. */
export function inWords(notice: Notice): Sentence | null {
  return (WORDS[notice.kind] as ((notice: Notice) => Sentence) | undefined)?.(notice) ?? null;
}

type Sentence = Readonly<{ words: string; tone: EventTone }>;

const plain = (words: string): Sentence => ({ words, tone: "plain" });
const good = (words: string): Sentence => ({ words, tone: "good" });
const bad = (words: string): Sentence => ({ words, tone: "bad" });

const WORDS: { readonly [Kind in Notice["kind"]]?: (notice: Extract<Notice, { kind: Kind }>) => Sentence } = {
  "camera-lost": ({ reason }) => bad(reason ? `The camera was lost: ${lossReason(reason)}` : "The camera was lost."),
  "camera-back": () => good("The camera is back."),
  "light-arming": ({ in_s }) => bad(`The camera's light goes on in ${fixed(in_s, 1, "s")}.`),
  "light-off": ({ reason }) => plain(`The light is off: ${reason}.`),
  "light-unconfirmed": ({ reason }) => bad(`${reason.charAt(0).toUpperCase()}${reason.slice(1)}.`),
  "light-confirmed": () => plain("Whether the light is off is known again."),
  "sequence-changed": ({ sequence }) => plain(sequenceWords(sequence)),
  "reconstruction-changed": () => plain("The settings of the reconstruction changed."),
  "simulation-changed": ({ scene, effects }) => {
    const chosen = Object.entries(effects).map(([effect, choice]) => `${effect.replaceAll("-", " ")} ${choice}`);
    return plain(`The camera stands before ${scene}${chosen.length > 0 ? `, with ${chosen.join(", ")}` : ""}.`);
  },
  "calibration-changed": ({ warning, calibration_id, reason }) => {
    if (warning) return bad(`The calibration may not hold: ${warning}.`);
    const unmeasured = UNMEASURED[calibration_id];
    if (unmeasured === undefined) return good(`The calibration ${calibration_id} is used from now on.`);
    return reason ? bad(`${unmeasured} are used from now on. ${reason}`) : plain(`${unmeasured} are used from now on.`);
  },
  "noise-differs": ({ reason }) => (reason ? bad(`${reason}.`) : good("The images are as noisy as stated again.")),
  "lease-changed": (notice) => plain(leaseWords(notice)),
  "recording-started": () => plain("A recording began."),
  "recording-dropped": ({ count }) =>
    bad(`The disk was too slow for ${grouped(count)} ${count === 1 ? "frame" : "frames"} of the recording.`),
  "disk-stalled": () => bad("The disk of the recordings does not answer. Frames may be dropped."),
  "recording-stopped": ({ reason, problem }) => {
    const words = `The recording ${END_REASONS[reason ?? ""] ?? "ended"}.`;
    return problem ? bad(`${words} ${problem}`) : good(words);
  },
};

/** Which multiples of the base frequency are measured: 1 to m, or others that a camera has of its own. */
export function multiplesWords(harmonics: number, sampling: SamplingDocument | null | undefined): string {
  const multiples = sampling?.multiples ?? [];
  return multiples.length === 0 ? `m = ${harmonics}` : `multiples ${multiples.join(", ")}`;
}

export function sequenceWords({ harmonics, sampling, exposure_s, images, base_frequency_hz }: AppliedDocument): string {
  return `The sequence changed: ${engineering(base_frequency_hz, "Hz")}, ${multiplesWords(harmonics, sampling)}, ${engineering(exposure_s, "s")}, ${images} images.`;
}

/** Names the change to a sequence, of which service and page both know. */
export function sequenceKey({ sequence_id }: AppliedDocument): string {
  return `sequence-${sequence_id}`;
}

function leaseWords({ change, holder, from }: Extract<Notice, { kind: "lease-changed" }>): string {
  if (change === "taken-over") return `${holder} has taken over control from ${from}.`;
  if (change === "granted") return `${holder} has taken control.`;
  if (change === "lapsed") return "Control has lapsed: its holder did not renew it.";
  return "Control was given back: every client may change things.";
}
