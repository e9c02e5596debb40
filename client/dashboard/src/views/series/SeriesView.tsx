import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { engineering, fixed, numberOf } from "../../scales/format";
import { hasEnded } from "../../store/jobs";
import { askedRegion } from "../../store/measures";
import type { SeriesRow } from "../../store/series";
import { useStore } from "../../store/store";
import { Button, Form, NumberField, TextField } from "../../ui/controls";
import { saveTable } from "../../ui/download";
import { Panel } from "../../ui/Panel";
import { Obstacle, Steer, TaskLine } from "../../ui/Steer";
import { useTask } from "../../ui/useTask";
import "./SeriesView.css";

const COLUMNS: readonly (readonly [string, (row: SeriesRow) => string])[] = [
  ["m", (row) => String(row.harmonics)],
  ["Exposure", (row) => engineering(Number(row.exposure_s), "s", 3)],
  ["Takes", (row) => String(row.takes)],
  ["Estimator", (row) => `${row.estimator}, ${row.neighbours}`],
  ["Time", (row) => engineering(Number(row.capture_s), "s", 3)],
  ["Noise", (row) => metres(row.range_std_m)],
  ["Bias", (row) => (row.range_bias_m === null ? "–" : `${metres(row.range_bias_m)} (${row.reference})`)],
  ["Within", (row) => share(row.within_share)],
  ["Valid", (row) => share(row.valid_share)],
];

/** Frames at each of several settings, and how far their ranges scatter and are off. */
export function SeriesView() {
  const { series, sequence, measures, reconstruction } = useStore();
  const task = useTask();
  const harmonics = useSignal("3, 4");
  const exposures_us = useSignal("");
  const takes = useSignal("");
  const estimators = useSignal("");
  const neighbours = useSignal("");
  useEffect(() => void reconstruction.refresh(), [reconstruction]);
  const now = reconstruction.document.value?.document;
  const frames = useSignal("100");
  const target_mm = useSignal("10");
  useEffect(() => void series.show(), [series, series.id.value]);
  const job = series.job.value;
  const running = job !== null && !hasEnded(job);
  const rows = series.rows;
  const most_m = Math.max(...rows.map(({ range_std_m }) => Number(range_std_m)));
  const start = (): void => {
    const sequences = listed(harmonics.value).flatMap((m) =>
      listed(exposures_us.value).flatMap((us) =>
        listed(takes.value).map((n) => ({ ...of("harmonics", m), ...of("exposure_s", us, 1e-6), ...of("takes", n) })),
      ),
    );
    const computed = named("estimator", estimators.value).flatMap((by) =>
      named("neighbours", neighbours.value).map((over) => ({ ...by, ...over })),
    );
    const settings = sequences.flatMap((sequence) => computed.map((reconstruction) => ({ sequence, reconstruction })));
    const region = askedRegion(measures.region.value);
    void task.run("", () => series.start({ settings, frames: numberOf(frames.value), target_m: numberOf(target_mm.value) * 1e-3, region }));
  };
  const csv = (): void => saveTable(`series-${series.id.value}`, [Object.keys(rows[0]), ...rows.map((row) => Object.values(row))]);
  return (
    <Panel downloads={rows.length === 0 ? [] : [{ text: "Table (CSV)", run: csv }]}>
      <div class="panel-body column grow fades">
        <Obstacle />
        <Form class="series-form wrapped spaced" onSubmit={start}>
          <TextField label="Harmonics m" name="harmonics" text={harmonics} />
          <TextField
            label="Exposures in µs"
            name="exposures"
            placeholder={`${fixed(1e6 * (sequence.value?.exposure_s ?? 0), 0, "")} now`}
            text={exposures_us}
          />
          <TextField label="Takes" name="takes" placeholder={`${sequence.value?.takes ?? ""} now`} text={takes} />
          <NumberField label="Frames at each" unit="" name="frames" text={frames} />
          <NumberField label="Target" unit="mm" name="target" text={target_mm} />
          <TextField label="Estimators" name="estimators" placeholder={`${now?.estimator ?? ""} now`} text={estimators} />
          <TextField label="Neighbours" name="neighbours" placeholder={`${now?.neighbours ?? ""} now`} text={neighbours} />
          <Steer type="submit" class="primary" disabled={running}>
            Start
          </Steer>
        </Form>
        <p class="small quiet">
          {measures.region.value === null ? "Of all pixels: mark a region in a map for a part." : "Of the marked region."}
        </p>
        {running && (
          <p class="row spaced" role="status" data-field="series-status">
            <progress value={job.progress} aria-label="Series" />
            {job.step}
            <Button onClick={() => void series.cancel()}>Cancel</Button>
          </p>
        )}
        {job?.problem && <p class="refusal">{String(job.problem.detail)}</p>}
        <TaskLine task={task} field="series-task" />
        {rows.length > 0 && (
          <div class="scrolls">
            <table class="series-table">
              <thead class="small quiet">
                <tr>
                  {COLUMNS.map(([name]) => (
                    <th key={name} scope="col">
                      {name}
                    </th>
                  ))}
                  <th scope="col">Noise compared</th>
                </tr>
              </thead>
              <tbody>
                {rows.map((row, n) => (
                  <tr key={n}>
                    {COLUMNS.map(([name, text]) => (
                      <td key={name}>{text(row)}</td>
                    ))}
                    <td>
                      <meter min={0} max={most_m} value={Number(row.range_std_m)} aria-label="Noise over that of the noisiest setting" />
                    </td>
                  </tr>
                ))}
              </tbody>
            </table>
          </div>
        )}
      </div>
    </Panel>
  );
}

/** The numbers of a list; one that is NaN, for what stays as it is, of an empty one. */
function listed(text: string): number[] {
  return text.trim() === "" ? [Number.NaN] : wordsOf(text).map(numberOf);
}

function wordsOf(text: string): string[] {
  return text.split(/[;,\s]+/).filter(Boolean);
}

/** A field by each word of a list; none, for what stays as it is, of an empty one. */
function named(field: string, text: string): Record<string, string>[] {
  const words = wordsOf(text);
  return words.length === 0 ? [{}] : words.map((word) => ({ [field]: word }));
}

function of(field: string, value: number, unit = 1): Record<string, number> {
  return Number.isNaN(value) ? {} : { [field]: value * unit };
}

function metres(value: number | string | null): string {
  return value === null ? "–" : engineering(Number(value), "m", 3);
}

function share(value: number | string | null): string {
  return value === null ? "–" : fixed(100 * Number(value), 1, "%");
}
