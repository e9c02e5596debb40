import { computed, signal } from "@preact/signals";
import { createContext } from "preact";
import { useContext } from "preact/hooks";

import type { AppliedSequence, CameraDocument } from "../stream/protocol";
import { Api } from "./api";
import { Frames } from "./frames";
import { Player } from "./player";
import { browserShelf, type Shelf } from "./settings";
import { Status } from "./status";

/** A place on the sensor: column from the left, row from the top. */
export interface Pixel {
  readonly x: number;
  readonly y: number;
}

/** All that the page knows. Views read and set it; what fills it is no concern of theirs. */
export class Store {
  readonly frames = new Frames();
  readonly status = new Status();
  readonly api: Api;
  readonly shelf: Shelf | null;
  /** The sequence in use, told by the service; null before. */
  readonly sequence = signal<AppliedSequence | null>(null);
  /** What the camera is and can do; null before the service told. */
  readonly camera = signal<CameraDocument | null>(null);
  /** The page keeps the frame it shows although newer ones exist. */
  readonly held = signal(false);
  /** The pixel whose impulse response is shown. */
  readonly selected = signal<Pixel | null>(null);
  /** The pixel under the pointer, in whichever view. */
  readonly pointed = signal<Pixel | null>(null);
  /** Time after which a flight repeats, by the frame on screen. */
  readonly period_s = computed(() => {
    const shown = this.frames.of("coefficients").value?.meta.base_frequency_hz;
    return 1 / (shown ?? this.sequence.value?.base_frequency_hz ?? 23e6);
  });
  readonly player = new Player(this.period_s);

  constructor({ api = new Api(), shelf = browserShelf() }: { api?: Api; shelf?: Shelf | null } = {}) {
    this.api = api;
    this.shelf = shelf;
  }
}

export const StoreContext = createContext<Store | null>(null);

export function useStore(): Store {
  const store = useContext(StoreContext);
  if (store === null) throw new Error("A view stands outside the store's context.");
  return store;
}
