/** Layouts that the user named, and the way back from changes. */
import { computed, effect, type Signal, signal, untracked } from "@preact/signals";

import { isLayout, type Layout } from "./layout";
import type { Settings } from "./settings";

/** Changes that can be undone, the last first. */
const MOST_STEPS = 50;
/** Longest name of a layout. */
export const LONGEST_NAME = 40;

type Named = Readonly<Record<string, Layout>>;

export class Layouts {
  /** By their names, in the order in which they were saved. */
  readonly named: Signal<Named>;
  readonly undoable = computed(() => this.#former.value.length > 0);
  readonly #former = signal<readonly Layout[]>([]);
  #last: Layout;

  constructor(
    settings: Settings,
    private readonly current: Signal<Layout>,
  ) {
    this.#last = current.peek();
    this.named = settings.of<Named>({ key: "layouts", initial: {}, accepts: isNamed });
    effect(() => {
      const [before, now] = [this.#last, current.value];
      this.#last = now;
      untracked(() => this.#keep(before, now));
    });
  }

  /** Keeps the present layout under a name; one that had it is replaced. */
  save(name: string): void {
    this.named.value = { ...this.named.peek(), [name]: this.current.peek() };
  }

  remove(name: string): void {
    const { [name]: _, ...others } = this.named.peek();
    this.named.value = others;
  }

  /** Returns to the layout before the last change; a splitter that was moved any number of times is one. */
  undo(): void {
    const [former, ...others] = this.#former.peek();
    if (former === undefined) return;
    this.#last = former; // this change itself is none that can be undone
    this.#former.value = others;
    this.current.value = former;
  }

  #keep(before: Layout, now: Layout): void {
    if (before === now) return;
    const former = this.#former.peek();
    const resizedBefore = former.length > 0 && placesOf(former[0]) === placesOf(before);
    if (placesOf(before) === placesOf(now) && resizedBefore) return;
    this.#former.value = [before, ...former].slice(0, MOST_STEPS);
  }
}

/** Which view stands where, whatever the sizes. */
function placesOf(layout: Layout): string {
  return JSON.stringify(layout, (key, value: unknown) => (key === "share" ? undefined : value));
}

function isNamed(value: unknown): value is Named {
  return typeof value === "object" && value !== null && Object.values(value).every((each) => isLayout(each));
}
