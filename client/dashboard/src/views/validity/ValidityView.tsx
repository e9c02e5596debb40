import { type ReadonlySignal, useComputed } from "@preact/signals";
import { useRef } from "preact/hooks";
import { fixed, grouped, NOTHING } from "../../scales/format";
import { drawnOf, type Frame, sentOf } from "../../store/frames";
import { aBoolean, type Setting } from "../../store/settings";
import { useStore } from "../../store/store";
import { Toggle } from "../../ui/controls";
import { type Rows, saveNumbers, savePicture, saveTable } from "../../ui/download";
import { NEEDS } from "../../ui/flags";
import { useDrawing, useProducts } from "../../ui/hooks";
import { Panel } from "../../ui/Panel";
import { draw } from "../../ui/paint";
import { Stage } from "../../ui/Stage";
import { countReasons, paintReasons, REASONS, type Reasons } from "./reasons";
import "../response/Listings.css";
import "./ValidityView.css";

/** Whether it is shown which ranges can be trusted, instead of the flags. */
const TRUST: Setting<boolean> = { key: "validity.trust", link: "trust", initial: false, ...aBoolean() };

/** Which pixels something is wrong with, and what. */
export function ValidityView() {
  const store = useStore();
  const amplitude = store.frames.amplitude.value;
  const trust = store.settings.of(TRUST);
  const reasons = REASONS[trust.value ? "trust" : "flags"];
  useProducts([reasons.product, amplitude]);
  const frame = store.frames.of(reasons.product);
  const scene = store.frames.of(amplitude);
  const canvas = useRef<HTMLCanvasElement>(null);
  useDrawing(() => {
    const [newest, brightness] = [frame.value, scene.value];
    if (newest === null || canvas.current === null) return;
    const [rows, columns] = newest.shape;
    const light = brightness?.values.length === newest.values.length ? drawnOf(brightness) : null;
    draw(canvas.current, columns, rows, (rgba) => paintReasons(reasons, newest.values, light, brightness?.map?.high ?? 1, rgba));
    canvas.current.dataset.frame = String(newest.meta.frame);
  }, [frame, scene, reasons]);
  return (
    <Panel
      tools={
        <Toggle on={trust} title="Which ranges can be trusted, and why">
          Trust
        </Toggle>
      }
      downloads={[
        { text: "Picture (PNG)", run: () => savePicture(`${reasons.product}-${frame.peek()?.meta.frame ?? 0}`, canvas.current) },
        {
          text: "Counts (CSV)",
          run: () => saveTable(`${reasons.product}-${frame.peek()?.meta.frame ?? 0}`, countRows(reasons, frame.peek())),
        },
        { text: `${trust.value ? "Trust" : "Flags"} (NPY)`, run: () => saveNumbers(store.api, frame.peek()) },
      ]}
    >
      <Stage frame={frame} label="Validity map">
        <canvas ref={canvas} data-product={reasons.product} />
      </Stage>
      <Legend key={reasons.product} frame={frame} reasons={reasons} />
    </Panel>
  );
}

/** How many pixels have each reason; no number where it could not be judged. */
function countRows(reasons: Reasons, frame: Frame | null): Rows {
  const { total, valid, byName } = countReasons(reasons, frame === null ? [] : sentOf(frame));
  const unjudged = reasons.product === "trust" ? (frame?.meta.accuracy?.not_judged ?? []) : [];
  const named = Object.entries({ good: valid, ...byName }).map(([name, count]) => [name, unjudged.includes(name) ? NaN : count] as const);
  return [["name", "pixels", "share_percent"], ...named.map(([name, count]) => [name, count, (100 * count) / total])];
}

function Legend({ frame, reasons }: { frame: ReadonlySignal<Frame | null>; reasons: Reasons }) {
  const counts = useComputed(() => countReasons(reasons, frame.value === null ? [] : sentOf(frame.value)));
  const { total, valid, byName } = counts.value;
  const unjudged = reasons.product === "trust" ? frame.value?.meta.accuracy?.not_judged : undefined;
  const share = (count: number): string => fixed(total === 0 ? NaN : (100 * count) / total, count === 0 || count === total ? 0 : 1, "%");
  return (
    <table class="listing legend">
      <tbody>
        <tr data-flag="valid">
          <th scope="row">
            <Swatch colour={null} /> {reasons.good[0]}
          </th>
          <td>{grouped(valid)}</td>
          <td>{share(valid)}</td>
          <td class="legend-words">{reasons.good[1]}</td>
        </tr>
        {reasons.all.map(({ name, title, words, colour }) => {
          const unknown = unjudged?.includes(name) ?? false;
          const said = unknown ? `not judged: it needs ${NEEDS[name]}` : words;
          return (
            <tr key={name} data-flag={name} class={byName[name] === 0 ? "quiet" : ""} title={said}>
              <th scope="row">
                <Swatch colour={colour} /> {title}
              </th>
              <td>{unknown ? NOTHING : grouped(byName[name])}</td>
              <td>{unknown ? NOTHING : share(byName[name])}</td>
              <td class="legend-words">{said}</td>
            </tr>
          );
        })}
      </tbody>
    </table>
  );
}

/** A spot of a flag's colour; the greys of what is valid for null. */
function Swatch({ colour }: { colour: string | null }) {
  return (
    <svg class="swatch" viewBox="0 0 12 12" width="12" height="12" aria-hidden="true">
      {colour === null && (
        <linearGradient id="legend-valid">
          <stop offset="0" stop-color="#222" />
          <stop offset="1" stop-color="#ddd" />
        </linearGradient>
      )}
      <rect width="12" height="12" rx="2" fill={colour ?? "url(#legend-valid)"} />
    </svg>
  );
}
