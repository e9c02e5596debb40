import { type Signal, signal } from "@preact/signals";
import type { Store } from "../../store/store";
import type { Action } from "../../ui/ActionMenu";
import { Button } from "../../ui/controls";
import { save } from "../../ui/download";
import type { FilmKind, Progress } from "../../ui/film";
import type { Subject } from "./film";

/** The film that is being made, if one is. */
export class Filming implements Progress {
  /** Share that is done, 0 to 1; null while no film is made. */
  readonly share: Signal<number | null> = signal(null);
  readonly #cancelled = signal(false);

  get cancelled(): boolean {
    return this.#cancelled.value;
  }

  report(share: number): void {
    this.share.value = share;
  }

  cancel(): void {
    this.#cancelled.value = true;
  }

  /** Films to choose from. */
  actions(subject: Subject, store: Store): Action[] {
    const run = (kind: FilmKind) => (): void => {
      const name = `pass-${store.frames.of("coefficients").peek()?.meta.frame ?? 0}.${kind}`;
      void this.#make(store, async () => (await import("./film")).filmPass(subject, store, kind, this), name);
    };
    return [
      { text: "Film of one pass (WebM)", run: run("webm") },
      { text: "Film of one pass (GIF)", run: run("gif") },
    ];
  }

  async #make({ events }: Store, make: () => Promise<Blob | null>, name: string): Promise<void> {
    if (this.share.peek() !== null) return; // one film at a time
    [this.share.value, this.#cancelled.value] = [0, false];
    try {
      const film = await make();
      if (film !== null) save(name, film);
    } catch (error) {
      events.tell(`No film was made: ${error instanceof Error ? error.message : String(error)}`, "bad");
    } finally {
      this.share.value = null;
    }
  }
}

/** How far the film is; nothing while none is made. */
export function FilmProgress({ filming }: { filming: Filming }) {
  if (filming.share.value === null) return null;
  return (
    <div class="panel-row wrapped apart nowrap filming" role="status">
      <span>Filming {Math.round(100 * filming.share.value)} %</span>
      <progress value={filming.share.value} aria-label="Film" />
      <Button onClick={() => filming.cancel()}>Cancel</Button>
    </div>
  );
}
