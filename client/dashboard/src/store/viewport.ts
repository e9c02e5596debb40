/** Which part of the picture all views of the sensor show. */
import type { Signal } from "@preact/signals";

import type { Settings } from "./settings";

/** A part of the picture: `zoom` times as large, its left and top end in shares of the whole. */
export type View = Readonly<{ zoom: number; left: number; top: number }>;

/** A place in the picture or in what is seen of it, in shares of its width and height. */
export type Point = Readonly<{ x: number; y: number }>;

export const WHOLE: View = { zoom: 1, left: 0, top: 0 };
const MOST_ZOOM = 40;

/** The part that is shown of all pictures of the sensor alike. */
export class Viewport {
  readonly view: Signal<View>;

  constructor(settings: Settings) {
    // As "4,0.25,0.1": how many times larger, its left and top end in shares.
    this.view = settings.of<View>({
      link: "sight",
      initial: WHOLE,
      text: (view) => (view === WHOLE ? "" : [view.zoom, view.left, view.top].map((each) => Number(each.toPrecision(4))).join()),
      parse: (text) => {
        const numbers = text.split(",").map(Number);
        return numbers.length === 3 && numbers.every(Number.isFinite) && numbers[0] > 1
          ? windowAt(numbers[0], numbers[1], numbers[2])
          : undefined;
      },
    });
  }

  /** Makes the picture larger by a factor around a place in what is seen; that place stays where it is. */
  zoomAt(at: Point, factor: number): void {
    const { zoom, left, top } = this.view.peek();
    const larger = Math.min(MOST_ZOOM, Math.max(1, zoom * factor));
    const gain = 1 / zoom - 1 / larger;
    this.view.value = windowAt(larger, left + at.x * gain, top + at.y * gain);
  }

  /** Moves the picture under the window, by shares of what is seen. */
  pan(by: Point): void {
    const { zoom, left, top } = this.view.peek();
    this.view.value = windowAt(zoom, left - by.x / zoom, top - by.y / zoom);
  }

  reset(): void {
    this.view.value = WHOLE;
  }
}

/** A part of the picture that lies within it; the whole where nothing is enlarged. */
export function windowAt(zoom: number, left: number, top: number): View {
  const larger = Math.min(MOST_ZOOM, zoom);
  const most = 1 - 1 / larger;
  const inside = (value: number): number => Math.min(most, Math.max(0, value));
  return larger <= 1 ? WHOLE : { zoom: larger, left: inside(left), top: inside(top) };
}

/** Where a place of the picture is seen. */
export function seenAt({ zoom, left, top }: View, { x, y }: Point): Point {
  return { x: (x - left) * zoom, y: (y - top) * zoom };
}

/** Which place of the picture is seen somewhere; inverse of `seenAt`. */
export function placeIn({ zoom, left, top }: View, { x, y }: Point): Point {
  return { x: left + x / zoom, y: top + y / zoom };
}

/** The pixels of a picture that are seen, in part too: column and row of the first, width and height. */
export function pixelsOf({ zoom, left, top }: View, width: number, height: number): readonly number[] {
  const [x, y] = [Math.floor(left * width), Math.floor(top * height)];
  const [right, bottom] = [Math.min(width, Math.ceil((left + 1 / zoom) * width)), Math.min(height, Math.ceil((top + 1 / zoom) * height))];
  return [x, y, right - x, bottom - y];
}
