import { useComputed } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { rangeOfTime_m } from "../../physics/constants";
import { densityAt } from "../../physics/maximumEntropy";
import { Poles } from "../../physics/poles";
import { fixed, significant } from "../../scales/format";
import { GATE_S, gateStart_rad, NAMES, type Play, type TransientLook } from "../../store/lightLook";
import { AMPLITUDE } from "../../store/mapCatalogue";
import { SPEEDS_NS } from "../../store/player";
import { type Store, useStore } from "../../store/store";
import { Button, Check, Choice, ColourChoice, Tabs, ToneChoice } from "../../ui/controls";
import { saveNumbers, savePicture } from "../../ui/download";
import { captionOf, timeWords } from "../../ui/figure";
import { type FigureParts, pictureFiles } from "../../ui/figureFiles";
import { useComputedOf, useDrawing, useProducts } from "../../ui/hooks";
import { PauseIcon, PlayIcon } from "../../ui/icons";
import { Panel } from "../../ui/Panel";
import { gapsOf, litOf, peaksOf, steady, turnsOf } from "./arrivals";
import { Filming, FilmProgress } from "./Filming";
import { LightBar, lightScale } from "./LightBar";
import { LightSoFar, Picture } from "./Picture";
import { PICTURES, stripOf } from "./strip";
import { Timeline, TimeReadout } from "./Timeline";
import "./TransientView.css";
import { PopoverButton } from "../../ui/PopoverButton";

const PLAY_TABS: readonly { readonly value: Play; readonly text: string; readonly hint: string }[] = [
  { value: "density", text: "In flight", hint: "The light that arrives at one time" },
  {
    value: "gate",
    text: "Last 1 ns",
    hint: "The light that came within the nanosecond before: a front that is too thin to be seen leaves a trail",
  },
  { value: "cumulative", text: "So far", hint: "All light that has come up to that time" },
];

/** Light in flight: the density of Eq. (2) at one time of flight, evaluated in this browser. */
export function TransientView() {
  const store = useStore();
  useProducts(["coefficients", AMPLITUDE]);
  const frame = store.frames.of("coefficients");
  const { player, light: look } = store;
  const filming = useMemo(() => new Filming(), []);
  useDrawing(() => {
    const arrivals = frame.value?.light?.arrivals;
    if (arrivals === undefined) return;
    // What is gathered over a time stays in sight.
    const trail = look.play.value === "gate" ? GATE_S / store.period_s.value : 0;
    const gaps = look.play.value === "cumulative" ? [] : gapsOf(arrivals, trail);
    player.learn(steady(player.lit.peek(), litOf(arrivals)), peaksOf(arrivals), gaps);
  }, [frame, player]);
  const play = look.play.value;
  const subject = useMemo(() => ({ snapshot: () => look.snapshot(), parts: () => partsOf(look, store) }), [look, store]);
  const figureName = (): string => `${look.play.peek()}-${Math.round(player.time_s.peek() * 1e12)}ps-${frame.peek()?.meta.frame ?? 0}`;
  const files = [...pictureFiles(figureName, subject.snapshot, subject.parts), ...filming.actions(subject, store)];
  useEffect(() => {
    look.files.value = files;
    // A film ends with the picture that it is taken of.
    return () => {
      filming.cancel();
      [look.snapshot, look.files.value] = [() => null, []];
    };
  }, [look, filming]);
  return (
    <Panel
      downloads={[
        ...files,
        {
          text: "Strip of 8 times (PNG)",
          run: () => {
            const arrivals = frame.peek()?.light?.arrivals;
            if (arrivals === undefined) return;
            const turn = player.turn.peek();
            const strip = stripOf(turnsOf(arrivals, PICTURES), store.period_s.peek(), (each) => {
              player.seek(each);
              return look.snapshot();
            });
            player.seek(turn);
            savePicture(`${look.play.peek()}-strip-${frame.peek()?.meta.frame ?? 0}`, strip);
          },
        },
        { text: "Coefficients (NPY)", run: () => saveNumbers(store.api, frame.peek()) },
      ]}
      tools={
        <>
          <Tabs label="What of the light" value={look.play.value} options={PLAY_TABS} onChange={(play) => (look.play.value = play)} />
          <LookMenu look={look} />
        </>
      }
    >
      <div class="picture grow spaced">
        {play === "density" ? <Picture look={look} /> : <LightSoFar look={look} />}
        <LightBar look={look} play={play} />
      </div>
      <footer class="panel-foot column spaced">
        <p class="panel-row small quiet">
          Light crosses the room, slowed {slowness(player.speed_ns.value)} times. Click a pixel to see when its light came back.{" "}
          <Button class="link" onClick={() => (store.dialog.value = "examples")}>
            More to see
          </Button>
        </p>
        <FilmProgress filming={filming} />
        <Timeline />
        <div class="panel-row wrapped apart">
          <Button
            class="play"
            aria-label={player.playing.value ? "Pause" : "Play"}
            title={player.playing.value ? "Pause (space)" : "Play (space)"}
            onClick={() => player.toggle()}
          >
            {player.playing.value ? <PauseIcon /> : <PlayIcon />}
          </Button>
          <TimeReadout />
          <DensityReadout play={play} />
          <Choice bare label="Speed" chosen={player.speed_ns} of={SPEEDS_NS} text={(speed) => `${speed} ns/s`} />
        </div>
      </footer>
    </Panel>
  );
}

/** What is written around a figure or a film of the light. */
function partsOf(look: TransientLook, store: Store): FigureParts {
  const time_s = store.player.time_s.peek();
  const meta = store.frames.of("coefficients").peek()?.meta;
  return {
    ...lightScale(look, store, look.play.peek()),
    title: `${NAMES[look.play.peek()]}, ${timeWords(time_s, rangeOfTime_m(time_s))}`,
    caption: meta === undefined ? "" : captionOf(meta, store.sequence.peek(), store.measures.notes),
    colours: look.colours.peek(),
    ground: "black",
  };
}

/** Times slower than real: 5 ns of flight in a second are 200 million. */
function slowness(speed_ns: number): string {
  const millions = 1e3 / speed_ns;
  return millions < 1000 ? `${millions} million` : `${millions / 1000} billion`;
}

/** The density at the pixel looked at, at the player's time; or the light within the gate or up to then. */
function DensityReadout({ play }: { play: Play }) {
  const poles = useRef<Poles | null>(null);
  const store = useStore();
  const density = useComputedOf([store, play], () => {
    const coefficients = store.frames.of("coefficients").value?.coefficients;
    const pixel = store.pointed.value ?? store.selected.value;
    if (!coefficients || pixel === null) return NaN;
    if (pixel.x >= coefficients.width || pixel.y >= coefficients.height) return NaN;
    const index = pixel.y * coefficients.width + pixel.x;
    const phase_rad = store.player.phase_rad.value;
    if (play === "density") return densityAt(coefficients, index, phase_rad);
    if (poles.current?.harmonics !== coefficients.harmonics) poles.current = new Poles(coefficients.harmonics, 1);
    poles.current.findOne(coefficients, index, 0);
    const before = play === "gate" ? poles.current.upTo(0, gateStart_rad(phase_rad, store.period_s.value)) : 0;
    return poles.current.upTo(0, phase_rad) - before;
  });
  const text = useComputed(() =>
    Number.isNaN(density.value) ? "" : play === "density" ? significant(density.value * 1e-9, 3, "DN/ns") : fixed(density.value, 0, "DN"),
  );
  return (
    <span class="readout-density grow roomy" data-field="density">
      {text}
    </span>
  );
}

const STOPS = [-4, -3, -2, -1, 0, 1, 2, 3, 4, 6, 8];

/** How the light is shown, behind a button. */
function LookMenu({ look }: { look: TransientLook }) {
  return (
    <PopoverButton face="Look" label="Look of the light" title="Tone, exposure and colours" kind="look">
      <ToneChoice tone={look.tone} />
      <Choice label="Exposure" chosen={look.stops} of={STOPS} text={stopsText} />
      <ColourChoice colours={look.colours} />
      {look.play.value === "density" && (
        <Check
          title="Show the still scene behind the light"
          checked={look.backdrop.value}
          onChange={(shown) => (look.backdrop.value = shown)}
        >
          Scene behind the light
        </Check>
      )}
    </PopoverButton>
  );
}

/** Exposure as photographers count it: a stop is a factor of two. */
function stopsText(stops: number): string {
  const count = Math.abs(stops);
  return stops === 0 ? "as metered" : `${count} ${count === 1 ? "stop" : "stops"} ${stops > 0 ? "brighter" : "darker"}`;
}
