import { computed } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useMemo } from "preact/hooks";

import type { Pixel } from "../store/pixel";
import { useStore } from "../store/store";

interface StageProps {
  /** Size of the picture in pixels of the sensor. */
  readonly width: number;
  readonly height: number;
  readonly label: string;
  /** The canvas. */
  readonly children: ComponentChildren;
}

/**
 * A picture of the sensor that fits its panel, with a crosshair.
 *
 * Pointing at it sets the pointed pixel, a click or tap selects one, for all views alike; with the stage
 * focused, Shift and the arrow keys move the selected pixel.
 */
export function Stage({ width, height, label, children }: StageProps) {
  const store = useStore();

  const pixelAt = (event: PointerEvent): Pixel => {
    const box = (event.currentTarget as HTMLElement).getBoundingClientRect();
    const clamp = (value: number, end: number): number => Math.min(end - 1, Math.max(0, Math.floor(value)));
    return {
      x: clamp(((event.clientX - box.left) / box.width) * width, width),
      y: clamp(((event.clientY - box.top) / box.height) * height, height),
    };
  };

  const onKeyDown = (event: KeyboardEvent): void => {
    const step = ARROWS[event.key];
    if (step === undefined || !event.shiftKey) return;
    event.preventDefault();
    event.stopPropagation();
    const from = store.selected.peek() ?? { x: width >> 1, y: height >> 1 };
    store.selected.value = {
      x: Math.min(width - 1, Math.max(0, from.x + step[0])),
      y: Math.min(height - 1, Math.max(0, from.y + step[1])),
    };
  };

  return (
    <div class="stage" style={{ "--aspect": width / height }}>
      <div
        class="stage-picture"
        role="application"
        aria-roledescription="sensor image"
        aria-label={`${label}. Click a pixel, or press Shift and an arrow key, to show its impulse response.`}
        tabIndex={0}
        onPointerMove={(event) => (store.pointed.value = pixelAt(event))}
        onPointerLeave={() => (store.pointed.value = null)}
        onPointerDown={(event) => {
          if (event.button === 0) store.selected.value = pixelAt(event);
        }}
        onKeyDown={onKeyDown}
      >
        {children}
        <Mark of="selected" width={width} height={height} />
        <Mark of="pointed" width={width} height={height} />
      </div>
    </div>
  );
}

const ARROWS: Readonly<Record<string, readonly [number, number] | undefined>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

/** The crosshair of the pointed or the selected pixel; moves without rendering anything else. */
function Mark({ of, width, height }: { of: "selected" | "pointed"; width: number; height: number }) {
  const store = useStore();
  const style = useMemo(
    () =>
      computed(() => {
        const pixel = store[of].value;
        if (pixel === null) return null;
        return {
          "--x": `${(100 * (pixel.x + 0.5)) / width}%`,
          "--y": `${(100 * (pixel.y + 0.5)) / height}%`,
          "--w": `${100 / width}%`,
          "--h": `${100 / height}%`,
        };
      }),
    [store, of, width, height],
  );
  if (style.value === null) return null;
  return (
    <div class={`mark mark-${of}`} style={style.value} aria-hidden="true">
      <i class="mark-column" />
      <i class="mark-row" />
      <i class="mark-pixel" />
    </div>
  );
}
