import { effect, type ReadonlySignal, type Signal, untracked, useComputed, useSignal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { rangeOfTime_m } from "../../physics/constants";
import { pixelOf } from "../../physics/reflection";
import { deviation, fixed, significant } from "../../scales/format";
import { autoLimits, type Span } from "../../scales/scale";
import { type Frame, wasSent } from "../../store/frames";
import { PIN_COLOURS } from "../../store/measures";
import type { Pixel } from "../../store/pixel";
import type { Lit } from "../../store/player";
import { aBoolean, type Setting } from "../../store/settings";
import { type Store, useStore } from "../../store/store";
import { Tabs, Toggle } from "../../ui/controls";
import { saveTable } from "../../ui/download";
import type { PlotWords } from "../../ui/drawing";
import { captionOf } from "../../ui/figure";
import { useComputedOf, useDrawing, useProducts } from "../../ui/hooks";
import { Panel } from "../../ui/Panel";
import { FirstFrame } from "../../ui/Stage";
import { usePlot } from "../plots/page";
import { litOf, steady } from "../transient/arrivals";
import { drawnOf, rowsOf, type Subject } from "./curves";
import { FlagHistory } from "./flagShares";
import { richestPixel } from "./interesting";
import { FlagWords, Found } from "./Listings";
import { MomentsPlane } from "./MomentsPlane";
import { type ResponsePlot, responsePlot } from "./plot";
import { ReturnHistory } from "./returns";
import { ASPECTS, type Aspect, SIDE, SIDES } from "./sides";
import { NO_STEMS, stemsOf } from "./stems";
import "./ResponseView.css";
import type { PixelDocument } from "../../stream/documents";

const LOGARITHMIC: Setting<boolean> = { key: "response.logarithmic", initial: false, ...aBoolean() };
/** Only the part of the period is plotted in which the picture has light. */
const LIT: Setting<boolean> = { key: "response.lit", link: "lit", initial: false, ...aBoolean() };
const PERIOD: Lit = { first: 0, last: 1 };

/** Share of the height that the axis was made for which is left after a frame without such a peak. */
const SHRINK = 0.96;

/** Everything about the selected pixel; its curves are computed here from the streamed coefficients. */
export function ResponseView() {
  const store = useStore();
  const { absent, amplitude } = store.frames;
  const obstacle = absent.value.coefficients;
  useProducts(["coefficients", "range", amplitude.value]);
  const flags = useMemo(() => new FlagHistory(), []);
  const returns = useMemo(() => new ReturnHistory(), []);
  const frame = store.frames.of(obstacle === undefined ? "coefficients" : "range");
  useEffect(() => store.details.follow(store.selected, frame), [store, frame]);
  // The curves wait for what the service says of the same frame.
  const looked = useComputedOf([store, frame], () => store.details.frame.value ?? frame.value);
  useEffect(() => selectFirst(store, frame), [store, frame]);
  const side = store.settings.of(SIDE);
  const shown = useComputedOf([looked, store], () => {
    const coefficients = looked.value?.coefficients;
    const pixel = store.selected.value;
    if (!coefficients || pixel === null) return null;
    if (pixel.x >= coefficients.width || pixel.y >= coefficients.height) return null;
    if (looked.value !== null && !wasSent(looked.value, pixel)) return null;
    const index = pixel.y * coefficients.width + pixel.x;
    return { pixel, coefficients, index };
  });
  const levinson = useComputed(() => (shown.value === null ? null : pixelOf(shown.value.coefficients, shown.value.index)));
  const logarithmic = store.settings.of(LOGARITHMIC);
  const pointed = useSignal("");
  const pixel = useComputedOf([shown], () =>
    absent.value.coefficients === undefined ? (shown.value?.pixel ?? null) : store.selected.value,
  );
  const frameless = useComputedOf([frame], () => frame.value === null);
  const place = useComputed(() => (pixel.value === null ? null : `${pixel.value.x}, ${pixel.value.y}`));
  const download = (aspect: Aspect) => (): void => {
    const now = shown.peek();
    if (now === null) return;
    const truth = store.details.document.peek()?.truth ?? null;
    saveTable(nameOf(aspect), rowsOf(drawnOf(aspect, now, store.measures.pins.peek(), truth)));
  };
  const nameOf = (what: string): string => `pixel-${place.peek()?.replace(", ", "-")}-${what}-${looked.peek()?.meta.frame ?? 0}`;
  const files = ASPECTS.map(({ value, text }) => ({ text: `${text} (CSV)`, run: download(value) }));
  const words = (): PlotWords => {
    const meta = looked.peek()?.meta;
    const title = `${SIDES.find(({ value }) => value === side.peek())?.text} at pixel ${place.peek()}`;
    return { name: nameOf(side.peek()), title, caption: meta ? captionOf(meta, store.sequence.peek()) : "" };
  };
  return (
    <Panel
      downloads={shown.value === null ? [] : files}
      plot={shown.value === null ? undefined : words}
      title={
        <h2>
          Impulse response <span class="quiet">{place.value === null ? "" : `of pixel ${place.value}`}</span>
        </h2>
      }
      tools={
        <>
          {side.value !== "moments" && <span data-field="sample">{pointed}</span>}
          <Tabs label="What of the pixel" value={side.value} options={SIDES} onChange={(value) => (side.value = value)} />
        </>
      }
    >
      <div class="response grow spaced">
        {obstacle !== undefined ? null : frameless.value ? (
          <FirstFrame />
        ) : (
          place.value === null && <p class="stage-empty cover">Click a pixel in one of the pictures.</p>
        )}
        {obstacle !== undefined ? (
          <p class="absent" data-field="absent">
            This camera has no density of light over time: {obstacle}.
          </p>
        ) : place.value === null ? null : side.value === "moments" ? (
          <MomentsPlane pixel={levinson} />
        ) : (
          <Plot key={side.value} aspect={side.value} logarithmic={logarithmic} shown={shown} returns={returns} pointed={pointed} />
        )}
        {place.value !== null && (
          <aside class="response-side column spaced fades" aria-label="What was found at the pixel" tabIndex={0}>
            <Found flags={flags} returns={returns} details={store.details.document.value} of={looked.value?.meta.frame ?? null} />
            <PixelFigures details={store.details.document.value} />
            <FlagWords flags={flags} looked={store.details.document.value !== null} />
          </aside>
        )}
      </div>
    </Panel>
  );
}

/** Selects a pixel worth looking at with the first frame, unless one was selected before; the answer ends it. */
function selectFirst(store: Store, frame: ReadonlySignal<Frame | null>): () => void {
  return effect(() => {
    const newest = frame.value;
    if (store.selected.value !== null || newest === null) return;
    const [height, width] = newest.shape;
    const pixel = newest.coefficients ? richestPixel(newest.coefficients) : { x: width >> 1, y: height >> 1 };
    // a slow browser has every second pixel while light plays: one of these keeps its curve
    untracked(() => (store.selected.value = pixel && { x: pixel.x & ~1, y: pixel.y & ~1 }));
  });
}

type Shown = Subject & Readonly<{ pixel: Pixel }>;

interface PlotProps {
  readonly aspect: Aspect;
  /** Whether the density's height is logarithmic. */
  readonly logarithmic: Signal<boolean>;
  readonly shown: { readonly value: Shown | null };
  readonly returns: ReturnHistory;
  /** Set to what is under the pointer, in words. */
  readonly pointed: { value: string };
}

/** The curves of one aspect over time of flight. */
function Plot({ aspect, logarithmic: wanted, shown, returns, pointed }: PlotProps) {
  const store = useStore();
  const logarithmic = aspect === "density" && wanted.value;
  const { measures } = store;
  const box = useRef<HTMLDivElement>(null);
  const dark = store.theme.dark.value;
  const held = useRef(0);
  const heldFor = useRef<Pixel | null>(null);
  const top = useRef<Span | null>(null);
  const lit = store.settings.of(LIT);
  const part = useSignal(PERIOD);
  const form = (place: HTMLElement): ResponsePlot =>
    responsePlot(place, {
      aspect,
      logarithmic,
      top: () => top.current?.high ?? 1,
      ends_ns: () => [part.peek().first * store.period_s.peek() * 1e9, part.peek().last * store.period_s.peek() * 1e9],
      seek: (time_ns) => {
        store.player.playing.value = false;
        store.player.seek((time_ns * 1e-9) / store.period_s.peek());
      },
      point: (sample) => (pointed.value = sample === null ? "" : sampleText(sample.time_ns, sample.value, aspect)),
    });
  const { made: plot, size } = usePlot(box, form, [store, dark, logarithmic, aspect]);

  useDrawing(() => {
    const now = shown.value;
    const details = store.details.document.value;
    const truth = details?.truth ?? null;
    if (plot.value === null || size.value.width === 0) return;
    if (now === null) {
      plot.value.show(null, NO_STEMS, new Map());
      return;
    }
    const { curves, ofPins } = drawnOf(aspect, now, measures.pins.value, truth);
    let highest = 0; // NaN never counts
    for (const line of [...curves.lines, ...ofPins.values()]) for (const value of line) if (value > highest) highest = value;
    // A peak's height is its noisiest figure: the axis grows with it at once and shrinks slowly.
    held.current = now.pixel === heldFor.current ? Math.max(highest, SHRINK * held.current) : highest;
    heldFor.current = now.pixel;
    top.current = autoLimits(top.current, { low: 0, high: held.current });
    const arrivals = lit.value && store.frames.of("coefficients").value?.light?.arrivals;
    part.value = (arrivals && steady(part.peek(), litOf(arrivals))) || PERIOD;
    if (details !== null) returns.take(details, store.frames.sceneOf(details.meta));
    plot.value.show(curves, details === null ? NO_STEMS : stemsOf(details, truth, returns), ofPins);
  }, [plot, shown, returns, aspect]);

  useDrawing(() => {
    const { first, last } = part.value;
    const place = (store.player.turn.value - first) / (last - first);
    if (plot.value !== null) Object.assign(plot.value.head, { hidden: place < 0 || place > 1 }).style.left = `${100 * place}%`;
  }, [plot]);

  const simulated = store.details.document.value?.truth != null;
  return (
    <div class="response-plot-box column grow">
      <div class="response-plot grow" ref={box} data-empty={shown.value === null} data-aspect={aspect} />
      <div class="key wrapped small">
        {aspect === "bounds" && (
          <span class="key-band" title="Any light with these moments lies within them">
            bounds
          </span>
        )}
        <span>estimate</span>
        {measures.pins.value.map(({ name }) => (
          <span key={name} class="key-pin" style={{ "--line": PIN_COLOURS[name] }}>
            {name}
          </span>
        ))}
        <span class="key-stem" title="As high as their share of the light">
          returns ± 1 σ
        </span>
        {simulated && (
          <span style={{ "--line": "var(--truth)" }} title="Stems are the true returns, as high as their share of the light">
            truth
          </span>
        )}
        {aspect === "bounds" && (
          <em title="Bounds hold for densities smoothed with the Poisson kernel; so is all that is drawn here">smoothed</em>
        )}
        {aspect !== "cumulative" && !logarithmic && (
          <em title="Height: linear near zero, logarithmic where it is high, so that what is dim stays in sight beside narrow and high peaks">
            asinh
          </em>
        )}
        <Toggle on={lit} title="Only the time between the first and the last light of the picture, instead of the whole period">
          lit
        </Toggle>
        {aspect === "density" && (
          <Toggle on={wanted} title="Logarithmic density">
            log
          </Toggle>
        )}
      </div>
    </div>
  );
}

function sampleText(time_ns: number, value: number, aspect: Aspect): string {
  const range_m = rangeOfTime_m(time_ns * 1e-9);
  return `${fixed(time_ns, 2, "ns")} · ${fixed(range_m, 2, "m")} · ${significant(value, 3, aspect === "cumulative" ? "DN" : "DN/ns")}`;
}

/** Range, time and light of the first return of a pixel, by the service; of the range its error, of the light how it scatters. */
function PixelFigures({ details }: { details: PixelDocument | null }) {
  const { frames, noises, rangeErrors } = useStore();
  const ofLight = frames.amplitude.value === "direct" ? "direct" : "brightness";
  const noise = noises.of(ofLight);
  void noise.frames.value; // read so that this follows what was measured
  const range_m = details?.range_m ?? NaN;
  const [error_m, light_std] =
    details === null ? [NaN, NaN] : [rangeErrors.at("range_error", details), noise.std(details.y * details.meta.width + details.x)];
  const row = (name: string, value: string, std: string, field: string) => (
    <tr>
      <th scope="row">{name}</th>
      <td data-field={field}>{value}</td>
      <td class="quiet" data-field={`${field}-std`}>
        {std}
      </td>
    </tr>
  );
  return (
    <table class="listing pixel-figures">
      <caption class="quiet" title="Half of the 90 % interval of the range; standard deviation (1 σ) of the light over the last frames">
        This pixel, range ± 90 %, light ± 1 σ
      </caption>
      <tbody>
        {row("range", fixed(range_m, 3, "m"), deviation(error_m, "m"), "pixel-range")}
        {row("time", fixed((range_m / rangeOfTime_m(1)) * 1e9, 2, "ns"), deviation(error_m / rangeOfTime_m(1), "s"), "pixel-time")}
        {row(ofLight, fixed(details?.[ofLight], 0, "DN"), deviation(light_std, "DN"), "pixel-light")}
      </tbody>
    </table>
  );
}
