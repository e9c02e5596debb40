import { computed, signal, useComputed, useSignal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import "uplot/dist/uPlot.min.css";

import { rangeOfTime_m } from "../../physics/constants";
import { impulseResponse, peaks, type Peak } from "../../physics/impulseResponse";
import { aBoolean, remembered } from "../../store/settings";
import { type Pixel, useStore } from "../../store/store";
import { Toggle } from "../../ui/controls";
import { fixed, significant } from "../../ui/format";
import { useDrawing, useProducts, useSize } from "../../ui/hooks";
import { Panel } from "../../ui/Panel";
import { autoLimits, type Span } from "../../ui/scale";
import { responsePlot, type ResponsePlot } from "./plot";

/** Even samples of the curve, beside those around its peaks. */
const SAMPLES = 513;
/** Share of the height that the axis was made for which is left after a frame without such a peak. */
const SHRINK = 0.96;
/** Returns listed beside the plot, and the least share of the light that makes one worth it. */
const LISTED = 4;
const LEAST_SHARE = 0.02;

/** The impulse response of the selected pixel, computed here from the streamed coefficients. */
export function ResponseView() {
  const store = useStore();
  useProducts(["coefficients"]);
  const frame = store.frames.of("coefficients");
  const shown = useMemo(
    () =>
      computed(() => {
        const coefficients = frame.value?.coefficients;
        const pixel = store.selected.value;
        if (!coefficients || pixel === null) return null;
        if (pixel.x >= coefficients.width || pixel.y >= coefficients.height) return null;
        const index = pixel.y * coefficients.width + pixel.x;
        const found = peaks(coefficients, index).filter(({ share }) => share >= LEAST_SHARE);
        const response = impulseResponse(coefficients, index, SAMPLES, found);
        return { pixel, response, peaks: found.slice(0, LISTED).sort((a, b) => a.time_s - b.time_s) };
      }),
    [frame, store],
  );

  const box = useRef<HTMLDivElement>(null);
  const size = useMemo(() => signal({ width: 0, height: 0 }), []);
  useSize(box, size);
  const plot = useSignal<ResponsePlot | null>(null);
  const dark = useSignal(window.matchMedia("(prefers-color-scheme: dark)").matches);
  useEffect(() => {
    const scheme = window.matchMedia("(prefers-color-scheme: dark)");
    const change = (): void => {
      dark.value = scheme.matches;
    };
    scheme.addEventListener("change", change);
    return () => {
      scheme.removeEventListener("change", change);
    };
  }, [dark]);

  const logarithmic = useMemo(() => remembered(store.shelf, "response.logarithmic", false, aBoolean), [store]);
  const pointed = useSignal("");
  const held = useRef(0);
  const heldFor = useRef<Pixel | null>(null);
  const top = useRef<Span | null>(null);
  useEffect(() => {
    if (box.current === null) return undefined;
    const made = responsePlot(box.current, {
      logarithmic: logarithmic.value,
      top: () => top.current?.high ?? 1,
      seek: (time_ns) => {
        store.player.playing.value = false;
        store.player.seek((time_ns * 1e-9) / store.period_s.peek());
      },
      point: (sample) => (pointed.value = sample === null ? "" : sampleText(sample.time_ns, sample.density)),
    });
    plot.value = made;
    return () => {
      plot.value = null;
      made.plot.destroy();
    };
  }, [store, dark.value, logarithmic.value]);

  useDrawing(() => {
    const { width, height } = size.value;
    if (width > 0 && height > 0) plot.value?.plot.setSize({ width, height });
  }, [plot, size]);

  useDrawing(() => {
    const response = shown.value?.response;
    if (plot.value === null || size.value.width === 0) return;
    if (response === undefined) {
      plot.value.plot.setData([[], []]);
      return;
    }
    const density = response.density.map((value) => value * 1e-9);
    const highest = density.reduce((a, b) => (b > a ? b : a), 0); // NaN never counts
    // A peak's height is its noisiest figure: the axis grows with it at once and shrinks slowly.
    const { pixel } = shown.value ?? { pixel: null };
    held.current = pixel === heldFor.current ? Math.max(highest, SHRINK * held.current) : highest;
    heldFor.current = pixel;
    top.current = autoLimits(top.current, { low: 0, high: held.current });
    plot.value.plot.setData([response.time_s.map((time_s) => time_s * 1e9), density]);
  }, [plot, shown]);

  useDrawing(() => {
    const turn = store.player.turn.value;
    if (plot.value !== null) plot.value.head.style.left = `${100 * turn}%`;
  }, [plot]);

  const place = useComputed(() => (shown.value === null ? null : `${shown.value.pixel.x}, ${shown.value.pixel.y}`));
  return (
    <Panel
      name="response"
      title={
        <h2>
          Impulse response <span class="quiet">{place.value === null ? "" : `of pixel ${place.value}`}</span>
        </h2>
      }
      tools={
        <>
          <span data-field="sample">{pointed}</span>
          <Toggle
            pressed={logarithmic.value}
            title="Logarithmic density"
            onToggle={() => (logarithmic.value = !logarithmic.peek())}
          >
            log
          </Toggle>
        </>
      }
    >
      <div class="response">
        <div class="response-plot" ref={box} data-empty={place.value === null}>
          {place.value === null && <p class="stage-empty">Click a pixel in one of the pictures.</p>}
        </div>
        <PeakTable peaks={shown.value?.peaks ?? []} />
      </div>
    </Panel>
  );
}

function sampleText(time_ns: number, density: number): string {
  const range_m = rangeOfTime_m(time_ns * 1e-9);
  return `${fixed(time_ns, 2, "ns")} · ${fixed(range_m, 2, "m")} · ${significant(density, 3, "DN/ns")}`;
}

function PeakTable({ peaks: listed }: { peaks: readonly Peak[] }) {
  if (listed.length === 0) return null;
  return (
    <table class="peaks">
      <caption class="quiet">Peaks of the density</caption>
      <thead>
        <tr>
          <th scope="col">time</th>
          <th scope="col">range</th>
          <th scope="col">light</th>
        </tr>
      </thead>
      <tbody>
        {listed.map((peak, at) => (
          <tr key={at}>
            <td>{fixed(peak.time_s * 1e9, 2, "ns")}</td>
            <td>{fixed(rangeOfTime_m(peak.time_s), 2, "m")}</td>
            <td>{fixed(100 * peak.share, 0, "%")}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
