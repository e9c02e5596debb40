import { useComputed, useSignal } from "@preact/signals";
import { useMemo, useRef } from "preact/hooks";
import { rangeOfTime_m } from "../../physics/constants";
import { COLOUR_MAPS, type ColourMapName } from "../../scales/colourMaps";
import { fixed, significant } from "../../scales/format";
import { scaleOf, TONES, type ToneKind } from "../../scales/tone";
import { oneOf, type Setting } from "../../store/settings";
import { useStore } from "../../store/store";
import { ColourBar } from "../../ui/ColourBar";
import { ColourChoice, ToneChoice } from "../../ui/controls";
import { npy, save } from "../../ui/download";
import { captionOf } from "../../ui/figure";
import { type FigureParts, pictureFiles } from "../../ui/figureFiles";
import { useDrawing, usePictureSize, useProducts } from "../../ui/hooks";
import { Panel } from "../../ui/Panel";
import { PopoverButton } from "../../ui/PopoverButton";
import { draw } from "../../ui/paint";
import { Ticks } from "../../ui/Ticks";
import { BINS, paintStreak, Streak, whiteOf } from "./streak";
import "../../ui/Marks.css";
import "./StreakView.css";

const TONE: Setting<ToneKind> = { key: "streak.tone", initial: "root", ...oneOf(TONES) };
const COLOURS: Setting<ColourMapName> = { key: "streak.colours", initial: "inferno", ...oneOf(COLOUR_MAPS) };

/** One row of the picture over time of flight: columns across, time downwards. */
export function StreakView() {
  const store = useStore();
  useProducts(["coefficients"]);
  const frame = store.frames.of("coefficients");
  const tone = store.settings.of(TONE);
  const colours = store.settings.of(COLOURS);
  const streak = useMemo(() => new Streak(), []);
  const canvas = useRef<HTMLCanvasElement>(null);
  const bright = useSignal(NaN);
  const pointed = useSignal<{ x: number; bin: number } | null>(null);
  const [width, height] = usePictureSize(frame);
  const row = useComputed(() => Math.min(height - 1, store.selected.value?.y ?? height >> 1));

  useDrawing(() => {
    const coefficients = frame.value?.coefficients;
    const [y, toneNow, coloursNow] = [row.value, tone.value, colours.value];
    if (!coefficients || canvas.current === null || y >= coefficients.height) return;
    streak.compute(coefficients, y);
    const white = whiteOf(streak.values);
    if (!(Math.abs(Math.log(white / bright.peek())) < 0.2)) bright.value = white; // not with every frame's noise
    draw(canvas.current, streak.width, BINS, (rgba) => paintStreak(streak.values, bright.peek(), toneNow, coloursNow, rgba));
    Object.assign(canvas.current.dataset, { frame: frame.peek()?.meta.frame, row: y, white: bright.peek(), colours: coloursNow });
  }, [frame, row]);

  const placeOf = (event: PointerEvent): { x: number; turn: number } => {
    const box = (event.currentTarget as HTMLElement).getBoundingClientRect();
    const inside = (share: number): number => Math.min(1 - 1e-9, Math.max(0, share));
    return { x: Math.floor(inside((event.clientX - box.left) / box.width) * width), turn: inside((event.clientY - box.top) / box.height) };
  };
  const choose = (event: PointerEvent): void => {
    const { x, turn } = placeOf(event);
    store.selected.value = { x, y: row.peek() };
    store.player.playing.value = false;
    store.player.seek(turn);
  };
  const period_ns = store.period_s.value * 1e9;
  const words = useComputed(() => {
    const at = pointed.value;
    if (frame.value === null || at === null) return "";
    const time_s = ((at.bin + 0.5) / BINS) * store.period_s.value;
    const density = streak.values[at.bin * streak.width + at.x] * 1e-9;
    return `column ${at.x} · ${fixed(time_s * 1e9, 1, "ns")} · ${fixed(rangeOfTime_m(time_s), 2, "m")} · ${significant(density, 3, "DN/ns")}`;
  });
  const scale = useComputed(() => scaleOf(tone.value, Number((bright.value * 1e-9).toPrecision(3))));
  const parts = (): FigureParts | null => {
    const meta = frame.peek()?.meta;
    if (meta === undefined) return null;
    const [title, caption] = [`Density of row ${row.peek()} over time of flight`, captionOf(meta, store.sequence.peek())];
    return {
      title,
      caption,
      scale: scale.peek(),
      colours: colours.peek(),
      unit: "DN/ns",
      ground: "black",
      sides: 1e9 * store.period_s.peek(),
    };
  };
  const name = (): string => `streak-row-${row.peek()}-${frame.peek()?.meta.frame ?? 0}`;
  return (
    <Panel
      title={
        <h2>
          Streak <span class="quiet">of row {row.value}</span>
        </h2>
      }
      tools={
        <PopoverButton face="Look" label="Look of the streak" title="Tone and colours" kind="look">
          <ToneChoice tone={tone} />
          <ColourChoice colours={colours} />
        </PopoverButton>
      }
      downloads={[
        ...pictureFiles(name, () => canvas.current, parts),
        { text: "Density in DN/s (NPY)", run: () => save(`${name()}.npy`, new Blob([npy(streak.values, [BINS, streak.width])])) },
      ]}
    >
      <div class="streak grow spaced">
        <Ticks class="streak-axis" side="top" end={period_ns} write={(time_ns) => fixed(time_ns, 0, "ns")} />
        <div
          class="streak-picture grow"
          role="img"
          aria-label={`Streak image of row ${row.value}: columns across, time of flight downwards`}
          onPointerMove={(event) => {
            const { x, turn } = placeOf(event);
            pointed.value = { x, bin: Math.floor(turn * BINS) };
          }}
          onPointerLeave={() => (pointed.value = null)}
          onPointerDown={(event) => {
            if (event.button === 0) choose(event);
          }}
        >
          <canvas ref={canvas} class="cover" data-product="streak" />
          <Marks width={width} />
        </div>
        {bright.value > 0 && <ColourBar scale={scale.value} colours={colours.value} unit="DN/ns" />}
      </div>
      <footer class="panel-foot column spaced">
        <div class="panel-row wrapped apart">
          <label class="scanline row">
            <span class="quiet">Scanline</span>
            <input
              type="range"
              min={0}
              max={height - 1}
              value={row.value}
              aria-label="Scanline"
              onInput={(event) =>
                (store.selected.value = { x: store.selected.peek()?.x ?? width >> 1, y: event.currentTarget.valueAsNumber })
              }
            />
          </label>
          <span class="clipped" data-field="streak">
            {words}
          </span>
        </div>
      </footer>
    </Panel>
  );
}

/** The player's time and the selected column. */
function Marks({ width }: { width: number }) {
  const store = useStore();
  const selected = store.selected.value;
  return (
    <div class="mark cover" style={{ "--y": `${100 * store.player.turn.value}%`, "--x": `${(100 * ((selected?.x ?? 0) + 0.5)) / width}%` }}>
      <i class="mark-row" />
      {selected !== null && <i class="mark-column" />}
    </div>
  );
}
