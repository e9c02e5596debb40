/** Films of the light: one pass of it, or the next frames of the camera. */
import { rangeOfTime_m } from "../../physics/constants";
import type { Frame } from "../../store/frames";
import type { Store } from "../../store/store";
import { until } from "../../store/until";
import { figureLayout, figureSvg, timeWords } from "../../ui/figure";
import { type FigureParts, imageOf } from "../../ui/figureFiles";
import { type FilmKind, type Progress, recorderOf } from "../../ui/film";

/** Width of the picture in a film, in px. */
const PICTURE_PX = 490;
/** Pictures a second of one pass, and the most in it. */
const RATE_HZ = 20;
const MOST_PICTURES = 240;
/** Frames of a film of the camera, and the longest that one of them is shown. */
const LIVE_FRAMES = 30;
const LONGEST_S = 2;
const FIRST_S = 0.1;

/** What a film is made of: the picture now, and what is written around it. */
export type Subject = Readonly<{ snapshot: () => HTMLCanvasElement | null; parts: () => FigureParts }>;

/** The canvas of a film; `draw` brings it up to date. Null before there is a picture. */
async function plateOf({ snapshot, parts }: Subject, store: Store): Promise<{ canvas: HTMLCanvasElement; draw: () => void } | null> {
  const first = snapshot();
  if (first === null) return null;
  const [columns, rows] = [first.width, first.height];
  const layout = figureLayout(columns, rows, PICTURE_PX);
  // What changes from picture to picture is written with each.
  const frame = await imageOf(figureSvg({ ...parts(), title: "", caption: "", picture: null, columns, rows }, layout));
  const canvas = document.createElement("canvas");
  // Videos want even sizes.
  [canvas.width, canvas.height] = [layout.width + (layout.width % 2), layout.height + (layout.height % 2)];
  const context = canvas.getContext("2d", { willReadFrequently: true }) as CanvasRenderingContext2D;
  const draw = (): void => {
    const picture = snapshot();
    const { caption } = parts();
    context.fillStyle = "#000";
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.drawImage(frame, 0, 0);
    context.imageSmoothingEnabled = false;
    if (picture !== null) context.drawImage(picture, layout.left, layout.top, layout.pictureWidth, layout.pictureHeight);
    context.fillStyle = "#fff";
    context.font = '600 15px "Inter Variable", sans-serif';
    const time_s = store.player.time_s.peek();
    context.fillText(timeWords(time_s, rangeOfTime_m(time_s)), layout.left, layout.top - 10);
    context.font = '11px "Inter Variable", sans-serif';
    context.fillText(caption, layout.left, layout.height - 12);
  };
  return { canvas, draw };
}

/** One pass of the light over the frame on screen, as fast as it is played; null where it was cancelled. */
export async function filmPass(subject: Subject, store: Store, kind: FilmKind, progress: Progress): Promise<Blob | null> {
  const { player, held } = store;
  const before = { turn: player.turn.peek(), playing: player.playing.peek(), held: held.peek() };
  [player.playing.value, held.value] = [false, true];
  try {
    const { first, last } = player.lit.peek() ?? { first: 0, last: 1 };
    const lasts_s = ((last - first) * store.period_s.peek() * 1e9) / player.speed_ns.peek();
    const count = Math.max(2, Math.min(MOST_PICTURES, Math.round(lasts_s * RATE_HZ)));
    player.seek(first);
    const plate = await plateOf(subject, store);
    if (plate === null) return null;
    const recorder = await recorderOf(plate.canvas, kind);
    for (let n = 0; n < count; n++) {
      player.seek(first + (n / (count - 1)) * (last - first));
      plate.draw();
      await recorder.add(lasts_s / count);
      progress.report((n + 1) / count);
      if (progress.cancelled) break;
    }
    const film = await recorder.finish();
    return progress.cancelled ? null : film;
  } finally {
    [player.turn.value, player.playing.value, held.value] = [before.turn, before.playing, before.held];
  }
}

/** Why no more frames come; null where they do. Read in an effect, it is followed. */
function standstill({ replay, held, status }: Store): string | null {
  if (replay.active.value) return replay.playing.value ? null : "the recording is paused.";
  if (held.value) return "the frame is held.";
  if (status.cameraLoss.value !== null) return "the camera is lost.";
  return status.running.value === false ? "the camera is stopped." : null;
}

/**
 * The next frames of the camera, each for as long as it took; null where it was cancelled.
 *
 * It is shorter where frames cease to come. Raises Error where none comes at all.
 */
export async function filmFrames(subject: Subject, store: Store, kind: FilmKind, progress: Progress): Promise<Blob | null> {
  const plate = await plateOf(subject, store);
  if (plate === null) return null;
  const recorder = await recorderOf(plate.canvas, kind);
  let shown = store.frames.of("coefficients").peek();
  let count = 0;
  for (; count < LIVE_FRAMES; count++) {
    const next = await frameAfter(store, shown, progress);
    if (next === null) break;
    const took_s = shown === null ? FIRST_S : Math.abs(next.meta.host_time_s - shown.meta.host_time_s);
    shown = next;
    plate.draw();
    // A WebM is stamped by the clock: the wait for the next frame is what its picture lasts.
    await recorder.add(kind === "gif" || count === LIVE_FRAMES - 1 ? Math.min(LONGEST_S, took_s) : 0);
    progress.report((count + 1) / LIVE_FRAMES);
  }
  const film = await recorder.finish();
  if (progress.cancelled) return null;
  if (count === 0) throw new Error(standstill(store) ?? "no frame came.");
  return film;
}

/** The next frame after one; null where the film was cancelled meanwhile, or frames ceased to come. */
function frameAfter(store: Store, shown: Frame | null, progress: Progress): Promise<Frame | null> {
  const newest = store.frames.of("coefficients");
  return until(() => {
    const frame = newest.value;
    if (progress.cancelled || standstill(store) !== null) return null;
    return frame === null || frame === shown ? undefined : frame;
  });
}
