import { computed, type ReadonlySignal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";

import { LEVELS, colourTable, type ColourMapName } from "../../ui/colourMaps";
import { decimalsFor, fraction, niceStep, ticks, type Scale } from "../../ui/scale";
import { fixed, significant, withUnit } from "../../ui/format";

interface ColourBarProps {
  readonly scale: Scale;
  readonly colours: ColourMapName;
  readonly unit: string;
  /** The value under the pointer, marked on the bar. */
  readonly marked: ReadonlySignal<number>;
}

/** The colour scale with its numbers. */
export function ColourBar({ scale, colours, unit, marked }: ColourBarProps) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const context = canvas.current?.getContext("2d");
    context?.putImageData(new ImageData(colourTable(colours), LEVELS, 1), 0, 0);
  }, [colours]);

  const marker = useMemo(
    () =>
      computed(() => {
        const place = fraction(scale, marked.value);
        return Number.isNaN(place) ? null : `${100 * Math.min(1, Math.max(0, place))}%`;
      }),
    [scale, marked],
  );
  const values = ticks(scale, 6);
  const decimals = decimalsFor(niceStep(scale.high - scale.low, 6));
  const write = (value: number): string => (scale.kind === "linear" ? fixed(value, decimals) : significant(value, 1));
  return (
    <div class="colour-bar" role="img" aria-label={`Colour scale from ${write(scale.low)} to ${withUnit(write(scale.high), unit)}`}>
      <canvas ref={canvas} width={LEVELS} height={1} />
      {marker.value !== null && <i class="colour-bar-marker" style={{ left: marker.value }} />}
      <div class="colour-bar-ticks">
        {values.map((value, at) => (
          <span key={value} style={{ left: `${100 * fraction(scale, value)}%` }}>
            {at === values.length - 1 ? withUnit(write(value), unit) : write(value)}
          </span>
        ))}
      </div>
    </div>
  );
}
