import { type Signal, useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";

import { deviation, engineering, fixed } from "../../scales/format";
import { BLINKS_HZ, beyondShare, differing, type Source, WAYS, type Way } from "../../store/comparison";
import type { Look } from "../../store/looks";
import { type Store, useStore } from "../../store/store";
import { Button, Choice, Form, Remove, Tabs, TextField } from "../../ui/controls";
import { PopoverButton } from "../../ui/PopoverButton";
import { useTask } from "../../ui/useTask";
import { clock, duration } from "../replay/words";
import { valueAtPixel } from "./Readout";

const WORDS: Readonly<Record<Way, string>> = { A: "A", B: "B", difference: "A − B", wipe: "Wipe", blink: "Blink" };

/** What B is, in words. */
export function sourceWords({ comparison, recordings }: Store): string {
  const source = comparison.source.value;
  if (source === null || source.frame === null) return source?.of ?? "";
  return `${recordings.document.value?.recordings.find(({ id }) => id === source.of)?.name ?? source.of}, frame ${source.frame}`;
}

/** What a map is compared with, behind a button. */
export function CompareMenu({ look, name, way }: { look: Look; name: string; way: Signal<Way> }) {
  const { comparison, recordings } = useStore();
  const [task, typed, popover] = [useTask(), useSignal(""), useRef<HTMLDivElement>(null)];
  const choose = async (work: () => Promise<unknown>): Promise<void> => {
    if (!(await task.run("Opening…", work))) return;
    if (way.value === "A") way.value = "difference";
    popover.current?.hidePopover();
  };
  const keep = async (): Promise<void> => {
    const frame = look.frame.peek();
    if (frame !== null) await comparison.keep(frame, typed.peek().trim() || `Frame ${frame.meta.frame}, ${clock(frame.meta.host_time_s)}`);
  };
  const source = (chosen: Source) => () => void choose(async () => (comparison.source.value = chosen));
  // The newest: the rest is found by the search of the recordings' panel.
  const recorded = (recordings.document.value?.recordings ?? []).filter(({ frames }) => frames > 0).slice(0, 8);
  return (
    <PopoverButton
      face="Compare"
      label={`Compare the ${name}`}
      title="Hold what is on screen (A) against a frame that is kept or recorded (B)"
      kind="compare"
      popover={popover}
      onOpened={() => void task.run("Reading what is kept…", () => comparison.look())}
    >
      <Form class="row at-end" onSubmit={() => void choose(keep)}>
        <TextField label="Name" text={typed} />
        <Button type="submit" class="primary" task={task} disabled={look.frame.value === null}>
          Keep this frame
        </Button>
      </Form>
      {comparison.kept.value.map((kept) => (
        <p key={kept} class="row">
          <Button task={task} class="grow clipped" onClick={source({ of: kept, frame: null })}>
            {kept}
          </Button>
          <Remove what={`Remove ${kept}`} onClick={() => void task.run("Removing…", () => comparison.look(kept))} />
        </p>
      ))}
      {recorded.map(({ id, name, started_s }) => (
        <Button key={id} task={task} onClick={source({ of: id, frame: 1 })}>
          {name} <span class="small quiet">{clock(started_s)}</span>
        </Button>
      ))}
      {task.refusal.value !== null && <p class="refusal">{task.refusal.value}</p>}
    </PopoverButton>
  );
}

/** A, B and their difference at a pixel, and in how much of the picture it means something. */
export function Compared({ source, look, way }: { source: Source; look: Look; way: Signal<Way> }) {
  const store = useStore();
  const { comparison, recordings } = store;
  const { product, unit, decimals } = look.product;
  const blink_hz = way.value !== "blink" ? 0 : comparison.blink_hz.value;
  useEffect(() => {
    if (blink_hz === 0) return undefined;
    const timer = setInterval(() => comparison.blink(), 1000 / blink_hz);
    return () => clearInterval(timer);
  }, [comparison, blink_hz]);
  const compared = comparison.of(product);
  const [a, b, apart] = [look.frame.value, compared.b.value, compared.difference.value];
  const pixel = store.pointed.value ?? store.selected.value;
  const difference = valueAtPixel(apart, pixel);
  const errors = product === "range" ? comparison.error_m.value : null;
  const error = apart === null || pixel === null ? NaN : errors?.[pixel.y * apart.shape[1] + pixel.x];
  const unlike = a === null || b === null ? [] : differing(a.meta, b.meta);
  const older_s = a === null || b === null ? NaN : a.meta.host_time_s - b.meta.host_time_s;
  const recording = recordings.document.value?.recordings.find(({ id }) => id === source.of);
  return (
    <div class="panel-row compared" role="group" aria-label="Compared">
      <div class="row">
        <Tabs
          label="A and B"
          value={way.value}
          options={WAYS.map((value) => ({ value, text: WORDS[value] }))}
          onChange={(chosen) => (way.value = chosen)}
        />
        {way.value === "blink" && (
          <Choice
            bare
            label="Changes a second"
            chosen={comparison.blink_hz}
            of={BLINKS_HZ}
            text={(hz) => (hz === 0 ? "by key V" : `${hz} Hz`)}
          />
        )}
        <Remove what="Compare no longer" onClick={() => (comparison.source.value = null)} />
      </div>
      <div class="row">
        <span class="clipped" data-field="source">
          <span class="quiet">B:</span> {sourceWords(store)}
          {Number.isFinite(older_s) && `, ${duration(Math.abs(older_s))} ${older_s < 0 ? "later" : "earlier"}`}
        </span>
        {source.frame !== null && recording !== undefined && (
          <input
            type="range"
            class="grow"
            aria-label="Frame of B"
            min={1}
            max={recording.frames}
            value={source.frame}
            onKeyDown={(event) => event.stopPropagation()} // they would move the light
            onChange={(event) => (comparison.source.value = { ...source, frame: event.currentTarget.valueAsNumber })}
          />
        )}
      </div>
      <p class="line">
        <span data-field="b">B {fixed(valueAtPixel(b, pixel), decimals, unit)}</span>
        <span data-field="difference" title="With half of its 90 % interval, from those of both ranges">
          A − B {unit === "m" ? engineering(difference, unit) : fixed(difference, decimals, unit)} {deviation(error, unit)}
        </span>
        <span class="quiet" data-field="beyond" title="Beyond the 90 % intervals of both: up to a tenth is chance. The others are grey">
          {errors === null || apart === null
            ? "errors not known"
            : `${fixed(100 * beyondShare(apart, errors), 0, "%")} of the trusted differ by more`}
        </span>
        {b !== null && apart === null && <span class="waiting">A and B are of different sizes.</span>}
        {unlike.length > 0 && <span class="waiting">Not measured alike: {unlike.join(", ")}</span>}
        {comparison.trouble.value !== null && <span class="refusal">{comparison.trouble.value}</span>}
      </p>
    </div>
  );
}
